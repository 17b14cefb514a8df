"""All rods end to end, so that what neighbours along a rod share is a shift of an array.

Each rod is a *run* of *places*, a place for each of its nodes; a closed rod goes on for `GHOSTS` places beyond both
ends, with the nodes that follow there::

    places    . . .  a b c d e  f g h  x y z u v w x y z u  . . .
                     open rods         closed: u v w x y z around, with three ghosts at either end

An edge on which no rod goes on is a rod of its own: every edge of the lattice is one *segment*, from a place to the
next.  A place inside a rod is a *joint*.  Arrays over places are (3, Q) or (Q,), coordinates in rows of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, offsets_of, order_cycles, ranges
from weavecore.geometry.matching import ALONE
from weavecore.model.lattice import Lattice
from weavecore.model.rod_pairing import pair_darts
from weavecore.polling import poll

GHOSTS = 3
"""Places beyond the ends of a closed rod, and before the first and after the last of all: as far as stencils reach."""


_PARTNERS: WeakKeyDictionary[Lattice, Ints] = WeakKeyDictionary()
"""The partners of lattices that were asked for them: each is asked several times."""


def partners_of(lattice: Lattice) -> Ints:
    """The dart (2E,) on which a rod goes on from each; see `weavecore.model.rod_pairing.pair_darts`.

    Parameters
    ----------
    lattice : Lattice
    """
    known = _PARTNERS.get(lattice)
    if known is None:
        known = _PARTNERS[lattice] = pair_darts(lattice)
        known.flags.writeable = False
    return known


@dataclass(frozen=True, eq=False)
class RodRuns:
    """The places of all rods.

    Parameters
    ----------
    node : (Q,) int64
        Node of each place; 0 of the `GHOSTS` places at either end of all.
    is_joint : (Q,) bool
        Places where a rod goes on, each joint once.
    is_segment : (Q,) bool
        Whether an edge leads to the next place, each edge once.
    is_ghost, has_next : (Q,) bool
        Ghosts; and places from which an edge leads to the next, those of ghosts too.
    ghost, original : (G,) int64
        The ghosts of closed rods, and the places of the same joints.
    first, last : (C,) int64
        The first and the last joint of each closed rod.
    """

    node: Ints
    is_joint: Bools
    is_segment: Bools
    is_ghost: Bools
    has_next: Bools
    ghost: Ints
    original: Ints
    first: Ints
    last: Ints

    def __len__(self) -> int:
        return len(self.node)


def find_runs(edges: Ints, partner: Ints) -> RodRuns:
    """Set the nodes of all rods end to end.

    Parameters
    ----------
    edges : (E, 2) int64
    partner : (2E,) int64
        The dart on which a rod goes on, as of `weavecore.model.rod_pairing.pair_darts`.

    Returns
    -------
    RodRuns
    """
    darts, offsets, is_closed = _darts_in_order(partner)
    tail, head = edges.ravel(), edges[:, ::-1].ravel()
    n_edges = np.diff(offsets)
    extra = np.where(is_closed, GHOSTS, 0)
    begin = GHOSTS + offsets_of(n_edges + np.where(is_closed, 2 * GHOSTS, 1))
    n = int(begin[-1]) + GHOSTS
    begin = begin[:-1] + extra
    place = ranges(begin, n_edges)
    node, is_joint, is_segment = np.zeros(n, np.int64), np.zeros(n, bool), np.zeros(n, bool)
    node[place], is_joint[place], is_segment[place] = tail[darts], True, True
    is_joint[begin[~is_closed]] = False
    node[(begin + n_edges)[~is_closed]] = head[darts[offsets[1:] - 1]][~is_closed]
    # Around a closed rod, more than once where it is shorter than the ghosts.
    rank, n_joints = np.arange(GHOSTS), n_edges[is_closed][:, None]
    begin = begin[is_closed][:, None]
    ghost = np.concatenate([begin - 1 - rank, begin + n_joints + rank], axis=1).ravel()
    original = np.concatenate([begin + (-1 - rank) % n_joints, begin + rank % n_joints], axis=1).ravel()
    node[ghost] = node[original]
    is_ghost, has_next = np.zeros(n, bool), is_segment.copy()
    is_ghost[ghost] = has_next[ghost] = True
    has_next[ghost[2 * GHOSTS - 1 :: 2 * GHOSTS]] = False
    first, last = begin[:, 0], (begin + n_joints - 1)[:, 0]
    return RodRuns(node, is_joint, is_segment, is_ghost, has_next, ghost, original, first, last)


def _darts_in_order(partner: Ints) -> tuple[Ints, Ints, Bools]:
    """Darts along each rod with their offsets, and whether the rod is closed.

    At its ends a rod is turned around, so that all darts lie in cycles: an open rod in one, there and back, of which
    half is kept; a closed rod in two, of which one is kept.
    """
    poll()
    dart = np.arange(len(partner))
    onward = partner[dart ^ 1]
    order, offsets = order_cycles(np.where(onward == ALONE, dart ^ 1, onward))
    counts = np.diff(offsets)
    cycle = np.repeat(np.arange(len(counts)), counts)
    of_dart = np.empty(len(partner), np.int64)
    of_dart[order] = cycle
    is_start = partner[order] == ALONE
    passed = np.cumsum(is_start)
    passed -= (passed - is_start)[offsets[:-1]][cycle]
    is_closed = np.bincount(cycle, is_start, len(counts)) == 0
    kept = np.where(is_closed[cycle], cycle < of_dart[order ^ 1], passed == 1)
    n_kept = np.bincount(cycle[kept], minlength=len(counts))
    is_rod = n_kept > 0
    return order[kept], offsets_of(n_kept[is_rod]), is_closed[is_rod]
