"""Meshes and planes of Rhino as arrays.

Vertices are taken in double precision; no function of a mesh that follows its face indices is called, because
one that is out of range ends the process.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.rhino_geometry.arrays import rows_from

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
