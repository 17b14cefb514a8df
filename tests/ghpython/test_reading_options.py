"""The first component repairs, leaves out and doubts as the command does, and shows the doubts as data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm

import weavecore as wc
from ghpython.stubs import Canvas, GhPath, run_component
from raw_meshes import grid, together, triangles
from weavecore import pipeline
from weavecore.model import Note, SurfaceMesh

Sheet = tuple[np.ndarray, np.ndarray]


def sheet(n: int) -> Sheet:
    """A flat sheet of n by n squares."""
    points, quads = grid(n, n)
    return points, triangles(quads)


def two_sheets(apart: float) -> Sheet:
    """Two sheets of 8 by 8 squares side by side, with a gap between them."""
    points, faces = sheet(8)
    return together((points, faces), (points + np.array([8.0 + apart, 0.0, 0.0]), faces))


def surface(**inputs: Any) -> Any:
    return run_component("Weave_Surface", **inputs)


def test_a_gap_is_welded_where_a_length_is_wired(canvas: Canvas) -> None:
    assert len(surface(geometry=two_sheets(0.01))["borders"]) == 2
    assert len(surface(geometry=two_sheets(0.01), weld=0.02)["borders"]) == 1


def test_a_hole_is_closed_up_to_a_length(canvas: Canvas) -> None:
    points, faces = sheet(6)
    inner = (np.abs(points[faces].mean(1)[:, :2] - 3) < 1).all(1)
    holed = points, faces[~inner]
    assert len(surface(geometry=holed)["borders"]) == 2
    assert len(surface(geometry=holed, fill_holes=9.0)["borders"]) == 1
    assert len(surface(geometry=holed, fill_holes=7.0)["borders"]) == 2


def test_a_scrap_is_a_doubt_with_its_place_and_left_out_where_only_the_largest_piece_is_taken(canvas: Canvas) -> None:
    points, faces = two_sheets(3.0)
    geometry = points, faces[: len(faces) // 2 + 1]
    ran = surface(geometry=geometry)
    (doubt,) = ran["doubts"]
    assert doubt.startswith("SCRAPS: ")
    assert ran.messages == [("Warning", doubt)]
    ((path, (place,)),) = ran["places"].branches.items()
    assert (path, type(place)) == (GhPath(0, 0), rhino3dm.Point3d)
    assert 11.0 < place.X < 12.0
    largest = surface(geometry=geometry, largest=True)
    assert (largest["surface"].n_faces, largest["doubts"], largest.messages) == (128, [], [])


@pytest.mark.parametrize("is_file", [False, True])
def test_the_outer_side_of_a_thin_solid_is_taken(is_file: bool, canvas: Canvas, tmp_path: Path) -> None:
    points, faces = slab()
    geometry: Any = (points, faces)
    if is_file:
        path = tmp_path / "slab.obj"
        rows = [f"v {x} {y} {z}\n" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces]
        path.write_text("".join(rows), "utf-8")
        geometry = str(path)
    side = surface(geometry=geometry, side="outer")
    assert side["surface"].n_faces == 288
    assert len(side["borders"]) == 1
    ((level, text),) = surface(geometry=geometry, side="inner").messages
    assert (level, text.split(":")[0]) == ("Error", "UNSUPPORTED")


def slab() -> Sheet:
    """A plate of 12 by 12 squares, half as thick as these."""
    points, faces = sheet(12)
    (rim,) = SurfaceMesh(points, faces).borders
    ahead, n = np.roll(rim, -1), len(points)
    sides = np.vstack([np.column_stack([ahead, rim, rim + n]), np.column_stack([ahead, rim + n, ahead + n])])
    return np.vstack([points, points - [0, 0, 0.5]]), np.vstack([faces, faces[:, ::-1] + n, sides])


def test_doubts_of_later_stages_are_warnings_and_those_before_are_not_repeated(canvas: Canvas) -> None:
    body = surface(geometry=slab())
    assert body.messages == []
    offset = run_component("Weave_Offset", surface=body["surface"], spacing=1.0)
    ((level, text),) = offset.messages
    assert (level, text.split(":")[0]) == ("Warning", "THIN")
    assert run_component("Weave_Link", latitudes=offset["latitudes"]).messages == []


def test_a_doubt_of_linking_is_a_warning(canvas: Canvas, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = Note("COARSE", "2 faces of the lattice lie inverted.")

    def link(latitudes: wc.Latitudes, **options: Any) -> wc.Lattice:
        latitudes = replace(latitudes, surface=replace(latitudes.surface, notes=(coarse,)))
        return pipeline.link(latitudes, **options)

    monkeypatch.setattr(wc, "link", link)
    latitudes = pipeline.offset(pipeline.surface_from(sheet(8)))
    assert run_component("Weave_Link", latitudes=latitudes).messages == [("Warning", f"COARSE: {coarse.text}")]
