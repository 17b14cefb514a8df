"""`Material`: what a rod is made of, as far as its bending goes."""

from __future__ import annotations

from dataclasses import dataclass

from weavecore.errors import Unsupported


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
        What the strength is divided by; 2 for a bend that is held shortly, 3 for one that stays.
    density : float
        In kg/m³.
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
                raise Unsupported(f"The {label} of {self.name} is {value}", remedy="Give a number above 0.")

    @property
    def least_bend(self) -> float:
        """Least admissible radius in diameters of the rod, or thicknesses of the strip: ``E / (2 σ / factor)``."""
        return self.modulus * 1000.0 * self.factor / (2.0 * self.strength)
