"""Where curves meet: candidates are the segments in a common face, never all pairs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, order_cycles, rows_of
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.propagation.steps import Rays

_PAIRS_AT_ONCE = 1_000_000


@dataclass(frozen=True, eq=False)
class Meetings:
    """Pairs of segments that cross.

    Parameters
    ----------
    first, second : (k,) int64
    on_first, on_second : (k,) float64
        Where on each, in 0 to 1.
    turns_left : (k,) bool
        Whether the second segment runs to the left of the first.
    """

    first: Ints
    second: Ints
    on_first: Floats
    on_second: Floats
    turns_left: Bools

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def of(cls, parts: list[Meetings]) -> Meetings:
        """One value of several."""
        names = ("first", "second", "on_first", "on_second", "turns_left")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class _Segments:
    """Segments in faces with their places in the plane of the face."""

    def __init__(self, ground: Ground, face: Ints, start: Floats, end: Floats) -> None:
        # Signs are taken of barycentric coordinates: these say exactly what lies on an edge.
        self.face, self.start, self.end = face, start[:, 1:], end[:, 1:]
        self.low = np.minimum(self.start, self.end)
        self.high = np.maximum(self.start, self.end)
        self.flat_start, self.flat_end = ground.flat(face, start), ground.flat(face, end)

    def overlap(self, i: Ints, other: _Segments, j: Ints) -> Bools:
        """Whether the boxes around segments overlap."""
        apart = (self.low[i] > other.high[j]) | (other.low[j] > self.high[i])
        return np.asarray(~apart.any(axis=1))


def meet_themselves(ground: Ground, curves: Curves) -> Meetings:
    """All self-intersections and mutual intersections of curves; each once."""
    segments = _Segments(ground, curves.face, curves.start, curves.end)
    parts = []
    for i, j in _candidates(segments.face, segments.face):
        apart = (i < j) & (curves.after[i] != j) & (curves.after[j] != i)
        parts.append(_meet(segments, i[apart], segments, j[apart]))
    return Meetings.of(parts)


def curves_meet(ground: Ground, curves: Curves, others: Curves) -> Meetings:
    """Where curves cross others."""
    ours = _Segments(ground, curves.face, curves.start, curves.end)
    theirs = _Segments(ground, others.face, others.start, others.end)
    return Meetings.of([_meet(ours, i, theirs, j) for i, j in _candidates(ours.face, theirs.face)])


def rays_meet(ground: Ground, rays: Rays, curves: Curves) -> Meetings:
    """Where rays, named by their segments, cross curves."""
    walks = rays.walks
    ours = _Segments(ground, walks.face, walks.start, walks.end)
    theirs = _Segments(ground, curves.face, curves.start, curves.end)
    return Meetings.of([_meet(ours, i, theirs, j) for i, j in _candidates(ours.face, theirs.face)])


def _meet(one: _Segments, i: Ints, other: _Segments, j: Ints) -> Meetings:
    near = one.overlap(i, other, j)
    i, j = i[near], j[near]
    crosses = _cross(one, i, other, j)
    i, j = i[crosses], j[crosses]
    a, b, c, d = one.start[i], one.end[i], other.start[j], other.end[j]
    on_first, on_second = places_of_crossing(a, b, c, d)
    u, v = b - a, d - c
    return Meetings(i, j, on_first, on_second, u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0)


def _cross(one: _Segments, i: Ints, other: _Segments, j: Ints) -> Bools:
    """The sum of four angles in the plane of the face, then sides by barycentric coordinates where it is full."""
    angles = sum_of_four_angles(one.flat_start[i], one.flat_end[i], other.flat_start[j], other.flat_end[j])
    crosses = angles > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(one.start[i[n]], one.end[i[n]], other.start[j[n]], other.end[j[n]])
    return crosses


def _candidates(faces: Ints, other_faces: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of an element of each that lie in one face, in blocks; at least one block."""
    order = np.argsort(other_faces, kind="stable")
    ordered = other_faces[order]
    first = np.searchsorted(ordered, faces, side="left")
    count = np.searchsorted(ordered, faces, side="right") - first
    total = np.concatenate([[0], np.cumsum(count)])
    begin = 0
    while True:
        end = int(np.searchsorted(total, total[begin] + _PAIRS_AT_ONCE, side="right")) - 1
        end = min(max(end, begin + 1), len(faces))
        i = np.repeat(np.arange(begin, end), count[begin:end])
        j = order[np.arange(len(i)) - (total[i] - total[begin]) + first[i]]
        yield i, j
        begin = end
        if begin >= len(faces):
            return


# ----------------------------------------------------------------------
# Whether two segments cross: the sum of four angles (Yan et al. 2016, §4.3), and who decides in doubt.
#
# Seen on a reference plane, the segments ab and cd cross where they are the diagonals of a convex
# quadrilateral a c b d.  Its four inner angles sum up to 2π; four points in any other position give less.
# The sum tends to 2π as well where the segments just touch, or miss each other by a hair: there
# the sides on which the ends lie decide, in exact arithmetic where rounding could turn them.

DOUBT = 1e-6
"""Radians below 2π down to which the sum of the angles leaves a crossing possible."""


def sum_of_four_angles(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Sum (n,) of the angles at the corners of the quadrilaterals a c b d, each between 0 and π.

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments ab and cd on the reference plane.
    """
    total = np.zeros(len(a))
    for before, at, after in ((d, a, c), (a, c, b), (c, b, d), (b, d, a)):
        u, v = before - at, after - at
        total += np.abs(np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(1)))
    return total


def sides_of(a: Floats, b: Floats, points: Floats) -> Ints:
    """On which side of the lines from a to b points lie: 1 left, -1 right; on the line counts as left.

    The sign is that of the exact value of the coordinates given.
    """
    sides, is_sure = _sides_in(np.float64, a, b, points)
    rest = np.flatnonzero(~is_sure)
    # Where the machine has longer numbers these tell nearly all of the rest apart.
    sides[rest], is_sure = _sides_in(np.longdouble, a[rest], b[rest], points[rest])
    for k in rest[~is_sure].tolist():
        (ax, ay), (bx, by), (px, py) = (tuple(map(Fraction, q[k].tolist())) for q in (a, b, points))
        sides[k] = 1 if (bx - ax) * (py - ay) >= (by - ay) * (px - ax) else -1
    return sides


def _sides_in(kind: type, a: Floats, b: Floats, points: Floats) -> tuple[Ints, Bools]:
    """The sides by numbers of a kind, and where rounding cannot have turned them."""
    a, b, points = a.astype(kind), b.astype(kind), points.astype(kind)
    u, v = b - a, points - a
    one, other = u[:, 0] * v[:, 1], u[:, 1] * v[:, 0]
    # The differences are rounded as well: their errors are of the size of the coordinates.
    size = np.maximum(np.abs(a), np.maximum(np.abs(b), np.abs(points))).max(axis=1, initial=0)
    spread = np.abs(u).max(axis=1, initial=0) + np.abs(v).max(axis=1, initial=0)
    bound = 8 * np.finfo(kind).eps * (np.abs(one) + np.abs(other) + size * spread)
    in_line = ((u == 0) & (v == 0)).any(axis=1)  # with an axis, exactly
    return np.where(one >= other, 1, -1), np.asarray(in_line | (np.abs(one - other) > bound))


def ends_on_opposite_sides(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Whether each of the segments ab and cd (n, 2) has its ends on both sides of the other."""
    return np.asarray((sides_of(a, b, c) != sides_of(a, b, d)) & (sides_of(c, d, a) != sides_of(c, d, b)))


def segments_cross(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Which of the segments ab and cd (n, 2) cross: the sum of four angles first, then the sides."""
    crosses = sum_of_four_angles(a, b, c, d) > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(a[n], b[n], c[n], d[n])
    return crosses


def places_of_crossing(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Where on ab and where on cd, in 0 to 1, segments that cross do so."""
    u, v, w = b - a, d - c, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area = np.where(area == 0, np.finfo(float).tiny, area)
    on_first = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / area
    on_second = (w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / area
    return np.clip(on_first, 0.0, 1.0), np.clip(on_second, 0.0, 1.0)


# ----------------------------------------------------------------------
# Taking the intersections of the children apart: regrouping (Yan et al. 2016, §4.3 and §4.4).
#
# Where A_i A_i+1 crosses A_j A_j+1 the curve goes on from A_i to A_j+1 and from A_j to A_i+1: one
# polyline becomes two where it crossed itself, two become one where they crossed each other.
# Both are the same exchange of followers.  It is made at the very place of the crossing, so
# that no new segment comes up that could cross others: each exchange takes one crossing away and
# adds none, and the process ends after as many exchanges as there were crossings, in any order.
#
# What comes out are simple loops.  Of the two strands at a crossing one has turned left and one right.
# Counting how many times the fronts lie on one's right, the place left of the first strand is one
# higher than the place left of the second; so the loops that hang together by crossings have
# *heights*, and those that bound what no front has covered yet are all equally high.


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
