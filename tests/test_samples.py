"""Every sample file is woven, and what comes out keeps all promises."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from stages import Woven, hold, weave
from weavecore import pipeline
from weavecore.model import FAMILIES, POCKET
from weavecore.weaving.strands import find_strands

FOLDER = Path(__file__).resolve().parents[1] / "sample_files"
SAMPLES = sorted(path.stem for path in FOLDER.glob("*.3dm"))

# Borders, and the Euler characteristic: 2 less the borders and twice the handles.
TOPOLOGY = {
    "closed_body": (0, 2),
    "handle": (1, -1),
    "hemisphere": (1, 1),
    "hourglass": (2, 0),
    "minimal_surface": (2, -8),
    "narrow_neck": (1, 1),
    "shell_2400x1600": (3, -1),
    "six_way_joint": (6, -4),
}


@cache
def woven(name: str) -> Woven:
    return weave(pipeline.read_surface(FOLDER / f"{name}.3dm"))


def test_there_are_samples_and_each_is_known() -> None:
    assert sorted(TOPOLOGY) == SAMPLES


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_has_the_borders_and_handles_that_it_is_named_for(name: str) -> None:
    surface = woven(name).latitudes.surface
    assert (len(surface.borders), surface.euler_characteristic) == TOPOLOGY[name]
    assert surface.is_closed == bool(surface.cuts)


@pytest.mark.parametrize("name", SAMPLES)
def test_the_borders_of_the_file_are_the_first_rings_point_for_point(name: str) -> None:
    surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
    polylines = woven(name).latitudes.polylines
    for k, loop in enumerate(surface.borders):
        assert np.array_equal(polylines.polyline(k), surface.vertices[loop])


@pytest.mark.parametrize("name", SAMPLES)
def test_a_woven_sample_keeps_all_promises(name: str) -> None:
    hold(woven(name))


@pytest.mark.parametrize("name", SAMPLES)
def test_a_woven_sample_is_even(name: str) -> None:
    lattice = woven(name).lattice
    length = lattice.edge_lengths[lattice.edge_family != POCKET]
    assert length.max() <= 1.5 * np.median(length)


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_woven_in_quads_keeps_all_promises(name: str) -> None:
    latitudes = woven(name).latitudes
    lattice = pipeline.link(latitudes, pattern="quad")
    hold(Woven(latitudes, lattice, find_strands(lattice)))
    sides = np.diff(lattice.face_offsets)
    assert np.mean(sides == 4) > 0.5


@pytest.mark.parametrize("name", SAMPLES)
def test_every_family_is_woven(name: str) -> None:
    assert len(np.unique(woven(name).lattice.edge_family)) >= len(FAMILIES) - 1
