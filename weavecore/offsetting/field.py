"""`DistanceField`: the distance from the borders, at the vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, frozen


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distance from the borders and cuts along the surface.

    Parameters
    ----------
    distance : (V,) float64
        In the model's unit; 0 on borders and cuts.
    gradient : (V, 3) float64
        Direction in which the shortest path arrives at each vertex: a unit vector tangent
        to a face there, pointing away from the borders.  Zero where there is none: on the
        borders and cuts, and where the direction is not known.
    """

    distance: Floats
    gradient: Floats

    def __post_init__(self) -> None:
        n = len(self.distance)
        object.__setattr__(self, "distance", frozen(self.distance, np.float64, (n,)))
        object.__setattr__(self, "gradient", frozen(self.gradient, np.float64, (n, 3)))
