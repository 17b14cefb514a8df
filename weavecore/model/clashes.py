"""`Clashes`: rods that would cut into each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen


@dataclass(frozen=True, eq=False)
class Clashes:
    """Pairs of rods whose axes come nearer to each other than a diameter, the nearest first.

    Parameters
    ----------
    strands : (K, 2) int64
        A rod that clashes with itself is there twice.
    distance : (K,) float64
        The least one of each pair.
    point : (K, 3) float64
        Where it is, halfway between the axes.
    """

    strands: Ints
    distance: Floats
    point: Floats

    def __post_init__(self) -> None:
        n = len(self.distance)
        object.__setattr__(self, "strands", frozen(self.strands, np.int64, (n, 2)))
        object.__setattr__(self, "distance", frozen(self.distance, np.float64, (n,)))
        object.__setattr__(self, "point", frozen(self.point, np.float64, (n, 3)))

    def __len__(self) -> int:
        return len(self.distance)
