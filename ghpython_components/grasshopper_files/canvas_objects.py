"""What can lie on Grasshopper's canvas, each as the chunk of its object."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from typing import Any

from grasshopper_files.archive import (
    BOOL,
    BYTES,
    COLOUR,
    DOUBLE,
    GUID,
    INT32,
    POINT_F,
    RECTANGLE_F,
    SINGLE,
    STRING,
    Chunk,
)
from grasshopper_files.components import (
    ACCESS,
    HINTS,
    SCRIPT_COMPONENT,
    Component,
    describe,
    pinned_id,
    put_parameters,
    put_script,
)

SCRIPT_LIBRARY = "066d0a87-236f-4eae-a0f4-9e42f5327962"
"""The plugin of Rhino that script components are part of."""

MESH = "1e936df3-0eea-4246-8549-514cb8862b7a"
SLIDER = "57da07bd-ecab-415d-9d86-af36d7073abc"
TOGGLE = "2e78987b-9dfb-42a2-8b76-3923ac8bd91a"
VALUE_LIST = "00027467-0d24-4fa7-b178-8dc0ac5f42ec"
PANEL = "59e0b89a-e487-49f8-bab8-b5bab16be14c"
GROUP = "c552a431-af5b-46a9-a8a4-0fcbc27ef596"
SCRIBBLE = "7f5c6c55-f846-4a08-9c9a-cfdc285cc6fe"

ROW, ICON, LETTER, MARGIN = 20.0, 28.0, 6.2, 2.0
"""Height of a parameter, width of a component's middle, mean width of a letter, and the rim of a component."""

Place = tuple[float, float]


def object_id(name: str) -> uuid.UUID:
    """The id of an object of the definition."""
    return pinned_id("definition", name)


def output_id(name: str, output: str) -> uuid.UUID:
    """The id of an output of a component of the definition, to which wires are tied."""
    return pinned_id(f"definition/{name}", "Output", output)


def mesh(name: str, content: bytes, version: int, place: Place) -> Chunk:
    """A parameter that holds a mesh."""
    chunk = _floating(MESH, "Mesh", name, "A mesh that is kept in the definition.", place, (90.0, 24.0))
    container = chunk.chunk("Container")
    data = container.add("PersistentData").put(INT32, Count=1)
    branch = data.add("Branch", 0).put(INT32, Count=1).put(STRING, Path="{0}")
    item = branch.add("Item", 0).put(BYTES, ON_Data=content).put(INT32, ON_Version=version)
    item.put(GUID, RefID=uuid.UUID(int=0))
    return chunk


def slider(name: str, value: float, low: float, high: float, digits: int, place: Place) -> Chunk:
    """A number slider."""
    chunk = _floating(SLIDER, "Number Slider", name, "Numeric slider for single values", place, (200.0, 20.0))
    settings = chunk.chunk("Container").add("Slider")
    settings.put(INT32, Digits=digits, GripDisplay=1, Interval=0 if digits else 1, SnapCount=0)
    settings.put(DOUBLE, Min=low, Max=high, Value=value)
    return chunk


def toggle(name: str, value: bool, place: Place) -> Chunk:
    """A switch."""
    chunk = _floating(TOGGLE, "Boolean Toggle", name, "Boolean (true/false) toggle", place, (150.0, 22.0))
    chunk.chunk("Container").put(BOOL, ToggleValue=value)
    return chunk


def value_list(name: str, values: Sequence[str], place: Place, *, chosen: str | None = None) -> Chunk:
    """A list of texts of which one is chosen, the first to begin with if no other is named."""
    chunk = _floating(VALUE_LIST, "Value List", name, "Provides a list of preset values", place, (170.0, 22.0))
    container = chunk.chunk("Container").put(INT32, ListCount=len(values), ListMode=1)
    for i, value in enumerate(values):
        item = container.add("ListItem", i)
        item.put(STRING, Name=value, Expression=f'"{value}"').put(BOOL, Selected=value == (chosen or values[0]))
    return chunk


def panel(name: str, place: Place, size: Place, *, text: str = "", source: uuid.UUID | None = None) -> Chunk:
    """A panel with a text of its own, or with what comes through a wire."""
    chunk = _floating(PANEL, "Panel", name, "A panel for custom notes and text values", place, size)
    container = chunk.chunk("Container").put(STRING, UserText=text).put(DOUBLE, ScrollRatio=0.0)
    container.chunk("Attributes").put(INT32, MarginLeft=0, MarginRight=0, MarginTop=0)
    if source is not None:
        _put_sources(container, [source])
    settings = container.add("PanelProperties").put(COLOUR, Colour=(255, 255, 250, 220))
    settings.put(BOOL, DrawIndices=False, DrawPaths=False, Multiline=True, SpecialCodes=False)
    settings.put(BOOL, Stream=False, Wrap=True)
    return chunk


def group(name: str, members: Sequence[uuid.UUID], colour: tuple[int, int, int, int]) -> Chunk:
    """A box around objects, with a label."""
    chunk = _object(GROUP, "Group", name, "A group of Grasshopper objects")
    container = chunk.chunk("Container").put(INT32, Border=0, ID_Count=len(members)).put(COLOUR, Colour=colour)
    for i, member in enumerate(members):
        container.put(GUID, index=i, ID=member)
    container.add("Attributes")
    return chunk


def scribble(name: str, text: str, place: Place, size: float) -> Chunk:
    """A text on the canvas."""
    chunk = _object(SCRIBBLE, "Scribble", name, "A quick note")
    container = chunk.chunk("Container").put(BOOL, Bold=False, Italic=False)
    container.put(STRING, Font="Microsoft Sans Serif", Text=text).put(SINGLE, Size=size)
    x, y = place
    width, height = 0.55 * size * len(text), 1.3 * size
    corners = {"Ca": (x, y), "Cb": (x + width, y), "Cc": (x + width, y + height), "Cd": (x, y + height)}
    container.put(POINT_F, **corners)
    _put_bounds(container, (x - 5.0, y - 5.0, width + 10.0, height + 10.0), pivot=place)
    return chunk


def component(one: Component, place: Place, wires: Mapping[str, uuid.UUID]) -> Chunk:
    """A component with its script, and the wires that come to its inputs."""
    owner = f"definition/{one.folder}"
    chunk = Chunk("Object").put(GUID, GUID=SCRIPT_COMPONENT, Lib=SCRIPT_LIBRARY).put(STRING, Name=one.name)
    container = chunk.add("Container").put(GUID, InstanceGuid=object_id(one.folder))
    describe(container, one)
    container.put(BOOL, GraftStandardOutputLines=True, MarshGuids=True, MarshInputs=True, MarshOutputs=True)
    container.put(BOOL, UsingScriptOutputParam=False)
    container.put(INT32, ScriptComponentVersion=3).put(STRING, Tooltip=one.metadata["description"])
    columns = _columns(one)
    height = ROW * max(len(one.inputs), len(one.outputs))
    _put_bounds(container, (*place, sum(columns) + 2 * MARGIN, height + 2 * MARGIN))
    data = put_parameters(container, one, owner=owner)
    sides = (("Input", one.inputs, 0.0, columns[0]), ("Output", one.outputs, columns[0] + columns[1], columns[2]))
    for side, parameters, left, width in sides:
        for i, parameter in enumerate(parameters):
            row = height / len(parameters)
            bounds = (place[0] + MARGIN + left, place[1] + MARGIN + i * row, width, row)
            _complete(data.chunk(f"{side}Param", i), parameter, bounds, wires if side == "Input" else {})
    put_script(container, one).put(BOOL, MarshGuids=True, MarshInputs=True, MarshOutputs=True)
    return chunk


def size_of(one: Component) -> Place:
    """Width and height of a component on the canvas."""
    return sum(_columns(one)) + 2 * MARGIN, ROW * max(len(one.inputs), len(one.outputs)) + 2 * MARGIN


def _columns(one: Component) -> tuple[float, float, float]:
    """Widths of the inputs, the icon and the outputs."""
    inputs, outputs = (max(len(p["nickname"]) for p in side) * LETTER + 10.0 for side in (one.inputs, one.outputs))
    return inputs, ICON, outputs


def _complete(
    chunk: Chunk,
    parameter: Mapping[str, Any],
    bounds: tuple[float, float, float, float],
    wires: Mapping[str, uuid.UUID],
) -> None:
    """Add what a parameter has once it lies on the canvas."""
    hint = HINTS[parameter.get("typeHintID", "ghdoc")]
    access = ACCESS[parameter.get("scriptParamAccess", "item")]
    if access:
        chunk.put(INT32, Access=access)
    if "typeHintID" not in parameter:
        chunk.put(BOOL, AllowTreeAccess=False, ShowTypeHints=True).put(INT32, ScriptParamAccess=0)
        chunk.put(GUID, TypeHintID=hint.id)
    chunk.put(INT32, ScriptParameterVersion=2)
    if parameter["name"] in wires:
        _put_sources(chunk, [wires[parameter["name"]]])
    x, y, width, height = bounds
    _put_bounds(chunk, bounds, pivot=(x + width / 2, y + height / 2))
    chunk.add("ConverterData").put(STRING, AssemblyName=hint.assembly, TypeName=hint.type_name)


def _floating(kind: str, kind_name: str, name: str, description: str, place: Place, size: Place) -> Chunk:
    """An object that is a parameter by itself: its wires are tied to its own id."""
    chunk = _object(kind, kind_name, name, description)
    container = chunk.chunk("Container").put(BOOL, Optional=False).put(INT32, SourceCount=0)
    _put_bounds(container, (*place, *size), pivot=place)
    return chunk


def _object(kind: str, kind_name: str, name: str, description: str) -> Chunk:
    chunk = Chunk("Object").put(GUID, GUID=kind).put(STRING, Name=kind_name)
    container = chunk.add("Container").put(GUID, InstanceGuid=object_id(name))
    container.put(STRING, Description=description, Name=kind_name, NickName=name)
    return chunk


def _put_bounds(
    container: Chunk, bounds: tuple[float, float, float, float], *, pivot: tuple[float, float] | None = None
) -> None:
    x, y, width, height = bounds
    attributes = container.add("Attributes").put(RECTANGLE_F, Bounds=bounds)
    attributes.put(POINT_F, Pivot=pivot or (x + width / 2, y + height / 2))


def _put_sources(container: Chunk, sources: Sequence[uuid.UUID]) -> None:
    container.items = [item for item in container.items if item.name != "SourceCount"]
    container.put(INT32, SourceCount=len(sources))
    for i, source in enumerate(sources):
        container.put(GUID, index=i, Source=source)
