"""`Bending`: how sharply each rod is bent; `Material`: how sharply it may be bent.

A straight rod of diameter d, bent to radius R, has the stress E d / (2 R), which may reach σ / factor::

    R ≥ d · E · factor / (2 σ) = d · least_bend          utilisation = least admissible R / R
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, frozen


@dataclass(frozen=True, eq=False)
class Bending:
    """The sharpest bend of every rod, in the model's unit.

    The radius is that of the axis at one point.

    Parameters
    ----------
    min_radius : (S,) float64
        Infinite for a straight rod.
    station_at_min : (S,) float64
        Arc length from the start of the strand to the middle of the sharpest bend.
    point_at_min : (S, 3) float64
    utilisation : (S,) float64
        Bending stress over allowable stress: least allowed radius over least radius.
    largest_diameter : (S,) float64
        The thickest rod that passes in its place, its larger shifts at the ties included, if all rods grow in
        proportion; infinite where any passes.
    """

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
        """Strands beyond a utilisation of 1, the worst first."""
        over = np.flatnonzero(self.utilisation > 1.0)
        return over[np.argsort(-self.utilisation[over], kind="stable")]


@dataclass(frozen=True)
class Material:
    """An elastic material of rods or strips.

    Parameters
    ----------
    name : str
    modulus : float
        Young's modulus in GPa.
    strength : float
        Characteristic bending strength in MPa.
    factor : float
        Safety factor that the strength is divided by: 2 for a short time, 3 for a permanent bend.
    density : float
        In kg/m³; 0 where it is not known.
    source : str
        Where the figures come from.
    """

    name: str
    modulus: float
    strength: float
    factor: float = 3.0
    density: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for label in ("modulus", "strength", "factor"):
            value = getattr(self, label)
            if not 0 < value < float("inf"):
                raise Unsupported(
                    f"The {label} of {self.name} must be positive (got {value})", remedy=f"Change the {label}."
                )

    @property
    def least_bend(self) -> float:
        """Least admissible radius in diameters of the rod, or thicknesses of the strip: ``E / (2 σ / factor)``."""
        return self.modulus * 1000.0 * self.factor / (2.0 * self.strength)
