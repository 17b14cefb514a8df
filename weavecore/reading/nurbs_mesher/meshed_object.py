"""`MeshedObject`: the triangle mesh of an object of a Rhino file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.model import Note


@dataclass(frozen=True, eq=False)
class MeshedObject:
    """One welded triangle mesh.

    Parameters
    ----------
    vertices : (V, 3) float64
        In the object's own unit and frame.
    faces : (F, 3) int64
        Counter-clockwise seen from outside.
    n_borders_expected : int, optional
        How many border loops it has by its own topology; None if unknown.
    chord_error : float
        The greatest distance measured between the mesh and the surface; 0 if not measured.
    notes : sequence of Note
        What the user should know.
    """

    vertices: Floats
    faces: Ints
    n_borders_expected: Optional[int] = None
    chord_error: float = 0.0
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.float64, (-1, 3)))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64, (-1, 3)))
        object.__setattr__(self, "notes", tuple(self.notes))
