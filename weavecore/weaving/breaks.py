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

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.model.rod_ends import FEWEST_JOINTS
from weavecore.model.strands import Strands
from weavecore.polling import each


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
    nodes: list[Ints] = []
    family: list[int] = []
    closed: list[bool] = []
    for s in each(range(len(strands))):
        path, at = strands.strand(s), np.flatnonzero(breaks[strands.offsets[s] : strands.offsets[s + 1]])
        is_closed = bool(strands.closed[s]) and len(at) == 0
        if strands.closed[s] and len(at):
            path, at = np.append(np.roll(path, -at[0]), path[at[0]]), at[1:] - at[0]
        starts, stops = np.concatenate([[0], at]), np.append(at, len(path) - 1)
        pieces = [path[a : b + 1] for a, b in zip(starts.tolist(), stops.tolist())]
        nodes += pieces
        family += [int(strands.family[s])] * len(pieces)
        closed += [is_closed] * len(pieces)
    return Strands(
        offsets_of([len(piece) for piece in nodes]),
        np.concatenate([*nodes, np.zeros(0, np.int64)]),
        np.array(family, np.int64),
        np.array(closed, bool),
    )
