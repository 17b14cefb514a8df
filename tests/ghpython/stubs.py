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

import rhino3dm

from grasshopper_files.components import with_header

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

    def __class_getitem__(cls, item: Any) -> type[DataTree] | str:
        # Rhino's signatures say DataTree[object]; to make one the items' type must be one of .NET.
        return cls if item is SYSTEM_OBJECT else f"DataTree[{item.__name__}]"

    def EnsurePath(self, path: GhPath) -> list[Any]:
        return self.branches.setdefault(path, [])

    def Add(self, item: Any, path: GhPath) -> None:
        self.EnsurePath(path).append(item)

    def __iter__(self) -> Iterator[Any]:
        return (item for branch in self.branches.values() for item in branch)


class List(list[Any]):
    """``System.Collections.Generic.List``."""

    def __class_getitem__(cls, item: type) -> type[List]:
        assert isinstance(item, type)
        return cls


class GhScriptInstance:
    pass


@dataclass
class Component:
    """What ``ghenv.Component`` is to a script."""

    inputs: Sequence[str]
    wired: Sequence[str] = ()
    InstanceGuid: str = "11111111-2222-3333-4444-555555555555"
    file: str | None = None
    RunCount: int = 1
    n_items: int = 1
    lists: Sequence[str] = ()
    n_branches: int = 1
    messages: list[tuple[str, str]] = field(default_factory=list)
    captions: list[str] = field(default_factory=list)

    @property
    def Params(self) -> Any:
        return SimpleNamespace(
            Input=[
                SimpleNamespace(
                    Name=n,
                    NickName=n,
                    SourceCount=int(n in self.wired),
                    Access="list" if n in self.lists else "item",
                    VolatileData=SimpleNamespace(DataCount=self.n_items, PathCount=self.n_branches),
                )
                for n in self.inputs
            ]
        )

    @property
    def Message(self) -> str:
        return self.captions[-1] if self.captions else ""

    @Message.setter
    def Message(self, text: str) -> None:
        self.captions.append(text)

    def OnPingDocument(self) -> Any:
        return SimpleNamespace(FilePath=self.file, DocumentID="0", Objects=[self])

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
        scriptcontext, rhino = ModuleType("scriptcontext"), ModuleType("Rhino")
        system, collections, generic = (
            ModuleType(name) for name in ("System", "System.Collections", "System.Collections.Generic")
        )
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
            system: {"Object": SYSTEM_OBJECT, "Int32": int, "Collections": collections},
            collections: {"Generic": generic},
            generic: {"List": List},
            # Without Rhino there is no document, and rhino3dm has the same classes as RhinoCommon.
            rhino: {"RhinoDoc": SimpleNamespace(ActiveDoc=None), "Geometry": rhino3dm},
        }
        for module, content in parts.items():
            vars(module).update(content)
        return {**{module.__name__: module for module in parts}, "Rhino.Geometry": rhino3dm}


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


NAMES_IN_SIGNATURES = {
    "none": "object",
    "float": "float",
    "int": "int",
    "bool": "bool",
    "str": "str",
    "plane": "Rhino.Geometry.Plane",
}
"""What Rhino calls a type hint in the signature of RunScript."""


def rhino_annotation(parameter: dict[str, Any]) -> str:
    """What Rhino writes behind an input in the signature of RunScript; "" where it takes any single value."""
    name, access = NAMES_IN_SIGNATURES[parameter["typeHintID"]], parameter["scriptParamAccess"]
    if access == "item":
        return "" if name == "object" else name
    return {"list": "System.Collections.Generic.List", "tree": "Grasshopper.DataTree"}[access] + f"[{name}]"


def rewritten(source: str, parameters: Sequence[dict[str, Any]]) -> str:
    """A script as Rhino saves it once it was edited: the signature of RunScript is made anew from the inputs."""
    function = run_script_of(source)
    annotated = [(p["name"], rhino_annotation(p)) for p in parameters]
    arguments = ["self", *(f"{name}: {text}" if text else name for name, text in annotated)]
    signature = f"    def RunScript({(',' + chr(10) + 12 * ' ').join(arguments)}):"
    lines = source.splitlines()
    return "\n".join([*lines[: function.lineno - 1], signature, *lines[function.body[0].lineno - 1 :]]) + "\n"


def run_script_of(source: str) -> ast.FunctionDef:
    """The method that Grasshopper calls."""
    (found,) = (node for node in script_class(source).body if isinstance(node, ast.FunctionDef))
    assert found.name == "RunScript"
    return found


def script_class(source: str) -> ast.ClassDef:
    """The class of a script that Grasshopper makes."""
    (found,) = (node for node in ast.parse(source).body if isinstance(node, ast.ClassDef))
    return found


def run_script(
    source: str, component: Component, inputs: Sequence[Any], output_names: Sequence[str], *, name: str = "code.py"
) -> Ran:
    """Run a script as Grasshopper does: its class is made and RunScript is called with one value an input."""
    scope: dict[str, Any] = {"__name__": "__main__", "ghenv": SimpleNamespace(Component=component)}
    # What this module imports from __future__ must not hold for the script: annotations are evaluated.
    exec(compile(source, name, "exec", dont_inherit=True), scope)
    before = len(component.messages)
    result = scope[script_class(source).name]().RunScript(*inputs)
    values = result if isinstance(result, tuple) else (result,)
    assert len(values) == len(output_names)
    return Ran(dict(zip(output_names, values)), component.messages[before:], component.Message, component.captions)


def run_component(name: str, *, component: Component | None = None, is_rewritten: bool = False, **inputs: Any) -> Ran:
    """Run a component of the plugin, as it is or as Rhino rewrites it; what is not named is not wired."""
    folder = COMPONENTS / name
    parameters = parameters_of(folder, "input")
    names = [p["name"] for p in parameters]
    assert set(inputs) <= set(names)
    component = component or Component(names, wired=list(inputs), InstanceGuid=name)
    outputs = [p["name"] for p in parameters_of(folder, "output")]
    source = with_header((folder / "code.py").read_text("utf-8"))
    source = rewritten(source, parameters) if is_rewritten else source
    return run_script(source, component, [inputs.get(n) for n in names], outputs, name=str(folder / "code.py"))


def install(canvas: Canvas, set_item: Callable[[Any, str, Any], None]) -> None:
    """Put the stubs where ``import`` finds them; what was there comes back after the test."""
    for name, module in canvas.modules().items():
        set_item(sys.modules, name, module)
