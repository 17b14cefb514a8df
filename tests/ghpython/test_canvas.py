"""What the components lean on: one run, what is kept of it, units, and how inputs are told apart."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rhino3dm

import rhino_shapes
from ghpython.stubs import Canvas, Component, DataTree, GhPath, Ran
from weavecore.canvas import Run, measure, read_geometry, solve
from weavecore.canvas.caching import cache_of
from weavecore.canvas.solve import Indistinct, digest
from weavecore.canvas.trees import data_tree, grouped
from weavecore.canvas.writing import write_value
from weavecore.errors import NonManifold, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.rhino_geometry import DocumentUnit, Drawing, document_unit, rhino_faces, rhino_vertices

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"


def run_once(
    compute: Any, component: Component | None = None, sticky: dict[str, Any] | None = None, **inputs: Any
) -> Ran:
    component = component or Component(list(inputs), wired=list(inputs))
    sticky = {} if sticky is None else sticky
    outputs = solve(component, sticky, compute, inputs, needs={"x": object}, n_outputs=1)
    return Ran({"y": outputs[0]}, component.messages, component.Message, component.captions)


def take(run: Run, x: Any) -> tuple[SurfaceMesh]:
    return (read_geometry(run, x),)


def take_with_edges(run: Run, x: Any) -> tuple[SurfaceMesh]:
    return (read_geometry(run, x, edge=0.05),)


def tell_document(run: Run, x: Any) -> tuple[DocumentUnit]:
    return (run.document,)


def divide(run: Run, x: float) -> tuple[float]:
    return (1 / x,)


def note(done: list[Any]) -> Any:
    """What writes down each input that it is run on."""

    def compute(run: Run, x: Any) -> tuple[None]:
        done.append(x)
        return (None,)

    return compute


def test_the_least_used_results_are_dropped(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    done: list[int] = []
    component = Component(["x"], wired=["x"])
    for x in [*range(4), 0, 4, 0, 1]:
        run_once(note(done), component, sticky, x=x)
    assert done == [*range(4), 4, 1], "0 was in use, 1 was not"


def test_a_list_that_runs_through_a_component_is_kept_whole_and_twice(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    done: list[int] = []
    component = Component(["x"], wired=["x"], n_items=12)
    for first in (0, 0, 100, 0, *range(200, 5000, 100)):
        for i in range(12):
            component.RunCount = i + 1
            run_once(note(done), component, sticky, x=first + i)
    assert done[:24] == [*range(12), *range(100, 112)], "what was set back was computed again"
    assert len(cache_of(component, sticky)) == 24, "memory grows with the steps of a slider"


def test_branches_and_messages_begin_with_the_run(canvas: Canvas) -> None:
    def compute(run: Run, x: int) -> tuple[Any]:
        if x == 2:
            raise NonManifold("Two sheets touch", remedy="Pull them apart.", ids=[3], kind="vertex")
        return (run.tree([((0,), [x]), ((1,), [x])]),)

    component = Component(["x"], wired=["x"], n_items=3)
    outputs = []
    for i, x in enumerate([1, 2, 3]):
        component.RunCount = i + 1
        outputs.append(run_once(compute, component, x=x)["y"])
    assert [list(map(str, tree.branches)) for tree in (outputs[0], outputs[2])] == [
        ["{0;0}", "{0;1}"],
        ["{2;0}", "{2;1}"],
    ]
    assert outputs[1] is None
    ((_, text),) = component.messages
    assert text.startswith("Item 2 of 3: NON_MANIFOLD: Two sheets touch")
    run_once(compute, component, x=None)
    assert component.messages[-1] == ("Warning", "Item 3 of 3: x: nothing comes through the wire.")


class Documents(list[Any]):
    """Grasshopper's open documents, and who wants to know when one is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.DocumentRemoved: Any = self
        self.handlers: list[Any] = []

    def __iadd__(self, handler: Any) -> Documents:  # type: ignore[misc, override]
        self.handlers.append(handler)
        return self


def test_results_are_freed_with_the_document_and_with_the_component(
    canvas: Canvas, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = Documents()
    monkeypatch.setattr(sys.modules["Grasshopper"], "Instances", SimpleNamespace(DocumentServer=server), raising=False)
    sticky: dict[str, Any] = {}
    placed = []
    for n in range(4):
        document = SimpleNamespace(DocumentID=n // 2, FilePath=None, Objects=[])
        component = Component(["x"], wired=["x"], InstanceGuid=str(n))
        document.Objects.append(component)
        component.OnPingDocument = lambda document=document: document  # type: ignore[method-assign]
        server.append(document)
        placed.append(component)
        run_once(note([]), component, sticky, x=1)
    kept = [name for name in sticky if name.startswith("weavecore:")]
    assert len(kept) == 4
    placed[1].OnPingDocument().Objects.clear()
    document = placed[0].OnPingDocument()
    document.Objects.append(Component(["x"], wired=["x"], InstanceGuid="new"))
    document.Objects[-1].OnPingDocument = lambda: document
    run_once(note([]), document.Objects[-1], sticky, x=1)
    assert "weavecore:0:1" not in sticky, "the component is deleted"
    (handler,) = server.handlers
    handler(None, placed[3].OnPingDocument())
    assert [name for name in sticky if name.startswith("weavecore:")] == ["weavecore:0:0", "weavecore:0:new"]


def test_a_button_acts_once_and_in_all_runs_of_its_solution(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    seen: list[bool] = []

    def compute(run: Run, x: int, write: bool) -> tuple[None]:
        seen.append(write)
        return (None,)

    component = Component(["x", "write"], wired=["x", "write"])
    for write in (False, True, True, False, True):
        for i in range(2):
            component.RunCount = i + 1
            inputs = {"x": i, "write": write}
            options: dict[str, Any] = {"needs": {"x": int}, "n_outputs": 1, "is_kept": False, "buttons": ["write"]}
            solve(component, sticky, compute, inputs, **options)
    assert seen == [False, False, True, True, True, True], (
        "what is written stays shown until the button is pressed again"
    )


def test_an_edited_script_is_run(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    outputs = []
    for part in ("i", "i", "i + 1", "i + 2"):
        scope: dict[str, Any] = {}
        exec(f"def compute(run, x):\n    return (object(), sum({part} for i in [x]))", scope)
        outputs.append(solve(Component(["x"]), sticky, scope["compute"], {"x": 5}, needs={"x": int}, n_outputs=2))
    assert outputs[0] is outputs[1]
    assert [value for _, value in outputs[1:]] == [5, 6, 7]
    assert outputs[2] is not outputs[1]


def test_what_fails_is_tried_again(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    tried: list[int] = []

    def compute(run: Run, x: int) -> tuple[int]:
        tried.append(x)
        raise NonManifold("Two sheets touch", remedy="Pull them apart.", ids=[3], kind="vertex")

    for _ in range(2):
        ran = run_once(compute, sticky=sticky, x=1)
        assert ran.messages == [("Error", "NON_MANIFOLD: Two sheets touch (vertex 3). Pull them apart.")]
    assert tried == [1, 1]


def test_a_fault_of_the_program_is_one_balloon_and_no_traceback(canvas: Canvas) -> None:
    ran = run_once(divide, x=0)
    ((level, text),) = ran.messages
    assert level == "Error"
    assert text.startswith("INTERNAL: ZeroDivisionError: division by zero.")
    assert ran.is_empty


def test_escape_is_heard_while_results_are_drawn_and_between_stages(
    canvas: Canvas, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("weavecore.polling.INTERVAL", 0.0)
    points = np.zeros((2, 3))

    def draw(run: Run, x: Any) -> tuple[Any]:
        canvas.is_escape_down = True
        return (x(run),)

    for work in (
        lambda run: run.drawing.lines(points, points),
        lambda run: run.drawing.polylines(points, np.array([0, 2]), [False]),
        lambda run: run.drawing.mesh(points, np.zeros((1, 4), np.int64)),
        lambda run: run.tree([((0,), [1])]),
        lambda run: write_value(run, None, "nothing.json", overwrite=False),
    ):
        canvas.is_escape_down = False
        assert run_once(draw, x=work).messages == [("Remark", "Cancelled. Recompute to go on.")]


def test_too_little_memory_is_told(canvas: Canvas) -> None:
    def compute(run: Run, x: int) -> tuple[int]:
        raise MemoryError

    assert run_once(compute, x=0).messages[0][1].startswith("TOO_MUCH_WORK: ")


def test_input_that_cannot_be_told_apart_is_computed_each_time(canvas: Canvas) -> None:
    sticky: dict[str, Any] = {}
    done: list[Any] = []
    for _ in range(2):
        run_once(note(done), sticky=sticky, x=object())
    assert len(done) == 2


def test_a_file_without_a_unit_is_warned_of(canvas: Canvas, tmp_path: Path) -> None:
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, "None")
    model.Objects.AddBrep(rhino_shapes.tube())
    assert model.Write(str(tmp_path / "tube.3dm"), 7)
    ran = run_once(take, x=str(tmp_path / "tube.3dm"))
    ((level, text),) = ran.messages
    assert (level, text[:14]) == ("Warning", "UNIT_UNKNOWN: ")


@pytest.fixture
def metres(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Rhino with a document in metres."""
    rhino = ModuleType("Rhino")
    objects = SimpleNamespace(FindId=lambda _: SimpleNamespace(Geometry=rhino_shapes.tube()))
    document = SimpleNamespace(ModelUnitSystem="UnitSystem.Meters", ModelAbsoluteTolerance=0.001, Objects=objects)
    vars(rhino)["RhinoDoc"] = SimpleNamespace(ActiveDoc=document)
    monkeypatch.setitem(sys.modules, "Rhino", rhino)
    return document


def test_a_file_in_another_unit_is_scaled_to_the_documents(canvas: Canvas, metres: Any, dome: str) -> None:
    assert document_unit() == DocumentUnit("Meters", 0.001)
    ran = run_once(take, x=dome)
    assert ran.messages == [("Remark", "The file is in Millimeters, the document in Meters: scaled by 0.001.")]
    surface = ran["y"]
    assert surface.unit == "Meters"
    assert surface.tolerance == pytest.approx(1e-5)
    mesh = rhino3dm.File3dm.Read(dome).Objects[0].Geometry
    assert np.array_equal(surface.vertices, rhino_vertices(mesh) / 1000.0)


def test_the_edge_is_in_the_documents_unit(canvas: Canvas, metres: Any, tmp_path: Path) -> None:
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Objects.AddBrep(rhino_shapes.tube(radius=300.0, height=500.0))
    assert model.Write(str(tmp_path / "tube.3dm"), 7)
    surface = run_once(take_with_edges, x=str(tmp_path / "tube.3dm"))["y"]
    assert 0.03 < np.median(surface.edge_lengths) < 0.06, "metres, as the surface"


def test_geometry_in_memory_has_the_documents_unit_and_tolerance(canvas: Canvas, metres: Any) -> None:
    surface = run_once(take, x=rhino_shapes.tube())["y"]
    assert (surface.unit, surface.tolerance) == ("Meters", 0.001)


class Guid:
    """An id of .NET, as far as it is told by its name."""


def test_an_id_is_looked_up_in_both_documents(canvas: Canvas, metres: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run_once(take, x=Guid())["y"].n_faces > 0
    metres.Objects.FindId = lambda _: None
    refused = run_once(take, x=Guid())
    assert refused.messages[0][1].startswith("NO_SURFACE: The document has no such object")
    found = SimpleNamespace(Geometry=rhino_shapes.tube())
    kept = SimpleNamespace(Objects=SimpleNamespace(Find=lambda _: found))
    monkeypatch.setattr(sys.modules["scriptcontext"], "doc", kept, raising=False)
    assert run_once(take, x=Guid())["y"].n_faces > 0


def test_another_unit_of_the_document_is_another_input(canvas: Canvas, metres: Any) -> None:
    sticky: dict[str, Any] = {}
    first = run_once(tell_document, sticky=sticky, x=1)["y"]
    metres.ModelUnitSystem = "UnitSystem.Feet"
    assert first.unit == "Meters"
    assert run_once(tell_document, sticky=sticky, x=1)["y"].unit == "Feet"


def test_a_unit_without_a_length_is_none(metres: Any) -> None:
    metres.ModelUnitSystem = "UnitSystem.CustomUnits"
    assert document_unit().unit == "None"


def test_without_a_document_there_is_no_unit(metres: Any) -> None:
    sys.modules["Rhino"].RhinoDoc.ActiveDoc = None  # type: ignore[attr-defined]
    assert document_unit() == DocumentUnit("None", 0.0)


def test_a_surface_passes_through(canvas: Canvas, stages: dict[str, Ran]) -> None:
    surface = stages["surface"]["surface"]
    assert run_once(take, x=surface)["y"] is surface


def test_values_are_told_apart_by_what_they_hold(stages: dict[str, Ran]) -> None:
    surface = stages["surface"]["surface"]
    twin = SurfaceMesh(surface.vertices, surface.faces, surface.unit, surface.tolerance, surface.cuts, surface.name)
    moved = SurfaceMesh(surface.vertices + 1.0, surface.faces, surface.unit)
    assert digest(surface) == digest(twin)
    assert len({digest(value) for value in (surface, moved, stages["link"]["lattice"])}) == 3


@pytest.mark.parametrize(
    ("one", "other"),
    [(1, 1.0), (0, False), ("1", 1), ("a", "b"), (None, ""), ([1, 2], [12]), ({"a": 1}, {"a": 2}), ([None], [])],
)
def test_plain_inputs_are_told_apart(one: Any, other: Any) -> None:
    assert digest(one) == digest(one)
    assert digest(one) != digest(other)


def test_a_file_that_changes_is_another_input(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0")
    before = digest(str(path))
    os.utime(path, (1, 1))
    assert digest(str(path)) != before
    assert digest("no such file") == digest("no such file")


def test_a_file_beside_the_definition_is_read_again_when_it_changes(canvas: Canvas, tmp_path: Path) -> None:
    component = Component(["x"], wired=["x"], file=str(tmp_path / "house.gh"))
    sticky: dict[str, Any] = {}
    done: list[Any] = []
    for content in ("one", "one", "another"):
        if not done or content == "another":
            (tmp_path / "shell.obj").write_text(content)
        run_once(note(done), component, sticky, x="shell.obj")
    assert len(done) == 2


def test_rhino_geometry_is_told_apart() -> None:
    assert digest(rhino_shapes.tube()) == digest(rhino_shapes.tube())
    assert digest(rhino_shapes.tube()) != digest(rhino_shapes.tube(radius=1.5))
    with pytest.raises(Indistinct):
        digest(object())


def test_branches_are_sorted_and_keep_their_items_in_order() -> None:
    assert grouped([2, 0, 2], "abc") == [((0,), ["b"]), ((2,), ["a", "c"])]


def test_a_branch_without_items_is_a_branch_all_the_same(canvas: Canvas) -> None:
    tree = data_tree([((0, 1), []), ((1,), [5]), ((1,), [6])])
    assert isinstance(tree, DataTree)
    assert tree.branches == {GhPath(0, 1): [], GhPath(1): [5, 6]}


def test_a_drawn_mesh_is_read_back_to_the_last_bit() -> None:
    rng = np.random.default_rng(3)
    points, quads = rng.normal(size=(40, 3)) * 1e5 + 1 / 3, rng.integers(0, 40, (25, 4))
    mesh = Drawing(rhino3dm).mesh(points, quads)
    assert np.array_equal(rhino_vertices(mesh), points)
    assert np.array_equal(rhino_faces(mesh), quads)


def test_measuring_needs_latitudes_at_least(stages: dict[str, Ran]) -> None:
    latitudes = stages["offset"]["latitudes"]
    measures = measure(latitudes)
    assert measures.edges is None
    assert measures.regular is None
    assert len(measures.spacing) == len(latitudes) - 1
    with pytest.raises(Unsupported, match="nothing to measure of a SurfaceMesh"):
        measure(stages["surface"]["surface"])  # type: ignore[arg-type]


class ValueLists(list[Any]):
    Add, Clear = list.append, list.clear


def value_list() -> Any:
    made = SimpleNamespace(ListItems=ValueLists(["One", "Two"]), Attributes=SimpleNamespace(), selected=None)
    made.CreateAttributes = lambda: None
    made.SelectItem = lambda i: setattr(made, "selected", made.ListItems[i])
    return made


def test_lists_appear_and_are_wired_when_a_component_is_placed(canvas: Canvas, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel: Any = sys.modules["Grasshopper.Kernel"]
    monkeypatch.setattr(kernel.GH_Document, "GH_ScheduleDelegate", lambda call: call, raising=False)
    special, drawing = ModuleType("Grasshopper.Kernel.Special"), ModuleType("System.Drawing")
    vars(special).update(GH_ValueList=value_list, GH_ValueListItem=lambda name, expression: (name, expression))
    vars(drawing)["PointF"] = lambda x, y: (x, y)
    monkeypatch.setitem(sys.modules, "Grasshopper.Kernel.Special", special)
    monkeypatch.setitem(sys.modules, "System.Drawing", drawing)
    scheduled: list[Any] = []
    added: list[Any] = []
    wired: list[Any] = []
    document: Any = SimpleNamespace(DocumentID="0", FilePath=None, Objects=[])
    document.ScheduleSolution = lambda _, call: scheduled.append(call)
    document.AddObject = lambda made, _update, _index: added.append(made)
    inputs = [SimpleNamespace(Name=name, NickName=name, SourceCount=0, AddSource=wired.append) for name in ("x", "by")]
    component: Any = SimpleNamespace(InstanceGuid="1", Params=SimpleNamespace(Input=inputs), Message="")
    component.Attributes = SimpleNamespace(Bounds=SimpleNamespace(Left=300.0, Bottom=90.0))
    component.OnPingDocument = lambda: document
    component.ExpireSolution = lambda _: None
    sticky: dict[str, Any] = {}
    options: dict[str, Any] = {"needs": {"x": int}, "n_outputs": 1, "lists": {"by": ("levels", "fronts")}}
    for _ in range(3):
        assert solve(component, sticky, note([]), {"x": None, "by": None}, **options) == (None,)
    (call,) = scheduled
    call(document)
    (made,) = added
    assert wired == [made]
    assert made.ListItems == [("levels", '"levels"'), ("fronts", '"fronts"')]
    assert (made.NickName, made.selected[0], made.Attributes.Pivot[0] < 300.0) == ("by", "levels", True)
    inputs[1].SourceCount, component.InstanceGuid = 1, "2"
    solve(component, sticky, note([]), {"x": None, "by": None}, **options)
    assert len(scheduled) == 1, "it is wired already"
