"""Clearance: whether the axes of rods are half of both diameters apart, at the joints and everywhere else.

`find_clashes` takes all axes as straight pieces of half a diameter.  Runs of pieces that may come near each other are
found in a k-d tree and divided again and again, down to single pieces: a run of parameter length h lies within
h² max|r''| / 8 of its chord, so pairs whose chords are further apart are left out.  So are, before anything is divided,
the runs of two rods that part from their joint, which nearly all others are.  O(n log n) for n runs.
`gaps_at_joints` is finer and looks only at the two rods of each contact, near their joint: most cross at a fair angle,
and their nearest places follow from two steps of Newton's method; the others are sampled.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Optional, Union

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, ranks_in_rows, rows_of, unit_vectors
from weavecore.geometry.closest import dots_of_columns, segment_distances
from weavecore.geometry.splines import (
    SplineRows,
    pieces_of,
    polynomial_values,
    slope_polynomials,
    span_ends,
    squares_of,
)
from weavecore.model.joints import Clashes, Joints
from weavecore.model.rod_axes import CurveRows, RodAxes
from weavecore.model.strands import Strands
from weavecore.polling import each
from weavecore.tolerances import CLASH
from weavecore.weaving.clash_work import LARGEST_RUN, PIECES_PER_DIAMETER

_SIZES = (16, 4, 1)
"""Pieces of the runs that are compared after the first round, in which they are about half an edge long."""

_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are neighbours and do not clash."""

_LITTLE_TURN = 1.0
"""Radians; half of them leave the two ends of four diameters of a rod three and a half diameters apart."""

_REACH = 5.0
"""The nearest places are looked for so many diameters along each rod, and no further than half an edge."""

_PIECES = 6
"""Each way from the joint a rod is taken for so many straight pieces, shorter ones near the joint."""

_TINY = np.finfo(float).tiny

_ROUNDING = 1e-9
"""Part by which the bound of a first look is larger, so that rounding leaves no pair out."""

_PAIRS_AT_ONCE = 32_768
"""Pairs of runs that are compared between two polls."""

_CROSSINGS_AT_ONCE, _CONTACTS_AT_ONCE = 4096, 1024
"""Contacts whose gaps are solved for, or sampled, between two polls; their arrays fit into a processor's cache."""

_NEWTON_STEPS = 2
"""Steps to the nearest places of two axes that cross: they are next to the joint, and each squares what is left."""

_LEAST_SINE = 0.4
"""Of the angle between axes that cross well; at sharper ones the nearest places may be far from the joint."""

_NEAR_JOINT = 0.25
"""Part of the shorter edge beside a joint within which axes are taken for parabolas."""

_AT_END = 0.02
"""Nearest places so few diameters from the end of a rod may lie beyond it: the gap is the same to a part of 1e-4."""


def find_clashes(axes: RodAxes, diameters: Floats, among: Optional[Ints] = None) -> Clashes:
    """Find the rods that cut into each other, at joints or between them.

    Parameters
    ----------
    axes : RodAxes
    diameters : (S,) float64
        Of the rods, in the model's unit.
    among : (k, 2) int64, optional
        Only these pairs of rods are looked at, the lesser of each first.

    Returns
    -------
    Clashes
        Each pair of rods once, at the place where they are nearest; the nearest pair first.
    """
    return clashes_of(axes.rows, axes.closed, diameters, among)


def clashes_of(curves: CurveRows, closed: Bools, diameters: Floats, among: Optional[Ints] = None) -> Clashes:
    """Find the rods that cut into each other, from their axes with the tips alone.

    Parameters
    ----------
    curves : CurveRows
    closed : (S,) bool
    diameters, among
        As of `find_clashes`.

    Returns
    -------
    Clashes
        As of `find_clashes`.
    """
    n_rods = len(closed)
    cubics = _Cubics(curves, closed, diameters, np.ones(n_rods, bool) if among is None else _marked(among, n_rods))
    cubic = np.arange(len(cubics.strand))
    runs = cubics.runs(cubic, np.zeros(len(cubic), np.int64), cubics.n_pieces, cubics.pieces_of_half())
    pairs = cKDTree(runs.middle.T).query_pairs(2.0 * runs.reach.max(initial=0.0), output_type="ndarray")
    pairs = np.concatenate([pairs, np.repeat(cubics.may_meet_themselves(runs), 2).reshape(-1, 2)])
    if among is not None:
        owners = np.sort(runs.strand[pairs], axis=1)
        pairs = pairs[np.isin(owners @ (n_rods, 1), among @ (n_rods, 1))]
    pairs = _near_pairs(cubics, runs, pairs)
    parts, ends = _in_parts(pairs), cubics.ends(runs)
    pairs = np.concatenate([part[~_part_from_ends(cubics, runs, ends, part)] for part in parts] or [pairs])
    for size in _SIZES:
        runs, pairs = _split(cubics, runs, pairs, size)
        pairs = _near_pairs(cubics, runs, pairs)
    one, other = pairs.T
    distance, middle = runs.distances(one, other)
    owners = np.sort(runs.strand[pairs], axis=1)
    order = np.lexsort([other, one, distance, owners[:, 1], owners[:, 0]])
    _, first = np.unique(owners[order] @ (n_rods, 1), return_index=True)
    chosen = order[first]
    chosen = chosen[np.argsort(distance[chosen], kind="stable")]
    return Clashes(owners[chosen], distance[chosen], middle[chosen])


def _marked(numbers: Ints, n: int) -> Bools:
    marked = np.zeros(n, bool)
    marked[numbers] = True
    return marked


@dataclass(frozen=True, eq=False)
class _Runs:
    """Runs of straight pieces of axes; coordinates are in rows.

    Parameters
    ----------
    cubic, first, last : (n,) int64
        The cubic, its piece at which the run begins, and the one before which it ends.
    strand : (n,) int64
    a, b : (3, n) float64
        Ends.
    middle : (3, n) float64
        Of the straight line between the ends.
    bound : (n,) float64
        Pieces of two runs may be too near each other where the lines between their ends are nearer than both bounds.
    reach : (n,) float64
        Radius of a ball about the middle: where those of two runs do not meet, nor do their bounds.
    """

    cubic: Ints
    first: Ints
    last: Ints
    strand: Ints
    a: Floats
    b: Floats
    middle: Floats
    bound: Floats
    reach: Floats

    def distances(self, one: Ints, other: Ints) -> tuple[Floats, Floats]:
        """Least distances (k,) of the lines between the ends of pairs of runs, and where (k, 3)."""
        return segment_distances(*(side[:, run].T for run in (one, other) for side in (self.a, self.b)))


class _Cubics:
    """The cubics of rods that are looked at, each divided evenly into straight pieces no longer than a step."""

    def __init__(self, curves: CurveRows, closed: Bools, diameters: Floats, looked_at: Bools) -> None:
        start, stop, width = span_ends(curves.parameters, curves.offsets, closed, curves.ends)
        strand = rows_of(curves.offsets)[start]
        chosen = np.flatnonzero(looked_at[strand])
        start, stop, width, self.strand = start[chosen], stop[chosen], width[chosen], strand[chosen]
        self.diameter = diameters[self.strand]
        self.n_pieces = pieces_of(width, self.diameter / PIECES_PER_DIAMETER)
        # The parameter is the length of the chords: near enough to arc length.
        self._at, self._width = curves.parameters[start], width
        self._turn = np.where(closed, curves.ends, np.inf)[self.strand]
        places = np.ascontiguousarray(curves.points.T)
        slopes = slope_polynomials(places, np.ascontiguousarray(curves.derivatives.T), start, stop, width)
        # Second derivatives are linear along a cubic, so they are greatest at its ends.
        square = np.maximum(squares_of(slopes[1:2])[0], squares_of(slopes[1:2] + 2.0 * slopes[2:])[0])
        self.most_bend = np.sqrt(square) / width
        powers = np.arange(1.0, 4.0)[:, None, None]
        self._places = np.concatenate([places[None, :, start], slopes * width / powers])

    def pieces_of_half(self) -> Ints:
        """(n,) pieces of each cubic that are as long as half of most of them, `LARGEST_RUN` at least."""
        half = np.median(self._width) / 2.0 if len(self._width) else 1.0
        pieces: Ints = np.ceil(half / self._width * self.n_pieces).astype(np.int64)
        return np.maximum(pieces, LARGEST_RUN)

    def runs(self, cubic: Ints, first: Ints, last: Ints, size: Union[int, Ints]) -> _Runs:
        """Divide runs of pieces into runs of ``size``, the last of each may be shorter."""
        counts = -(-(last - first) // size)
        owner = np.repeat(np.arange(len(cubic)), counts)
        sizes = np.full(len(cubic), size, np.int64)[owner]
        begin: Ints = first[owner] + sizes * ranks_in_rows(counts)
        end: Ints = np.minimum(begin + sizes, last[owner])
        cubic = cubic[owner]
        n, places = self.n_pieces[cubic], self._places[:, :, cubic]
        a, b = (polynomial_values(places, k / n) for k in (begin, end))
        # A curve lies within h²/8 max|r''| of its chord.
        deviation = self.most_bend[cubic] * ((end - begin) / n * self._width[cubic]) ** 2 / 8.0
        half = np.sqrt(_squares(b - a)) / 2.0
        slack = np.where(end - begin == 1, 0.0, deviation)
        bound = slack + (1.0 - CLASH) / 2.0 * self.diameter[cubic]
        reach = (half + bound) * (1.0 + _ROUNDING)
        return _Runs(cubic, begin, end, self.strand[cubic], a, b, (a + b) / 2.0, bound, reach)

    def is_own(self, runs: _Runs, pairs: Ints) -> Bools:
        """Which pairs of one rod cannot clash: all their pieces are neighbours, or it hardly turns on its way.

        A curve that turns by less than a radian from end to end is at least cos(1/2) times as wide as it is long.
        """
        cubic = runs.cubic[pairs]
        at, part = self._at[cubic], self._width[cubic] / self.n_pieces[cubic]
        begin, end = at + part * runs.first[pairs], at + part * (runs.last[pairs] - 1)
        apart = end.max(1) - begin.min(1)
        is_single = (runs.last - runs.first == 1)[pairs].all(1)
        apart = np.where(is_single, np.minimum(apart, self._turn[cubic[:, 0]] - apart), apart)
        near = apart < _OWN_REACH * self.diameter[cubic[:, 0]]
        is_hardly_bent = self.most_bend[cubic].max(1) * (end.max(1) - begin.min(1)) < _LITTLE_TURN
        # Cubics of one rod that follow each other have numbers that do.
        is_hardly_bent &= np.abs(cubic[:, 0] - cubic[:, 1]) <= 1
        own: Bools = near | is_hardly_bent
        return own

    def may_meet_themselves(self, runs: _Runs) -> Ints:
        """The runs that pieces of their own may clash with: those that are long, and turn much on their way."""
        cubic = runs.cubic
        length = self._width[cubic] / self.n_pieces[cubic] * (runs.last - runs.first - 1)
        is_bent = self.most_bend[cubic] * length >= _LITTLE_TURN
        return np.flatnonzero(is_bent & (length >= _OWN_REACH * self.diameter[cubic]))

    def ends(self, runs: _Runs) -> tuple[Floats, Floats, Floats]:
        """Both ends (2, 3, n) of runs, the tangents there into the runs, and their length (n,) by the parameter."""
        cubic = runs.cubic
        n, width = self.n_pieces[cubic], self._width[cubic]
        powers = np.arange(1.0, 4.0)[:, None, None]
        slopes = self._places[1:, :, cubic] * powers / width
        tangents = polynomial_values(slopes, runs.first / n), -polynomial_values(slopes, runs.last / n)
        return np.stack([runs.a, runs.b]), np.stack(tangents), (runs.last - runs.first) / n * width

    def piece(self, cubic: Ints) -> Floats:
        """Length of single pieces by the parameter."""
        lengths: Floats = self._width[cubic] / self.n_pieces[cubic]
        return lengths


def _near_pairs(cubics: _Cubics, runs: _Runs, pairs: Ints) -> Ints:
    """The pairs of runs that may have pieces nearer than rods may be, neighbours on one rod left out."""
    return np.concatenate([_near_pairs_of(cubics, runs, part) for part in _in_parts(pairs)] or [pairs])


def _in_parts(pairs: Ints) -> Iterator[Ints]:
    return each(pairs[begin : begin + _PAIRS_AT_ONCE] for begin in range(0, len(pairs), _PAIRS_AT_ONCE))


def _near_pairs_of(cubics: _Cubics, runs: _Runs, pairs: Ints) -> Ints:
    # Pairs whose middles are further apart than half of both lengths and the bound need not be measured.
    pairs = pairs[_may_be_near(runs, pairs[:, 0], pairs[:, 1])]
    kept = np.ones(len(pairs), bool)
    same = np.flatnonzero(runs.strand[pairs[:, 0]] == runs.strand[pairs[:, 1]])
    kept[same] = ~cubics.is_own(runs, pairs[same])
    one, other = pairs[kept].T
    distance, _ = runs.distances(one, other)
    kept[kept] = distance < runs.bound[one] + runs.bound[other]
    return pairs[kept]


def _part_from_ends(cubics: _Cubics, runs: _Runs, run_ends: tuple[Floats, Floats, Floats], pairs: Ints) -> Bools:
    """Whether two runs are nowhere nearer than rods may be because they part from their ends that are nearest.

    With D from one end to the other, u and v the tangents there, places s and t along the runs and m the greater of
    these, the curves are at least ``|D + s u - t v| - K m² / 2`` apart, where K is the sum of the greatest second
    derivatives.  The component of D that is normal to u and v stays, the others, η long, are overcome after η / k::

        |D + s u - t v| ≥ √(δ² + max(k m - η, 0)²)        k m ≤ |s u - t v|

    As a function of m² this rises first and then falls, so the two ends are enough.
    """
    ends, tangents, length = run_ends
    one, other = pairs.T
    square = [_squares(ends[i][:, one] - ends[j][:, other]) for i, j in ((0, 0), (0, 1), (1, 0), (1, 1))]
    i, j = np.divmod(np.argmin(square, axis=0), 2)
    gap = ends[i, :, one].T - ends[j, :, other].T
    u, v = tangents[i, :, one].T, tangents[j, :, other].T
    uu, vv, uv = _squares(u), _squares(v), dots_of_columns(u, v)
    across = np.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
    sine = _squares(across) / np.maximum(uu * vv, _TINY)
    normal = dots_of_columns(gap, across) ** 2 / np.maximum(_squares(across), _TINY)
    aside = np.maximum(_squares(gap) - normal, 0.0)
    k = np.minimum(uu, vv) * np.where(uv > 0.0, sine, 1.0)
    is_wide = sine > _LEAST_SINE**2
    k = np.where(is_wide, k, 1.0)
    bend = cubics.most_bend[runs.cubic[one]] + cubics.most_bend[runs.cubic[other]]
    far, piece = (
        np.maximum(length[one], length[other]),
        np.maximum(*(cubics.piece(runs.cubic[x]) for x in (one, other))),
    )
    diameter = (cubics.diameter[runs.cubic[one]] + cubics.diameter[runs.cubic[other]]) / 2.0
    # Straight pieces lie a little inside the curves.
    least = (1.0 - CLASH) * diameter + bend * (piece**2 / 8.0 + aside / k)
    stays = np.sqrt(normal) > least
    parts: Bools = is_wide & stays & (np.sqrt(normal + k * far**2) - bend * far**2 > least)
    return parts


def _squares(vectors: Floats) -> Floats:
    return dots_of_columns(vectors, vectors)


def _may_be_near(runs: _Runs, one: Ints, other: Ints) -> Bools:
    """Whether the balls about runs meet, and their bounds; any shapes that go together."""
    square = np.zeros(np.broadcast_shapes(one.shape, other.shape))
    for coordinate in runs.middle:
        gap = coordinate[one] - coordinate[other]
        square += gap * gap
    return square <= (runs.reach[one] + runs.reach[other]) ** 2


def _split(cubics: _Cubics, runs: _Runs, pairs: Ints, size: int) -> tuple[_Runs, Ints]:
    """Divide the runs of all pairs further, and pair the parts of one with those of the other that may be near."""
    marked = _marked(pairs.ravel(), len(runs.cubic))
    used, index = np.flatnonzero(marked), np.cumsum(marked) - 1
    first, last = runs.first[used], runs.last[used]
    parts = cubics.runs(runs.cubic[used], first, last, size)
    counts = -(-(last - first) // size)
    begin = np.cumsum(counts) - counts
    nth = np.arange(counts.max(initial=0))
    found = [np.zeros((0, 2), np.int64)]
    at_once = max(_PAIRS_AT_ONCE // max(len(nth) ** 2, 1), 1)
    for start in each(range(0, len(pairs), at_once)):
        one, other = (
            np.where(nth < counts[run][:, None], begin[run][:, None] + nth, -1)
            for run in index[pairs[start : start + at_once]].T
        )
        one, other = one[:, :, None], other[:, None, :]
        near = _may_be_near(parts, one, other) & (one >= 0) & (one <= other)
        found.append(np.stack([np.broadcast_to(side, near.shape)[near] for side in (one, other)], axis=1))
    return parts, np.concatenate(found)


def gaps_at_joints(
    points: Floats,
    rows: SplineRows,
    strands: Strands,
    joints: Joints,
    apart: Floats,
    counts_overhangs: Bools,
    contacts: Ints,
) -> Floats:
    """Least distance between the axes of the two rods of contacts, near the joint.

    Parameters
    ----------
    points : (M, 3) float64
        Of the visits.
    rows : SplineRows
    strands : Strands
    joints : Joints
    apart : (C,) float64
        Mean diameter of the two rods.
    counts_overhangs : (C,) bool
        Whether rods that end at the joint are taken to run on straight beyond it.
    contacts : (k,) int64
        Those that are measured.

    Returns
    -------
    (k,) float64
    """
    visits = joints.visit[joints.contacts[contacts]]
    axes = _AxesAtVisits(points, rows, strands)
    least = np.empty(len(visits))
    sampled = [np.zeros(0, np.int64)]
    for begin in each(range(0, len(visits), _CROSSINGS_AT_ONCE)):
        part = slice(begin, begin + _CROSSINGS_AT_ONCE)
        least[part], is_crossing = _gaps_of_crossings(axes, visits[part], apart[contacts[part]])
        sampled.append(begin + np.flatnonzero(~is_crossing))
    rest = np.concatenate(sampled)
    for begin in each(range(0, len(rest), _CONTACTS_AT_ONCE)):
        some = rest[begin : begin + _CONTACTS_AT_ONCE]
        reach = _REACH * apart[contacts[some]]
        beyond = np.where(counts_overhangs[contacts[some]], reach, 0.0)
        least[some] = _least_distances(*(axes.around(v, reach, beyond) for v in visits[some].T))
    return least


def _gaps_of_crossings(axes: _AxesAtVisits, visits: Ints, apart: Floats) -> tuple[Floats, Bools]:
    """Least distances (k,) of axes that cross well, and which do: at no sharp angle, nearest right at the joint.

    Near the joint the axes are parabolas, and their nearest places are found by Newton's method.
    """
    place, slope, bend = zip(*(axes.parabolas(v) for v in visits.T))
    room = np.minimum(apart, _NEAR_JOINT * np.minimum(*(axes.room(v) for v in visits.T)))
    s, t = np.zeros(len(visits)), np.zeros(len(visits))
    start = place[0] - place[1]
    is_crossing = np.ones(len(visits), bool)
    for _ in range(_NEWTON_STEPS):
        one, other = slope[0] + s * bend[0], slope[1] + t * bend[1]
        gap = start + s * (slope[0] + one) / 2.0 - t * (slope[1] + other) / 2.0
        oo, tt, ot = (dots_of_columns(*pair) for pair in ((one, one), (other, other), (one, other)))
        is_crossing &= oo * tt - ot * ot > _LEAST_SINE**2 * oo * tt
        oo, tt = oo + dots_of_columns(gap, bend[0]), tt - dots_of_columns(gap, bend[1])
        along, across = dots_of_columns(gap, one), dots_of_columns(gap, other)
        det = np.where(is_crossing, oo * tt - ot * ot, 1.0)
        s, t = s + (ot * across - tt * along) / det, t + (oo * across - ot * along) / det
        is_crossing &= (np.abs(s) < room) & (np.abs(t) < room) & (det > 0.0)
        s, t = np.where(is_crossing, s, 0.0), np.where(is_crossing, t, 0.0)
    for v, way in zip(visits.T, (s, t)):
        is_crossing &= ~axes.is_end(v) | (np.abs(way) < _AT_END * apart)
    gap = start + s * (slope[0] + s * bend[0] / 2.0) - t * (slope[1] + t * bend[1] / 2.0)
    return np.sqrt(dots_of_columns(gap, gap)), is_crossing


def _least_distances(one: Floats, other: Floats) -> Floats:
    """Least distances (k,) between two rows of polylines (3, m, k): between the segments at their nearest corners."""
    m, n = one.shape[1:]
    square = np.empty((m, m, n))
    for i in range(m):
        gap = one[:, i, None] - other
        gap *= gap
        np.add(gap[0], gap[1], out=square[i])
        square[i] += gap[2]
    p, q = np.divmod(square.reshape(m * m, n).argmin(0), m)
    row = np.arange(n)
    least = np.full(n, np.inf)
    for i in (np.maximum(p - 1, 0), np.minimum(p, m - 2)):
        for j in (np.maximum(q - 1, 0), np.minimum(q, m - 2)):
            ends = one[:, i, row].T, one[:, i + 1, row].T, other[:, j, row].T, other[:, j + 1, row].T
            least = np.minimum(least, segment_distances(*ends)[0])
    return least


class _AxesAtVisits:
    """The axes on both sides of visits, as polynomials; coordinates in rows."""

    def __init__(self, points: Floats, rows: SplineRows, strands: Strands) -> None:
        self._points, self._slopes = np.ascontiguousarray(points.T), np.ascontiguousarray(rows.derivatives.T)
        self._following, self._preceding = strands.following, strands.preceding
        goes_round = strands.following < np.arange(len(points))
        ahead = np.where(goes_round, rows.ends[strands.owner], rows.parameters[strands.following])
        self._width = np.where(strands.following >= 0, ahead - rows.parameters, 1.0)

    def is_end(self, visits: Ints) -> Bools:
        """Whether a rod ends there."""
        ends: Bools = (self._following[visits] < 0) | (self._preceding[visits] < 0)
        return ends

    def room(self, visits: Ints) -> Floats:
        """Width by the parameter of the shorter cubic beside visits."""
        ahead, behind = self._following[visits] >= 0, self._preceding[visits]
        before = np.where(behind >= 0, self._width[behind], np.inf)
        return np.minimum(np.where(ahead, self._width[visits], np.inf), before)

    def parabolas(self, visits: Ints) -> tuple[Floats, Floats, Floats]:
        """Places, first and second derivatives (3, k) at visits; no second ones where a rod ends."""
        after = self._following[visits]
        place, slope, width = self._points[:, visits], self._slopes[:, visits], self._width[visits]
        rise = self._points[:, after] - place
        is_end = self.is_end(visits)
        width = np.where(is_end, 1.0, width)
        bend = (6.0 * rise / width - 4.0 * slope - 2.0 * self._slopes[:, after]) / width
        return place, slope, np.where(is_end, 0.0, bend)

    def around(self, visits: Ints, reach: Floats, beyond: Floats) -> Floats:
        """Points (3, 2 · pieces + 1, k) on both sides of visits, and ``beyond`` the end of a rod straight on."""
        steps = (np.arange(_PIECES + 1) / _PIECES)[:, None] ** 2
        sides = []
        for is_ahead, beside in ((False, self._preceding[visits]), (True, self._following[visits])):
            start, stop = (visits, beside) if is_ahead else (beside, visits)
            first, last = self._points[:, start], self._points[:, stop]
            width = self._width[start]
            slope, rise = width * self._slopes[:, start], last - first
            turn = slope + width * self._slopes[:, stop]
            second, third = 3.0 * rise - slope - turn, turn - 2.0 * rise
            part = np.minimum(reach / width, 0.5) * steps
            t = part if is_ahead else 1.0 - part
            place = ((third[:, None] * t + second[:, None]) * t + slope[:, None]) * t + first[:, None]
            end = np.flatnonzero(beside < 0)
            tangent = unit_vectors(self._slopes[:, visits[end]].T).T
            straight = tangent[:, None] * (beyond[end] * steps)
            at = self._points[:, None, visits[end]]
            place[:, :, end] = at + straight if is_ahead else at - straight
            sides.append(place)
        return np.concatenate([sides[0][:, :0:-1], sides[1]], axis=1)
