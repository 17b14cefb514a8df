r"""Where rods are broken because they cannot be bent into their place.

A basket maker breaks a rod at a hairpin: two rods cross at the node and run past it by an overhang::

         \   /                    \   /
          \ /                      X            both go on straight
           V     one rod           / \          and are tied where they cross

A rod that bends too sharply at several nodes in a row is broken at the sharpest of them, first only where both pieces
keep enough joints to hold them.  Greedy over the visits of a rod, the sharpest first: O(M log M).
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, ranks_in_rows
from weavecore.model.rod_ends import FEWEST_JOINTS
from weavecore.model.strands import Strands


def find_breaks(strands: Strands, largest: Floats, diameters: Floats, *, fewest: int = FEWEST_JOINTS) -> Bools:
    """Visits (M,) at which rods of their diameters are to be broken.

    Parameters
    ----------
    strands : Strands
    largest : (M,) float64
        The largest diameter that can be bent as the rod is at each visit.
    diameters : (S,) float64
        Of the rods, in the same unit.
    fewest : int
        No piece is left with fewer joints.
    """
    breaks = np.zeros(len(largest), bool)
    too_sharp = largest < np.repeat(diameters, np.diff(strands.offsets))
    for s in np.unique(np.searchsorted(strands.offsets, np.flatnonzero(too_sharp), side="right") - 1).tolist():
        part = slice(strands.offsets[s], strands.offsets[s + 1])
        breaks[part] = _breaks_of_rod(largest[part], too_sharp[part], bool(strands.closed[s]), fewest - 1)
    return breaks


def _breaks_of_rod(largest: Floats, too_sharp: Bools, closed: bool, reach: int) -> Bools:
    """The sharpest visits first, each far enough from the ends of the rod and from the breaks before it."""
    n = len(largest)
    breaks = np.zeros(n, bool)
    free = too_sharp.copy()
    if not closed:
        free[:reach] = free[n - reach :] = False
    elif n <= reach:
        return breaks
    for k in np.argsort(largest, kind="stable").tolist():
        if not too_sharp[k]:
            break
        if free[k]:
            breaks[k] = True
            near = np.arange(k - reach + 1, k + reach)
            free[near % n if closed else near[(near >= 0) & (near < n)]] = False
    return breaks


def break_strands(strands: Strands, breaks: Bools) -> Strands:
    """The same strands, each broken at the marked visits; the node of a break belongs to both pieces.

    Parameters
    ----------
    strands : Strands
    breaks : (M,) bool
        By the visits of ``strands.nodes``.

    Returns
    -------
    Strands
        The pieces of a strand follow one another in its place; a closed strand that is broken once becomes open.
    """
    n_visits = np.diff(strands.offsets)
    is_broken = np.zeros(len(strands), bool)
    is_broken[strands.owner[breaks]] = True
    is_opened = strands.closed & is_broken
    # An opened ring begins and ends at its first break.
    marked = np.flatnonzero(breaks)
    first = np.zeros(len(strands), np.int64)
    first[strands.owner[marked[::-1]]] = marked[::-1] - strands.offsets[strands.owner[marked[::-1]]]
    first[~is_opened] = 0
    length = n_visits + is_opened
    row, rank = np.repeat(np.arange(len(strands)), length), ranks_in_rows(length)
    visit = strands.offsets[row] + (first[row] + rank) % n_visits[row]
    parts = breaks[visit] & (rank > 0) & (rank < length[row] - 1)
    # The node of a break is the last of one piece and the first of the next.
    begins = (np.cumsum(1 + parts) - 1)[parts | (rank == 0)]
    counts = 1 + np.bincount(row, parts, len(strands)).astype(np.int64)
    return Strands(
        np.append(begins, len(visit) + parts.sum()),
        strands.nodes[np.repeat(visit, 1 + parts)],
        np.repeat(strands.family, counts),
        np.repeat(strands.closed & ~is_broken, counts),
    )
