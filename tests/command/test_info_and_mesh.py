"""``weavecore info`` and ``weavecore mesh``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import rhino3dm

from weavecore.pipeline import export, read_surface
from woven_tube import tube_surface

Run = Callable[..., Any]


def test_info_tells_of_each_object_what_weaving_asks(run: Run) -> None:
    ended = run("info", "tube.3dm")
    assert (ended.status, ended.err) == (0, "")
    first, layers, heading, row, *borders = ended.out.splitlines()
    assert [line.split(",")[0] for line in borders] == [f"Tube: border {k}: length 6.2117 m" for k in (0, 1)]
    assert first == "tube.3dm: 3dm, version 7, unit Meters, tolerance 0.002"
    assert layers == "layers: weave, weave::surface"
    assert heading.split() == ["object", "kind", "layer", "faces", "borders", "χ", "verdict"]
    assert row.split()[:4] == ["Tube", "Mesh", "weave::surface", "48"]
    assert row.split()[4:] == ["0:", "6.2117", "m,", "1:", "6.2117", "m", "0", "can", "be", "woven"]


def test_info_says_why_an_object_would_be_refused(run: Run, folder: Path) -> None:
    surface = tube_surface()
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in surface.vertices.tolist())
    Path("bad.obj").write_text(text + "f 1 2 3\nf 1 2 4\nf 1 2 5\n", "utf-8")
    ended = run("info", "bad.obj")
    assert ended.status == 0
    assert "NON_MANIFOLD" in ended.out


@pytest.mark.parametrize("name", ["not there.3dm", "empty.3dm", "empty.obj", "notes.txt"])
def test_a_file_that_cannot_be_read_is_one_line(run: Run, folder: Path, name: str) -> None:
    Path("empty.3dm").touch()
    Path("empty.obj").touch()
    Path("notes.txt").touch()
    for command in (["info", name], ["weave", name], ["mesh", name, "-o", "m.obj"]):
        ended = run(*command)
        if command[0] == "info" and name == "empty.obj":
            assert "DEGENERATE" in ended.out or "NO_SURFACE" in ended.out or ended.status == 1
            continue
        assert ended.status == 1
        assert ended.err.startswith("weavecore: ")
        assert ended.err.count("\n") == 1
        assert "Traceback" not in ended.err


@pytest.mark.parametrize("ending", ["3dm", "obj", "ply", "off", "json"])
def test_mesh_writes_the_mesh_that_weave_would_use(run: Run, folder: Path, ending: str) -> None:
    ended = run("mesh", "tube.3dm", "-o", f"m.{ending}")
    assert (ended.status, ended.err) == (0, "")
    assert "surface  Tube: 48 faces, 2 borders" in ended.out
    if ending != "json":
        again = read_surface(f"m.{ending}")
        assert np.array_equal(again.vertices, tube_surface().vertices)
        assert np.array_equal(again.faces, tube_surface().faces)


def test_mesh_keeps_the_unit_and_chooses_by_layer(run: Run, folder: Path) -> None:
    assert run("mesh", "tube.3dm", "-o", "m.3dm", "--layer", "weave::surface").status == 0
    assert read_surface("m.3dm").unit == "Meters"
    ended = run("mesh", "tube.3dm", "-o", "n.3dm", "--layer", "elsewhere")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: NO_SURFACE: ")


def test_names_that_look_like_markup_are_shown_as_they_are(run: Run, folder: Path) -> None:
    export(replace(tube_surface(), name="Tube [bold]x[/bold] :smile:"), "odd.3dm")
    assert "Tube [bold]x[/bold] :smile:" in run("info", "odd.3dm").out


def test_info_lists_pieces_and_doubts_and_writes_marks(run: Run, folder: Path) -> None:
    sheet = "v 0 0 {0}\nv {1} 0 {0}\nv {1} {1} {0}\nv 0 {1} {0}\n"
    faces = "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n"
    Path("two.obj").write_text(sheet.format(0, 100) + sheet.format(50, 1) + faces, "utf-8")
    ended = run("info", "two.obj", "--marks", "marks.3dm")
    assert ended.status == 0
    assert "piece 0: 2 faces, 141.42 large, about (50, 50, 0)" in ended.out
    assert "doubt SCRAPS: 1 piece of 2" in ended.out
    marks = rhino3dm.File3dm.Read("marks.3dm")
    kinds = sorted(one.Geometry.ObjectType.name for one in marks.Objects)
    assert kinds == ["Curve", "Curve", "TextDot"]
    assert run("info", "two.obj", "--marks", "marks.3dm").status == 1


def test_marks_show_edges_with_more_than_two_faces(run: Run, folder: Path) -> None:
    fin = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"
    Path("fin.obj").write_text(fin, "utf-8")
    ended = run("info", "fin.obj", "--marks", "marks.3dm")
    assert "first at (0.5, 0, 0)" in " ".join(ended.out.split())
    assert len(rhino3dm.File3dm.Read("marks.3dm").Objects) > 0
