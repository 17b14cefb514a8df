"""Units of length: Rhino's names for them, and lengths as people type them.

A *typed length* is a number with or without a suffix: ``120``, ``120mm``, ``4.7in``, ``0.12 m``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Optional

from weavecore.errors import Unsupported

NO_UNIT = "None"

METRES = {
    "Angstroms": 1e-10,
    "Nanometers": 1e-9,
    "Microns": 1e-6,
    "Millimeters": 1e-3,
    "Centimeters": 1e-2,
    "Decimeters": 1e-1,
    "Meters": 1.0,
    "Dekameters": 1e1,
    "Hectometers": 1e2,
    "Kilometers": 1e3,
    "Megameters": 1e6,
    "Gigameters": 1e9,
    "Microinches": 2.54e-8,
    "Mils": 2.54e-5,
    "Inches": 0.0254,
    "Feet": 0.3048,
    "Yards": 0.9144,
    "Miles": 1609.344,
    "PrinterPoints": 0.0254 / 72,
    "PrinterPicas": 0.0254 / 6,
    "NauticalMiles": 1852.0,
}
"""Metres in one of each of Rhino's units of length."""

SUFFIXES = {
    "mm": "Millimeters",
    "cm": "Centimeters",
    "dm": "Decimeters",
    "m": "Meters",
    "km": "Kilometers",
    "um": "Microns",
    "µm": "Microns",
    "mil": "Mils",
    "in": "Inches",
    '"': "Inches",
    "ft": "Feet",
    "'": "Feet",
    "yd": "Yards",
}
"""What may follow a typed length."""

_LEAST, _GREATEST = 1e-50, 1e50
"""Of lengths: squares, cubes and quotients of these are finite, and above 0."""

_SHORT = {name: suffix for suffix, name in reversed(SUFFIXES.items())}
_TYPED = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s.]*)\s*")


@dataclass(frozen=True)
class Length:
    """A typed length: a value, and the Rhino name of its unit, or "" for the file's own."""

    value: float
    unit: str = ""

    def __str__(self) -> str:
        return with_unit(self.value, self.unit, digits=12)

    def in_unit(self, unit: str) -> float:
        """The value in the unit of a file.

        Raises
        ------
        Unsupported
            Where the length has a unit and the file has none that is known.
        """
        if not self.unit or self.unit == unit:
            return self.value
        if unit not in METRES:
            raise Unsupported(
                f"The file states no unit, so {self} cannot be converted",
                remedy="Give the length as a plain number in the file's own unit.",
            )
        # One rounding less than by way of metres: 120 mm in Meters is 0.12 to the last bit.
        return self.value / (METRES[unit] / METRES[self.unit])


@dataclass(frozen=True)
class Lengths:
    """Several typed lengths, one at least."""

    lengths: tuple[Length, ...]

    @property
    def least(self) -> Length:
        """The one with the least value."""
        return min(self.lengths, key=lambda length: length.value * METRES.get(length.unit, 1.0))

    def in_unit(self, unit: str) -> list[float]:
        """The values in the unit of a file; see `Length.in_unit`."""
        return [length.in_unit(unit) for length in self.lengths]


def millimetres_in(unit: str, stated: Optional[str] = None) -> float:
    """Millimetres in one of the units of a file, or, where the file states none, of the unit that the user states.

    Parameters
    ----------
    unit : str
        Rhino's name of the file's unit, or "None".
    stated : str, optional
        A suffix such as ``mm``, or Rhino's name.

    Raises
    ------
    Unsupported
        Where neither is known, or they contradict each other.
    """
    name = SUFFIXES.get(stated, stated) if stated else None
    if name is not None and name not in METRES:
        raise Unsupported(f"Unknown unit {stated!r}", remedy=f"Take one of: {', '.join(SUFFIXES)}.")
    if unit in METRES and name not in (None, unit):
        raise Unsupported(f"The result is in {unit}, not in {name}", remedy="Omit the unit.")
    chosen = unit if unit in METRES else name
    if chosen is None:
        raise Unsupported(
            "The result states no unit, and rods are cut in millimetres",
            remedy="Name it: --unit mm, unit='mm'.",
        )
    return METRES[chosen] / METRES["Millimeters"]


def parse_length(text: str) -> Length:
    """Read a typed length.

    Parameters
    ----------
    text : str
        A number with or without a suffix of `SUFFIXES`.

    Returns
    -------
    Length

    Raises
    ------
    ValueError
        Where the text is not a number, is not above 0, or has a suffix that is not in `SUFFIXES`.
    """
    match = _TYPED.fullmatch(text)
    if not match:
        raise ValueError(f"{text!r} is not a length; write a number such as 120, 120mm or 4.7in")
    number, suffix = float(match[1]), match[2]
    if suffix and suffix not in SUFFIXES:
        raise ValueError(f"{suffix!r} in {text!r} is not a known unit; known are {', '.join(SUFFIXES)}")
    if not 0 < number < float("inf"):
        raise ValueError(f"{text!r} must be above 0")
    if not _LEAST <= number <= _GREATEST:
        raise ValueError(f"{text!r} must be between {_LEAST:g} and {_GREATEST:g}")
    return Length(number, SUFFIXES.get(suffix, ""))


def check_length(length: Optional[float], what: str) -> None:
    """Refuse a length so small or large that areas and counts made from it are not finite.

    Parameters
    ----------
    length : float or None
        In any unit; what is not positive or not finite is left to those who use it.
    what : str
        What it is, for the error.

    Raises
    ------
    Unsupported
    """
    if length is not None and (0 < length < _LEAST or _GREATEST < length < float("inf")):
        raise Unsupported(
            f"{what} must be between {_LEAST:g} and {_GREATEST:g} (got {length:g})", remedy="Check the number."
        )


def with_unit(length: float, unit: str, *, digits: int = 5) -> str:
    """Write a length for a person to read.

    Parameters
    ----------
    length : float
    unit : str
        Rhino's name; "" or "None" where there is none.
    digits : int
        Significant digits.

    Returns
    -------
    str
        With the suffix of the unit, or the unit's name where it has no suffix.
    """
    name = "" if unit in ("", NO_UNIT) else _SHORT.get(unit, unit.lower())
    return f"{length:,.{digits}g} {name}".rstrip()
