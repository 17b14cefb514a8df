"""Run a definition as Grasshopper does: follow the wires back from each object and run its script."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ghpython.stubs import Component, Ran, run_script
from grasshopper_files import canvas_objects as canvas
from grasshopper_files.archive import Chunk
from grasshopper_files.components import ACCESS, SCRIPT_COMPONENT, script_text
from grasshopper_files.internalised import decode_geometry


@dataclass(frozen=True)
class Placed:
    """An object on the canvas."""

    kind: str
    container: Chunk

    @property
    def id(self) -> str:
        return str(self.container.get("InstanceGuid"))

    @property
    def is_component(self) -> bool:
        return self.kind == SCRIPT_COMPONENT

    @property
    def name(self) -> str:
        return str(self.container.get("Name" if self.is_component else "NickName"))

    def parameters(self, side: str) -> list[Chunk]:
        data = self.container.chunk("ParameterData")
        return [data.chunk(f"{side}Param", i) for i in range(data.get(f"{side}Count"))]

    @property
    def sources(self) -> list[Chunk]:
        """What a wire can start from."""
        if self.kind in (canvas.GROUP, canvas.SCRIBBLE):
            return []
        return self.parameters("Output") if self.is_component else [self.container]

    @property
    def targets(self) -> list[Chunk]:
        """What a wire can end at."""
        return self.parameters("Input") if self.is_component else [self.container]


def objects_of(root: Chunk) -> list[Placed]:
    holder = root.chunk("Definition").chunk("DefinitionObjects")
    chunks = [holder.chunk("Object", i) for i in range(holder.get("ObjectCount"))]
    return [Placed(str(chunk.get("GUID")), chunk.chunk("Container")) for chunk in chunks]


def wires_of(parameter: Chunk) -> list[str]:
    """The ids that the wires of a parameter come from."""
    return [str(parameter.get("Source", index=i)) for i in range(parameter.get("SourceCount", 0))]


class Definition:
    """A definition being run: every script once, when something asks for it."""

    def __init__(self, root: Chunk) -> None:
        self.objects = objects_of(root)
        self._owner = {str(source.get("InstanceGuid")): (o, source) for o in self.objects for source in o.sources}
        self.ran: dict[str, Ran] = {}

    def named(self, name: str) -> Placed:
        (found,) = (one for one in self.objects if one.name == name)
        return found

    def run(self, name: str) -> Ran:
        """Run a component, after all that it hangs on."""
        placed = self.named(name)
        if name not in self.ran:
            inputs = placed.parameters("Input")
            names = [p.get("Name") for p in inputs]
            wired = [p.get("Name") for p in inputs if wires_of(p)]
            component = Component(names, wired=wired, InstanceGuid=placed.id)
            outputs = [p.get("Name") for p in placed.parameters("Output")]
            values = [self.values_at(p) for p in inputs]
            self.ran[name] = run_script(script_text(placed.container), component, values, outputs, name=name)
        return self.ran[name]

    def values_at(self, parameter: Chunk) -> Any:
        """What a script gets: one value, or a list where the parameter takes one."""
        if parameter.get("ScriptParamAccess") == ACCESS["list"]:
            return [self.value_of(source) for source in wires_of(parameter)]
        return self.value_at(parameter)

    def value_at(self, parameter: Chunk) -> Any:
        """What comes through the wire of a parameter, if there is one."""
        values = [self.value_of(source) for source in wires_of(parameter)]
        assert len(values) <= 1
        return values[0] if values else None

    def value_of(self, source: str) -> Any:
        placed, chunk = self._owner[source]
        if placed.is_component:
            return self.run(placed.name)[chunk.get("Name")]
        return next(self._value_of_object(placed))

    def _value_of_object(self, placed: Placed) -> Iterator[Any]:
        container = placed.container
        if placed.kind == canvas.SLIDER:
            yield container.chunk("Slider").get("Value")
        elif placed.kind == canvas.TOGGLE:
            yield container.get("ToggleValue")
        elif placed.kind == canvas.VALUE_LIST:
            items = [container.chunk("ListItem", i) for i in range(container.get("ListCount"))]
            yield next(item.get("Expression").strip('"') for item in items if item.get("Selected"))
        elif placed.kind == canvas.PANEL:
            yield self.value_at(container) if wires_of(container) else container.get("UserText")
        elif placed.kind == canvas.MESH:
            item = container.chunk("PersistentData").chunk("Branch", 0).chunk("Item", 0)
            yield decode_geometry(item.get("ON_Data"))
        else:
            raise AssertionError(f"{placed.name} gives no value")
