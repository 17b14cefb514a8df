"""What a pattern asks of the division and of the links between two rings.

A pattern is data, not code: a new one is a new entry in `PATTERNS`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.errors import Unsupported


@dataclass(frozen=True)
class Pattern:
    """How rings line up and which cells lie between them.

    Parameters
    ----------
    name : str
    edge_per_spacing : float
        The edge length that goes best with a spacing, over that spacing: it gives either where only the other is
        asked for.
    child_sits : float
        Where a child's node sits above an edge of its parent: 0.5 above the middle, 0 in
        line with a node.
    count_step : int
        Every ring has a multiple of this many nodes.
    count_slack : float
        A child keeps the count of its parent while its edges are within this factor of the
        edge length that was asked for; 1 where each ring is counted for itself.
    has_diagonals : bool
        Whether cells between two rings are triangles; else they are quads wherever the
        counts agree.
    in_pairs : bool
        Whether links are left out two at a time, so that every cell between two rings has an even
        number of sides and rods can go over and under in turn.
    """

    name: str
    edge_per_spacing: float
    child_sits: float
    count_step: int
    count_slack: float
    has_diagonals: bool
    in_pairs: bool


PATTERNS = {
    pattern.name: pattern
    for pattern in (
        Pattern(
            "triangular",
            edge_per_spacing=2.0 / np.sqrt(3.0),
            child_sits=0.5,
            count_step=1,
            count_slack=1.0,
            has_diagonals=True,
            in_pairs=False,
        ),
        # Even rings can be woven plainly: over, under, over…
        Pattern(
            "quad",
            edge_per_spacing=1.0,
            child_sits=0.0,
            count_step=2,
            count_slack=1.35,
            has_diagonals=False,
            in_pairs=True,
        ),
    )
}
PATTERNS["plain"] = replace(PATTERNS["quad"], name="plain")
# Rings of a multiple of four nodes close in a twill of over two, under two.
PATTERNS["twill"] = replace(PATTERNS["quad"], name="twill", count_step=4, in_pairs=False)


def pattern_named(name: str) -> Pattern:
    """The pattern of that name.

    Raises
    ------
    Unsupported
        When there is none.
    """
    if name not in PATTERNS:
        raise Unsupported(f"There is no pattern {name!r}", remedy=f"Take one of: {', '.join(sorted(PATTERNS))}.")
    return PATTERNS[name]
