"""`Drawing`: arrays as Rhino's curves, points, lines and meshes.

With RhinoCommon whole arrays are handed over, meshes as archives with rhino3dm; other points go one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any, Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import each, poll
from weavecore.rhino_geometry.mesh_archive import mesh_archive
from weavecore.rhino_geometry.net_arrays import net_array


class Drawing:
    """Makes geometry with RhinoCommon where Rhino is loaded, else with rhino3dm.

    Parameters
    ----------
    library : module, optional
        ``Rhino.Geometry`` or ``rhino3dm``, or what has the same classes.
    """

    def __init__(self, library: Optional[Any] = None) -> None:
        self._library: Any = library or _library()
        self._has_arrays = hasattr(self._library.Mesh().Vertices, "AddVertices")

    def points(self, points: Floats) -> Any:
        """Points (n, 3) as Rhino's."""
        poll()
        if self._has_arrays:
            return net_array(self._library.Point3d, np.asarray(points, np.float64))
        return list(map(self._library.Point3d, *points.T.tolist()))

    def vectors(self, vectors: Floats) -> list[Any]:
        """Vectors (n, 3) as Rhino's."""
        poll()
        return list(map(self._library.Vector3d, *vectors.T.tolist()))

    def polyline(self, points: Floats, *, is_closed: bool) -> Any:
        """A polyline curve through points (n, 3); a closed one goes back to its first."""
        drawn = np.concatenate([points, points[:1]]) if is_closed else points
        if self._has_arrays:
            return self._library.PolylineCurve(self.points(drawn))
        polyline = self._library.Polyline(len(drawn))
        list(map(polyline.Add, *drawn.T.tolist()))
        return polyline.ToPolylineCurve()

    def polylines(self, points: Floats, offsets: Ints, closed: Any) -> list[Any]:
        """A polyline curve for each row of ragged points."""
        ends = offsets.tolist()
        rows = each(zip(ends, ends[1:], closed))
        return [self.polyline(points[start:end], is_closed=bool(loop)) for start, end, loop in rows]

    def lines(self, starts: Floats, ends: Floats) -> list[Any]:
        """A line from each start (n, 3) to each end (n, 3)."""
        if self._has_arrays:
            return list(net_array(self._library.Line, np.concatenate([starts, ends], axis=1)))
        make = self._library.Line
        return [make(a, b) for a, b in each(zip(self.points(starts), self.points(ends)))]

    def spline(self, knots: Floats, controls: Floats) -> Any:
        """A B-spline curve: knots (n + degree + 1,) in full form, control points (n, 3)."""
        poll()
        order = len(knots) - len(controls)
        curve = self._library.NurbsCurve.Create(False, order - 1, self.points(controls))
        # Rhino's knots go without the first and the last one.
        places = curve.Knots
        for i, knot in enumerate(knots[1:-1].tolist()):
            places[i] = knot
        return curve

    def mesh(self, points: Floats, quads: Ints, *, colour: Optional[Sequence[int]] = None) -> Any:
        """A mesh of points (n, 3) and faces (F, 4), of which a triangle repeats its last corner; of one colour or none.

        The colour is red, green and blue in 0…255.
        """
        poll()
        archive = None if self._has_arrays or not len(points) else mesh_archive(self._library)
        if archive is not None:
            content = archive.encode(points, quads, None if colour is None else (colour[0], colour[1], colour[2]))
            decoded = self._library.CommonObject.Decode(content)
            decoded.Normals.ComputeNormals()
            return decoded
        mesh = self._library.Mesh()
        if self._has_arrays:
            mesh.Vertices.UseDoublePrecisionVertices = True
            mesh.Vertices.AddVertices(self.points(points))
            mesh.Faces.AddFaces(net_array(self._library.MeshFace, quads.astype(np.int32)))
        else:
            # AddPoint3d keeps double precision, which Add does not.
            list(map(mesh.Vertices.AddPoint3d, *points.T.tolist()))
            list(map(mesh.Faces.AddFace, *quads.T.tolist()))
        mesh.Normals.ComputeNormals()
        if colour is not None and self._has_arrays:
            mesh.VertexColors.CreateMonotoneMesh(import_module("System.Drawing").Color.FromArgb(*colour))
        elif colour is not None:
            list(map(mesh.VertexColors.Add, *([part] * len(points) for part in colour)))
        return mesh

    def joined(self, meshes: Iterable[Any]) -> Any:
        """One mesh of several, which stay as they are."""
        whole = self._library.Mesh()
        for mesh in meshes:
            whole.Append(mesh)
        return whole


def _library() -> Any:
    try:
        geometry = import_module("Rhino.Geometry")
    except ImportError:
        return import_module("rhino3dm")
    # Stubs for editors are packages of the same name without anything in them.
    return geometry if hasattr(geometry, "Mesh") else import_module("rhino3dm")
