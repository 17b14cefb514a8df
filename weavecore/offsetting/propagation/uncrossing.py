r"""Uncrossing: curves are reconnected at their intersections until none is left (Yan et al. 2016, §4.3 and §4.4).

Where A_i A_i+1 crosses A_j A_j+1, A_i is connected to A_j+1 and A_j to A_i+1.  A polyline that crossed itself becomes
two (§4.3, disentangle the self-intersections), two that crossed each other become one (§4.4, mutual intersections);
both are the same exchange of followers::

    A_i       A_j+1         A_i \     / A_j+1
        \   /                    '---'
          x       becomes        .---.
        /   \                   /     \
    A_j       A_i+1         A_j         A_i+1

The exchange is made at the crossing x itself: the paper's new segment from A_i to A_j+1 might cross others, while this
adds none.  So each exchange takes one crossing away, and all are made at once: the order does not matter.

What comes out are simple loops.  Of the two branches at a crossing one turns left and one right.  The *winding number*
of a place counts how many of the fronts it has on the right (Alexander 1928; the exchange is Seifert's smoothing of a
crossing).  Left of the branch that turns left it is one higher than left of the other.  So the loops of one tangle
have relative winding numbers, and those that bound what no front has swept all have the same.

The time is linear in segments and crossings, apart from sorting the crossings along the curves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, order_cycles, rows_of
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import Intersections
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves


@dataclass(frozen=True, eq=False)
class UncrossedCurves:
    """Simple curves, and how they hung together.

    Parameters
    ----------
    curves : SurfaceCurves
        C of them, of m segments.
    group : (C,) int64
        Curves that hung together by crossings have the same.
    winding : (C,) int64
        Relative winding number in the group: how many more fronts lie on the right of a curve than of others.
    segment : (m,) int64
        The segment of the raw curves that each segment is a piece of.
    first, last : (m,) float64
        From which part of that segment to which, in 0 to 1.
    """

    curves: SurfaceCurves
    group: Ints
    winding: Ints
    segment: Ints
    first: Floats
    last: Floats


def reconnect_at_crossings(domain: Domain, raw: SurfaceCurves, crossings: Intersections) -> UncrossedCurves:
    """Exchange the followers at every crossing (§4.3, §4.4).

    Parameters
    ----------
    domain : Domain
    raw : SurfaceCurves
    crossings : Intersections
        Of the raw curves.  Those that are left out stay.

    Returns
    -------
    UncrossedCurves
        The order is that of their least pieces along the raw curves.
    """
    pieces = _cut_at_crossings(raw, crossings)
    segment, first, last = pieces.segment, pieces.first, pieces.last
    start = raw.start[segment] * (1 - first)[:, None] + raw.end[segment] * first[:, None]
    # Both branches at a crossing pass the same place, to the last bit.
    start[pieces.begins[1::2]] = start[pieces.begins[0::2]]
    end = raw.end[segment].copy()
    end[pieces.begins - 1] = start[pieces.begins]
    order, offsets, closed = _order_pieces(pieces.after, pieces.is_end)
    curve = np.empty(len(segment), np.int64)
    curve[order] = rows_of(offsets)
    group, winding = _find_windings(curve, pieces.begins, crossings, len(offsets) - 1)
    is_cut = np.zeros(len(segment), bool)
    is_cut[pieces.begins] = True
    curves = SurfaceCurves(
        offsets=offsets,
        closed=closed,
        face=raw.face[segment][order],
        start=start[order],
        end=end[order],
        is_vertex=(is_cut | raw.is_vertex[segment])[order],
        is_corner=is_cut[order],
        points=domain.points(raw.face[segment], start)[order],
    )
    return UncrossedCurves(curves, group, winding, segment[order], first[order], last[order])


@dataclass(frozen=True, eq=False)
class _SegmentPieces:
    """Pieces of segments between crossings, along the raw curves.

    Crossing k cuts two segments: cut 2k lies on the first, cut 2k + 1 on the second.

    Parameters
    ----------
    segment : (p,) int64
        The segment of each piece.
    first, last : (p,) float64
        From which part of it to which.
    begins : (2k,) int64
        The piece that begins at each cut; the one before it ends there.
    after : (p,) int64
        The next piece, once all crossings have been reconnected.  That of an open curve's end is the curve's start.
    is_end : (p,) bool
        Ends of open curves.
    """

    segment: Ints
    first: Floats
    last: Floats
    begins: Ints
    after: Ints
    is_end: Bools


def _cut_at_crossings(raw: SurfaceCurves, crossings: Intersections) -> _SegmentPieces:
    n, k = len(raw.face), len(crossings)
    cut_segment = np.stack([crossings.first, crossings.second], axis=1).ravel()
    cut_part = np.stack([crossings.on_first, crossings.on_second], axis=1).ravel()
    order = np.lexsort((cut_part, cut_segment))
    counts = np.bincount(cut_segment, minlength=n) + 1
    offsets = offsets_of(counts)
    segment = rows_of(offsets)
    begins = np.empty(2 * k, np.int64)
    rank = np.arange(2 * k) - offsets_of(counts - 1)[cut_segment[order]]
    begins[order] = offsets[cut_segment[order]] + 1 + rank
    first, last = np.zeros(len(segment)), np.ones(len(segment))
    first[begins] = last[begins - 1] = cut_part
    after = np.arange(1, len(segment) + 1)
    ends_segment = np.ones(len(segment), bool)
    ends_segment[begins - 1] = False
    after[ends_segment] = offsets[next_in_loop(raw.offsets)[segment[ends_segment]]]
    # The reconnection of §4.3 and §4.4: what comes in on one segment goes out on the other.
    after[begins - 1] = begins[np.arange(2 * k) ^ 1]
    is_end = np.zeros(len(segment), bool)
    is_end[offsets[raw.offsets[1:][~raw.closed] - 1]] = True
    return _SegmentPieces(segment, first, last, begins, after, is_end)


def _order_pieces(after: Ints, is_end: Bools) -> tuple[Ints, Ints, Bools]:
    """Pieces (p,) in order, offsets (C+1,) of the curves, and which are closed: an open one begins behind an end."""
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


def _find_windings(curve: Ints, begins: Ints, crossings: Intersections, n_curves: int) -> tuple[Ints, Ints]:
    """Group and relative winding number of every curve (C,), spread over the crossings from one curve of each group.

    The branch that comes in on the first segment and goes out on the second turns left where the second runs to the
    left of the first: the curve that it belongs to is the higher one.
    """
    in_first = curve[begins[0::2] - 1]
    in_second = curve[begins[1::2] - 1]
    high = np.where(crossings.turns_left, in_first, in_second)
    low = np.where(crossings.turns_left, in_second, in_first)
    links = coo_matrix((np.ones(len(high)), (high, low)), shape=(n_curves, n_curves)).tocsr()
    _, group = connected_components(links, directed=False)
    rise = {}
    for a, b in zip(high.tolist(), low.tolist()):
        rise[a, b], rise[b, a] = 1, -1
    winding = np.zeros(n_curves, np.int64)
    _, roots, sizes = np.unique(group, return_index=True, return_counts=True)
    for root in roots[sizes > 1].tolist():
        walk, before = breadth_first_order(links, root, directed=False)
        for at in walk[1:].tolist():
            winding[at] = winding[before[at]] + rise[int(at), int(before[at])]
    return group.astype(np.int64), winding
