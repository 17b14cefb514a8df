"""`RhinoFileBuilder`: a .3dm file being put together with rhino3dm, the same bytes in every run.

Ids of layers and objects are UUIDs (version 5) of the content.  openNURBS writes the present time into each file and no
call of rhino3dm changes that, so the dates are overwritten in the bytes.  A .3dm is a header and then *chunks*::

    32 bytes header │ type code 4 │ length 8 │ body … │ type code 4 │ value 8 │ …
                                                        highest bit set: no body
    history chunk:    version 1 │ author │ date of creation │ author │ date of change │ count │ CRC-32
"""

from __future__ import annotations

import base64
import struct
import uuid
import zlib
from collections.abc import Mapping
from typing import Any, Callable

from numpy.typing import NDArray

from weavecore.errors import NotWritten
from weavecore.exporting.polygons import Polygons
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.polygon_mesh import fan_quads
from weavecore.polling import each, poll

VERSION = 7
"""The archive version that is written: Rhino 7 and later read it."""

SEPARATOR = "::"
"""Between the names in a layer's full path."""

_PROPERTIES, _HISTORY = 0x10000014, 0x20008021
"""Type codes of openNURBS: TCODE_PROPERTIES_TABLE and TCODE_PROPERTIES_REVISIONHISTORY."""

_NO_BODY = 0x80000000
"""The bit of a type code that marks a chunk with a value instead of a length and a body (TCODE_SHORT)."""

_FILE_HEADER, _CHUNK_HEADER, _CRC = 32, 12, 4
"""Bytes before the first chunk, before the body of a chunk, and at the end of a body with a CRC-32."""

_ROWS_AT_ONCE = 10_000
"""Vertices or faces that are added between two polls."""

_N_DATES, _DATE_BYTES = 2, 32
_NEW_YEAR_2000 = (0, 0, 0, 1, 0, 100, 6, 0)
"""Second, minute, hour, day, month, year, day of the week and of the year, as C's struct tm counts them."""


class RhinoFileBuilder:
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

        # The stubs of rhino3dm are incomplete.
        self._rhino: Any = rhino3dm
        self._file: Any = self._rhino.File3dm()
        self._seed = uuid.uuid5(uuid.NAMESPACE_URL, f"weavecore:{seed}")
        self._layers: dict[str, tuple[int, uuid.UUID]] = {}
        settings = self._file.Settings
        # Rhino would take a unit without a name for millimetres.
        settings.ModelUnitSystem = getattr(self._rhino.UnitSystem, unit, getattr(self._rhino.UnitSystem, "None"))
        if tolerance > 0:
            settings.ModelAbsoluteTolerance = tolerance
        self._file.ApplicationName = "weavecore"

    def layer(self, path: str, colour: tuple[int, int, int]) -> int:
        """Index of the layer with this full path; missing layers are added, parents included."""
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

    def add_polyline(
        self,
        points: Floats,
        layer: int,
        name: str,
        texts: Mapping[str, object],
        colour: tuple[int, int, int] | None = None,
        *,
        is_arrow: bool = False,
    ) -> None:
        """Add a polyline through points (n, 3), as they are; in a colour of its own, with an arrowhead at its end."""
        polyline = self._rhino.Polyline(len(points))
        # A list of Point3d takes twice as long.
        list(map(polyline.Add, *points.T.tolist()))
        self._expect(self._file.Objects.AddPolyline, polyline, layer, name, texts, colour, is_arrow=is_arrow)

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
        # Rhino omits the first and the last knot.
        own_knots, own_points, point = curve.Knots, curve.Points, self._rhino.Point4d
        for i, knot in enumerate(knots[1:-1].tolist()):
            own_knots[i] = knot
        for i, (x, y, z) in enumerate(controls.tolist()):
            own_points[i] = point(x, y, z, 1.0)
        self._expect(self._file.Objects.AddCurve, curve, layer, name, texts, colour)

    def add_points(
        self, points: Floats, layer: int, name: str, texts: Mapping[str, object], colours: Ints | None = None
    ) -> None:
        """Add points (n, 3) as one cloud, in their order; each in a colour of its own (n, 3) where there are any."""
        places = map(self._rhino.Point3d, *points.T.tolist())
        cloud = self._rhino.PointCloud(list(places) if colours is None else [])
        if colours is not None:
            for place, colour in zip(places, colours.tolist()):
                cloud.Add(place, (*colour, 255))
        self._expect(self._file.Objects.AddPointCloud, cloud, layer, name, texts)

    def add_point(self, point: Floats, layer: int, name: str, texts: Mapping[str, object]) -> None:
        """Add a point (3,)."""
        place = self._rhino.Point(self._rhino.Point3d(*point.tolist()))
        self._expect(self._file.Objects.Add, place, layer, name, texts)

    def add_dot(self, point: Floats, layer: int, text: str) -> None:
        """Add a text dot at a point (3,)."""
        attributes = self._rhino.ObjectAttributes()
        attributes.LayerIndex = layer
        attributes.Id = self._id(f"dot {layer} {text} {point.tolist()}")
        dot = self._rhino.TextDot(text, self._rhino.Point3d(*point.tolist()))
        self._file.Objects.Add(dot, attributes)

    def add_mesh(self, polygons: Polygons, layer: int, name: str, texts: Mapping[str, object]) -> None:
        """Add a mesh; triangles and quads stay, larger faces become fans."""
        mesh = self._rhino.Mesh()
        # AddPoint3d keeps double precision, which Add does not.
        _add_each(mesh.Vertices.AddPoint3d, polygons.points)
        _add_each(mesh.Faces.AddFace, fan_quads(polygons.offsets, polygons.corners)[0])
        mesh.Normals.ComputeNormals()
        poll()
        self._expect(self._file.Objects.AddMesh, mesh, layer, name, texts)

    def encode(self) -> bytes:
        """The bytes of the file."""
        options = self._rhino.File3dmWriteOptions()
        options.Version = VERSION
        poll()
        content = base64.b64decode(self._file.Encode(options) or "")
        poll()
        if not content:
            raise NotWritten("rhino3dm encoded no file", remedy="Write the result as .json instead.")
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
        *,
        is_arrow: bool = False,
    ) -> None:
        """Add an object, and raise where rhino3dm rejects it, which it does silently."""
        attributes = self._rhino.ObjectAttributes()
        attributes.LayerIndex, attributes.Name = layer, name
        attributes.Id = self._id(f"object {layer} {name}")
        if colour is not None:
            attributes.ObjectColor = (*colour, 255)
            attributes.ColorSource = self._rhino.ObjectColorSource.ColorFromObject
        if is_arrow:
            attributes.ObjectDecoration = self._rhino.ObjectDecoration.EndArrowhead
        for key, text in texts.items():
            attributes.SetUserString(key, str(text))
        if add(geometry, attributes) != attributes.Id:
            raise NotWritten(
                "rhino3dm rejected an object",
                remedy="Write the result as .json, and please report it with the input.",
                ids=[name],
                kind="object",
            )


def _add_each(add: Callable[..., Any], rows: NDArray[Any]) -> None:
    """Call with the values of each row (n, k)."""
    for start in each(range(0, len(rows), _ROWS_AT_ONCE)):
        list(map(add, *rows[start : start + _ROWS_AT_ONCE].T.tolist()))


def with_fixed_dates(content: bytes) -> bytes:
    """Set the dates in a .3dm to a fixed one.

    Parameters
    ----------
    content : bytes
        A .3dm of version 5 or later.

    Returns
    -------
    bytes
        Unchanged where the file has no history.
    """
    table = _find_chunk(content, _PROPERTIES, _FILE_HEADER)
    history = table and _find_chunk(content, _HISTORY, table[0])
    if not history:
        return content
    start, end = history
    body = bytearray(content[start : end - _CRC])
    at = 1
    for _ in range(_N_DATES):
        (n_letters,) = struct.unpack_from("<i", body, at)
        at += 4 + 2 * n_letters
        struct.pack_into("<8i", body, at, *_NEW_YEAR_2000)
        at += _DATE_BYTES
    return content[:start] + bytes(body) + struct.pack("<I", zlib.crc32(body)) + content[end:]


def _find_chunk(content: bytes, wanted: int, at: int) -> tuple[int, int] | None:
    """Start and end of the body of the first chunk with that code, from ``at`` on; None where there is none."""
    while at + _CHUNK_HEADER <= len(content):
        code, length = struct.unpack_from("<Iq", content, at)
        at += _CHUNK_HEADER
        if code & _NO_BODY:
            continue
        if code == wanted:
            return at, at + length
        at += length
    return None
