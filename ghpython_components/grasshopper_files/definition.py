"""The definition ``weave_workflow``: a surface that it holds itself, and all components wired one after the other."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Any

from grasshopper_files import canvas_objects as canvas
from grasshopper_files.archive import (
    BOOL,
    COLOUR,
    DATE,
    GUID,
    INT32,
    POINT,
    POINT_F,
    RECTANGLE_F,
    SINGLE,
    STRING,
    VERSION,
    Chunk,
)
from grasshopper_files.components import Component
from grasshopper_files.internalised import archive_version, encode_geometry

NAME = "weave_workflow"
TITLE = (
    "weavecore: surface, offset, link, strands, and what follows. Move a slider; switch 'write' on to write the file."
)

METHODS = ("levels", "fronts")
PATTERNS = ("triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal")
_MATERIALS = ("gfrp", "gfrp-short", "bamboo", "rattan", "steel-strip")

_STYLES = ("usual", "stacked", "plain", "twill 2/2", "twill 3/1")
_COLOURS = ("family", "utilisation", "step")

_AT = (0.0, 0.0)
_of, _out = canvas.object_id, canvas.output_id

_TICKS = (date(2026, 1, 1) - date(1, 1, 1)).days * 24 * 3600 * 10**7
"""The date of the file is fixed, so that the same sources give the same bytes."""

_SCRIPT_VERSION = "8.6.24101.5001"
_SCRIPT_ASSEMBLY = f"RhinoCodePluginGH, Version={_SCRIPT_VERSION}, Culture=neutral, PublicKeyToken=552281e97c755530"
"""What the script components were saved by; later ones read them too."""

_TOP, _GAP, _PAD, _LABEL = 100.0, 50.0, 34.0, 24.0
_BETWEEN, _BELOW_WIRE = 44.0, 40.0
_TINT = {"blue": (150, 170, 192, 222), "green": (150, 176, 214, 190), "amber": (150, 234, 206, 160)}


@dataclass
class Stage:
    """A group in the making: its component, what stands beside that, and where it stands.

    ``place`` is "right" of the one before, "under" it, or the first of a "row".
    """

    label: str
    folder: str
    tint: str
    wires: dict[str, uuid.UUID]
    controls: list[Chunk] = field(default_factory=list)
    place: str = "right"


def definition(components: Mapping[str, Component], geometry: Any) -> Chunk:
    """The tree of the definition.

    Parameters
    ----------
    components : mapping
        The components by the names of their folders.
    geometry : rhino3dm.Mesh
        The surface that is kept in it.
    """
    return arranged(NAME, TITLE, _stages(geometry), components)


def arranged(name: str, title: str, stages: Iterable[Stage], components: Mapping[str, Component]) -> Chunk:
    """A definition of groups, placed one after the other.

    Parameters
    ----------
    name, title : str
        The file's name without its ending, and what stands on top.
    stages : iterable of Stage
    components : mapping
        The components by the names of their folders.
    """
    objects = [canvas.scribble("title", title, (20.0, 20.0), 16.0)]
    left, top, right, bottom, lowest = 20.0, _TOP, 20.0, _TOP, _TOP
    for stage in stages:
        if stage.place == "row":
            left, bottom = 20.0, lowest
        elif stage.place == "right":
            left = right
        if stage.place != "right":
            top = bottom + _GAP + _LABEL + _PAD
        made, right, bottom = _laid_out(stage, components[stage.folder], (left, top))
        right, lowest = right + _GAP, max(lowest, bottom)
        objects += made
    return _document(name, title, objects)


def _stages(geometry: Any) -> list[Stage]:
    """The groups from left to right; the controls of each are placed when they are laid out."""
    first = [*_surface_to_link(geometry), *_strands_to_measure()]
    return [*first, _simulate(), *_shown(), *_made(), *_taken_apart(), _choose()]


def _surface_to_link(geometry: Any) -> list[Stage]:
    sample = canvas.mesh("sample", encode_geometry(geometry), archive_version(geometry), _AT)
    return [
        Stage(
            "1 Surface",
            "Weave_Surface",
            "blue",
            {"geometry": _of("sample")},
            [sample, canvas.panel("what it is", _AT, (200.0, 60.0), source=_out("Weave_Surface", "notes"))],
        ),
        Stage(
            "2 Offset",
            "Weave_Offset",
            "blue",
            {"surface": _out("Weave_Surface", "surface"), "spacing": _of("spacing"), "method": _of("method")},
            [canvas.slider("spacing", 50.0, 10.0, 100.0, 1, _AT), canvas.value_list("method", METHODS, _AT)],
        ),
        Stage(
            "3 Link",
            "Weave_Link",
            "green",
            {"latitudes": _out("Weave_Offset", "latitudes"), "pattern": _of("pattern")},
            [canvas.value_list("pattern", PATTERNS, _AT)],
        ),
    ]


def _strands_to_measure() -> list[Stage]:
    weave = _out("Weave_Strands", "weave")
    return [
        Stage(
            "4 Strands",
            "Weave_Strands",
            "amber",
            {
                "lattice": _out("Weave_Link", "lattice"),
                **{name: _of(name) for name in ("diameter", "material", "style")},
            },
            [
                canvas.slider("diameter", 0.8, 0.2, 10.0, 1, _AT),
                canvas.value_list("material", _MATERIALS, _AT),
                canvas.value_list("style", _STYLES, _AT),
            ],
            "row",
        ),
        Stage(
            "5 Export",
            "Weave_Export",
            "green",
            {"value": weave, "path": _of("path"), "write": _of("write"), "overwrite": _of("overwrite")},
            [
                canvas.panel("path", _AT, (170.0, 30.0), text="woven.3dm"),
                canvas.toggle("write", False, _AT),
                canvas.toggle("overwrite", False, _AT),
                canvas.panel("report", _AT, (330.0, 150.0), source=_out("Weave_Export", "report")),
            ],
        ),
        Stage(
            "6 Measure",
            "Weave_Measure",
            "green",
            {"value": weave},
            [
                canvas.panel("regular nodes", _AT, (160.0, 30.0), source=_out("Weave_Measure", "regular")),
                canvas.panel("least radius", _AT, (160.0, 30.0), source=_out("Weave_Measure", "radius")),
                canvas.panel("findings", _AT, (330.0, 76.0), source=_out("Weave_Measure", "findings")),
            ],
            "under",
        ),
    ]


def _simulate() -> Stage:
    return Stage(
        "7 Simulate",
        "Weave_Simulate",
        "amber",
        {"weave": _out("Weave_Strands", "weave"), "supports": _of("supports")},
        [
            canvas.value_list("supports", ("borders", "none"), _AT),
            canvas.panel("departures", _AT, (160.0, 90.0), source=_out("Weave_Simulate", "departure")),
            canvas.panel("stable", _AT, (160.0, 30.0), source=_out("Weave_Simulate", "stable")),
        ],
        "row",
    )


def _shown() -> list[Stage]:
    weave = _out("Weave_Strands", "weave")
    return [
        Stage(
            "8 Preview",
            "Weave_Preview",
            "amber",
            {"weave": weave, "colour": _of("colour"), "step": _of("step"), "amplitude": _of("amplitude")},
            [
                canvas.value_list("colour", _COLOURS, _AT),
                canvas.slider("step", 10000.0, 0.0, 10000.0, 0, _AT),
                canvas.slider("amplitude", 1.0, 0.0, 10.0, 1, _AT),
            ],
            "row",
        ),
        Stage(
            "9 View",
            "Weave_View",
            "green",
            {"value": weave, "show": _of("show")},
            [canvas.toggle("show", False, _AT)],
        ),
        Stage(
            "10 Bake",
            "Weave_Bake",
            "green",
            {"weave": weave, "bake": _of("bake")},
            [canvas.toggle("bake", False, _AT)],
        ),
    ]


def _made() -> list[Stage]:
    inputs = {name: _of(name) for name in ("stock", "folder")}
    return [
        Stage(
            "11 Fabricate",
            "Weave_Fabricate",
            "green",
            {"weave": _out("Weave_Strands", "weave"), **inputs, "write": _of("fabricate")},
            [
                canvas.slider("stock", 6000.0, 500.0, 12000.0, 0, _AT),
                canvas.panel("folder", _AT, (170.0, 30.0), text="workshop"),
                canvas.toggle("fabricate", False, _AT),
                canvas.panel("cut list", _AT, (330.0, 150.0), source=_out("Weave_Fabricate", "cut_list")),
                canvas.panel("sums", _AT, (330.0, 76.0), source=_out("Weave_Fabricate", "report")),
            ],
            "row",
        ),
    ]


def _taken_apart() -> list[Stage]:
    lattice, weave = _out("Weave_Link", "lattice"), _out("Weave_Strands", "weave")
    return [
        Stage("12 Lattice", "Deconstruct_Lattice", "blue", {"lattice": lattice}, place="row"),
        Stage(
            "13 Weave",
            "Deconstruct_Weave",
            "blue",
            {"weave": weave},
            [canvas.panel("order", _AT, (200.0, 90.0), source=_out("Deconstruct_Weave", "order"))],
        ),
    ]


def _choose() -> Stage:
    return Stage(
        "14 Choose",
        "Weave_Choose",
        "blue",
        {"table": _of("table")},
        [
            canvas.panel("table", _AT, (170.0, 30.0), text="explored"),
            canvas.panel("reason", _AT, (330.0, 60.0), source=_out("Weave_Choose", "reason")),
        ],
        "row",
    )


def _laid_out(stage: Stage, one: Component, corner: tuple[float, float]) -> tuple[list[Chunk], float, float]:
    """The objects of a stage in their places with their group, and where they end on the right and below.

    What feeds the component stands left of it, what it feeds right of it, both below the wire between stages.
    """
    left, top = corner[0] + _PAD / 2, corner[1]
    feeding = [c for c in stage.controls if c.chunk("Container").get("SourceCount") == 0]
    fed = [c for c in stage.controls if c not in feeding]
    is_first = "geometry" in stage.wires
    middle = _stack(feeding, left, top if is_first else top + _BELOW_WIRE)
    component = canvas.component(one, (middle, top), stage.wires)
    right = middle + canvas.size_of(one)[0]
    if fed:
        right = _stack(fed, right + _BETWEEN, top + _BELOW_WIRE) - _BETWEEN
    objects = [component, *feeding, *fed]
    members = [chunk.chunk("Container").get("InstanceGuid") for chunk in objects]
    bottom = max(y + height for _, y, _, height in map(_bounds, objects))
    return [*objects, canvas.group(stage.label, members, _TINT[stage.tint])], right, bottom


def _stack(controls: list[Chunk], x: float, y: float) -> float:
    """Place controls under one another, and tell where what is right of them begins."""
    for control in controls:
        _move(control, x, y)
        y += _bounds(control)[3] + 14.0
    return x + max((_bounds(control)[2] + _BETWEEN for control in controls), default=0.0)


def _bounds(chunk: Chunk) -> tuple[float, float, float, float]:
    bounds: tuple[float, float, float, float] = chunk.chunk("Container").chunk("Attributes").get("Bounds")
    return bounds


def _move(chunk: Chunk, x: float, y: float) -> None:
    attributes = chunk.chunk("Container").chunk("Attributes")
    *_, width, height = attributes.get("Bounds")
    attributes.items = [item for item in attributes.items if item.name not in ("Bounds", "Pivot")]
    attributes.put(RECTANGLE_F, Bounds=(x, y, width, height)).put(POINT_F, Pivot=(x, y))


def _document(name: str, title: str, objects: list[Chunk]) -> Chunk:
    """The objects with all that a file has about them."""
    root = Chunk("Root").put(VERSION, ArchiveVersion=(0, 2, 2))
    body = root.add("Definition").put(VERSION, plugin_version=(1, 0, 8))
    header = body.add("DocumentHeader").put(GUID, DocumentID=canvas.object_id(name)).put(STRING, Preview="Shaded")
    header.put(INT32, PreviewMeshType=1)
    header.put(COLOUR, PreviewNormal=(100, 40, 72, 146), PreviewSelected=(100, 201, 122, 43))
    properties = body.add("DefinitionProperties").put(DATE, Date=_TICKS).put(BOOL, KeepOpen=False)
    properties.put(STRING, Description=title, Name=f"{name}.gh")
    properties.add("Revisions").put(INT32, RevisionCount=0)
    properties.add("Projection").put(POINT, Target=(0, 0)).put(SINGLE, Zoom=0.5)
    properties.add("Views").put(INT32, ViewCount=0)
    body.add("RcpLayout").put(INT32, GroupCount=0)
    library = body.add("GHALibraries").put(INT32, Count=1).add("Library", 0)
    library.put(GUID, Id=canvas.SCRIPT_LIBRARY)
    library.put(STRING, Author="", Name="RhinoCodePluginGH", Version="", AssemblyVersion=_SCRIPT_VERSION)
    library.put(STRING, AssemblyFullName=_SCRIPT_ASSEMBLY)
    holder = body.add("DefinitionObjects").put(INT32, ObjectCount=len(objects))
    for i, chunk in enumerate(objects):
        chunk.index = i
    holder.chunks = objects
    return root
