"""`RawMesh`: a mesh as it was given, before anything is checked or mended.

It holds arrays and texts only, so that a file can be read in another process and the
result handed over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from weavecore.geometry.arrays import Ints
from weavecore.rhino_geometry.conversion import is_rhino_mesh, rhino_faces, rhino_vertices

Plane = tuple[ArrayLike, ArrayLike]
"""A point and a normal."""

DOUBLE = float(np.finfo(np.float64).eps)
SINGLE = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Vertices and faces as they were given.

    Parameters
    ----------
    vertices : (V, 3) numbers
    faces : (F, 3) or (F, 4) whole numbers
        Triangles, or quads of which a triangle repeats its last corner or has -1 there.
    face_ids : (F,) int64, optional
        The number that each face has for the user; its row where there is none.
    unit, tolerance, name
        As in `SurfaceMesh`.
    notes : tuple of str
        What was done to get here, one sentence each.
    epsilon : float
        Relative precision of the numbers that the coordinates were kept in.
    n_borders_expected : int, optional
        How many borders the object that was meshed says that it has.
    """

    vertices: NDArray[Any]
    faces: NDArray[Any]
    face_ids: Optional[Ints] = None
    unit: str = "None"
    tolerance: float = 0.0
    name: str = ""
    notes: tuple[str, ...] = ()
    epsilon: float = DOUBLE
    n_borders_expected: Optional[int] = None


# ----------------------------------------------------------------------
# Meshes of rhino3dm and of RhinoCommon, and of trimesh, as arrays.
#
# They are told by what they have, so that none of these libraries is imported.

__all__ = ["is_array_mesh", "is_rhino_mesh", "rhino_faces", "rhino_vertices"]


def is_array_mesh(geometry: Any) -> bool:
    """Whether it has vertices and faces as arrays, as a trimesh.Trimesh and a `SurfaceMesh` do."""
    return hasattr(geometry, "vertices") and hasattr(geometry, "faces")


# ----------------------------------------------------------------------
# Words for what is reported.

_PLURALS = {"vertex": "vertices"}


def counted(n: int, noun: str) -> str:
    """``1 face``, ``2,000 vertices``."""
    return f"{n:,} {noun if n == 1 else _PLURALS.get(noun, noun + 's')}"
