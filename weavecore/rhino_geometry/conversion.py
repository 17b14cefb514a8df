"""Meshes, planes and curves of Rhino as arrays.

Vertices are taken in double precision.  No function of a mesh that follows its face indices is called, because an
index out of range ends the process.
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
"""Fields of RhinoCommon's ``MeshFace``."""

_ANGLE = math.radians(10)
"""Turn of a polyline at a vertex at most: a curve within the tolerance of a chord keeps its bends."""


def is_rhino_mesh(geometry: Any) -> bool:
    """Whether it is a mesh of rhino3dm or RhinoCommon.

    Parameters
    ----------
    geometry : object
        Anything.

    Returns
    -------
    bool
    """
    return hasattr(geometry, "Faces") and hasattr(getattr(geometry, "Vertices", None), "ToPoint3dArray")


def rhino_vertices(mesh: Any) -> Floats:
    """Vertices of a Rhino mesh.

    Parameters
    ----------
    mesh : Mesh
        Of rhino3dm or RhinoCommon.

    Returns
    -------
    (V, 3) float64
    """
    return rows_from(mesh.Vertices.ToPoint3dArray(), "XYZ")


def rhino_faces(mesh: Any) -> NDArray[Any]:
    """Faces of a Rhino mesh.

    Parameters
    ----------
    mesh : Mesh
        Of rhino3dm or RhinoCommon.

    Returns
    -------
    (F, 4) int64
        A triangle repeats its last corner.
    """
    if hasattr(mesh.Faces, "ToIntArray"):
        # Quads stay quads, so that they are split in the same way as everywhere else.
        return rows_from(mesh.Faces.ToIntArray(False), [""], np.int32).reshape(-1, 4).astype(np.int64)
    faces = list(mesh.Faces)
    if faces and not isinstance(faces[0], tuple):
        return rows_from(faces, _CORNERS, np.int64)
    return np.array(faces, np.int64).reshape(-1, 4)


def plane_from(plane: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A point and a normal of a plane of Rhino.

    Parameters
    ----------
    plane : Plane
        Of rhino3dm or RhinoCommon.

    Returns
    -------
    point, normal : tuple of three floats

    Raises
    ------
    Unsupported
        Where it is not a plane.
    """
    if not hasattr(plane, "Origin") or not (hasattr(plane, "Normal") or hasattr(plane, "ZAxis")):
        raise Unsupported(f"A {type(plane).__name__} came where a plane must be", remedy="Wire a plane.")
    origin, normal = plane.Origin, plane.Normal if hasattr(plane, "Normal") else plane.ZAxis
    return (origin.X, origin.Y, origin.Z), (normal.X, normal.Y, normal.Z)


def is_rhino_curve(geometry: Any) -> bool:
    """Whether it is a curve, line, arc, circle, rectangle or polyline of rhino3dm or RhinoCommon.

    Parameters
    ----------
    geometry : object
        Anything.

    Returns
    -------
    bool
    """
    return hasattr(geometry, "ToNurbsCurve") or _is_line(geometry)


def is_curve_in_rhino(geometry: Any) -> bool:
    """Whether it is a curve of RhinoCommon, not of rhino3dm.

    Parameters
    ----------
    geometry : object
        Anything.

    Returns
    -------
    bool
    """
    return is_rhino_curve(geometry) and hasattr(geometry, "GetType")


def line_points(geometry: Any) -> Floats | None:
    """Both ends of a line.

    Parameters
    ----------
    geometry : object
        A curve of rhino3dm or RhinoCommon.

    Returns
    -------
    (2, 3) float64, or None where it is another curve
    """
    return rows_from([geometry.From, geometry.To], "XYZ") if _is_line(geometry) else None


def curve_in_rhino(geometry: Any) -> Any:
    """A curve of RhinoCommon from a curve, or from a structure such as an arc, ellipse, rectangle or polyline.

    Parameters
    ----------
    geometry : Rhino.Geometry.Curve, Arc, Ellipse…

    Returns
    -------
    Rhino.Geometry.Curve

    Raises
    ------
    Degenerate
        Where Rhino makes none of it.
    """
    # Structures have methods of the same names with other arguments: Arc.BoundingBox(), Rectangle3d.ToPolyline().
    form = geometry if hasattr(geometry, "GetBoundingBox") else geometry.ToNurbsCurve()
    if form is None:
        raise _no_polyline(geometry)
    return form


def curve_in_rhino_points(curve: Any, tolerance: float) -> Floats:
    """Points along a curve of RhinoCommon.

    Parameters
    ----------
    curve : Rhino.Geometry.Curve
    tolerance : float
        Distance of the curve from the lines between the points at most, in the model's unit.

    Returns
    -------
    (n, 3) float64

    Raises
    ------
    Degenerate
        Where Rhino makes no polyline of it.
    """
    drawn = curve.ToPolyline(tolerance, _ANGLE, 0.0, 0.0)
    if drawn is None:
        raise _no_polyline(curve)
    points: Floats = np.asarray(rows_from([drawn.Point(i) for i in range(drawn.PointCount)], "XYZ"), np.float64)
    return points


def _no_polyline(geometry: Any) -> Degenerate:
    return Degenerate(
        f"Rhino makes no polyline of this {type(geometry).__name__}",
        remedy="Look with Rhino's command Check at what is wrong with it.",
    )


def _is_line(geometry: Any) -> bool:
    return hasattr(geometry, "From") and hasattr(geometry, "To")
