"""Run the plugin as it is installed: ``python -I -S bare_canvas.py PACKAGE SURFACE [FOLDER_OF_NUMPY_AND_SCIPY]``.

``PACKAGE`` is the unzipped ``.yak``.  The process has the standard library, a few classes in the place of Rhino's, and
what the package brings along.  It weaves a file from component to component, and prints the components that ran.
"""

from __future__ import annotations

import base64
import struct
import sys
import zlib
from pathlib import Path
from types import ModuleType, SimpleNamespace


class Point3d:
    def __init__(self, *row: float) -> None:
        self.X, self.Y, self.Z = row


class Vector3d(Point3d):
    pass


class TextDot:
    def __init__(self, text: str, place: Point3d) -> None:
        self.text, self.place = text, place


class Items(list):
    Add = list.append


class Polyline(Items):
    def __init__(self, n: int) -> None:
        super().__init__()

    def Add(self, *row: float) -> None:
        self.append(row)

    def ToPolylineCurve(self) -> Polyline:
        return self


class NurbsCurve:
    @staticmethod
    def Create(is_periodic: bool, degree: int, points: list) -> SimpleNamespace:
        return SimpleNamespace(Knots=[0.0] * (len(points) + degree - 1))


class Mesh:
    def __init__(self) -> None:
        self.Vertices = SimpleNamespace(AddPoint3d=lambda *row: None)
        self.Faces = SimpleNamespace(AddFace=lambda *row: None)
        self.VertexColors = Items()
        self.VertexColors.Add = lambda *row: None
        self.Append = lambda mesh: None
        self.Normals = SimpleNamespace(ComputeNormals=lambda: None)


class Line:
    def __init__(self, *ends: Point3d) -> None:
        self.ends = ends


class DataTree(Items):
    def __class_getitem__(cls, item: object) -> type[DataTree]:
        return cls

    def EnsurePath(self, path: tuple) -> None:
        pass

    def Add(self, item: object, path: tuple) -> None:
        self.append(item)


class ScriptList(list):
    def __class_getitem__(cls, item: object) -> type[ScriptList]:
        return cls


def module(name: str, **content: object) -> SimpleNamespace:
    made = ModuleType(name)
    vars(made).update(content)
    sys.modules[name] = made
    return made


def install(package: str) -> None:
    geometry = module(
        "Rhino.Geometry",
        **{kind.__name__: kind for kind in (Point3d, Vector3d, Polyline, NurbsCurve, Mesh, Line, TextDot)},
        Plane=object,
    )
    opened = SimpleNamespace(ModelUnitSystem="UnitSystem.Millimeters", ModelAbsoluteTolerance=0.01)
    host = SimpleNamespace(GetActivePlugInVersionFolders=lambda: [SimpleNamespace(FullName=package)])
    module(
        "Rhino", Geometry=geometry, Runtime=SimpleNamespace(HostUtils=host), RhinoDoc=SimpleNamespace(ActiveDoc=opened)
    )
    data = module("Grasshopper.Kernel.Data", GH_Path=lambda *path: path)
    level = SimpleNamespace(Remark="Remark", Warning="Warning", Error="Error")
    document = SimpleNamespace(IsEscapeKeyDown=lambda: False)
    kernel = module("Grasshopper.Kernel", Data=data, GH_ScriptInstance=object, GH_RuntimeMessageLevel=level)
    kernel.GH_Document = document
    folders = SimpleNamespace(DefaultUserObjectFolder=package)
    module("Grasshopper", Kernel=kernel, DataTree=DataTree, Folders=folders)
    generic = module("System.Collections.Generic", List=ScriptList)
    collections = module("System.Collections", Generic=generic)
    module("System", Object=object, Int32=int, Collections=collections)
    module("scriptcontext", sticky={})


def script_of(user_object: bytes) -> str:
    """The script in a ``.ghuser``, found by its bytes: an item ``Text`` inside the item ``Object``."""
    outer = zlib.decompress(user_object, wbits=-15)
    inner = outer[outer.index(b"\x06Object\xff\xff\xff\xff") + 15 :]
    (length,) = struct.unpack_from("<i", inner)
    content = zlib.decompress(inner[4 : 4 + length], wbits=-15)
    text = content[content.index(b"\x04Text\xff\xff\xff\xff") + 13 :]
    size, shift, n = 0, 0, 0
    while True:
        size |= (text[n] & 127) << shift
        n, shift = n + 1, shift + 7
        if text[n - 1] < 128:
            break
    return base64.b64decode(text[n : n + size]).decode("utf-8")


class Component:
    """What ``ghenv.Component`` is, as far as it is called here."""

    InstanceGuid, Message, RunCount = "0", "", 1

    def __init__(self) -> None:
        self.Params = SimpleNamespace(Input=[])
        self.said: list[tuple[str, str]] = []

    def OnPingDocument(self) -> None:
        return None

    def AddRuntimeMessage(self, level: str, text: str) -> None:
        self.said.append((level, text))


def run(package: Path, name: str, *inputs: object) -> tuple:
    component = Component()
    component.InstanceGuid = f"{name} {inputs[1:]}"
    source = script_of((package / f"{name}.ghuser").read_bytes())
    scope = {"ghenv": SimpleNamespace(Component=component), "__name__": "__main__"}
    exec(compile(source, name, "exec", dont_inherit=True), scope)
    (kind,) = (value for value in scope.values() if hasattr(value, "RunScript"))
    given = kind.RunScript.__code__.co_argcount - 1
    outputs = kind().RunScript(*inputs, *[None] * (given - len(inputs)))
    errors = [text for level, text in component.said if level == "Error"]
    if errors:
        raise SystemExit(f"{name}: {errors}")
    print(name, component.Message)
    return outputs


def main(package: str, surface: str, numerics: str | None = None) -> None:
    if numerics:
        sys.path.append(numerics)
    install(package)
    home = Path(package)
    taken = run(home, "Weave_Surface", surface)[0]
    latitudes = run(home, "Weave_Offset", taken, [90.0])[0]
    lattice = run(home, "Weave_Link", latitudes)[0]
    weave = run(home, "Weave_Strands", lattice)[0]
    for name in ("Weave_Measure", "Weave_Simulate", "Weave_Preview", "Deconstruct_Weave"):
        run(home, name, weave)
    run(home, "Deconstruct_Lattice", lattice)
    run(home, "Weave_Fabricate", weave, 900.0, None, str(Path(surface).parent / "workshop"), True)
    for ending in ("json", "obj", "html"):
        run(home, "Weave_Export", weave, str(Path(surface).parent / f"woven.{ending}"), True)
    import weavecore

    print(weavecore.__version__, weavecore.__file__)


if __name__ == "__main__":
    main(*sys.argv[1:])
