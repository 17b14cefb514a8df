"""`Bending`: how sharply each rod is bent, and whether its material bears it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen


@dataclass(frozen=True, eq=False)
class Bending:
    """The sharpest bend of every rod, in the model's unit.

    The radius is the mean one over a window of arc length: at a single point it would tell
    of noise more than of the rod.

    Parameters
    ----------
    window : float
        Arc length that the curvature is taken over.
    min_radius : (S,) float64
        Infinite for a straight rod.
    station_at_min : (S,) float64
        Arc length from the start of the strand to the middle of the sharpest bend.
    point_at_min : (S, 3) float64
    utilisation : (S,) float64
        Bending stress over the allowable stress, which is the strength divided by the safety factor of the material:
        least admissible radius over least radius.  Above 1 the allowable stress is exceeded.
    largest_diameter : (S,) float64
        The thickest rod that would bear the same bend.
    """

    window: float
    min_radius: Floats
    station_at_min: Floats
    point_at_min: Floats
    utilisation: Floats
    largest_diameter: Floats

    def __post_init__(self) -> None:
        n = len(self.min_radius)
        for name, shape in (
            ("min_radius", (n,)),
            ("station_at_min", (n,)),
            ("point_at_min", (n, 3)),
            ("utilisation", (n,)),
            ("largest_diameter", (n,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64, shape))

    @property
    def violations(self) -> Ints:
        """Strands that are bent too sharply, the worst first."""
        over = np.flatnonzero(self.utilisation > 1.0)
        return over[np.argsort(-self.utilisation[over], kind="stable")]
