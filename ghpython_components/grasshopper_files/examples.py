"""Smaller definitions, each of one habit: another pattern, a closed body, a curve to start from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from grasshopper_files import canvas_objects as canvas
from grasshopper_files.archive import Chunk
from grasshopper_files.components import Component
from grasshopper_files.definition import PATTERNS, Stage, arranged
from grasshopper_files.internalised import archive_version, encode_geometry

_AT = (0.0, 0.0)
_of, _out = canvas.object_id, canvas.output_id


@dataclass(frozen=True)
class Example:
    """A surface of the sample files, and how it is woven.

    Parameters
    ----------
    sample : str
    title : str
    spacing : float
    pattern : str
    has_guide : bool
        Whether the curves start from a circle at a height that a slider sets.
    """

    sample: str
    title: str
    spacing: float
    pattern: str
    has_guide: bool = False


EXAMPLES = {
    "weave_kagome": Example("narrow_neck.3dm", "A kagome weave: choose another pattern in the list.", 40.0, "kagome"),
    "weave_closed_body": Example("closed_body.3dm", "A closed body is cut in two by itself.", 70.0, "triangular"),
    "weave_from_curve": Example("hemisphere.3dm", "The rings start from a curve.", 40.0, "kagome", True),
}
"""The definitions by their names."""

_GUIDE = '''"""A circle on a dome of radius 300."""
import Rhino
import Grasshopper


class Guide(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, height: float):
        if height is None:
            return None
        return Rhino.Geometry.Circle(Rhino.Geometry.Point3d(0, 0, height), (300.0**2 - height**2) ** 0.5)
'''
"""A script of the definition's own, as a user writes one."""


def example(name: str, components: Mapping[str, Component], read: Callable[[str], Any]) -> Chunk:
    """The tree of a definition.

    Parameters
    ----------
    name : str
        One of `EXAMPLES`.
    components : mapping
        The components by the names of their folders.
    read : callable
        Gives the rhino3dm mesh of a sample file.
    """
    one = EXAMPLES[name]
    stages = _guide_stages() if one.has_guide else []
    stages = [*stages, *_surface_to_offset(one, read(one.sample)), *_link_to_preview(one)]
    numbered = [replace(stage, label=f"{i} {stage.label}") for i, stage in enumerate(stages, start=1)]
    return arranged(name, one.title, numbered, {**components, "Guide": _guide(components["Weave_Offset"])})


def _guide(icon_of: Component) -> Component:
    height = {"name": "height", "nickname": "height", "description": "Height of the circle.", "optional": True}
    height.update(allowTreeAccess=True, showTypeHints=True, scriptParamAccess="item", typeHintID="float")
    height.update(wireDisplay="default")
    curve = {"name": "curve", "nickname": "curve", "description": "The circle."}
    names = {"name": "Guide", "nickname": "Guide", "description": "A circle on the dome."}
    script = {"iconDisplay": 2, "marshalGuids": True, "inputParameters": [height], "outputParameters": [curve]}
    return Component("Guide", _GUIDE, icon_of.icon, {**names, "ghpython": script})


def _guide_stages() -> list[Stage]:
    slider = canvas.slider("height", 150.0, 20.0, 280.0, 0, _AT)
    return [Stage("Guide", "Guide", "amber", {"height": _of("height")}, [slider])]


def _surface_to_offset(one: Example, geometry: Any) -> list[Stage]:
    sample = canvas.mesh("sample", encode_geometry(geometry), archive_version(geometry), _AT)
    wires = {"surface": _out("Weave_Surface", "surface"), "spacing": _of("spacing")}
    wires.update({"guides": _out("Guide", "curve")} if one.has_guide else {})
    return [
        Stage("Surface", "Weave_Surface", "blue", {"geometry": _of("sample")}, [sample]),
        Stage("Offset", "Weave_Offset", "blue", wires, [canvas.slider("spacing", one.spacing, 20.0, 120.0, 1, _AT)]),
    ]


def _link_to_preview(one: Example) -> list[Stage]:
    weave = _out("Weave_Strands", "weave")
    pattern = canvas.value_list("pattern", PATTERNS, _AT, chosen=one.pattern)
    link = {"latitudes": _out("Weave_Offset", "latitudes"), "pattern": _of("pattern")}
    amplitude = canvas.slider("amplitude", 2.0, 0.0, 10.0, 1, _AT)
    return [
        Stage("Link", "Weave_Link", "green", link, [pattern], "row"),
        Stage("Strands", "Weave_Strands", "amber", {"lattice": _out("Weave_Link", "lattice")}),
        Stage("Preview", "Weave_Preview", "amber", {"weave": weave, "amplitude": _of("amplitude")}, [amplitude]),
    ]
