"""What a cable tie carries; without NumPy, for the command's help.

The force at which the loop of a tie may open is its *loop tensile strength*, which makers declare and test as IEC 62275
(UL 62275) says.  Ties of polyamide 6.6 are sold by width, and what they carry hardly differs between makers.
"""

from __future__ import annotations

from dataclasses import dataclass

from weavecore.errors import Unsupported

_STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class CableTie:
    """A kind of cable tie.

    Parameters
    ----------
    width : float
        In millimetres.
    strength : float
        Loop tensile strength in N.
    """

    width: float
    strength: float


CABLE_TIES = tuple(
    CableTie(width, float(round(kilograms * _STANDARD_GRAVITY)))
    for width, kilograms in ((2.5, 8.1), (3.6, 18.2), (4.8, 22.2), (7.6, 54.4))
)
"""Polyamide 6.6 by width, from kilograms to whole newtons: https://www.cableties-online.co.uk/blog/how-strong-are-cable-ties."""

DEFAULT_TIE = CABLE_TIES[0]
"""The narrowest: what it carries, all carry."""


def checked_tie_strength(strength: float) -> float:
    """The strength of a tie in N.

    Parameters
    ----------
    strength : float

    Raises
    ------
    Unsupported
        Where it is not positive.
    """
    if not 0 < strength < float("inf"):
        known = ", ".join(f"{tie.width:g} mm: {tie.strength:.0f} N" for tie in CABLE_TIES)
        raise Unsupported(
            f"The strength of a tie must be positive (got {strength:g} N)",
            remedy=f"Cable ties carry, by width: {known}.",
        )
    return strength
