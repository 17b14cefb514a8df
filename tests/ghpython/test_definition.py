from __future__ import annotations

import ast
import re
import subprocess
import sys
import zipfile
from importlib import import_module
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import build
import draw_canvas
import write_guide
from ghpython.runner import Definition, objects_of, wires_of
from ghpython.stubs import COMPONENTS, NAMES, Canvas, script_class
from grasshopper_files import canvas_objects
from grasshopper_files.archive import Chunk, decode_archive, encode_archive
from grasshopper_files.components import read_component, script_text
from grasshopper_files.examples import EXAMPLES
from grasshopper_files.xml_archive import decode_xml
from weavecore import pipeline
from weavecore.canvas import LISTS
from weavecore.exporting.registry import WRITERS
from weavecore.reading.read import ENDINGS
from weavecore.rhino_geometry import DocumentUnit

SAMPLE = Path(build.SAMPLE)


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return build.build()


@pytest.fixture
def in_millimetres(monkeypatch: pytest.MonkeyPatch) -> None:
    unit = DocumentUnit("Millimeters", 0.01)
    monkeypatch.setattr(import_module("weavecore.canvas.solve"), "document_unit", lambda: unit)


@pytest.fixture(scope="module")
def workflow(files: dict[str, bytes]) -> Chunk:
    return decode_archive(files["weave_workflow.gh"])


def test_every_wire_ends_at_a_parameter_that_is_there(workflow: Chunk) -> None:
    objects = objects_of(workflow)
    sources = [str(source.get("InstanceGuid")) for one in objects for source in one.sources]
    wires = [wire for one in objects for target in one.targets for wire in wires_of(target)]
    assert len(set(sources)) == len(sources)
    assert len(wires) >= 15
    assert [wire for wire in wires if wire not in sources] == []


def test_all_components_are_there_and_hang_together(workflow: Chunk) -> None:
    objects = objects_of(workflow)
    components = [one for one in objects if one.is_component]
    assert sorted(one.name for one in components) == sorted(name.replace("_", " ") for name in NAMES)
    for one in components:
        assert wires_of(one.targets[0]), f"nothing comes to {one.name}"


def test_what_is_grouped_is_there_and_every_component_is_in_a_group(workflow: Chunk) -> None:
    objects = objects_of(workflow)
    groups = [one.container for one in objects if one.container.get("ID_Count") is not None]
    grouped = [str(group.get("ID", index=i)) for group in groups for i in range(group.get("ID_Count"))]
    assert all(group.get("NickName")[0].isdigit() for group in groups)
    assert set(grouped) <= {one.id for one in objects}
    assert {one.id for one in objects if one.is_component} <= set(grouped)


@pytest.mark.parametrize("name", ["weave_workflow", *EXAMPLES])
def test_no_object_and_no_group_lies_on_another(name: str, files: dict[str, bytes]) -> None:
    objects = objects_of(decode_archive(files[f"{name}.gh"]))
    boxes = {o.id: o.container.chunk("Attributes").get("Bounds") for o in objects if o.kind != canvas_objects.GROUP}
    groups = {}
    for group in (o.container for o in objects if o.kind == canvas_objects.GROUP):
        members = [str(group.get("ID", index=i)) for i in range(group.get("ID_Count"))]
        groups[group.get("NickName")] = around([boxes[one] for one in members])
        boxes = {one: box for one, box in boxes.items() if one not in members}
    assert len(boxes) == 1, "all but the title are in a group"
    assert [
        (one, other) for one in groups for other in groups if one < other and overlap(groups[one], groups[other])
    ] == []
    assert [name for name in groups for title in boxes.values() if overlap(groups[name], title)] == []


def around(boxes: list[tuple[float, ...]]) -> tuple[float, ...]:
    """The box around some boxes, with the rim and the label that a group has."""
    left, top = min(x for x, *_ in boxes) - 16, min(y for _, y, *_ in boxes) - 40
    right, bottom = max(x + w for x, _, w, _ in boxes) + 16, max(y + h for _, y, _, h in boxes) + 24
    return left, top, right - left, bottom - top


def overlap(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(a < b + length and b < a + size for a, b, size, length in zip(one, other, one[2:], other[2:]))


def test_every_script_is_that_of_its_folder_and_fits_its_parameters(workflow: Chunk) -> None:
    for one in objects_of(workflow):
        if not one.is_component:
            continue
        source = script_text(one.container)
        assert source == read_component(COMPONENTS / one.name.replace(" ", "_")).code
        (run,) = (node for node in script_class(source).body if isinstance(node, ast.FunctionDef))
        assert [a.arg for a in run.args.args[1:]] == [p.get("Name") for p in one.parameters("Input")]
        ast.parse(source, feature_version=(3, 9))


def test_binary_and_xml_hold_the_same_tree(files: dict[str, bytes], workflow: Chunk) -> None:
    assert plain(decode_xml(files["weave_workflow.ghx"])) == plain(workflow)


def test_the_tree_survives_being_written_again(workflow: Chunk) -> None:
    assert plain(decode_archive(encode_archive(workflow))) == plain(workflow)


def plain(chunk: Chunk) -> tuple[object, ...]:
    items = [(item.name, item.index, item.type, str(item.value)) for item in chunk.items]
    return chunk.name, chunk.index, items, [plain(child) for child in chunk.chunks]


def test_the_definition_run_head_to_tail_gives_the_lattice_of_the_pipeline(workflow: Chunk, canvas: Canvas) -> None:
    definition = Definition(workflow)
    lattice = definition.run("Weave Link")["lattice"]
    surface = pipeline.read_surface(SAMPLE)
    spacing = definition.named("spacing").container.chunk("Slider").get("Value")
    expected = pipeline.link(pipeline.offset(surface, spacing=spacing))
    for name in ("nodes", "edges", "edge_family", "face_nodes", "node_latitude"):
        assert (getattr(lattice, name) == getattr(expected, name)).all(), name
    weave = definition.run("Weave Strands")["weave"]
    assert weave.rod_diameter == definition.named("diameter").container.chunk("Slider").get("Value")
    for name in ("Weave Measure", "Weave Export"):
        assert [text for level, text in definition.run(name).messages if level == "Error"] == []
    assert definition.run("Weave Export")["file"] is None
    assert any(line.startswith("rods:") for line in definition.value_at(definition.named("report").container))
    assert definition.value_at(definition.named("regular nodes").container) > 0.5
    assert [text for ran in definition.ran.values() for level, text in ran.messages if level == "Error"] == []


@pytest.mark.parametrize("name", ["weave_workflow", *EXAMPLES])
@pytest.mark.usefixtures("canvas", "in_millimetres")
def test_a_definition_opens_without_a_warning(name: str, files: dict[str, bytes]) -> None:
    definition = Definition(decode_archive(files[f"{name}.gh"]))
    for one in definition.objects:
        if one.is_component:
            messages = definition.run(one.name).messages
            assert [text for level, text in messages if level != "Remark"] == [], one.name
            assert messages == [] or one.name == "Weave Choose"
    surface, preview = definition.run("Weave Surface")["surface"], definition.run("Weave Preview")
    assert len(preview["names"]) == len(definition.run("Weave Strands")["weave"]) > 30
    if name in EXAMPLES:
        assert definition.run("Weave Strands")["weave"].lattice.pattern == EXAMPLES[name].pattern
    assert (len(surface.cuts) > 0) == (name == "weave_closed_body")
    starts = definition.run("Weave Offset")["latitudes"].surface.starts
    assert (starts is not None) == (name == "weave_from_curve")


def test_moving_a_slider_changes_what_hangs_on_it(workflow: Chunk, canvas: Canvas) -> None:
    definition = Definition(workflow)
    before = definition.run("Weave Strands")["weave"]
    settings = definition.named("diameter").container.chunk("Slider")
    items = list(settings.items)
    settings.items = [item for item in items if item.name != "Value"]
    settings.put(6, Value=2.0)
    try:
        again = Definition(workflow)
        after = again.run("Weave Strands")["weave"]
    finally:
        settings.items = items
    assert after.rod_diameter == 2.0
    assert after is not before
    assert after.lattice is before.lattice, "the lattice was computed again"


def test_the_lists_offer_what_weavecore_knows(workflow: Chunk) -> None:
    known = {name: values for name, values in LISTS.items() if name != "splice"}
    inputs = {p["name"]: p["description"] for name in NAMES for p in read_component(COMPONENTS / name).inputs}
    for name, values in known.items():
        container = Definition(workflow).named(name).container
        items = [container.chunk("ListItem", i) for i in range(container.get("ListCount"))]
        assert [item.get("Name") for item in items] == list(values), name
        assert [value for value in values if value not in inputs[name]] == [], name
        (chosen,) = (item.get("Name") for item in items if item.get("Selected"))
        assert f"Default: {chosen}." in inputs[name]


def test_the_endings_are_those_that_weavecore_reads_and_writes() -> None:
    described = {}
    for name, parameter in (("Weave_Surface", "geometry"), ("Weave_Export", "path")):
        (text,) = (p["description"] for p in read_component(COMPONENTS / name).inputs if p["name"] == parameter)
        described[name] = set(re.findall(r"\.[a-z0-9]+\b", text))
    assert described == {"Weave_Surface": set(ENDINGS), "Weave_Export": set(WRITERS)}


def test_two_builds_give_the_same_bytes(files: dict[str, bytes], tmp_path: Path) -> None:
    command = [sys.executable, str(COMPONENTS / "build.py"), "-o", str(tmp_path / "plugin")]
    subprocess.run(command, check=True, capture_output=True, env={"PYTHONHASHSEED": "7"}, timeout=60)
    written = {path.name: path.read_bytes() for path in (tmp_path / "plugin").iterdir()}
    assert written == files


def test_the_package_has_its_manifest_and_all_components(files: dict[str, bytes]) -> None:
    name = f"weavecore-{build.version()}-rh8-any.yak"
    with zipfile.ZipFile(BytesIO(files[name])) as package:
        assert package.testzip() is None
        assert package.namelist()[0] == "manifest.yml"
        manifest = package.read("manifest.yml").decode("utf-8")
        for folder in NAMES:
            assert package.read(f"{folder}.ghuser") == files[f"{folder}.ghuser"]
        for one in ("weave_workflow", *EXAMPLES):
            assert package.read(f"misc/{one}.gh") == files[f"{one}.gh"]
        assert package.read("icon.png")[16:24] == (64).to_bytes(4, "big") * 2
    keys = [line.split(":")[0] for line in manifest.splitlines() if line[:1].isalpha()]
    assert {"name", "version", "authors", "description", "icon", "keywords"} <= set(keys)
    assert f"\nversion: {build.version()}\n" in manifest


def test_the_sample_inside_is_the_sample_file(workflow: Chunk) -> None:
    definition = Definition(workflow)
    mesh = definition.value_of(definition.named("sample").id)
    expected = pipeline.read_surface(SAMPLE)
    found = pipeline.surface_from(mesh)
    assert np.array_equal(found.vertices, expected.vertices)
    assert np.array_equal(found.faces, expected.faces)


def test_the_guide_shows_each_component_as_it_is_now() -> None:
    folder, guide = write_guide.COMPONENT_PICTURES, write_guide.GUIDE.read_text("utf-8")
    drawn = write_guide.component_pictures()
    assert {path.name: path.read_text("utf-8") for path in folder.iterdir()} == drawn
    assert sorted(drawn) == [f"{name}.svg" for name in NAMES]
    assert sum(map(len, drawn.values())) < 300_000
    for name in NAMES:
        one, picture = read_component(COMPONENTS / name), drawn[f"{name}.svg"]
        assert f"(images/components/{name}.svg)" in guide
        for text in (*(p["nickname"] for p in [*one.inputs, *one.outputs]), f"{one.name} ({one.metadata['nickname']})"):
            assert f">{text}</text>" in picture, (name, text)
        assert picture.count("<circle") == len(one.inputs) + len(one.outputs)


def test_the_guide_has_the_picture_and_the_tables_of_now() -> None:
    assert write_guide.PICTURE.read_text("utf-8") == write_guide.picture()
    guide = write_guide.GUIDE.read_text("utf-8")
    assert guide == write_guide.with_tables(guide)
    assert guide.count("| in | `") == sum(len(read_component(COMPONENTS / name).inputs) for name in NAMES)


def test_what_is_drawn_is_what_lies_on_the_canvas(workflow: Chunk) -> None:
    drawn = draw_canvas.draw(workflow)
    objects = objects_of(workflow)
    wires = [wire for one in objects for target in one.targets for wire in wires_of(target)]
    assert drawn.count("stroke-opacity") == len(wires)
    assert drawn.count("<image ") == len(NAMES)
    for one in objects:
        assert f">{one.name}<" in drawn or one.container.get("UserText") or one.container.get("Text"), one.name
