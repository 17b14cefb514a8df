"""The rods of a weave in the files, read back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import rhino3dm
import trimesh

from weavecore import pipeline
from weavecore.exporting.polygons import pipes_of
from weavecore.exporting.registry import encode
from weavecore.geometry.polygon_mesh import fan_triangles
from weavecore.palette import utilisation_colours
from weavecore.viewing.picture import draw_pixels
from woven_rods import curve_of, woven_tube


def test_json_names_every_strand_and_every_crossing() -> None:
    weave = woven_tube("kagome")
    result = json.loads(encode(weave, "out.json"))
    assert [strand["id"] for strand in result["strands"]] == list(weave.ids)
    assert len(result["crossings"]) == len(weave.crossings)
    nodes = {strand["id"]: set(strand["nodes"]) for strand in result["strands"]}
    for crossing in result["crossings"]:
        assert crossing["node"] in nodes[crossing["over"]] & nodes[crossing["under"]]
    assert result["parameters"]["pattern"] == "kagome"
    assert (result["weave"]["rod_diameter"], result["weave"]["over_under"]) == (5.0, "plain")
    assert result["weave"]["material"]["name"] == "gfrp"


def test_json_has_the_axis_and_the_bending_of_every_strand() -> None:
    weave = woven_tube("triangular")
    for s, strand in enumerate(json.loads(encode(weave, "out.json"))["strands"]):
        knots, controls = weave.axes.bspline(s)
        assert strand["axis"] == {"degree": 3, "knots": knots.tolist(), "controls": controls.tolist()}
        assert len(strand["stations"]) == len(strand["layer_offsets"]) == len(strand["nodes"])
        assert strand["axis_length"] == weave.axes.lengths[s]
        assert strand["utilisation"] == weave.bending.utilisation[s]


@pytest.mark.parametrize("pattern", ["triangular", "kagome"])
def test_3dm_has_the_axes_as_nurbs_curves_of_degree_3(tmp_path: Path, pattern: str) -> None:
    weave = woven_tube(pattern)
    pipeline.export(weave, tmp_path / "out.3dm")
    document = rhino3dm.File3dm.Read(str(tmp_path / "out.3dm"))
    rods = {one.Attributes.Name: one for one in document.Objects if one.Attributes.Name in weave.ids}
    assert sorted(rods) == sorted(weave.ids)
    colours = utilisation_colours(weave.bending.utilisation)
    for s, name in enumerate(weave.ids):
        curve = rods[name].Geometry
        assert (type(curve).__name__, curve.Degree, curve.IsValid, curve.IsRational) == ("NurbsCurve", 3, True, False)
        at = np.linspace(0, weave.axes.ends[s], 40)
        found = np.array([[p.X, p.Y, p.Z] for p in map(curve.PointAt, at.tolist())])
        assert np.abs(found - curve_of(weave, s)(at)).max() < 1e-9
        assert curve.IsClosed == weave.strands.closed[s]
        assert rods[name].Attributes.ObjectColor[:3] == tuple(colours[s])
        assert document.Layers[rods[name].Attributes.LayerIndex].FullPath.startswith("weave::rods::")


def test_colours_turn_red_where_the_rod_breaks() -> None:
    blue, red, beyond = utilisation_colours([0.0, 1.0, 7.0]).tolist()
    assert blue[2] > blue[0]
    assert red[0] > red[2]
    assert red == beyond


@pytest.mark.parametrize("pattern", ["triangular", "kagome"])
def test_rods_are_watertight_pipes_of_the_volume_of_their_lengths(pattern: str) -> None:
    weave = woven_tube(pattern)
    pipes = pipes_of(weave)
    triangles, _ = fan_triangles(pipes.offsets, pipes.corners)
    mesh = trimesh.Trimesh(pipes.points, triangles, process=False)
    assert mesh.is_watertight
    assert mesh.body_count == len(weave)
    # A regular polygon of 12 sides has 0.9549 of the area of its circle.
    expected = 0.9549 * np.pi * (weave.rod_diameter / 2) ** 2 * weave.axes.lengths.sum()
    assert abs(mesh.volume / expected - 1) < 0.005


def test_a_mesh_file_of_a_weave_holds_its_rods(tmp_path: Path) -> None:
    weave = woven_tube("triangular")
    pipeline.export(weave, tmp_path / "rods.stl")
    mesh = trimesh.load(tmp_path / "rods.stl")
    pipes = pipes_of(weave)
    assert len(mesh.faces) == len(fan_triangles(pipes.offsets, pipes.corners)[0])
    assert np.allclose(mesh.bounds, [pipes.points.min(0), pipes.points.max(0)], atol=1e-3)


def test_the_picture_of_a_weave_shows_which_rod_is_over() -> None:
    lattice = woven_tube("kagome").lattice
    plain, again, stacked = (
        draw_pixels(pipeline.weave(lattice, rod_diameter=8.0, over_under=style), size=(300, 220), view=(1.0, -1.0, 0.4))
        for style in ("plain", "plain", "stacked")
    )
    assert np.array_equal(plain, again)
    assert (plain != stacked).any(2).mean() > 0.01


def test_the_same_weave_gives_the_same_bytes() -> None:
    lattice = woven_tube("kagome").lattice
    for ending in ("out.json", "out.3dm"):
        contents = {encode(pipeline.weave(lattice, rod_diameter=5.0), ending) for _ in range(2)}
        assert len(contents) == 1
