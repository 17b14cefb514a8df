"""Meshes of rhino3dm and of RhinoCommon, and of trimesh, as arrays.

They are told by what they have, so that none of these libraries is imported.  Vertices of
Rhino meshes are taken in double precision; no function of the mesh that follows its face
indices is called, because one that is out of range ends the process.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats


def is_rhino_mesh(geometry: Any) -> bool:
    """Whether it is a mesh of rhino3dm or RhinoCommon."""
    return hasattr(geometry, "Faces") and hasattr(getattr(geometry, "Vertices", None), "ToPoint3dArray")


def is_array_mesh(geometry: Any) -> bool:
    """Whether it has vertices and faces as arrays, as a trimesh.Trimesh and a `SurfaceMesh` do."""
    return hasattr(geometry, "vertices") and hasattr(geometry, "faces")


def rhino_vertices(mesh: Any) -> Floats:
    """Vertices (V, 3) of a Rhino mesh."""
    points = [*map(attrgetter("X", "Y", "Z"), mesh.Vertices.ToPoint3dArray())]
    return np.array(points, np.float64).reshape(-1, 3)


def rhino_faces(mesh: Any) -> NDArray[Any]:
    """Faces (F, 4) of a Rhino mesh; a triangle repeats its last corner."""
    faces = list(mesh.Faces)
    if faces and not isinstance(faces[0], tuple):
        faces = [*map(attrgetter("A", "B", "C", "D"), faces)]
    return np.array(faces, np.int64).reshape(-1, 4)
