"""`MeshedObject`: what becomes of a surface of a Rhino file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen

UNTOLD = -1
"""Instead of a number of borders where the object does not say it."""


@dataclass(frozen=True, eq=False)
class MeshedObject:
    """One welded triangle mesh.

    Parameters
    ----------
    vertices : (V, 3) float64
        In the object's own unit and frame.
    faces : (F, 3) int64
        Counter-clockwise seen from outside.
    loops_expected : int
        How many borders the object says that it has, or `UNTOLD`.
    chord_error : float
        The greatest distance measured between the mesh and the surface; 0 where it was not measured.
    notes : sequence of str
        What is worth telling, one sentence each.
    """

    vertices: Floats
    faces: Ints
    loops_expected: int
    chord_error: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.float64, (-1, 3)))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64, (-1, 3)))
        object.__setattr__(self, "notes", tuple(self.notes))
