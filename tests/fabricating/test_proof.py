"""The proof of the whole: where every node is, from `marks.csv` and `axes.csv` alone, read with the csv module."""

from __future__ import annotations

import csv
from collections import defaultdict

import numpy as np
import pytest

from fabricated import PATTERNS, SAMPLES, SHELL, made
from woven_rods import woven_sample

NEAR = 0.2
"""Millimetres, on a shell of 2.4 m."""


def rows_of(content: bytes) -> list[dict[str, str]]:
    """The rows of a table, as any reader has them that can pass over a line that begins with #."""
    lines = [line for line in content.decode().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def rebuilt(marks: list[dict[str, str]], axes: list[dict[str, str]]) -> dict[str, np.ndarray]:
    """Places of all nodes by name: at each, p = node + layer_offset · n for every rod there, solved for node and n."""
    points = {
        (row["rod_id"], row["station"]): [float(row[key]) for key in ("x", "y", "z", "layer_offset")] for row in axes
    }
    passes = defaultdict(set)
    for row in marks:
        passes[row["joint_id"]].add((row["rod_id"], row["station"]))
        if row["other_rod"]:
            passes[row["joint_id"]].add((row["other_rod"], row["other_station"]))
    places = {}
    for name, keys in passes.items():
        found = np.array([points[key] for key in sorted(keys)])
        if len(found) == 1:
            assert found[0, 3] == 0.0
            places[name] = found[0, :3]
            continue
        system = np.c_[np.ones(len(found)), found[:, 3]]
        solution, _, rank, _ = np.linalg.lstsq(system, found[:, :3], rcond=None)
        assert rank == 2, name
        places[name] = solution[0]
    return places


def hold(name: str, pattern: str) -> None:
    weave, folder = woven_sample(name, pattern), made(name, pattern)
    places = rebuilt(rows_of(folder.files["marks.csv"]), rows_of(folder.files["axes.csv"]))
    found = {int(key[1:]): place for key, place in places.items()}
    # Every node of the lattice that a rod passes is found again, and where it was.
    assert sorted(found) == np.unique(weave.strands.nodes).tolist()
    off = [np.linalg.norm(place - weave.lattice.nodes[node]) for node, place in found.items()]
    assert max(off) < NEAR
    named = {
        row["joint_id"]: [float(row[key]) for key in ("x", "y", "z")] for row in rows_of(folder.files["joints.csv"])
    }
    assert named.keys() == {key for key in places if key.startswith("J")}
    assert max(np.linalg.norm(places[key] - place) for key, place in named.items()) < NEAR


@pytest.mark.parametrize(
    "pattern", [pytest.param(name, marks=[] if name == "plain" else pytest.mark.slow) for name in PATTERNS]
)
def test_every_node_of_the_shell_is_rebuilt_from_marks_and_axes_alone(pattern: str) -> None:
    hold(SHELL, pattern)


@pytest.mark.parametrize("name", SAMPLES[1:])
def test_every_node_of_the_samples_is_rebuilt_from_marks_and_axes_alone(name: str) -> None:
    hold(name, "triangular")


@pytest.mark.slow
@pytest.mark.parametrize("pattern", PATTERNS[1:])
@pytest.mark.parametrize("name", SAMPLES[1:])
def test_every_node_is_rebuilt_of_every_pattern_of_every_sample(name: str, pattern: str) -> None:
    hold(name, pattern)
