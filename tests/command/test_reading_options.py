"""What a user says of how a file is read: which objects, how fine, how long."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.pipeline import read_surface

r = pytest.importorskip("rhino3dm")

Run = Callable[..., Any]


@pytest.fixture
def corner(folder: Path) -> Path:
    """A floor and a wall that meet, in metres, and a disc elsewhere, on one layer."""
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    model.Settings.ModelAbsoluteTolerance = 1e-3
    layer = r.Layer()
    layer.Name = "Shell"
    index = model.Layers.Add(layer)
    floor = make.square((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    wall = make.square((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))
    disc = make.disc()
    disc.Translate(r.Vector3d(9, 0, 0))
    for name, shape in (("floor", floor), ("wall", wall), ("disc", disc)):
        attributes = r.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, index
        model.Objects.Add(shape, attributes)
    model.Write("corner.3dm", 8)
    return folder


def lengths(path: str) -> np.ndarray:
    return read_surface(path).edge_lengths


def test_several_objects_are_joined_and_told(run: Run, corner: Path) -> None:
    ended = run("mesh", "corner.3dm", "-o", "m.json", "--object", "floor", "--object", "wall")
    assert (ended.status, ended.err) == (0, "")
    result = json.loads(Path("m.json").read_text("utf-8"))
    assert result["parameters"]["object"] == ["floor", "wall"]
    assert np.max(result["surface"]["vertices"], axis=0) == pytest.approx([1, 1, 1])


def test_a_layer_whose_objects_lie_apart_is_ambiguous(run: Run, corner: Path) -> None:
    ended = run("mesh", "corner.3dm", "-o", "m.obj", "--layer", "Shell")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: AMBIGUOUS_SURFACE: corner.3dm has 3 candidate objects")
    assert "'disc'" in ended.err


def test_the_edge_target_is_a_length_in_any_unit(run: Run, corner: Path) -> None:
    for name, target in (("coarse", "0.2"), ("fine", "50mm")):
        ended = run("mesh", "corner.3dm", "-o", f"{name}.obj", "--object", "disc", "--edge-target", target)
        assert (ended.status, ended.err) == (0, "")
    assert 0.15 < np.median(lengths("coarse.obj")) < 0.22
    assert 0.04 < np.median(lengths("fine.obj")) < 0.055


def test_the_edge_target_of_a_weave_is_told(run: Run, corner: Path) -> None:
    target = ["--object", "disc", "--edge-target", "10cm", "--spacing", "300mm"]
    assert run("weave", "corner.3dm", "--json", "w.json", *target).status == 0
    result = json.loads(Path("w.json").read_text("utf-8"))
    assert result["parameters"]["edge_target"] == pytest.approx(0.1)
    assert result["parameters"]["object"] == "disc"
    sides = np.array(result["surface"]["vertices"])[np.array(result["surface"]["faces"])]
    assert 0.06 < np.median(np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2)) < 0.11


def test_a_small_spacing_makes_a_finer_mesh(run: Run, corner: Path) -> None:
    for name, spacing in (("wide", "300mm"), ("tight", "60mm")):
        assert (
            run("weave", "corner.3dm", "--json", f"{name}.json", "--object", "disc", "--spacing", spacing).status == 0
        )
    n_faces = [len(json.loads(Path(f"{n}.json").read_text("utf-8"))["surface"]["faces"]) for n in ("wide", "tight")]
    assert n_faces[1] > 2 * n_faces[0]


@pytest.mark.parametrize("target", ["0", "-3", "some"])
def test_an_edge_target_that_is_no_length_is_wrong_usage(run: Run, corner: Path, target: str) -> None:
    assert run("mesh", "corner.3dm", "-o", "m.obj", "--object", "disc", "--edge-target", target).status == 2


def test_an_edge_target_with_far_too_many_triangles_is_refused(run: Run, corner: Path) -> None:
    ended = run("mesh", "corner.3dm", "-o", "m.obj", "--object", "disc", "--edge-target", "0.001mm")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: TOO_MUCH_WORK: ")
    assert not Path("m.obj").exists()


def test_the_time_limit_is_kept_and_named(run: Run, corner: Path) -> None:
    options = ["--object", "disc", "--edge-target", "2mm", "--time-limit", "1"]
    ended = run("mesh", "corner.3dm", "-o", "m.obj", *options)
    assert ended.status == 1
    assert ended.err.startswith("weavecore: TOO_MUCH_WORK: ")
    assert "takes longer than 1 seconds" in ended.err
    assert "--time-limit" in ended.err
