"""Taking the intersections of the children apart: regrouping (Yan et al. 2016, §4.3 and §4.4).

Where A_i A_i+1 crosses A_j A_j+1 the curve goes on from A_i to A_j+1 and from A_j to A_i+1: one
polyline becomes two where it crossed itself, two become one where they crossed each other.
Both are the same exchange of followers.  It is made at the very place of the crossing, so
that no new segment comes up that could cross others: each exchange takes one crossing away and
adds none, and the process ends after as many exchanges as there were crossings, in any order.

What comes out are simple loops.  Of the two strands at a crossing one has turned left and one right.
Counting how many times the fronts lie on one's right, the place left of the first strand is one
higher than the place left of the second; so the loops that hang together by crossings have
*heights*, and those that bound what no front has covered yet are all equally high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cycles import order_cycles
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.meeting import Meetings


@dataclass(frozen=True, eq=False)
class Regrouped:
    """Simple loops, and how they hung together.

    Parameters
    ----------
    curves : Curves
    group : (C,) int64
        Loops that hung together by crossings have the same.
    height : (C,) int64
        Within its group: how many more fronts lie on the right of a loop than of others.
    segment : (m,) int64
        The segment of the raw curves that each segment is a part of.
    first, last : (m,) float64
        Which part of it.
    """

    curves: Curves
    group: Ints
    height: Ints
    segment: Ints
    first: Floats
    last: Floats


def regroup(ground: Ground, raw: Curves, meetings: Meetings) -> Regrouped:
    """Exchange followers at every crossing.

    Parameters
    ----------
    raw : Curves
    meetings : Meetings
        All crossings of the raw curves.
    """
    n, k = len(raw.face), len(meetings)
    # Each crossing cuts two segments; cut 2k lies on the first, cut 2k + 1 on the second.
    cut_segment = np.stack([meetings.first, meetings.second], axis=1).ravel()
    cut_place = np.stack([meetings.on_first, meetings.on_second], axis=1).ravel()
    order = np.lexsort((cut_place, cut_segment))
    counts = np.bincount(cut_segment, minlength=n) + 1
    offsets = offsets_of(counts)
    segment = rows_of(offsets)
    # The piece that begins at each cut, and the cut with which each piece begins.
    begins = np.empty(2 * k, np.int64)
    begins[order] = offsets[cut_segment[order]] + 1 + np.arange(2 * k) - offsets_of(counts - 1)[cut_segment[order]]
    is_cut = np.zeros(len(segment), bool)
    is_cut[begins] = True
    first = np.zeros(len(segment))
    first[begins] = cut_place
    after = np.arange(1, len(segment) + 1)
    ends_at_node = np.ones(len(segment), bool)
    ends_at_node[begins - 1] = False
    after[ends_at_node] = offsets[next_in_loop(raw.offsets)[segment[ends_at_node]]]
    is_end = np.zeros(len(segment), bool)
    is_end[offsets[raw.offsets[1:][~raw.closed] - 1]] = True
    last = np.ones(len(segment))
    last[begins - 1] = cut_place
    partner = np.arange(2 * k) ^ 1
    after[begins - 1] = begins[partner]
    start = raw.start[segment] * (1 - first)[:, None] + raw.end[segment] * first[:, None]
    # Both strands at a crossing pass the same place, to the last bit.
    start[begins[1::2]] = start[begins[0::2]]
    end = raw.end[segment].copy()
    end[begins - 1] = start[begins]

    loop_order, loop_offsets, closed = _order_loops(after, is_end)
    loop = np.empty(len(segment), np.int64)
    loop[loop_order] = rows_of(loop_offsets)
    group, height = _heights(loop, begins, meetings, len(loop_offsets) - 1)
    curves = Curves(
        loop_offsets,
        closed,
        raw.face[segment][loop_order],
        start[loop_order],
        end[loop_order],
        (is_cut | raw.is_vertex[segment])[loop_order],
        is_cut[loop_order],
        ground.points(raw.face[segment], start)[loop_order],
    )
    return Regrouped(curves, group, height, segment[loop_order], first[loop_order], last[loop_order])


def _order_loops(after: Ints, is_end: Bools) -> tuple[Ints, Ints, Bools]:
    """Pieces in order, the offsets of the loops, and which are closed: behind an end begins an open one."""
    order, offsets = order_cycles(after)
    if not is_end.any():
        return order, offsets, np.ones(len(offsets) - 1, bool)
    cycle, row = rows_of(offsets), np.arange(len(order))
    first = offsets[:-1].copy()
    ends = np.flatnonzero(is_end[order])
    first[cycle[ends]] = ends + 1
    turned = np.lexsort(((row - first[cycle]) % np.diff(offsets)[cycle], cycle))
    order = order[turned]
    heads = np.unique(np.concatenate([offsets[:-1], np.flatnonzero(is_end[order]) + 1]))
    offsets = heads[heads < len(order)]
    offsets = np.append(offsets, len(order)).astype(np.int64)
    return order, offsets, ~is_end[order[offsets[1:] - 1]]


def _heights(loop: Ints, begins: Ints, meetings: Meetings, n_loops: int) -> tuple[Ints, Ints]:
    """Group and height of every loop.

    The strand that comes in on the first segment and goes out on the second has turned left where
    the second runs to the left of the first: it is the higher one.
    """
    in_first = loop[begins[0::2] - 1]
    in_second = loop[begins[1::2] - 1]
    high = np.where(meetings.turns_left, in_first, in_second)
    low = np.where(meetings.turns_left, in_second, in_first)
    links = coo_matrix((np.ones(len(high)), (high, low)), shape=(n_loops, n_loops)).tocsr()
    _, group = connected_components(links, directed=False)
    rise = {}
    for a, b in zip(high.tolist(), low.tolist()):
        rise[a, b], rise[b, a] = 1, -1
    height = np.zeros(n_loops, np.int64)
    _, roots, sizes = np.unique(group, return_index=True, return_counts=True)
    for root in roots[sizes > 1].tolist():
        walk, before = breadth_first_order(links, root, directed=False)
        for at in walk[1:].tolist():
            height[at] = height[before[at]] + rise[int(at), int(before[at])]
    return group.astype(np.int64), height


def lengths_of(curves: Curves) -> Floats:
    """(C,) length of each curve."""
    return np.bincount(curves.owner, curves.lengths, minlength=len(curves)).astype(np.float64)
