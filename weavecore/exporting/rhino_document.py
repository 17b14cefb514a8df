"""`Document`: a .3dm in the making, over rhino3dm's file object.

Everything in it that could differ from run to run is fixed: ids of layers and objects are made from the
content, and the dates of the file's history from nothing.
"""

from __future__ import annotations

import base64
import struct
import uuid
import zlib
from collections.abc import Mapping
from typing import Any

from weavecore.errors import NotWritten
from weavecore.exporting.product import Polygons
from weavecore.geometry.arrays import Floats
from weavecore.geometry.polygon_mesh import fan_quads

VERSION = 7
"""The archive version that is written: Rhino 7 and later read it."""

SEPARATOR = "::"
"""What stands between the names in a layer's full path."""


class Document:
    """A .3dm file being put together.

    Parameters
    ----------
    unit : str
        Rhino's name of the unit of all coordinates.
    tolerance : float
        Absolute tolerance; 0 leaves Rhino's default.
    seed : str
        Text that ids are made from: the same seed and names give the same ids.
    """

    def __init__(self, unit: str, tolerance: float, *, seed: str) -> None:
        import rhino3dm

        # The stubs of rhino3dm do not know half of what it has.
        self._rhino: Any = rhino3dm
        self._file: Any = self._rhino.File3dm()
        self._seed = uuid.uuid5(uuid.NAMESPACE_URL, f"weavecore:{seed}")
        self._layers: dict[str, tuple[int, uuid.UUID]] = {}
        settings = self._file.Settings
        # A unit that Rhino does not name would be taken for millimetres.
        settings.ModelUnitSystem = getattr(self._rhino.UnitSystem, unit, getattr(self._rhino.UnitSystem, "None"))
        if tolerance > 0:
            settings.ModelAbsoluteTolerance = tolerance
        self._file.ApplicationName = "weavecore"

    def layer(self, path: str, colour: tuple[int, int, int]) -> int:
        """Index of the layer with this full path; it and the layers above it are made where they are missing."""
        if path not in self._layers:
            parent, _, name = path.rpartition(SEPARATOR)
            layer = self._rhino.Layer()
            layer.Name, layer.Color = name, (*colour, 255)
            layer.Id = self._id(f"layer {path}")
            if parent:
                self.layer(parent, colour)
                layer.ParentLayerId = self._layers[parent][1]
            self._layers[path] = (self._file.Layers.Add(layer), layer.Id)
        return self._layers[path][0]

    def add_polyline(self, points: Floats, layer: int, name: str, texts: Mapping[str, object]) -> None:
        """Add a polyline through points (n, 3), as they are."""
        polyline = self._rhino.Polyline(len(points))
        # A list of Point3d takes twice as long.
        list(map(polyline.Add, *points.T.tolist()))
        self._expect(self._file.Objects.AddPolyline, polyline, layer, name, texts)

    def add_curve(
        self,
        knots: Floats,
        controls: Floats,
        layer: int,
        name: str,
        texts: Mapping[str, object],
        colour: tuple[int, int, int],
    ) -> None:
        """Add a B-spline in a colour of its own: knots (n + degree + 1,) in full form, control points (n, 3)."""
        order = len(knots) - len(controls)
        curve = self._rhino.NurbsCurve(3, False, order, len(controls))
        # Rhino's knots go without the first and the last one.
        for i, knot in enumerate(knots[1:-1].tolist()):
            curve.Knots[i] = knot
        for i, (x, y, z) in enumerate(controls.tolist()):
            curve.Points[i] = self._rhino.Point4d(x, y, z, 1.0)
        self._expect(self._file.Objects.AddCurve, curve, layer, name, texts, colour)

    def add_points(self, points: Floats, layer: int, name: str, texts: Mapping[str, object]) -> None:
        """Add points (n, 3) as one cloud, in their order."""
        cloud = self._rhino.PointCloud(list(map(self._rhino.Point3d, *points.T.tolist())))
        self._expect(self._file.Objects.AddPointCloud, cloud, layer, name, texts)

    def add_mesh(self, polygons: Polygons, layer: int, name: str, texts: Mapping[str, object]) -> None:
        """Add a mesh; triangles and quads stay, larger faces become fans."""
        mesh = self._rhino.Mesh()
        # AddPoint3d keeps double precision, which Add does not.
        list(map(mesh.Vertices.AddPoint3d, *polygons.points.T.tolist()))
        list(map(mesh.Faces.AddFace, *fan_quads(polygons.offsets, polygons.corners)[0].T.tolist()))
        mesh.Normals.ComputeNormals()
        self._expect(self._file.Objects.AddMesh, mesh, layer, name, texts)

    def encode(self) -> bytes:
        """The bytes of the file."""
        options = self._rhino.File3dmWriteOptions()
        options.Version = VERSION
        content = base64.b64decode(self._file.Encode(options) or "")
        if not content:
            raise NotWritten("Rhino's library gave no file", remedy="Write the result as .json instead.")
        return with_fixed_dates(content)

    def _id(self, name: str) -> uuid.UUID:
        return uuid.uuid5(self._seed, name)

    def _expect(
        self,
        add: Any,
        geometry: Any,
        layer: int,
        name: str,
        texts: Mapping[str, object],
        colour: tuple[int, int, int] | None = None,
    ) -> None:
        """Add an object and see that it was taken: rhino3dm says nothing when it was not."""
        attributes = self._rhino.ObjectAttributes()
        attributes.LayerIndex, attributes.Name = layer, name
        attributes.Id = self._id(f"object {layer} {name}")
        if colour is not None:
            attributes.ObjectColor = (*colour, 255)
            attributes.ColorSource = self._rhino.ObjectColorSource.ColorFromObject
        for key, text in texts.items():
            attributes.SetUserString(key, str(text))
        if add(geometry, attributes) != attributes.Id:
            raise NotWritten(
                "Rhino's library did not take an object",
                remedy="Write the result as .json and look at what is special about it.",
                ids=[name],
                kind="object",
            )


# ----------------------------------------------------------------------
# The dates in a .3dm: openNURBS writes the time of writing into each file, and no call of rhino3dm changes that.
#
# A .3dm is a header of 32 bytes and then *chunks*: a type code of 4 bytes, a length of 8 and a body of that length.
# A chunk whose code has the highest bit set has a value in place of the length, and no body.

_PROPERTIES, _HISTORY = 0x10000014, 0x20008021
_NO_BODY = 0x80000000
_HEADER, _HEAD = 32, 12
_N_DATES = 2
_NEW_YEAR_2000 = (0, 0, 0, 1, 0, 100, 6, 0)
"""Second, minute, hour, day, month, year, day of the week and of the year, as C counts them."""


def with_fixed_dates(content: bytes) -> bytes:
    """The bytes of a .3dm, of version 5 or later, with the dates of its history set to one that does not change.

    The history's body is a version byte, then the author and the date of the making, the
    same of the last change, a count, and a CRC-32 of all this.
    """
    table = _find_chunk(content, _PROPERTIES, _HEADER)
    history = table and _find_chunk(content, _HISTORY, table[0])
    if not history:
        return content
    start, end = history
    body = bytearray(content[start : end - 4])
    at = 1
    for _ in range(_N_DATES):
        (n_letters,) = struct.unpack_from("<i", body, at)
        at += 4 + 2 * n_letters
        struct.pack_into("<8i", body, at, *_NEW_YEAR_2000)
        at += 32
    return content[:start] + bytes(body) + struct.pack("<I", zlib.crc32(body)) + content[end:]


def _find_chunk(content: bytes, wanted: int, at: int) -> tuple[int, int] | None:
    """Start and end of the body of the first chunk with that code, from ``at`` on; None where there is none."""
    while at + _HEAD <= len(content):
        code, length = struct.unpack_from("<Iq", content, at)
        at += _HEAD
        if code & _NO_BODY:
            continue
        if code == wanted:
            return at, at + length
        at += length
    return None
