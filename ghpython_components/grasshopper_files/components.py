"""A folder of a component (``code.py``, ``metadata.json``, ``icon.png``) and the user object made of it."""

from __future__ import annotations

import ast
import base64
import json
import uuid
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from grasshopper_files.archive import BITMAP, BOOL, BYTES, GUID, INT32, STRING, Chunk, encode_archive

SCRIPT_COMPONENT = "c9b2d725-6f87-4b07-af90-bd9aefef68eb"
SCRIPT_PARAMETER = "08908df5-fa14-4982-9ab2-1aa0927566aa"
PINNED = uuid.uuid5(uuid.NAMESPACE_URL, "weavecore:grasshopper")
"""All ids that are not Grasshopper's own are made from this one and a name, so that every build has the same."""

HEADER = Path(__file__).resolve().parents[1] / "header.py"
"""What every script begins with."""

ACCESS = {"item": 0, "list": 1, "tree": 2}
WIRES = {"default": 0, "faint": 1, "hidden": 2}


@dataclass(frozen=True)
class TypeHint:
    """What Grasshopper converts an input to: the id of the hint, and the .NET type with its assembly."""

    id: str
    type_name: str
    assembly: str = "System.Private.CoreLib"


HINTS = {
    # Values as they are.  Python's usual hint, ghdoc, would hand over ids of geometry, as rhinoscriptsyntax wants it.
    "none": TypeHint("6a184b65-baa3-42d1-a548-3915b401de53", "System.Object"),
    "ghdoc": TypeHint("1c282eeb-dd16-439f-94e4-7d92b542fe8b", "System.Object"),
    "float": TypeHint("9d51e32e-c038-4352-9554-f4137ca91b9a", "System.Double"),
    "int": TypeHint("48d01794-d3d8-4aef-990e-127168822244", "System.Int32"),
    "bool": TypeHint("d60527f5-b5af-4ef6-8970-5f96fe412559", "System.Boolean"),
    "str": TypeHint("3aceb454-6dbd-4c5b-9b6b-e71f8c1cdf88", "System.String"),
    "plane": TypeHint("3897522d-58e9-4d60-b38c-978ddacfedd8", "Rhino.Geometry.Plane", "RhinoCommon"),
}


@dataclass(frozen=True)
class Component:
    """A component as its folder says.

    Parameters
    ----------
    folder : str
        The folder's name, which the user object has too.
    code : str
    icon : bytes
        A .png of 24 by 24 pixels.
    metadata : dict
    """

    folder: str
    code: str
    icon: bytes
    metadata: dict[str, Any]

    @property
    def name(self) -> str:
        """Its name in Grasshopper's menus."""
        return str(self.metadata["name"])

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """Its input parameters."""
        return list(self.metadata["ghpython"]["inputParameters"])

    @property
    def outputs(self) -> list[dict[str, Any]]:
        """Its output parameters."""
        return list(self.metadata["ghpython"]["outputParameters"])


def pinned_id(*names: object) -> uuid.UUID:
    """The id that belongs to these names."""
    return uuid.uuid5(PINNED, "/".join(map(str, names)))


def read_component(folder: Path) -> Component:
    """Read a component from its folder; ends of lines are those of the repository, whatever the machine."""
    code = with_header((folder / "code.py").read_text("utf-8"))
    metadata = json.loads((folder / "metadata.json").read_text("utf-8"))
    return Component(folder.name, code, (folder / "icon.png").read_bytes(), metadata)


def with_header(code: str) -> str:
    """A script with what all scripts begin with: requirements, Rhino's modules, and the way to weavecore.

    The requirements come first, where Rhino looks for them, and the script's docstring after them.
    """
    header = HEADER.read_text("utf-8").splitlines()
    n = next(i for i, line in enumerate(header) if not line.startswith("#"))
    lines = code.splitlines()
    end = ast.parse(code).body[0].end_lineno
    return "\n".join([*header[:n], *lines[:end], *header[n:], *lines[end:], ""])


def without_requirements(component: Component) -> Component:
    """A component whose script asks Rhino to install nothing."""
    lines = [line for line in component.code.splitlines() if not line.startswith(("# r: ", "# venv: "))]
    return replace(component, code="\n".join([*lines, ""]))


def read_components(home: Path) -> list[Component]:
    """All components in the folders of a folder, by their names."""
    return [read_component(path.parent) for path in sorted(home.glob("*/metadata.json"))]


def encode_user_object(component: Component) -> bytes:
    """The bytes of a ``.ghuser`` file."""
    metadata = component.metadata
    root = Chunk("UserObject")
    root.put(GUID, BaseID=SCRIPT_COMPONENT, InstanceGuid=metadata["instanceGuid"])
    root.put(STRING, Name=metadata["name"], NickName=metadata["nickname"])
    root.put(STRING, Description=metadata["description"], ToolTip=metadata["description"])
    root.put(STRING, Category=metadata["category"], SubCategory=metadata["subcategory"])
    root.put(INT32, Exposure=metadata["exposure"])
    root.put(BYTES, Icon=component.icon, Object=encode_archive(_inner_container(component)))
    return encode_archive(root)


def _inner_container(component: Component) -> Chunk:
    """What is copied onto the canvas; Grasshopper adds the rest when it is placed."""
    inner = Chunk("UserObject")
    describe(inner, component)
    inner.put(BOOL, MarshalGuids=component.metadata["ghpython"]["marshalGuids"])
    put_parameters(inner, component, owner=component.folder)
    put_script(inner, component)
    return inner


def describe(container: Chunk, component: Component) -> None:
    """Put into a container what a component is called and looks like."""
    metadata = component.metadata
    container.put(STRING, Description=metadata["description"], Name=metadata["name"], NickName=metadata["nickname"])
    container.put(BITMAP, IconOverride=component.icon)
    container.put(INT32, IconDisplay=metadata["ghpython"]["iconDisplay"])
    # The script has no parameter for what it prints: the balloons say what is to be said.
    container.put(BOOL, UsingLibraryInputParam=False, UsingScriptInputParam=False, UsingStandardOutputParam=False)


def put_parameters(container: Chunk, component: Component, *, owner: str) -> Chunk:
    """Put the parameters into a container; their ids are those of the owner."""
    data = container.add("ParameterData")
    for side, parameters in (("Input", component.inputs), ("Output", component.outputs)):
        data.put(INT32, **{f"{side}Count": len(parameters)})
        for i, parameter in enumerate(parameters):
            data.put(GUID, index=i, **{f"{side}Id": SCRIPT_PARAMETER})
            chunk = data.add(f"{side}Param", i)
            _put_parameter(chunk, parameter)
            chunk.put(GUID, InstanceGuid=pinned_id(owner, side, parameter["name"]))
            if side == "Input":
                _put_input(chunk, parameter)
    return data


def _put_parameter(chunk: Chunk, parameter: dict[str, Any]) -> None:
    chunk.put(STRING, Name=parameter["name"], NickName=parameter["nickname"])
    chunk.put(STRING, Description=parameter["description"], ToolTip=parameter["description"])
    chunk.put(BOOL, Optional=parameter.get("optional", False))
    chunk.put(BOOL, ReverseData=parameter.get("reverse", False), SimplifyData=parameter.get("simplify", False))
    chunk.put(INT32, SourceCount=0)
    mapping = 1 if parameter.get("flatten") else 2 if parameter.get("graft") else 0
    if mapping:
        chunk.put(INT32, Mapping=mapping)


def _put_input(chunk: Chunk, parameter: dict[str, Any]) -> None:
    access = ACCESS[parameter["scriptParamAccess"]]
    chunk.put(BOOL, AllowTreeAccess=parameter["allowTreeAccess"], ShowTypeHints=parameter["showTypeHints"])
    chunk.put(INT32, ScriptParamAccess=access, WireDisplay=WIRES[parameter["wireDisplay"]])
    chunk.put(GUID, TypeHintID=HINTS[parameter["typeHintID"]].id)


def put_script(container: Chunk, component: Component) -> Chunk:
    """Put the script into a container: without the language it would be taken for C#."""
    script = container.add("Script")
    script.put(STRING, Text=base64.b64encode(component.code.encode("utf-8")).decode("ascii"), Title=component.name)
    script.add("LanguageSpec").put(STRING, Taxon="*.*.python", Version="3.*")
    return script


def script_text(container: Chunk) -> str:
    """The script that a container holds."""
    return base64.b64decode(container.chunk("Script").get("Text")).decode("utf-8")
