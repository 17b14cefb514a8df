"""Every component on real input, on nothing, on a None, on bad input, and cancelled."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm

import rhino_shapes
from ghpython.stubs import (
    COMPONENTS,
    NAMES,
    NAMES_IN_SIGNATURES,
    Canvas,
    Component,
    GhPath,
    List,
    Ran,
    metadata_of,
    parameters_of,
    rewritten,
    rhino_annotation,
    run_component,
    run_script,
    run_script_of,
)
from grasshopper_files.components import ACCESS, HINTS, read_component, without_requirements
from weavecore import canvas as module_of_canvas
from weavecore import pipeline
from weavecore.canvas import lists_of
from weavecore.exploring import Row
from weavecore.exploring.evaluate import BEND, DIAMETER, ENDS, RODS
from weavecore.exploring.table import INPUTS, encode_table
from weavecore.model import Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.rhino_geometry import DocumentUnit
from woven_tube import tube_surface

DOME = str(COMPONENTS.parent / "sample_files" / "hemisphere.3dm")
NEEDS = {
    "Weave_Surface": "geometry",
    "Weave_Offset": "surface",
    "Weave_Link": "latitudes",
    "Weave_Strands": "lattice",
    "Weave_Simulate": "weave",
    "Weave_Export": "value",
    "Weave_Measure": "value",
    "Weave_Choose": "table",
    "Weave_Preview": "weave",
    "Weave_Fabricate": "weave",
    "Weave_View": "value",
    "Weave_Bake": "weave",
    "Deconstruct_Lattice": "lattice",
    "Deconstruct_Weave": "weave",
}


def source_of(name: str) -> str:
    return read_component(COMPONENTS / name).code


@pytest.mark.parametrize("name", NAMES)
def test_the_script_has_the_signature_that_rhino_would_write(name: str) -> None:
    inputs = parameters_of(COMPONENTS / name, "input")
    arguments = run_script_of(source_of(name)).args.args[1:]
    assert [a.arg for a in arguments] == [p["name"] for p in inputs]
    annotations = [ast.unparse(a.annotation) if a.annotation else "" for a in arguments]
    assert annotations == list(map(rhino_annotation, inputs))
    again = rewritten(source_of(name), inputs)
    assert ast.dump(ast.parse(again)) == ast.dump(ast.parse(source_of(name)))


@pytest.mark.parametrize("hint", sorted(NAMES_IN_SIGNATURES))
@pytest.mark.parametrize("access", sorted(ACCESS))
@pytest.mark.parametrize("name", NAMES)
def test_another_hint_or_access_that_is_chosen_on_the_canvas_leaves_a_script_that_runs(
    name: str, access: str, hint: str, canvas: Canvas
) -> None:
    inputs = [{**p, "scriptParamAccess": access, "typeHintID": hint} for p in parameters_of(COMPONENTS / name, "input")]
    outputs = [p["name"] for p in parameters_of(COMPONENTS / name, "output")]
    component = Component([p["name"] for p in inputs])
    ran = run_script(rewritten(source_of(name), inputs), component, [None] * len(inputs), outputs)
    assert ran.messages == []


@pytest.mark.parametrize("name", NAMES)
def test_the_script_is_one_of_python_3_9_and_asks_rhino_for_published_packages_alone(name: str) -> None:
    source = source_of(name)
    ast.parse(source, feature_version=(3, 9))
    *required, environment = source.splitlines()[:3]
    assert environment == "# venv: weavecore"
    for line in required:
        package, bound = re.fullmatch(r"# r: (numpy|scipy)>=(\d+\.\d+)", line).groups()  # type: ignore[union-attr]
        assert f'"{package}>={bound}"' in (COMPONENTS.parent / "pyproject.toml").read_text("utf-8")
    assert "# r: " not in without_requirements(read_component(COMPONENTS / name)).code


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_says_what_it_is(name: str) -> None:
    metadata = metadata_of(COMPONENTS / name)
    assert metadata["name"] == name.replace("_", " ")
    assert metadata["category"] == "Weave"
    assert metadata["exposure"] in (2, 4, 8, 16)
    assert metadata["ghpython"]["iconDisplay"] == 2
    for side in ("input", "output"):
        parameters = parameters_of(COMPONENTS / name, side)
        names = [p["name"] for p in parameters]
        assert len(set(names)) == len(names)
        for parameter in parameters:
            # Rhino takes the one or the other for the name of the script's variable.
            assert parameter["nickname"] == parameter["name"]
            assert parameter["name"].isidentifier()
            assert parameter["description"].endswith(".")
    for i, parameter in enumerate(parameters_of(COMPONENTS / name, "input")):
        assert parameter["typeHintID"] in HINTS
        assert parameter["typeHintID"] != "ghdoc", "geometry would come as an id"
        assert parameter["scriptParamAccess"] in ACCESS
        # Else Grasshopper would complain of what is not wired, and the script not keep silent.
        assert parameter["optional"] is True
        has_default = "Default: " in parameter["description"]
        assert has_default == (i > 0) or name == "Weave_Export", f"{name}: {parameter['name']}"


@pytest.mark.parametrize("name", ["Weave_Strands", "Weave_Simulate", "Weave_Measure"])
def test_a_utilisation_above_1_exceeds_the_allowable_stress_and_is_not_said_to_break_the_rod(name: str) -> None:
    (text,) = (p["description"] for p in parameters_of(COMPONENTS / name, "output") if p["name"] == "utilisation")
    assert "strength divided by a safety factor" in text
    assert text.endswith("above 1 exceeds the allowable stress.")
    assert "break" not in text


@pytest.mark.parametrize("is_rewritten", [False, True], ids=["as shipped", "rewritten"])
@pytest.mark.parametrize("name", NAMES)
def test_unwired_it_keeps_silent(name: str, is_rewritten: bool, canvas: Canvas) -> None:
    ran = run_component(name, is_rewritten=is_rewritten)
    assert ran.is_empty
    assert ran.messages == []
    assert ran.caption == ""


@pytest.mark.parametrize("name", NAMES)
def test_a_wire_that_gives_nothing_is_told(name: str, canvas: Canvas) -> None:
    ran = run_component(name, **{NEEDS[name]: None})
    assert ran.is_empty
    assert ran.messages == [("Warning", f"{NEEDS[name]}: nothing comes through the wire.")]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [object(), 7, [1, 2, 3]], ids=["object", "number", "list"])
def test_what_is_no_input_at_all_is_refused_in_words(name: str, value: Any, canvas: Canvas) -> None:
    ran = run_component(name, **{NEEDS[name]: value})
    assert ran.is_empty
    ((level, text),) = ran.messages
    assert level == "Error"
    assert text.startswith("UNSUPPORTED: ")


def test_real_input_gives_every_output_and_no_complaint(stages: dict[str, Ran]) -> None:
    for name, ran in stages.items():
        assert [message for message in ran.messages if message[0] == "Error"] == [], name
        assert [key for key, value in ran.outputs.items() if value is None] == [], name
        assert re.search(r"\d", ran.caption), f"{name} has no counts in its caption"
    values = stages["surface"]["surface"], stages["offset"]["latitudes"], stages["link"]["lattice"]
    assert [type(value) for value in values] == [SurfaceMesh, Latitudes, Lattice]
    assert isinstance(stages["strands"]["weave"], Weave)


@pytest.mark.parametrize("is_rewritten", [False, True], ids=["as shipped", "rewritten"])
def test_a_script_that_rhino_has_rewritten_gives_the_same(
    canvas: Canvas, tube: SurfaceMesh, stages: dict[str, Ran], is_rewritten: bool, tmp_path: Path
) -> None:
    surface = run_component("Weave_Surface", is_rewritten=is_rewritten, geometry=(tube.vertices, tube.faces), edge=1.0)
    spacing = List([1.0])
    offset = run_component("Weave_Offset", is_rewritten=is_rewritten, surface=surface["surface"], spacing=spacing)
    link = run_component("Weave_Link", is_rewritten=is_rewritten, latitudes=offset["latitudes"], pattern="quad")
    strands = run_component("Weave_Strands", is_rewritten=is_rewritten, lattice=link["lattice"], diameter=0.01)
    points, forces = List([rhino3dm.Point3d(1, 0, 1)]), List([rhino3dm.Vector3d(0, 0, -0.001)])
    options = {"supports": "borders", "places": List([]), "points": points, "forces": forces}
    weave = stages["strands"]["weave"]  # The tube has no unit, and forces need one.
    simulate = run_component("Weave_Simulate", is_rewritten=is_rewritten, weave=weave, **options)
    measure = run_component("Weave_Measure", is_rewritten=is_rewritten, value=strands["weave"])
    target = str(tmp_path / "woven.json")
    export = run_component("Weave_Export", is_rewritten=is_rewritten, value=strands["weave"], path=target, write=True)
    ran = (surface, offset, link, strands, simulate, measure, export)
    assert [text for one in ran for level, text in one.messages if level == "Error"] == []
    expected = pipeline.link(pipeline.offset(tube, spacing=1.0), pattern="quad")
    assert np.array_equal(link["lattice"].nodes, expected.nodes)
    assert export["file"] == target


@pytest.fixture(scope="module")
def tube() -> SurfaceMesh:
    return tube_surface()


def test_the_offset_starts_at_chosen_borders(tube: SurfaceMesh, canvas: Canvas) -> None:
    for wired in ([0], [None, 0], 0):
        ran = run_component("Weave_Offset", surface=tube, spacing=[1.0], borders=wired)
        assert ran.messages == []
        assert [p.tolist() for p in ran["latitudes"].surface.starts.paths] == [tube.borders[0].tolist()]
    assert run_component("Weave_Offset", surface=tube, borders=[])["latitudes"].surface.starts is None
    ((level, text),) = run_component("Weave_Offset", surface=tube, borders=[2]).messages
    assert (level, text[:9]) == ("Error", "BAD_INDEX")


@pytest.mark.parametrize(
    ("guide", "is_closed"),
    [
        (rhino_shapes.polyline((1, 0, 2), (np.cos(np.pi / 6), 0.5, 2), (0.5, np.cos(np.pi / 6), 2)), False),
        (rhino3dm.Line(rhino_shapes.point(1, 0, 1), rhino_shapes.point(1, 0, 4)), False),
        (rhino3dm.Circle(rhino_shapes.point(0, 0, 2), 0.98), True),
    ],
    ids=["polyline", "line", "circle"],
)
def test_the_offset_starts_at_guides(guide: Any, is_closed: bool, tube: SurfaceMesh, canvas: Canvas) -> None:
    ran = run_component("Weave_Offset", surface=tube, spacing=[1.0], guides=[guide, None])
    assert ran.messages == []
    assert ran["latitudes"].surface.starts.closed.tolist() == [is_closed]
    assert np.unique(ran["latitudes"].generation).tolist() == list(range(len(ran["curves"].branches)))
    again = run_component("Weave_Offset", surface=tube, spacing=[1.0], guides=[guide, None])
    assert again["latitudes"] is ran["latitudes"], "the same guide is not computed again"


def test_borders_are_picked_by_what_lies_near_them(tube: SurfaceMesh, canvas: Canvas) -> None:
    top = int(np.argmax([tube.vertices[loop][:, 2].mean() for loop in tube.borders]))
    z = float(tube.vertices[tube.borders[top]][:, 2].mean())
    for near in (rhino3dm.Point3d(3.0, 0.0, z + 1.0), rhino3dm.Circle(rhino_shapes.point(0, 0, z), 0.7)):
        ran = run_component("Weave_Offset", surface=tube, spacing=[1.0], borders=[near, None, top])
        assert [p.tolist() for p in ran["latitudes"].surface.starts.paths] == [tube.borders[top].tolist()]
    for wrong, told in (
        (0.5, "A border has a whole number (got 0.5)"),
        ("top", "borders must be a number (got 'top')"),
    ):
        ((level, text),) = run_component("Weave_Offset", surface=tube, borders=[wrong]).messages
        assert (level, told in text) == ("Error", True), text


def test_rings_are_denser_near_points_with_factors(tube: SurfaceMesh, canvas: Canvas) -> None:
    def offset(**inputs: Any) -> Ran:
        return run_component("Weave_Offset", surface=tube, spacing=[1.0], borders=[0], **inputs)

    axis, side = rhino3dm.Point3d(0, 0, 2.5), rhino3dm.Point3d(1, 0, 2.5)
    ran = offset(points=[axis, None], factors=[0.5], reach=100.0)
    assert ran.messages == []
    expected = pipeline.offset(tube, spacing=1.0, borders=[0], factors=[((0, 0, 2.5), 0.5)], reach=100.0)
    assert np.array_equal(ran["latitudes"].distance, expected.distance)
    assert ran["latitudes"].n_generations > 1.5 * offset()["latitudes"].n_generations
    assert offset(points=[axis, side], factors=[0.5], reach=100.0).messages == []
    ((level, text),) = offset(points=[side], factors=[0.5], reach=1.0).messages
    assert (level, text[:8]) == ("Remark", "GRADED: ")
    for inputs, words in (
        ({"points": [axis]}, "Points need factors"),
        ({"factors": [0.5]}, "Points need factors"),
        ({"points": [axis], "factors": ["abc"]}, "factors must be a number (got 'abc')"),
        ({"points": ["abc"], "factors": [0.5]}, "The points must be points"),
        ({"points": [axis], "factors": [1, 2]}, "There are 2 factors for 1 points"),
        ({"points": [axis], "factors": [0]}, "a positive factor (got the factor 0.0)"),
    ):
        ((level, text),) = offset(**inputs).messages
        assert (level, words in text) == ("Error", True), text


def test_names_may_have_capitals_and_numbers_must_be_numbers(canvas: Canvas, tube: SurfaceMesh) -> None:
    offset = run_component("Weave_Offset", surface=tube, spacing=["1.0"], method=" Levels ")
    lattice = run_component("Weave_Link", latitudes=offset["latitudes"], pattern='"Kagome"')["lattice"]
    assert lattice.pattern == "kagome"
    strands = run_component("Weave_Strands", lattice=lattice, diameter=0.01, material="GFRP", style="Plain")
    assert strands["weave"].over_under == "plain"
    for inputs, told in (
        ({"spacing": ["abc"]}, "spacing must be a number (got 'abc')"),
        ({"method": "Rays"}, "'rays'"),
    ):
        ((level, text),) = run_component("Weave_Offset", surface=tube, **inputs).messages
        assert (level, told in text) == ("Error", True), text
        assert "INTERNAL" not in text


def test_the_usual_style_on_the_list_is_that_of_the_pattern(canvas: Canvas, tube: SurfaceMesh) -> None:
    latitudes = run_component("Weave_Offset", surface=tube, spacing=[1.0])["latitudes"]
    for pattern, style, expected in (
        ("triangular", "Usual", "stacked"),
        ("twill", "usual", "twill 2/2"),
        ("quad", "usual", "plain"),
        ("quad", "twill 3/1", "twill 3/1"),
    ):
        lattice = run_component("Weave_Link", latitudes=latitudes, pattern=pattern)["lattice"]
        ran = run_component("Weave_Strands", lattice=lattice, diameter=0.01, style=style)
        assert ran["weave"].over_under == expected, (pattern, style)
    assert set(lists_of("material", "style")) == {"material", "style"}


def test_a_panel_shows_a_result_in_one_line(stages: dict[str, Ran]) -> None:
    parts = (("surface", "surface"), ("offset", "latitudes"), ("link", "lattice"), ("strands", "weave"))
    for stage, name in (*parts, ("simulate", "equilibrium")):
        text = str(stages[stage][name])
        assert re.fullmatch(r"<[A-Z]\w+: .*\d.*>", text), text
        assert len(text) < 100


def test_a_guide_off_the_surface_is_refused_in_words(tube: SurfaceMesh, canvas: Canvas) -> None:
    far = rhino3dm.Line(rhino_shapes.point(9, 0, 1), rhino_shapes.point(9, 0, 4))
    wrong = ((far, "BAD_CURVE: The curve lies up to 8 off"), (object(), "BAD_CURVE: A object is not a curve"))
    for guide, told in wrong:
        ((level, text),) = run_component("Weave_Offset", surface=tube, guides=[guide]).messages
        assert level == "Error"
        assert text.startswith(told)


def test_curves_lie_in_branches_by_generation(stages: dict[str, Ran]) -> None:
    latitudes = stages["offset"]["latitudes"]
    curves = stages["offset"]["curves"].branches
    assert list(curves) == [GhPath(0, g) for g in range(latitudes.n_generations)]
    assert sum(map(len, curves.values())) == len(latitudes)
    first = curves[GhPath(0, 0)][0]
    assert isinstance(first, rhino3dm.Curve)
    assert first.IsClosed
    start = latitudes.polylines.polyline(0)[0]
    assert tuple(start) == (first.PointAtStart.X, first.PointAtStart.Y, first.PointAtStart.Z)


def test_several_spacings_follow_one_another(canvas: Canvas, stages: dict[str, Ran]) -> None:
    surface = stages["surface"]["surface"]
    graded = run_component("Weave_Offset", surface=surface, spacing=[30.0, 60.0, 90.0])["latitudes"]
    steps = np.diff(np.unique(graded.distance))
    assert steps.tolist() == [30.0, 60.0, *[90.0] * (graded.n_generations - 3)]
    single = run_component("Weave_Offset", surface=surface, spacing=[50.0])["latitudes"]
    assert np.array_equal(single.polylines.points, stages["offset"]["latitudes"].polylines.points)
    unwired = run_component("Weave_Offset", surface=surface, spacing=[])["latitudes"]
    assert unwired.spacing == pipeline.suggest_spacing(surface)


def test_parents_are_found_in_the_branch_before(canvas: Canvas) -> None:
    sample = COMPONENTS.parent / "sample_files" / "six_way_joint.3dm"
    surface = run_component("Weave_Surface", geometry=str(sample))["surface"]
    ran = run_component("Weave_Offset", surface=surface, spacing=60.0)
    latitudes, curves = ran["latitudes"], ran["curves"].branches
    found = set()
    for path, parents in ran["parents"].branches.items():
        child = index_of(latitudes, *path[1:])
        assert path[2] < len(curves[GhPath(0, path[1])])
        found |= {(index_of(latitudes, path[1] - 1, item), child) for item in parents}
    assert found == set(map(tuple, latitudes.parents.tolist()))


def index_of(latitudes: Latitudes, generation: int, item: int) -> int:
    return int(np.flatnonzero(latitudes.generation == generation)[item])


def test_the_lattice_is_drawn_whole(stages: dict[str, Ran]) -> None:
    link = stages["link"]
    lattice = link["lattice"]
    assert len(link["nodes"]) == lattice.n_nodes
    assert len(link["mesh"].Faces) == lattice.n_faces
    assert len(link["pockets"]) == int((lattice.edge_family == 2).sum())
    linked = np.unique(lattice.node_latitude[lattice.node_latitude >= 0])
    assert list(link["rings"].branches) == [
        GhPath(0, g) for g in np.unique(lattice.latitudes.generation[linked]).tolist()
    ]
    assert len(list(link["rings"])) >= len(linked)
    assert all(path[1] < lattice.latitudes.n_generations for path in link["longitudes"].branches)


def test_rods_names_layers_and_bends_belong_together(stages: dict[str, Ran]) -> None:
    ran = stages["strands"]
    weave = ran["weave"]
    names = [name for branch in ran["names"].branches.values() for name in branch]
    assert sorted(names) == sorted(weave.ids)
    for path, branch in ran["names"].branches.items():
        assert {name[0] for name in branch} == {"LABP"[path[1]]}
        assert len(ran["rods"].branches[path]) == len(branch) == len(ran["utilisation"].branches[path])
        for item, name in enumerate(branch):
            s = weave.ids.index(name)
            assert ran["utilisation"].branches[path][item] == weave.bending.utilisation[s]
            rod = ran["rods"].branches[path][item]
            rows = weave.axes.rows
            start = rows.points[rows.offsets[s]]
            assert np.allclose([rod.PointAtStart.X, rod.PointAtStart.Y, rod.PointAtStart.Z], start, atol=1e-9)
            layers = ran["layers"].branches[GhPath(0, path[1], item)]
            assert len(layers) == len(weave.strands.strand(s))
    under = [n for layers in ran["layers"].branches.values() for n in layers]
    assert np.bincount(under, minlength=3)[:3].min() > 100, "three rods cross at most nodes of a triangular lattice"


def test_measures_are_those_of_the_lattice(stages: dict[str, Ran]) -> None:
    ran, lattice = stages["measure"], stages["link"]["lattice"]
    assert ran["edges"] == lattice.edge_lengths.tolist()
    assert len(ran["spacing"]) == len(lattice.latitudes) - 1
    assert 0.97 * 50.0 < min(ran["spacing"]) <= max(ran["spacing"]) < 1.001 * 50.0
    assert 0.8 < ran["regular"] <= 1.0
    weave = stages["strands"]["weave"]
    assert ran["radius"] == weave.bending.min_radius.min()
    assert (ran["length"], ran["joints"]) == (weave.axes.lengths.sum(), len(weave.joints))
    metres = ran["length"] / 1000.0
    kilograms = metres * np.pi / 4 * (weave.rod_diameter / 1000.0) ** 2 * weave.material.density
    assert kilograms <= ran["mass"] < 1.05 * kilograms
    assert 0.0 <= ran["waste"] < 1.0
    assert any("strands" in line for line in ran["findings"])


def test_what_a_stage_refuses_is_shown_with_its_remedy(canvas: Canvas, stages: dict[str, Ran]) -> None:
    surface, latitudes = stages["surface"]["surface"], stages["offset"]["latitudes"]
    lattice = stages["link"]["lattice"]
    refused = {
        "SPACING_TOO_LARGE": run_component("Weave_Offset", surface=surface, spacing=1e6),
        "UNSUPPORTED: Spacing must be positive (got -1)": run_component("Weave_Offset", surface=surface, spacing=-1.0),
        "UNSUPPORTED: Unknown method": run_component("Weave_Offset", surface=surface, method="guess"),
        "UNSUPPORTED: Unknown pattern": run_component("Weave_Link", latitudes=latitudes, pattern="knit"),
        "UNSUPPORTED: Unknown material": run_component("Weave_Strands", lattice=lattice, material="glass"),
        "UNSUPPORTED: Unknown weave": run_component("Weave_Strands", lattice=lattice, style="satin"),
        "UNREADABLE": run_component("Weave_Surface", geometry="/nowhere/shell.3dm"),
        "NO_SURFACE": run_component("Weave_Surface", geometry=DOME, layer="Roof"),
        "UNSUPPORTED: A str came where a plane": run_component("Weave_Surface", geometry=DOME, plane="XY"),
        "UNSUPPORTED: A SurfaceMesh came": run_component("Weave_Link", latitudes=surface),
    }
    for start, ran in refused.items():
        assert ran.is_empty, start
        ((level, text),) = ran.messages
        assert (level, text.startswith(start)) == ("Error", True), text
        assert text.count(". ") >= 1, f"no remedy: {text}"


@pytest.mark.parametrize("name", sorted({*NAMES} - {"Weave_Bake"}))
def test_escape_cancels_and_nothing_is_kept(name: str, stages: dict[str, Ran], canvas: Canvas, tmp_path: Path) -> None:
    inputs: dict[str, Any] = {
        "Weave_Surface": {"geometry": plane_file(tmp_path)},
        "Weave_Offset": {"surface": stages["surface"]["surface"], "spacing": 7.0},
        "Weave_Link": {"latitudes": stages["offset"]["latitudes"], "pattern": "quad"},
        "Weave_Strands": {"lattice": stages["link"]["lattice"], "diameter": 3.0},
        "Weave_Simulate": {"weave": stages["strands"]["weave"], "gravity": False},
        "Weave_Measure": {"value": stages["offset"]["latitudes"]},
        "Weave_Choose": {"table": str(table_of(tmp_path / "explored"))},
        "Weave_Preview": {"weave": stages["strands"]["weave"], "amplitude": 3.0},
        "Weave_Fabricate": {"weave": stages["strands"]["weave"], "stock": 900.0},
        "Weave_View": {"value": stages["link"]["lattice"], "show": True, "path": str(tmp_path / "woven.html")},
        "Deconstruct_Lattice": {"lattice": stages["link"]["lattice"]},
        "Deconstruct_Weave": {"weave": stages["strands"]["weave"]},
        "Weave_Export": {"value": stages["link"]["lattice"], "path": str(tmp_path / "woven.obj"), "write": True},
    }[name]
    canvas.is_escape_down = True
    ran = run_component(name, **inputs)
    assert ran.is_empty
    assert ran.messages == [("Remark", "Cancelled. Recompute to go on.")]
    assert ran.caption == "cancelled"
    assert not (tmp_path / "woven.obj").exists()
    canvas.is_escape_down = False
    again = run_component(name, **inputs)
    assert not again.is_empty, again.messages


def table_of(folder: Path) -> Path:
    """A table of three variants, in millimetres, of which the second is the best and the third has an error."""
    texts = (("all", "30", "plain", "stock"), ("0+2", "40", "kagome", "4"), ("all", "50", "plain", "stock"))
    rows = []
    for number, (borders, spacing, pattern, rod) in enumerate(texts, start=1):
        inputs = dict(zip(INPUTS, ("dome", borders, spacing, pattern, rod, "gfrp")))
        figures = {BEND: 100.0, ENDS: 9 - number, RODS: 40, DIAMETER: 4.0} if number < 3 else {}
        error = "" if number < 3 else "SPACING_TOO_LARGE: It is too large."
        rows.append(Row(number, inputs, figures, error, f"k{number}", "pictures/k.png", "", "Millimeters"))
    folder.mkdir()
    (folder / "data.csv").write_bytes(encode_table(rows, (BEND, ENDS, RODS, DIAMETER)))
    return folder


def test_a_row_of_a_table_comes_in_the_unit_of_the_document(
    canvas: Canvas, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = table_of(tmp_path / "explored")
    monkeypatch.setattr(import_module("weavecore.canvas.solve"), "document_unit", lambda: DocumentUnit("Meters", 0.001))
    ran = run_component("Weave_Choose", table=f'"{folder}"', row=2)
    assert ran.messages == []
    assert (ran["distance"], ran["diameter"]) == pytest.approx((0.04, 0.004))
    assert (ran["pattern"], ran["material"], ran["borders"]) == ("kagome", "gfrp", [0, 2])
    assert ran["picture"] == str(folder / "pictures/k.png")
    assert "ends inside: 7" in ran["figures"]


def test_without_a_number_the_best_row_is_taken_and_why_is_shown(canvas: Canvas, tmp_path: Path) -> None:
    ran = run_component("Weave_Choose", table=str(table_of(tmp_path / "explored") / "data.csv"))
    assert ran.caption == "row 2"
    assert "fewest ends" in ran["reason"]


def test_a_table_that_is_not_there_yet_is_a_remark(canvas: Canvas, tmp_path: Path) -> None:
    ran = run_component("Weave_Choose", table=str(tmp_path / "explored"))
    assert ran.is_empty
    ((level, text),) = ran.messages
    assert (level, ran.caption) == ("Remark", "no table")
    assert "weavecore explore writes one" in text


def test_a_row_with_an_error_is_warned_about_and_one_that_is_not_there_refused(canvas: Canvas, tmp_path: Path) -> None:
    folder = str(table_of(tmp_path / "explored"))
    assert run_component("Weave_Choose", table=folder, row=3).messages == [
        ("Warning", "SPACING_TOO_LARGE: It is too large.")
    ]
    ((level, text),) = run_component("Weave_Choose", table=folder, row=4).messages
    assert (level, text) == ("Error", "BAD_INDEX: Row 4 does not exist. Take one from 1 to 3.")
    assert run_component("Weave_Choose", table=folder, row=1)["diameter"] is None


def plane_file(folder: Path) -> str:
    """A file with a surface that has to be meshed, which takes steps that can be cancelled."""
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Objects.AddBrep(rhino_shapes.tube())
    path = folder / "plane.3dm"
    assert model.Write(str(path), 7)
    return str(path)


def test_a_caption_tells_how_far_it_is(stages: dict[str, Ran]) -> None:
    assert any("%" in text for text in stages["offset"].captions[:-1])


def test_the_same_input_is_not_computed_again(canvas: Canvas, stages: dict[str, Ran], dome: str) -> None:
    again = run_component("Weave_Surface", geometry=dome)
    assert again["surface"] is stages["surface"]["surface"]
    assert again.caption == stages["surface"].caption
    other = run_component("Weave_Offset", surface=again["surface"], spacing=55.0)
    assert other["latitudes"] is not stages["offset"]["latitudes"]
    back = run_component("Weave_Offset", surface=again["surface"], spacing=50.0)
    assert back["latitudes"] is stages["offset"]["latitudes"]


def test_equal_input_from_elsewhere_is_not_computed_again(canvas: Canvas, stages: dict[str, Ran], dome: str) -> None:
    twin = pipeline.read_surface(dome)
    assert twin is not stages["surface"]["surface"]
    assert run_component("Weave_Offset", surface=twin, spacing=50.0)["latitudes"] is stages["offset"]["latitudes"]


def test_each_placed_component_has_results_of_its_own(canvas: Canvas, stages: dict[str, Ran]) -> None:
    names = [p["name"] for p in parameters_of(COMPONENTS / "Weave_Link", "input")]
    second = Component(names, wired=names, InstanceGuid="another")
    ran = run_component("Weave_Link", component=second, latitudes=stages["offset"]["latitudes"])
    assert ran["lattice"] is not stages["link"]["lattice"]


def test_balloons_come_again_with_results_that_are_kept(canvas: Canvas, stages: dict[str, Ran]) -> None:
    first = run_component("Weave_Strands", lattice=stages["link"]["lattice"], diameter=8.0)
    again = run_component("Weave_Strands", lattice=stages["link"]["lattice"], diameter=8.0)
    assert again["weave"] is first["weave"]
    assert again.messages == first.messages
    assert any(text.startswith("Bent too sharply: ") for _, text in first.messages)
    conflicts = len(first["weave"].conflicts)
    assert any(f" at {conflicts} place" in text for _, text in first.messages) == (conflicts > 0)


def test_another_diameter_takes_the_rods_that_are_laid_out_already(
    canvas: Canvas, stages: dict[str, Ran], monkeypatch: pytest.MonkeyPatch
) -> None:
    lattice, laid = stages["link"]["lattice"], []
    lay_out = module_of_canvas.lay_out_rods

    def counted(*arguments: Any) -> Any:
        laid.append(arguments)
        return lay_out(*arguments)

    monkeypatch.setattr(module_of_canvas, "lay_out_rods", counted)
    names = [p["name"] for p in parameters_of(COMPONENTS / "Weave_Strands", "input")]
    component = Component(names, wired=["lattice", "diameter"], InstanceGuid="slider")
    weaves = [
        run_component("Weave_Strands", component=component, lattice=lattice, diameter=diameter, style=style)["weave"]
        for diameter, style in ((3.0, None), (4.0, None), (4.0, "plain"), (5.0, None))
    ]
    assert len(laid) == 2
    alone = pipeline.weave(lattice, rod_diameter=4.0)
    assert np.array_equal(weaves[1].axes.controls, alone.axes.controls)
    assert weaves[2].over_under == "plain"


def test_export_writes_once_when_its_button_turns_true(canvas: Canvas, stages: dict[str, Ran], tmp_path: Path) -> None:
    weave, target = stages["strands"]["weave"], tmp_path / "woven.3dm"
    waiting = run_component("Weave_Export", value=weave, path=str(target))
    assert (waiting["file"], waiting.caption) == (None, "not written")
    assert any(line.startswith("rods: ") for line in waiting["report"])
    assert not target.exists()
    for write in (True, True, False):
        ran = run_component("Weave_Export", value=weave, path=f' "{target}" ', write=write)
        assert (ran["file"], ran.caption) == (str(target), "written")
    assert target.stat().st_size > 10_000
    target.write_bytes(b"")
    run_component("Weave_Export", value=weave, path=str(target), write=False)
    again = run_component("Weave_Export", value=weave, path=str(target), write=True)
    assert again.messages[0][1].startswith("EXISTS: ")
    released = run_component("Weave_Export", value=weave, path=str(target), write=False)
    assert released.messages == again.messages, "the message is still there when the button is released"
    run_component("Weave_Export", value=weave, path=str(target), write=True, overwrite=True)
    assert target.stat().st_size > 10_000
    ((level, text),) = run_component("Weave_Export", value=weave, write=True, component=exporter("b")).messages
    assert (level, text[:24]) == ("Warning", "There is no file to writ")


def exporter(guid: str) -> Component:
    names = [p["name"] for p in parameters_of(COMPONENTS / "Weave_Export", "input")]
    return Component(names, wired=names, InstanceGuid=guid)


def test_a_file_without_a_folder_goes_beside_the_definition(
    canvas: Canvas, stages: dict[str, Ran], tmp_path: Path
) -> None:
    names = [p["name"] for p in parameters_of(COMPONENTS / "Weave_Export", "input")]
    component = Component(names, wired=names, file=str(tmp_path / "house.gh"))
    ran = run_component("Weave_Export", component=component, value=stages["link"]["lattice"], path="a.obj", write=True)
    assert ran["file"] == str(tmp_path / "a.obj")
    assert (tmp_path / "a.obj").exists()


def test_geometry_of_rhino_is_taken_as_well_as_files(canvas: Canvas, dome: str) -> None:
    model = rhino3dm.File3dm.Read(dome)
    ran = run_component("Weave_Surface", geometry=model.Objects[0].Geometry)
    expected = pipeline.read_surface(dome)
    assert (ran["surface"].vertices == expected.vertices).all()
    assert ran["surface"].unit == "None", "without Rhino there is no document"
    assert len(ran["borders"]) == 1
    assert ran["borders"][0].IsClosed


def test_a_plane_cuts_a_closed_surface(canvas: Canvas) -> None:
    body = str(COMPONENTS.parent / "sample_files" / "closed_body.3dm")
    plane = rhino3dm.Plane(rhino3dm.Point3d(0, 0, 0), rhino3dm.Vector3d(0, 0, 1))
    own = run_component("Weave_Surface", geometry=body)
    by_plane = run_component("Weave_Surface", geometry=body, plane=plane)
    cut = by_plane["surface"].cuts[0]
    assert np.abs(by_plane["surface"].vertices[cut][:, 2]).max() < 12.0
    assert len(own["surface"].cuts) == 1
    assert not np.array_equal(own["surface"].cuts[0], cut)


def test_rings_are_freed_and_rods_are_chosen_from_a_stock(canvas: Canvas, stages: dict[str, Ran]) -> None:
    latitudes = stages["offset"]["latitudes"]
    freed = run_component("Weave_Link", latitudes=latitudes, free_rings=True)["lattice"]
    assert (freed.nodes == pipeline.link(latitudes, free_rings=True).nodes).all()
    for stock, expected in (([0.25, None], 0.25), ([0.25, 90.0], 0.25)):
        ran = run_component("Weave_Strands", lattice=freed, stock=stock, material="gfrp")
        assert ran["weave"].rod_diameter == expected, ran.messages
