"""How much work it is to compare rods with each other (`clearance`), estimated before they are laid.

Rods of diameter d and of length L in all are compared as 2 L/d straight pieces.  Spread over a surface of area A,
each has 2 L/d · π (1.5 d)²/A others in reach.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import TooMuchWork

PIECES_PER_DIAMETER = 2
"""Straight pieces of an axis on the length of a diameter."""

MOST_PIECES = 2_500_000
"""Straight pieces that are compared: each takes 500 bytes and 6 µs."""

MOST_PAIRS = 4_000_000
"""Pairs of pieces that are near each other: each takes 400 bytes."""


def check_work(length: float, n_edges: int, area: float, rod_diameter: float) -> None:
    """Refuse a diameter at which `find_clashes` would compare too many pieces.

    Parameters
    ----------
    length : float
        Of all edges that rods run along.
    n_edges : int
    area : float
        Of the surface.
    rod_diameter : float
        In the model's unit.

    Raises
    ------
    TooMuchWork
        Where rods are very thin for their length, or so thick that each lies in many others.
    """
    pieces = max(PIECES_PER_DIAMETER * length / rod_diameter, n_edges)
    if pieces > MOST_PIECES:
        least = PIECES_PER_DIAMETER * length / MOST_PIECES
        raise TooMuchWork(
            f"Rods of {rod_diameter:.4g} and {length:.4g} long in all would be compared in {pieces:,.0f} pieces, "
            f"more than {MOST_PIECES:,}",
            remedy=f"Use a diameter of at least {least:.3g}, or check the unit.",
        )
    reach = rod_diameter * (1.0 + 1.0 / PIECES_PER_DIAMETER)
    pairs = pieces**2 / 2 * min(1.0, np.pi * reach**2 / area)
    if pairs > MOST_PAIRS or rod_diameter**2 > area:
        raise TooMuchWork(
            f"Rods of {rod_diameter:.4g} on a surface of {area:.4g} square units would be too near each other at "
            f"about {pairs:,.0f} places",
            remedy="Use a smaller diameter or a larger spacing, or check the unit.",
        )
