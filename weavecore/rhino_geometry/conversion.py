"""Meshes and planes of Rhino as arrays.

Vertices are taken in double precision; no function of a mesh that follows its face indices is called, because
one that is out of range ends the process.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Degenerate, Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.rhino_geometry.net_arrays import rows_from

_CORNERS = ("A", "B", "C", "D")


def is_rhino_mesh(geometry: Any) -> bool:
    """Whether it is a mesh of rhino3dm or RhinoCommon."""
    return hasattr(geometry, "Faces") and hasattr(getattr(geometry, "Vertices", None), "ToPoint3dArray")


def rhino_vertices(mesh: Any) -> Floats:
    """Vertices (V, 3) of a Rhino mesh."""
    return rows_from(mesh.Vertices.ToPoint3dArray(), "XYZ")


def rhino_faces(mesh: Any) -> NDArray[Any]:
    """Faces (F, 4) of a Rhino mesh; a triangle repeats its last corner."""
    if hasattr(mesh.Faces, "ToIntArray"):
        # Quads stay quads, so that they are split in the same way as everywhere else.
        return rows_from(mesh.Faces.ToIntArray(False), [""], np.int32).reshape(-1, 4).astype(np.int64)
    faces = list(mesh.Faces)
    if faces and not isinstance(faces[0], tuple):
        return rows_from(faces, _CORNERS, np.int64)
    return np.array(faces, np.int64).reshape(-1, 4)


def plane_from(plane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A point and a normal of a plane of Rhino.

    Raises
    ------
    Unsupported
    """
    if not hasattr(plane, "Origin") or not (hasattr(plane, "Normal") or hasattr(plane, "ZAxis")):
        raise Unsupported(f"A {type(plane).__name__} came where a plane must be", remedy="Wire a plane.")
    origin, normal = plane.Origin, plane.Normal if hasattr(plane, "Normal") else plane.ZAxis
    return (origin.X, origin.Y, origin.Z), (normal.X, normal.Y, normal.Z)


# ----------------------------------------------------------------------
# Curves of Rhino as points along them.

_ANGLE = math.radians(10)


def is_rhino_curve(geometry: Any) -> bool:
    """Whether it is a curve, line, arc, circle, rectangle or polyline of rhino3dm or RhinoCommon."""
    return hasattr(geometry, "ToNurbsCurve") or _is_line(geometry)


def is_curve_in_rhino(geometry: Any) -> bool:
    """Whether it is one that Rhino, not rhino3dm, holds in memory."""
    return is_rhino_curve(geometry) and hasattr(geometry, "GetType")


def line_points(geometry: Any) -> Floats | None:
    """Both ends (2, 3) of a line; None of any other curve."""
    return rows_from([geometry.From, geometry.To], "XYZ") if _is_line(geometry) else None


def curve_in_rhino_points(curve: Any, tolerance: float) -> Floats:
    """Points (n, 3) along a curve of RhinoCommon, no further from the lines between them than a tolerance.

    Raises
    ------
    Degenerate
        Where Rhino makes no polyline of it.
    """
    ends = line_points(curve)
    if ends is not None:
        return ends
    form = curve if hasattr(curve, "ToPolyline") else curve.ToNurbsCurve()
    drawn = form.ToPolyline(tolerance, _ANGLE, 0.0, 0.0) if form is not None else None
    if drawn is None:
        raise Degenerate(
            f"Rhino makes no polyline of this {type(curve).__name__}",
            remedy="Look with Rhino's command Check at what is wrong with it.",
        )
    points: Floats = np.asarray(rows_from([drawn.Point(i) for i in range(drawn.PointCount)], "XYZ"), np.float64)
    return points


def _is_line(geometry: Any) -> bool:
    return hasattr(geometry, "From") and hasattr(geometry, "To")
