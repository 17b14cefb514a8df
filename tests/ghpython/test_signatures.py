"""Every call of Rhino, Grasshopper and .NET is one that these have, with the arguments that are handed over.

The table is held to what the scripts and the package call, and to the signatures of Rhino 8.20 that the package
rhino-stubs-typed on PyPI has, where that is installed: ``pip install rhino-stubs-typed``.
"""

from __future__ import annotations

import ast
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

from ghpython.stubs import COMPONENTS

PACKAGE = COMPONENTS.parent / "weavecore"
SOURCES = [
    *sorted((PACKAGE / "canvas").glob("*.py")),
    *sorted((PACKAGE / "rhino_geometry").glob("*.py")),
    PACKAGE / "reading" / "curves.py",
    COMPONENTS / "header.py",
    *sorted(COMPONENTS.glob("*/code.py")),
]

CALLS = {
    "Rhino.RhinoDoc": ["ActiveDoc", "Objects", "Layers", "Views", "ModelUnitSystem", "ModelAbsoluteTolerance"],
    "Rhino.RhinoDoc methods": ["BeginUndoRecord(str)", "EndUndoRecord(int)"],
    "Rhino.Runtime.HostUtils": ["GetActivePlugInVersionFolders()"],
    "Rhino.DocObjects.ObjectAttributes": [
        "Name",
        "LayerIndex",
        "ObjectColor",
        "ColorSource",
        "SetUserString(str, str)",
    ],
    "Rhino.DocObjects.ObjectColorSource": ["ColorFromObject"],
    "Rhino.DocObjects.Layer": ["Name", "ParentLayerId", "Id"],
    "Rhino.DocObjects.RhinoObject": ["Geometry"],
    "Rhino.DocObjects.Tables.ObjectTable": ["AddCurve(Curve, ObjectAttributes)", "FindId(Guid)", "Find(Guid)"],
    "Rhino.DocObjects.Tables.LayerTable": ["Add(Layer)", "FindByFullPath(str, int)", "__getitem__(int)"],
    "Rhino.DocObjects.Tables.ViewTable": ["Redraw()"],
    "Rhino.Geometry.GeometryBase": ["GetBoundingBox(bool)", "DataCRC(int)"],
    "Rhino.Geometry.BoundingBox": ["Diagonal", "Min", "Max"],
    "Rhino.Geometry.Point3d": ["__init__(float, float, float)", "X", "Y", "Z"],
    "Rhino.Geometry.Point": ["Location"],
    "Rhino.Geometry.Vector3d": ["__init__(float, float, float)", "X", "Y", "Z", "Length"],
    "Rhino.Geometry.Plane": ["Origin", "Normal", "XAxis", "YAxis", "ZAxis"],
    "Rhino.Geometry.Interval": ["T0", "T1"],
    "Rhino.Geometry.Line": ["__init__(float, float, float, float, float, float)", "From", "To"],
    "Rhino.Geometry.Arc": ["StartPoint", "MidPoint", "EndPoint", "ToNurbsCurve()"],
    "Rhino.Geometry.Circle": ["Plane", "Radius", "ToNurbsCurve()"],
    "Rhino.Geometry.Ellipse": ["Plane", "Radius1", "Radius2", "ToNurbsCurve()"],
    "Rhino.Geometry.Rectangle3d": ["Plane", "X", "Y", "ToNurbsCurve()"],
    "Rhino.Geometry.Polyline": ["ToNurbsCurve()"],
    "Rhino.Geometry.Curve": ["ToPolyline(float, float, float, float)", "ToNurbsCurve()", "Domain"],
    "Rhino.Geometry.PolylineCurve": ["__init__(Iterable[Point3d])", "PointCount", "Point(int)"],
    "Rhino.Geometry.NurbsCurve": ["Create(bool, int, Iterable[Point3d])", "Knots"],
    "Rhino.Geometry.Collections.NurbsCurveKnotList": ["__setitem__(int, float)"],
    "Rhino.Geometry.TextDot": ["__init__(str, Point3d)"],
    "Rhino.Geometry.Mesh": ["__init__()", "Vertices", "Faces", "Normals", "VertexColors", "Append(Mesh)"],
    "Rhino.Geometry.Mesh of others": ["CreateFromBrep(Brep, MeshingParameters)", "CreateFromSubD(SubD, int)"],
    "Rhino.Geometry.MeshFace": ["__init__(int, int, int, int)"],
    "Rhino.Geometry.Collections.MeshVertexList": [
        "UseDoublePrecisionVertices",
        "AddVertices(Iterable[Point3d])",
        "ToPoint3dArray()",
    ],
    "Rhino.Geometry.Collections.MeshFaceList": ["AddFaces(Iterable[MeshFace])", "ToIntArray(bool)"],
    "Rhino.Geometry.Collections.MeshVertexNormalList": ["ComputeNormals()"],
    "Rhino.Geometry.Collections.MeshVertexColorList": ["CreateMonotoneMesh(Color)"],
    "Rhino.Geometry.MeshingParameters": [
        "__init__()",
        "JaggedSeams",
        "SimplePlanes",
        "RefineGrid",
        "MaximumEdgeLength",
        "Tolerance",
    ],
    "Rhino.Geometry.Brep": ["Faces", "Loops"],
    "Rhino.Geometry.BrepFace": ["DuplicateFace(bool)", "Loops"],
    "Rhino.Geometry.Surface": ["ToBrep()"],
    "Rhino.Geometry.Extrusion": ["ToBrep(bool)", "PathTangent"],
    "Rhino.Geometry.SubD": ["Faces", "Subdivide(int)"],
    "Rhino.Geometry.Collections.SubDFaceList": ["Count"],
    "Grasshopper.Instances": ["DocumentServer"],
    "Grasshopper.Folders": ["DefaultUserObjectFolder"],
    "Grasshopper.Kernel.GH_DocumentServer": ["add_DocumentRemoved(DocumentRemovedEventHandler)", "__iter__()"],
    "Grasshopper.Kernel.GH_Document": [
        "IsEscapeKeyDown()",
        "ScheduleSolution(int, GH_ScheduleDelegate)",
        "AddObject(IGH_DocumentObject, bool, int)",
        "FilePath",
        "DocumentID",
        "Objects",
    ],
    "Grasshopper.Kernel.GH_ScheduleDelegate": [],
    "Grasshopper.Kernel.GH_ScriptInstance": [],
    "Grasshopper.Kernel.GH_ActiveObject": [
        "AddRuntimeMessage(GH_RuntimeMessageLevel, str)",
        "OnPingDocument()",
        "ExpireSolution(bool)",
    ],
    "Grasshopper.Kernel.GH_RuntimeMessageLevel": ["Remark", "Warning", "Error"],
    "Grasshopper.Kernel.GH_Component": ["Params", "Message", "RunCount"],
    "Grasshopper.Kernel.GH_ComponentParamServer": ["Input"],
    "Grasshopper.Kernel.GH_InstanceDescription": ["Name", "NickName", "InstanceGuid"],
    "Grasshopper.Kernel.GH_DocumentObject": ["Attributes"],
    "Grasshopper.Kernel.IGH_Attributes": ["Bounds", "Pivot"],
    "Grasshopper.Kernel.IGH_Param": ["SourceCount", "Access", "VolatileData", "AddSource(IGH_Param)"],
    "Grasshopper.Kernel.Data.IGH_Structure": ["DataCount", "PathCount"],
    "Grasshopper.Kernel.Data.GH_Path": ["__init__(Iterable[int])"],
    "Grasshopper.Kernel.Special.GH_ValueList": ["__init__()", "CreateAttributes()", "ListItems", "SelectItem(int)"],
    "Grasshopper.Kernel.Special.GH_ValueListItem": ["__init__(str, str)"],
    "System.Drawing.Color": ["FromArgb(int, int, int)"],
    "System.Drawing.PointF": ["__init__(float, float)"],
    "System.Drawing.RectangleF": ["Left", "Bottom"],
}
"""Members of classes: an attribute by its name, a call with the types of what is handed over.  What a base class has
counts as its own; a second word behind a class tells two entries of it apart."""

OTHERS = {
    # Collections, numbers and arrays of .NET, and its bridge to Python.
    *("List", "Add", "Clear", "Object", "Int32", "Array", "CreateInstance", "GetClrType", "GetType", "GetElementType"),
    *("GCHandle", "GCHandleType", "Alloc", "Pinned", "AddrOfPinnedObject", "ToInt64", "Free", "Marshal", "SizeOf"),
    # DirectoryInfo.  The generic DataTree is not in the stubs: the tests on mono have it.
    *("FullName", "DataTree", "EnsurePath"),
    # Namespaces, and the variable ghenv of a script.
    *("Geometry", "DocObjects", "Runtime", "Kernel", "Collections", "Generic", "Component"),
    # An event, which the stubs have as add_DocumentRemoved.
    "DocumentRemoved",
    # rhino3dm alone.
    *("CommonObject", "Decode", "Encode", "AddPoint3d", "AddFace", "ToPolylineCurve"),
    # Python and NumPy, and classes of weavecore.
    *("T", "PathLike", "SurfaceMesh", "Latitudes", "Lattice", "Weave"),
}
"""Names that are not in the table: what they are."""


def in_table() -> set[str]:
    """The last words of classes and the names of members."""
    classes = {name.split()[0].rpartition(".")[2] for name in CALLS}
    return classes | {member.partition("(")[0] for members in CALLS.values() for member in members}


def test_every_attribute_with_a_capital_is_in_the_table() -> None:
    used = {
        node.attr
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Attribute) and node.attr[:1].isupper()
    }
    assert sorted(used - in_table() - OTHERS) == []
    assert sorted(name for name in OTHERS if name not in used) == [], "is not called any longer"


@cache
def classes_of(namespace: str) -> dict[str, ast.ClassDef]:
    """The classes of a namespace in the stubs."""
    package, top = ("dotnet-stubs", "System-stubs") if namespace.startswith("System") else ("rhino-stubs-typed", "")
    package = "grasshopper-stubs-typed" if namespace.startswith("Grasshopper") else package
    try:
        found = distribution(package)
    except PackageNotFoundError:
        pytest.skip("pip install rhino-stubs-typed")
    path = "/".join([top or namespace.split(".", maxsplit=1)[0], *namespace.split(".")[1:], "__init__.pyi"])
    tree = ast.parse(Path(str(found.locate_file(path))).read_text("utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


def members_of(namespace: str, name: str) -> set[str]:
    """The attributes of a class and of its bases, and its calls with the types of their arguments."""
    found: set[str] = set()
    if name not in classes_of(namespace):
        return found
    node = classes_of(namespace)[name]
    for part in node.body:
        if isinstance(part, ast.FunctionDef):
            found.add(described(part, part.name))
        elif isinstance(part, ast.ClassDef):  # The overloads of a method of .NET's own.
            group = part.name.rpartition("_")[0]
            found |= {described(call, group) for call in part.body if isinstance(call, ast.FunctionDef)}
        elif isinstance(part, (ast.Assign, ast.AnnAssign)):
            target = part.targets[0] if isinstance(part, ast.Assign) else part.target
            found.add(ast.unparse(target))
    bases = [ast.unparse(base) for base in node.bases]
    homes = {"CommonObject": "Rhino.Runtime", "SurfaceProxy": "Rhino.Geometry"}
    return found.union(*(members_of(homes.get(base, namespace), base) for base in bases))


def described(function: ast.FunctionDef, name: str) -> str:
    """A property by its name, a method with the types of its arguments."""
    arguments = [ast.unparse(a.annotation) for a in function.args.args if a.annotation]
    is_property = any("property" in ast.unparse(d) for d in function.decorator_list)
    return name if is_property else f"{name}({', '.join(arguments)})"


@pytest.mark.parametrize("entry", CALLS)
def test_rhino_has_what_is_called(entry: str) -> None:
    namespace, _, name = entry.split(maxsplit=1)[0].rpartition(".")
    assert name in classes_of(namespace)
    assert [member for member in CALLS[entry] if member not in members_of(namespace, name)] == []
