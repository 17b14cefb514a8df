"""`RawMesh`: a mesh as it was read, before anything is checked or repaired.

It holds arrays and texts only, so that a file can be read in another process and the result sent to this one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from weavecore.geometry.arrays import Ints
from weavecore.model import Note

Plane = tuple[ArrayLike, ArrayLike]
"""A point and a normal."""

DOUBLE = float(np.finfo(np.float64).eps)
"""Relative rounding of coordinates that were stored in double precision."""

SINGLE = float(np.finfo(np.float32).eps)
"""Relative rounding of coordinates that were stored in single precision, as in a binary .stl."""


_PLURALS = {"vertex": "vertices"}
"""Nouns whose plural does not end in s."""


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Vertices and faces as they were read.

    Parameters
    ----------
    vertices : (V, 3) numbers
        In the unit of the file.
    faces : (F, 3) or (F, 4) whole numbers
        Triangles, or quads; a triangle among quads repeats its last corner or has -1 there.
    face_ids : (F,) int64, optional
        The number that each face has for the user; its row if missing.
    unit, tolerance, name
        As in `SurfaceMesh`.
    notes : tuple of Note
        What was changed or doubted so far.
    epsilon : float
        Relative rounding of the stored coordinates: `DOUBLE` or `SINGLE`.
    n_borders_expected : int, optional
        How many border loops the meshed object has by its own topology.
    part_names : tuple of tuple of str
        Names of each part of the file: its object and its groups; empty where there is one part.
    part_of_face : (F,) int64, optional
        The part of each face.
    """

    vertices: NDArray[Any]
    faces: NDArray[Any]
    face_ids: Optional[Ints] = None
    unit: str = "None"
    tolerance: float = 0.0
    name: str = ""
    notes: tuple[Note, ...] = ()
    epsilon: float = DOUBLE
    n_borders_expected: Optional[int] = None
    part_names: tuple[tuple[str, ...], ...] = ()
    part_of_face: Optional[Ints] = None


@dataclass(frozen=True)
class RepairOptions:
    """What is to be repaired or left out beyond the usual.

    Parameters
    ----------
    weld : float, optional
        Vertices of borders that are no further apart are welded; by default the file's tolerance, or a millionth of the
        size.
    fill_holes : float, optional
        Borders up to this length are closed.
    is_largest_only : bool
        Whether only the piece with the largest area is taken.
    side : str, optional
        ``"outer"``: only the outer side of a thin solid is taken.
    """

    weld: Optional[float] = None
    fill_holes: Optional[float] = None
    is_largest_only: bool = False
    side: Optional[str] = None


def is_array_mesh(geometry: Any) -> bool:
    """Whether an object has vertices and faces as arrays, as a trimesh.Trimesh and a `SurfaceMesh` do.

    Parameters
    ----------
    geometry : object
    """
    return hasattr(geometry, "vertices") and hasattr(geometry, "faces")


def counted(n: int, noun: str) -> str:
    """A count with its noun: ``1 face``, ``2,000 vertices``.

    Parameters
    ----------
    n : int
    noun : str
        In the singular.
    """
    return f"{n:,} {noun if n == 1 else _PLURALS.get(noun, noun + 's')}"
