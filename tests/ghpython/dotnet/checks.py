"""Run the way through .NET: ``python checks.py RhinoLike.dll`` prints what each check said, "" if it held, as JSON.

It loads .NET into its process for good, so it has a process of its own.
"""

from __future__ import annotations

import contextlib
import json
import sys
import traceback
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any, Callable

import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]

CHECKS: dict[str, Callable[[], None]] = {}


def check(function: Callable[[], None]) -> Callable[[], None]:
    CHECKS[function.__name__] = function
    return function


def load(assembly: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # It warns of every mono that distributions ship.
        import pythonnet

        pythonnet.load("mono")
        import clr
    sys.path.append(str(assembly.parent))
    clr.AddReference(assembly.stem)
    context = ModuleType("scriptcontext")
    vars(context)["sticky"] = {}
    sys.modules["scriptcontext"] = context


def geometry() -> Any:
    import Rhino.Geometry

    return Rhino.Geometry


def patch(*numbers: float) -> Any:
    """A rectangle: a corner and two sides."""
    rg = geometry()
    corner, u, v = numbers[:3], numbers[3:6], numbers[6:]
    return rg.Patch(rg.Point3d(*map(float, corner)), rg.Vector3d(*map(float, u)), rg.Vector3d(*map(float, v)))


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet of n by n quads, with coordinates that single precision would change."""
    x, y = np.meshgrid(np.linspace(0.0, 100.0, n + 1), np.linspace(0.0, 100.0, n + 1))
    points = np.stack([x, y, 5.0 * np.sin(x / 17.0) + 1.0 / 3.0], axis=2).reshape(-1, 3)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return points, np.stack([a, a + 1, a + n + 2, a + n + 1], axis=1)


@check
def points_go_to_dotnet_and_back_to_the_last_bit() -> None:
    from weavecore.rhino_geometry.net_arrays import net_array, rows_from

    points = np.random.default_rng(1).normal(size=(1000, 3)) * 1e6
    array = net_array(geometry().Point3d, points)
    assert array.Length == 1000
    assert points[7, [0, 2]].tolist() == [array[7].X, array[7].Z]
    assert (rows_from(array, "XYZ") == points).all()
    assert rows_from(net_array(geometry().Point3d, points[:0]), "XYZ").shape == (0, 3)


@check
def arrays_are_copied_as_blocks_and_not_row_by_row() -> None:
    from weavecore.rhino_geometry import net_arrays

    def forbidden(array: Any, names: Any) -> list[Any]:
        raise AssertionError("row by row")

    kept, net_arrays._rows_one_by_one = net_arrays._rows_one_by_one, forbidden
    try:
        array = net_arrays.net_array(geometry().Point3d, np.ones((3, 3)))
        assert (net_arrays.rows_from(array, "XYZ") == 1.0).all()
    finally:
        net_arrays._rows_one_by_one = kept


@check
def structures_of_another_size_are_taken_row_by_row() -> None:
    from System import Array

    from weavecore.rhino_geometry.net_arrays import rows_from

    rg = geometry()
    lines = Array[rg.Line]([rg.Line(0.0, 1.0, 2.0, 3.0, 4.0, 5.0)])
    assert rows_from(lines, ("To.X", "To.Y", "To.Z")).tolist() == [[3.0, 4.0, 5.0]]


@check
def a_mesh_goes_there_and_back_in_double_precision() -> None:
    from weavecore.rhino_geometry import Drawing, is_rhino_mesh, rhino_faces, rhino_vertices

    points, quads = grid(12)
    mesh = Drawing().mesh(points, quads)
    assert mesh.Vertices.UseDoublePrecisionVertices
    assert is_rhino_mesh(mesh)
    assert (rhino_vertices(mesh) == points).all()
    assert (rhino_faces(mesh) == quads).all()


@check
def a_mesh_gives_the_surface_that_its_arrays_give() -> None:
    from weavecore import pipeline
    from weavecore.rhino_geometry import Drawing

    points, quads = grid(12)
    mine = pipeline.surface_from(Drawing().mesh(points, quads))
    plain = pipeline.surface_from((points, quads))
    assert (mine.vertices == plain.vertices).all()
    assert (mine.faces == plain.faces).all()


@check
def curves_and_lines_have_all_their_points() -> None:
    from weavecore.rhino_geometry import Drawing

    drawing, points = Drawing(), np.random.default_rng(2).normal(size=(9, 3))
    ring = drawing.polyline(points, is_closed=True)
    assert ring.PointCount == 10
    assert ring.IsClosed
    assert points[8, :2].tolist() == [ring.Point(8).X, ring.Point(8).Y]
    assert drawing.polyline(points, is_closed=False).PointCount == 9
    lines = drawing.lines(points[:4], points[4:8])
    assert [line.To.X for line in lines] == points[4:8, 0].tolist()
    knots = np.concatenate([[0.0] * 4, [0.2, 0.4, 0.5, 0.6, 0.9], [1.0] * 4])
    spline = drawing.spline(knots, points)
    assert (spline.Degree, spline.PointCount) == (3, 9)
    assert list(spline.Knots) == knots[1:-1].tolist()


@check
def faces_of_a_brep_are_meshed_by_rhino_and_joined() -> None:
    from weavecore import pipeline

    # Three sides of a tunnel: faces share edges, and the borders are its two ends and its feet, in one loop.
    sides = patch(0, 0, 0, 0, 0, 3, 6, 0, 0), patch(0, 0, 3, 0, 4, 0, 6, 0, 0), patch(0, 4, 3, 0, 0, -3, 6, 0, 0)
    surface = pipeline.surface_from(geometry().Brep(*sides), unit="Meters", tolerance=0.001)
    assert len(surface.borders) == 1
    assert surface.euler_characteristic == 1
    assert surface.unit == "Meters"
    assert float(surface.edge_lengths.max()) < 0.3


@check
def the_edge_target_is_kept() -> None:
    from weavecore import pipeline

    rg = geometry()
    surface = pipeline.surface_from(rg.PlaneSurface(patch(0, 0, 0, 6, 0, 0, 0, 4, 0)), edge_target=2.0)
    assert surface.n_faces == 12
    for kind in (rg.Extrusion, rg.BrepFace):
        assert pipeline.surface_from(kind(patch(0, 0, 0, 6, 0, 0, 0, 4, 0)), edge_target=2.0).n_faces == 12


@check
def a_subd_is_meshed_as_finely_as_it_has_few_faces() -> None:
    from weavecore import pipeline

    rg = geometry()
    few = pipeline.surface_from(rg.SubD(patch(0, 0, 0, 6, 0, 0, 0, 6, 0), 6))
    many = pipeline.surface_from(rg.SubD(patch(0, 0, 0, 6, 0, 0, 0, 6, 0), 4000))
    assert few.n_faces > many.n_faces > 0


@check
def what_rhino_cannot_mesh_is_refused() -> None:
    from weavecore import pipeline
    from weavecore.errors import Degenerate

    brep = geometry().Brep(patch(0, 0, 0, 6, 0, 0, 0, 4, 0))
    brep.IsHopeless = True
    with pytest.raises(Degenerate, match="command Check"):
        pipeline.surface_from(brep)


@check
def the_documents_unit_and_tolerance_are_taken() -> None:
    import Rhino

    from weavecore.rhino_geometry import document_unit

    assert document_unit() == ("None", 0.0)
    with open_document(Rhino.UnitSystem.Meters, 0.001):
        assert document_unit() == ("Meters", 0.001)
    with open_document(getattr(Rhino.UnitSystem, "None"), 0.01):
        assert document_unit() == ("None", 0.01)


@check
def a_plane_is_a_point_and_a_normal() -> None:
    from weavecore.rhino_geometry import plane_from

    rg = geometry()
    plane = rg.Plane(rg.Point3d(1.0, 2.0, 3.0), rg.Vector3d(0.0, 0.0, 1.0))
    assert plane_from(plane) == ((1.0, 2.0, 3.0), (0.0, 0.0, 1.0))


@check
def geometry_is_told_apart_by_its_digest() -> None:
    from weavecore.canvas.solve import digest
    from weavecore.rhino_geometry import Drawing

    rg = geometry()
    points, quads = grid(3)
    first, again = Drawing().mesh(points, quads), Drawing().mesh(points, quads)
    points[5, 0] += 1e-9  # An inner vertex: the box stays the same.
    other = Drawing().mesh(points, quads)
    assert digest(first) == digest(again) != digest(other)
    breps = [rg.Brep(patch(0, 0, z, 6, 0, 0, 0, 4, 0)) for z in (0, 0, 1)]
    assert digest(breps[0]) == digest(breps[1]) != digest(breps[2])
    planes = [rg.Plane(rg.Point3d(z, 0.0, 0.0), rg.Vector3d(0.0, 0.0, 1.0)) for z in (0.0, 1.0)]
    assert digest(planes[0]) != digest(planes[1])


@check
def all_components_run_on_dotnet_geometry() -> None:
    import Rhino
    from Grasshopper import DataTree
    from System import Object

    from weavecore import pipeline
    from weavecore.rhino_geometry import Drawing

    points, quads = grid(40)
    with open_document(Rhino.UnitSystem.Millimeters, 0.01):
        surface, borders, mesh, *_ = run("Weave_Surface", geometry=Drawing().mesh(points, quads))
        assert type(borders[0]).__name__ == "PolylineCurve"
        assert mesh.Faces.Count == surface.n_faces
        latitudes, curves, parents = run("Weave_Offset", surface=surface, spacing=12.0)
        assert isinstance(curves, DataTree[Object])
        assert curves.BranchCount == latitudes.n_generations
        assert str(parents.Path(1)) == "{0;1;0}"
        assert list(parents.Branch(1)) == [0]
        lattice, nodes, rings, *_ = run("Weave_Link", latitudes=latitudes)
        assert [type(nodes), len(nodes)] == [list, lattice.n_nodes]
        linked = lattice.node_latitude[lattice.node_latitude >= 0]
        assert rings.BranchCount == len(set(latitudes.generation[linked].tolist()))
        weave, rods, names, layers, utilisation = run("Weave_Strands", lattice=lattice)
        assert sum(rods.Branch(i).Count for i in range(rods.BranchCount)) == len(weave)
        assert names.Branch(0)[0] == weave.ids[0]
        trees = parents, names, utilisation, layers
        kinds = [tree.TypeNameOf(1, 0) for tree in trees]
        assert kinds == ["System.Int32", "System.String", "System.Double", "System.Int32"]
        rg = geometry()
        corners = [rg.Point3d(*row) for row in lattice.nodes[:3].tolist()]
        at_rest, drawn, *_, held, reactions, stable, springs, lengths, _, ties = run(
            "Weave_Simulate", weave=weave, places=corners, gravity=False
        )
        assert stable is True
        assert sum(drawn.Branch(i).Count for i in range(drawn.BranchCount)) == len(weave)
        assert len(held) == len(reactions) == int(at_rest.is_supported.sum()) == 3
        assert [type(one[0]).__name__ for one in (held, reactions, ties)] == ["Point3d", "Vector3d", "Line"]
        assert springs.BranchCount == lengths.BranchCount == len(weave)
        assert lengths.TypeNameOf(1, 0) == "System.Double"
        assert run("Weave_Measure", value=weave)[2] > 0.5
        assert run("Weave_Export", value=weave)[0] is None
    plain = pipeline.link(pipeline.offset(pipeline.surface_from((points, quads)), spacing=12.0))
    assert (lattice.nodes == plain.nodes).all()
    assert (lattice.edges == plain.edges).all()


@check
def a_list_of_dotnet_is_taken_as_numbers() -> None:
    from System import Double
    from System.Collections.Generic import List

    from weavecore import canvas
    from weavecore.canvas.solve import digest

    spacings = List[Double]()
    assert canvas.numbers(spacings) is None
    spacings.Add(12.0)
    assert canvas.numbers(spacings) == 12.0
    before = digest(spacings)
    spacings.Add(9.0)
    assert canvas.numbers(spacings) == [12.0, 9.0]
    assert digest(spacings) != before


@check
def an_object_of_the_document_is_found_by_its_id() -> None:
    import Rhino

    with open_document(Rhino.UnitSystem.Millimeters, 0.01) as document:
        found = document.Objects.Add(geometry().PlaneSurface(patch(0, 0, 0, 6, 0, 0, 0, 4, 0)))
        assert run("Weave_Surface", geometry=found)[0].unit == "Millimeters"
        from System import Guid

        component = make_component("Weave_Surface")
        assert run("Weave_Surface", component=component, geometry=Guid.NewGuid())[0] is None
        assert "NO_SURFACE" in component.Messages[0]


@check
def what_is_wired_is_seen_on_interfaces() -> None:
    component = make_component("Weave_Offset")
    assert run("Weave_Offset", component=component) == (None, None, None)
    assert list(component.Messages) == []
    component.Params.Input[0].__implementation__.SourceCount = 1
    assert run("Weave_Offset", component=component) == (None, None, None)
    assert list(component.Messages) == ["Warning: surface: nothing comes through the wire."]


@check
def files_belong_beside_the_definition() -> None:
    from Grasshopper.Kernel import GH_Document

    component = make_component("Weave_Surface")
    component.Document = GH_Document()
    component.Document.FilePath = str(ROOT / "sample_files" / "house.gh")
    assert run("Weave_Surface", component=component, geometry="hemisphere.3dm")[0].n_faces > 1000


@check
def escape_cancels() -> None:
    from Grasshopper.Kernel import GH_Document

    from weavecore import pipeline

    component = make_component("Weave_Offset")
    points, quads = grid(40)
    GH_Document.EscapeKeyDown = True
    try:
        outputs = run("Weave_Offset", component=component, surface=pipeline.surface_from((points, quads)), spacing=9.0)
    finally:
        GH_Document.EscapeKeyDown = False
    assert outputs == (None, None, None)
    assert list(component.Messages) == ["Remark: Cancelled. Recompute to go on."]


@check
def messages_reach_the_component() -> None:
    component = make_component("Weave_Offset")
    assert run("Weave_Offset", component=component, surface="a text") == (None, None, None)
    assert component.Messages[0].startswith("Error: UNSUPPORTED: A str came where surface must be a SurfaceMesh.")


@contextlib.contextmanager
def open_document(unit: Any, tolerance: float) -> Any:
    import Rhino

    document = Rhino.RhinoDoc()
    document.ModelUnitSystem, document.ModelAbsoluteTolerance = unit, tolerance
    Rhino.RhinoDoc.ActiveDoc = document
    try:
        yield document
    finally:
        Rhino.RhinoDoc.ActiveDoc = None


def make_component(name: str) -> Any:
    from Grasshopper.Kernel import Component, Param

    component = Component()
    metadata = json.loads((ROOT / "ghpython_components" / name / "metadata.json").read_text("utf-8"))
    for parameter in metadata["ghpython"]["inputParameters"]:
        made = Param()
        made.Name = made.NickName = parameter["name"]
        component.Params.Input.Add(made)
    return component


def run(name: str, *, component: Any = None, **inputs: Any) -> tuple[Any, ...]:
    """Run a component's script."""
    from grasshopper_files.components import with_header

    component = component or make_component(name)
    path = ROOT / "ghpython_components" / name / "code.py"
    environment = ModuleType("ghenv")
    vars(environment)["Component"] = component
    scope: dict[str, Any] = {"__name__": "__main__", "ghenv": environment}
    # Rhino's pythonnet takes Python's object for .NET's, which the one on PyPI does not.
    source = with_header(path.read_text("utf-8")).replace("List[object]", "List[System.Object]")
    exec(compile(source, str(path), "exec", dont_inherit=True), scope)
    script = scope[name.partition("_")[2]]()
    outputs = script.RunScript(*(inputs.get(parameter.Name) for parameter in component.Params.Input))
    errors = [text for text in component.Messages if text.startswith("Error: INTERNAL")]
    assert not errors, errors
    return outputs


def main(assembly: str) -> None:
    sys.path[:0] = [str(ROOT), str(ROOT / "ghpython_components")]
    load(Path(assembly))
    sys.stdout.write(json.dumps({name: outcome_of(function) for name, function in CHECKS.items()}))


def outcome_of(function: Callable[[], None]) -> str:
    """Nothing, or the traceback of what went wrong."""
    try:
        function()
    except Exception:  # noqa: BLE001 - whatever it is, the test shows it.
        return traceback.format_exc()
    return ""


if __name__ == "__main__":
    main(sys.argv[1])
