"""How much work it is to compare rods with each other (`clearance`), estimated before they are laid.

Rods of diameter d and of length L in all are first compared in n runs of `LARGEST_RUN` pieces, one an edge at least.
Spread over a surface of area A, each has n π (d + L/n)²/A others in reach.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import TooMuchWork
from weavecore.texts import rough_count

PIECES_PER_DIAMETER = 2
"""Straight pieces of an axis on the length of a diameter."""

LARGEST_RUN = 64
"""Pieces of the runs that are compared first."""

MOST_RUNS = 2_500_000
"""Runs of straight pieces that are compared first: each takes 500 bytes."""

MOST_PAIRS = 4_000_000
"""Pairs of runs that are near each other: each takes 400 bytes."""


def check_work(length: float, n_edges: int, area: float, rod_diameter: float) -> None:
    """Refuse a diameter at which `find_clashes` would compare too many runs of pieces.

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
    runs = max(PIECES_PER_DIAMETER * length / rod_diameter / LARGEST_RUN, n_edges)
    if runs > MOST_RUNS:
        least = PIECES_PER_DIAMETER * length / LARGEST_RUN / MOST_RUNS
        raise TooMuchWork(
            f"Rods of {rod_diameter:.4g} and {length:.4g} long in all would be compared in {rough_count(runs)} parts, "
            f"more than {MOST_RUNS:,}",
            remedy=f"Use a diameter of at least {least:.3g}, or check the unit.",
        )
    reach = rod_diameter + length / max(runs, 1.0)
    pairs = runs**2 / 2 * min(1.0, np.pi * reach**2 / area)
    if pairs > MOST_PAIRS or rod_diameter**2 > area:
        raise TooMuchWork(
            f"Rods of {rod_diameter:.4g} on a surface of {area:.4g} square units would be too near each other at "
            f"about {rough_count(pairs)} places",
            remedy="Use a smaller diameter or a larger spacing, or check the unit.",
        )
