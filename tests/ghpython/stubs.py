"""Grasshopper as far as the components use it: it records what it is told."""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Callable

COMPONENTS = Path(__file__).resolve().parents[2] / "ghpython_components"
FOLDERS = sorted(path.parent for path in COMPONENTS.glob("*/metadata.json"))
NAMES = [folder.name for folder in FOLDERS]


class GhPath(tuple[int, ...]):
    __slots__ = ()

    def __new__(cls, *indices: int) -> GhPath:
        assert all(type(i) is int for i in indices), "a path takes whole numbers of Python's own"
        return super().__new__(cls, indices)

    def __str__(self) -> str:
        return "{" + ";".join(map(str, self)) + "}"


SYSTEM_OBJECT = object()


class DataTree:
    """Branches by path, in the order in which they were made."""

    def __init__(self) -> None:
        self.branches: dict[GhPath, list[Any]] = {}

    def __class_getitem__(cls, item: Any) -> type[DataTree]:
        assert item is SYSTEM_OBJECT, "the items' type is one of .NET"
        return cls

    def EnsurePath(self, path: GhPath) -> list[Any]:
        return self.branches.setdefault(path, [])

    def Add(self, item: Any, path: GhPath) -> None:
        self.EnsurePath(path).append(item)

    def __iter__(self) -> Iterator[Any]:
        return (item for branch in self.branches.values() for item in branch)


class GhScriptInstance:
    pass


@dataclass
class Component:
    """What ``ghenv.Component`` is to a script."""

    inputs: Sequence[str]
    wired: Sequence[str] = ()
    InstanceGuid: str = "11111111-2222-3333-4444-555555555555"
    file: str | None = None
    messages: list[tuple[str, str]] = field(default_factory=list)
    captions: list[str] = field(default_factory=list)

    @property
    def Params(self) -> Any:
        return SimpleNamespace(
            Input=[SimpleNamespace(Name=n, NickName=n, SourceCount=int(n in self.wired)) for n in self.inputs]
        )

    @property
    def Message(self) -> str:
        return self.captions[-1]

    @Message.setter
    def Message(self, text: str) -> None:
        self.captions.append(text)

    def OnPingDocument(self) -> Any:
        return SimpleNamespace(FilePath=self.file)

    def AddRuntimeMessage(self, level: str, text: str) -> None:
        self.messages.append((level, text))


@dataclass
class Canvas:
    """The stubbed modules, and whether Escape is held down."""

    sticky: dict[str, Any] = field(default_factory=dict)
    is_escape_down: bool = False

    def modules(self) -> dict[str, ModuleType]:
        grasshopper, kernel, data = (
            ModuleType(name) for name in ("Grasshopper", "Grasshopper.Kernel", "Grasshopper.Kernel.Data")
        )
        scriptcontext, system = ModuleType("scriptcontext"), ModuleType("System")
        parts: dict[ModuleType, dict[str, Any]] = {
            grasshopper: {"DataTree": DataTree, "Kernel": kernel},
            kernel: {
                "Data": data,
                "GH_ScriptInstance": GhScriptInstance,
                "GH_RuntimeMessageLevel": SimpleNamespace(Remark="Remark", Warning="Warning", Error="Error"),
                "GH_Document": SimpleNamespace(IsEscapeKeyDown=lambda: self.is_escape_down),
            },
            data: {"GH_Path": GhPath},
            scriptcontext: {"sticky": self.sticky},
            system: {"Object": SYSTEM_OBJECT, "Int32": int},
        }
        for module, content in parts.items():
            vars(module).update(content)
        return {module.__name__: module for module in parts}


@dataclass
class Ran:
    """One run: outputs by name, balloons and the caption."""

    outputs: dict[str, Any]
    messages: list[tuple[str, str]]
    caption: str
    captions: list[str]

    def __getitem__(self, name: str) -> Any:
        return self.outputs[name]

    @property
    def is_empty(self) -> bool:
        return all(value is None for value in self.outputs.values())


def metadata_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "metadata.json").read_text("utf-8"))


def parameters_of(folder: Path, side: str) -> list[dict[str, Any]]:
    """The ``input`` or ``output`` parameters of a component."""
    return metadata_of(folder)["ghpython"][f"{side}Parameters"]


def script_class(source: str) -> ast.ClassDef:
    """The class of a script that Grasshopper makes."""
    (found,) = (node for node in ast.parse(source).body if isinstance(node, ast.ClassDef))
    return found


def run_script(
    source: str, component: Component, inputs: Sequence[Any], output_names: Sequence[str], *, name: str = "code.py"
) -> Ran:
    """Run a script as Grasshopper does: its class is made and RunScript is called with one value an input."""
    scope: dict[str, Any] = {"__name__": "__main__", "ghenv": SimpleNamespace(Component=component)}
    exec(compile(source, name, "exec"), scope)
    before = len(component.messages)
    result = scope[script_class(source).name]().RunScript(*inputs)
    values = result if isinstance(result, tuple) else (result,)
    assert len(values) == len(output_names)
    return Ran(dict(zip(output_names, values)), component.messages[before:], component.Message, component.captions)


def run_component(name: str, *, component: Component | None = None, **inputs: Any) -> Ran:
    """Run a component of the plugin; what is not named is not wired."""
    folder = COMPONENTS / name
    names = [p["name"] for p in parameters_of(folder, "input")]
    assert set(inputs) <= set(names)
    component = component or Component(names, wired=list(inputs))
    outputs = [p["name"] for p in parameters_of(folder, "output")]
    source = (folder / "code.py").read_text("utf-8")
    return run_script(source, component, [inputs.get(n) for n in names], outputs, name=str(folder / "code.py"))


def install(canvas: Canvas, set_item: Callable[[Any, str, Any], None]) -> None:
    """Put the stubs where ``import`` finds them; what was there comes back after the test."""
    for name, module in canvas.modules().items():
        set_item(sys.modules, name, module)
