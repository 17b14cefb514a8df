"""How much memory it takes to simulate a weave, estimated before it starts: linear in the points along the rods."""

from __future__ import annotations

from weavecore.errors import TooMuchWork
from weavecore.model import Weave

MOST_POINTS = 150_000
"""Points along rods: a sample with 12,360 takes 280 MB more than none, so these take some 3 GB."""


def check_work(weave: Weave, segments: int) -> None:
    """Refuse a weave with more points along its rods than the memory of a usual computer holds.

    Parameters
    ----------
    weave : Weave
    segments : int
        Straight segments between two joints.

    Raises
    ------
    TooMuchWork
    """
    points = weave.lattice.n_edges * segments
    if points > MOST_POINTS:
        raise TooMuchWork(
            f"{weave.lattice.n_edges:,} edges of {segments} segments have about {points:,} points, more than "
            f"{MOST_POINTS:,}",
            remedy="Use fewer segments, or weave with a larger spacing.",
        )
