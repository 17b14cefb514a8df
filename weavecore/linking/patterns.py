"""What a pattern asks of the division of the rings and of the links between them.

A pattern is data, not code: a new one is a new entry in `PATTERNS`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.errors import Unsupported


@dataclass(frozen=True)
class Pattern:
    """How the nodes of neighbouring rings lie to each other and which cells are between them.

    Parameters
    ----------
    name : str
    edge_per_spacing : float
        Default edge length as a multiple of the spacing.
    child_phase : float
        Where a child's node lies over an edge of its parent, as a part of that edge: 0.5 over the middle, 0 in
        line with its first node.
    count_multiple : int
        Every ring has a multiple of this many nodes.
    count_tolerance : float
        Counts are chosen together, so that few rods end, within this factor of the edge length that was asked for;
        1 where each ring is counted for itself.
    jump_cost : float
        What a change of the count from ring to ring costs besides the rods that end there, in such rods: above 0 where
        a few large changes are better than many small ones.
    balances_splits : bool
        Whether counts are chosen together across bands in which rings split or merge (`ring_counts`).
    has_diagonals : bool
        Whether cells between two rings are triangles; if not they are quads wherever the counts agree.
    even_cells : bool
        Whether every cell between two rings has an even number of sides, so that rods can go over and under
        alternately.  Links are then left out two at a time.
    """

    name: str
    edge_per_spacing: float
    child_phase: float
    count_multiple: int
    count_tolerance: float
    jump_cost: float
    balances_splits: bool
    has_diagonals: bool
    even_cells: bool


PATTERNS = {
    pattern.name: pattern
    for pattern in (
        # Equilateral triangles of edge a have rows of height a·√3/2.
        Pattern(
            "triangular",
            edge_per_spacing=2.0 / np.sqrt(3.0),
            child_phase=0.5,
            count_multiple=1,
            count_tolerance=1.4,
            jump_cost=0.0,
            balances_splits=False,
            has_diagonals=True,
            even_cells=False,
        ),
        # Only a ring with an even count closes in a plain weave: over, under, over…
        Pattern(
            "quad",
            edge_per_spacing=1.0,
            child_phase=0.0,
            count_multiple=2,
            count_tolerance=1.4,
            jump_cost=1.0,
            balances_splits=False,
            has_diagonals=False,
            even_cells=True,
        ),
    )
}
PATTERNS["plain"] = replace(PATTERNS["quad"], name="plain")
# Only a ring of a multiple of four nodes closes in a twill of over two, under two.
PATTERNS["twill"] = replace(PATTERNS["quad"], name="twill", count_multiple=4, even_cells=False)


def pattern_named(name: str) -> Pattern:
    """The pattern of that name.

    Parameters
    ----------
    name : str
        A key of `PATTERNS`.

    Raises
    ------
    Unsupported
        When there is none.
    """
    if name not in PATTERNS:
        raise Unsupported(f"Unknown pattern {name!r}", remedy=f"Choose one of: {', '.join(sorted(PATTERNS))}.")
    return PATTERNS[name]
