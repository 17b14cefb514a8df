"""How much work it is to fabricate a weave, estimated before it starts.

Rods of diameter d and of length L in all are sampled at L / (2 d) points to rate places for splices, and cut from
stock of length s into L / s pieces at least.
"""

from __future__ import annotations

from weavecore.errors import TooMuchWork
from weavecore.fabricating.plan import STEP_IN_DIAMETERS
from weavecore.model import Weave
from weavecore.texts import rough_count

MOST_SAMPLES = 5_000_000
"""Points along rods, each of which takes some arrays of doubles: more would take gigabytes."""

MOST_PIECES = 50_000
"""Pieces of stock: each is a row of tables and a strip of the templates."""


def check_work(weave: Weave, *, scale: float, stock: float) -> None:
    """Refuse a weave that would take minutes or gigabytes to fabricate.

    Parameters
    ----------
    weave : Weave
    scale : float
        Millimetres in one unit of the weave.
    stock : float
        Length of the bars in millimetres.

    Raises
    ------
    TooMuchWork
    """
    length = float(weave.axes.lengths.sum())
    samples = float((weave.axes.lengths / weave.diameters).sum()) / STEP_IN_DIAMETERS
    if samples > MOST_SAMPLES:
        least = length / (STEP_IN_DIAMETERS * MOST_SAMPLES)
        raise TooMuchWork(
            f"Rods of diameter {weave.diameters.min():.4g} and {length:.4g} long in all would be measured at about "
            f"{rough_count(samples)} points, more than {MOST_SAMPLES:,}",
            remedy=f"Weave with a diameter of at least {least:.3g}, or check the unit.",
        )
    pieces = length * scale / stock
    if pieces > MOST_PIECES:
        raise TooMuchWork(
            f"Rods of {length * scale:.4g} mm in all would be cut into about {rough_count(pieces)} pieces of stock of "
            f"{stock:.4g} mm, more than {MOST_PIECES:,}",
            remedy="Use longer stock, or check the unit.",
        )
