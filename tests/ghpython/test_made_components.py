"""Preview, the two Deconstruct components, Fabricate, View and Bake: what they give belongs together."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rhino3dm

from ghpython.stubs import Canvas, GhPath, Ran, run_component
from weavecore.model import Weave
from weavecore.weaving.sequence import find_sequence


@pytest.fixture(scope="module")
def weave(stages: dict[str, Ran]) -> Weave:
    return stages["strands"]["weave"]


def rows(points: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in points])


def colours_of(mesh: rhino3dm.Mesh) -> set[tuple[int, ...]]:
    return {tuple(mesh.VertexColors[i])[:3] for i in range(len(mesh.VertexColors))}


def test_pipes_lie_about_the_axes_of_the_rods(canvas: Canvas, weave: Weave) -> None:
    ran = run_component("Weave_Preview", weave=weave)
    points = rows([ran["mesh"].Vertices[i] for i in range(len(ran["mesh"].Vertices))])
    axes = weave.axes.samples(weave.rod_diameter * 5).points
    nearest = np.sqrt(((points[::23, None] - axes[None]) ** 2).sum(2).min(1))
    assert np.abs(nearest - weave.rod_diameter / 2).max() < 0.1 * weave.lattice.edge_length
    assert ran["mesh"].IsValid
    assert len(colours_of(ran["mesh"])) == len({name[0] for name in weave.ids})
    assert (ran["steps"], ran["names"]) == (len(weave), list(weave.ids))
    assert [dot.Text for dot in ran["dots"]] == ran["names"]


def test_a_slider_goes_through_the_steps_of_the_construction(canvas: Canvas, weave: Weave) -> None:
    sequence = find_sequence(weave)
    whole = len(run_component("Weave_Preview", weave=weave)["mesh"].Vertices)
    for step in (0, 3, 10_000):
        ran = run_component("Weave_Preview", weave=weave, step=step, colour="STEP")
        assert set(ran["names"]) == {weave.ids[s] for s in sequence.strand[:step].tolist()}
        assert (len(ran["mesh"].Vertices) == whole) == (step > len(weave))


def test_over_and_under_are_drawn_larger_by_the_amplitude(canvas: Canvas, weave: Weave) -> None:
    heights = []
    for amplitude in (0.0, 1.0, 5.0):
        mesh = run_component("Weave_Preview", weave=weave, amplitude=amplitude)["mesh"]
        points = rows([mesh.Vertices[i] for i in range(len(mesh.Vertices))])
        heights.append(np.linalg.norm(points, axis=1).max())
    assert heights[0] < heights[1] < heights[2]


def test_a_preview_shows_a_weave_at_rest_and_refuses_other_things(canvas: Canvas, stages: dict[str, Ran]) -> None:
    at_rest = stages["simulate"]["equilibrium"]
    ran = run_component("Weave_Preview", weave=at_rest, colour="utilisation")
    drawn = run_component("Weave_Preview", weave=at_rest.weave, colour="utilisation")
    middles, before = rows(ran["places"]), rows(drawn["places"])
    moved = np.linalg.norm(middles - before, axis=1).max()
    assert 0.3 * at_rest.departure_max < moved < 1.5 * at_rest.departure_max
    for inputs, words in (
        ({"weave": 5}, "where a weave must be"),
        ({"weave": at_rest, "colour": "age"}, "Unknown colour 'age'"),
    ):
        ((level, text),) = run_component("Weave_Preview", **inputs).messages
        assert (level, words in text) == ("Error", True)


def test_a_lattice_comes_apart_into_trees_that_match(canvas: Canvas, stages: dict[str, Ran]) -> None:
    lattice = stages["link"]["lattice"]
    ran = run_component("Deconstruct_Lattice", lattice=lattice)
    nodes = rows(ran["nodes"])
    assert np.array_equal(nodes, lattice.nodes)
    for path, lines in ran["edges"].branches.items():
        starts, ends = ran["starts"].branches[path], ran["ends"].branches[path]
        assert len(lines) == len(starts) == len(ends) == int((lattice.edge_family == path[1]).sum())
        assert np.array_equal(rows(line.From for line in lines), nodes[starts])
        assert np.array_equal(rows(line.To for line in lines), nodes[ends])
    assert len(ran["faces"].branches) == lattice.n_faces
    assert ran["faces"].branches[GhPath(0, 5)] == lattice.face_nodes[slice(*lattice.face_offsets[5:7])].tolist()
    assert np.array_equal(rows(ran["supports"]), nodes[ran["border"]])
    assert {ran["generation"][node] for node in ran["border"]} == {0.0}


def test_a_weave_comes_apart_into_trees_that_match(canvas: Canvas, weave: Weave) -> None:
    ran = run_component("Deconstruct_Weave", weave=weave)
    joints = rows(ran["joints"])
    over = {(node, a, b) for node, a, b in weave.joints.crossings.tolist()}
    told = set()
    for j, node in enumerate(weave.joints.node.tolist()):
        order = [weave.ids.index(name) for name in ran["order"].branches[GhPath(0, j)]]
        told |= {(node, upper, lower) for k, upper in enumerate(order) for lower in order[:k]}
    assert told == over
    for path, names in ran["names"].branches.items():
        for item, name in enumerate(names):
            s, place = weave.ids.index(name), GhPath(0, path[1], item)
            along, stations = ran["along"].branches[place], ran["stations"].branches[place]
            assert len(along) == len(stations) == int((weave.joints.strand == s).sum())
            assert stations == sorted(stations)
            assert np.allclose(joints[along], weave.lattice.nodes[weave.joints.node[along]])
            assert ran["lengths"].branches[path][item] == weave.axes.lengths[s]
    assert list(ran["lines"].branches) == list(ran["rest"].branches) == [GhPath(0, s) for s in range(len(weave))]
    assert len(ran["normals"]) == len(joints)
    assert len(ran["ties"]) == len(weave.joints.contacts)


def test_pieces_marks_and_cut_list_are_those_of_the_workshop(canvas: Canvas, weave: Weave, tmp_path: Path) -> None:
    folder = tmp_path / "workshop"
    inputs: dict[str, Any] = {"weave": weave, "stock": 1200.0, "folder": str(folder)}
    ran = run_component("Weave_Fabricate", **inputs)
    assert ran["written"] is None
    assert not folder.exists()
    pressed = run_component("Weave_Fabricate", **inputs, write=True)
    assert pressed["written"] == str(folder)
    assert any("checks" in line for line in pressed["report"])
    table = [line.split(",") for line in (folder / "pieces.csv").read_text("utf-8").splitlines() if "," in line]
    head = next(i for i, line in enumerate(table) if line[0] == "piece_id")
    written = {line[0]: float(line[table[head].index("cut_length")]) for line in table[head + 1 :]}
    assert dict(zip(ran["names"], ran["lengths"])) == pytest.approx(written, abs=0.01)
    assert max(ran["lengths"]) <= 1200.0
    for k, (line, length) in enumerate(zip(ran["pieces"], ran["lengths"])):
        assert line.Length == pytest.approx(length)
        path = GhPath(0, k)
        marks, codes = ran["marks"].branches[path], ran["codes"].branches[path]
        assert len(marks) == len(codes) == len(ran["places"].branches[path])
        for mark, code in zip(marks, codes):
            assert -1e-6 <= mark.From.X <= length + 1e-6
            assert (mark.To.Y - line.From.Y > 5) == ("over " in code)
            assert (line.From.Y - mark.From.Y > 5) == ("under " in code)
    listed = [text for branch in ran["cut_list"].branches.values() for text in branch]
    assert sorted(text.split()[1] for text in listed) == sorted(written)


def test_the_folder_is_written_once_and_stays_told(canvas: Canvas, weave: Weave, tmp_path: Path) -> None:
    inputs: dict[str, Any] = {"weave": weave, "folder": str(tmp_path / "workshop")}
    first = run_component("Weave_Fabricate", **inputs, write=True)
    stamp = (tmp_path / "workshop" / "pieces.csv").stat().st_mtime_ns
    for write in (True, False):
        again = run_component("Weave_Fabricate", **inputs, write=write)
        assert again["written"] == first["written"]
    assert (tmp_path / "workshop" / "pieces.csv").stat().st_mtime_ns == stamp
    ((level, text),) = run_component("Weave_Fabricate", weave=weave, stock=800.0, write=True).messages
    assert (level, text[:21]) == ("Warning", "There is no folder to")


def test_a_page_is_written_and_opened_by_the_button(
    canvas: Canvas, weave: Weave, tmp_path: Path, browser: list[str]
) -> None:
    target = tmp_path / "page.html"
    inputs = {"value": weave, "path": str(target)}
    assert run_component("Weave_View", **inputs)["file"] is None
    for show in (True, True, False):
        assert run_component("Weave_View", **inputs, show=show)["file"] == str(target)
    assert browser == [target.as_uri()]
    assert b"<html" in target.read_bytes()
    ((_, text),) = run_component("Weave_View", value=weave, path="page.json", show=True).messages
    assert "Let the path end in .html" in text


class Layers(list[Any]):
    def FindByFullPath(self, path: str, missing: int) -> int:
        return next((i for i, layer in enumerate(self) if self.path_of(layer) == path), missing)

    def path_of(self, layer: Any) -> str:
        above = next((one for one in self if one.Id == getattr(layer, "ParentLayerId", None)), None)
        return layer.Name if above is None else f"{self.path_of(above)}::{layer.Name}"

    def Add(self, layer: Any) -> int:
        layer.Id = f"id of {layer.Name}"
        self.append(layer)
        return len(self) - 1


class Attributes(SimpleNamespace):
    def SetUserString(self, key: str, text: str) -> None:
        assert isinstance(text, str)
        self.__dict__.setdefault("texts", {})[key] = text


@pytest.fixture
def document(canvas: Canvas, monkeypatch: pytest.MonkeyPatch) -> Any:
    baked: list[Any] = []
    undo: list[str] = []
    objects = SimpleNamespace(AddCurve=lambda curve, attributes: baked.append((curve, attributes)) or len(baked))
    views = SimpleNamespace(Redraw=lambda: None)
    made = SimpleNamespace(Layers=Layers(), Objects=objects, Views=views, baked=baked, undo=undo)
    made.ModelUnitSystem, made.ModelAbsoluteTolerance = "UnitSystem.Millimeters", 0.01
    made.BeginUndoRecord = undo.append
    made.EndUndoRecord = lambda _: undo.append("end")
    rhino = sys.modules["Rhino"]
    source = SimpleNamespace(ColorFromObject="by object")
    objects_module = SimpleNamespace(ObjectAttributes=Attributes, Layer=SimpleNamespace, ObjectColorSource=source)
    monkeypatch.setattr(rhino, "DocObjects", objects_module, raising=False)
    monkeypatch.setattr(rhino, "RhinoDoc", SimpleNamespace(ActiveDoc=made))
    drawing = ModuleType("System.Drawing")
    vars(drawing)["Color"] = SimpleNamespace(FromArgb=lambda *parts: parts)
    monkeypatch.setitem(sys.modules, "System.Drawing", drawing)
    return made


def test_rods_are_baked_with_layers_names_and_user_text(document: Any, weave: Weave) -> None:
    ran = run_component("Weave_Bake", weave=weave, layer="roof", bake=True)
    assert ran.messages == []
    assert len(ran["ids"]) == len(weave) == len(document.baked)
    assert document.undo == ["Weave Bake", "end"]
    for (_, attributes), name in zip(document.baked, weave.ids):
        assert attributes.Name == name == attributes.texts["id"]
        assert float(attributes.texts["length"]) == weave.axes.lengths[weave.ids.index(name)]
        path = document.Layers.path_of(document.Layers[attributes.LayerIndex])
        assert path.startswith("roof::rods::")
    assert len(document.Layers) == 2 + len({name[0] for name in weave.ids})
    run_component("Weave_Bake", weave=weave, layer="roof", bake=True)
    assert len(document.baked) == len(weave), "a solution that comes by itself bakes nothing"


def test_without_a_document_nothing_is_baked(canvas: Canvas, weave: Weave) -> None:
    ((level, text),) = run_component("Weave_Bake", weave=weave, bake=True).messages
    assert (level, text[:40]) == ("Error", "UNSUPPORTED: No document is open in Rhin")


def test_a_library_that_is_missing_is_named_with_the_line_that_brings_it(
    canvas: Canvas, weave: Weave, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rhino3dm", None)
    ran = run_component("Weave_Export", value=weave, path=str(tmp_path / "woven.3dm"), write=True)
    ((level, text),) = ran.messages
    assert level == "Error"
    assert "Add # r: rhino3dm on top of the component's script." in text
