"""Clearance: whether the axes of rods are half of both diameters apart, at the joints and everywhere else.

`find_clashes` takes all axes as straight pieces of half a diameter.  Runs of pieces that may come near each other are
found in a k-d tree and divided again and again, down to single pieces: a run of parameter length h lies within
h² max|r''| / 8 of its chord, so pairs whose chords are further apart are left out.  O(n log n) for n runs.
`gaps_at_joints` is finer and looks only at the two rods of each contact, near their joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, dots, ranks_in_rows, rows_of, small_products
from weavecore.geometry.closest import segment_distances
from weavecore.geometry.splines import SplineRows, cubic_points, pieces_of, span_ends
from weavecore.model.joints import Clashes, Joints
from weavecore.model.rod_axes import RodAxes
from weavecore.model.strands import Strands
from weavecore.polling import each
from weavecore.tolerances import CLASH
from weavecore.weaving.clash_work import LARGEST_RUN, PIECES_PER_DIAMETER

_SIZES = (LARGEST_RUN, 16, 4, 1)
"""Pieces of the runs that are compared, from the first round to the last."""

_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are neighbours and do not clash."""

_LITTLE_TURN = 1.0
"""Radians; half of them leave the two ends of four diameters of a rod three and a half diameters apart."""

_REACH = 5.0
"""The nearest places are looked for so many diameters along each rod, and no further than half an edge."""

_PIECES = 6
"""Each way from the joint a rod is taken for so many straight pieces, shorter ones near the joint."""

_PAIRS_AT_ONCE = 32_768
"""Pairs of runs that are compared between two polls."""

_CONTACTS_AT_ONCE = 4096
"""Contacts whose gaps are measured between two polls; their arrays fit into a processor's cache."""


def find_clashes(axes: RodAxes, diameters: Floats) -> Clashes:
    """Find the rods that cut into each other, at joints or between them.

    Parameters
    ----------
    axes : RodAxes
    diameters : (S,) float64
        Of the rods, in the model's unit.

    Returns
    -------
    Clashes
        Each pair of rods once, at the place where they are nearest; the nearest pair first.
    """
    cubics = _Cubics(axes, diameters)
    runs = cubics.runs(np.arange(len(cubics.start)), np.zeros(len(cubics.start), np.int64), cubics.n_pieces, _SIZES[0])
    middle = (runs.a + runs.b) / 2.0
    length = np.linalg.norm(runs.b - runs.a, axis=1)
    reach = diameters.max(initial=0.0) + (length + 2.0 * runs.deviation).max(initial=0.0)
    pairs = cKDTree(middle).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = np.concatenate([pairs, np.repeat(np.arange(len(middle)), 2).reshape(-1, 2)])
    pairs = _near_pairs(cubics, runs, pairs)
    for size in each(_SIZES[1:]):
        runs, pairs = _split(cubics, runs, pairs, size)
        pairs = _near_pairs(cubics, runs, pairs)
    one, other = pairs.T
    distance, middle = segment_distances(runs.a[one], runs.b[one], runs.a[other], runs.b[other])
    owners = np.sort(cubics.strand[runs.cubic[pairs]], axis=1)
    order = np.lexsort([other, one, distance, owners[:, 1], owners[:, 0]])
    _, first = np.unique(owners[order] @ (len(axes), 1), return_index=True)
    chosen = order[first]
    chosen = chosen[np.argsort(distance[chosen], kind="stable")]
    return Clashes(owners[chosen], distance[chosen], middle[chosen])


@dataclass(frozen=True, eq=False)
class _Runs:
    """Runs of straight pieces of axes.

    Parameters
    ----------
    cubic, first, last : (n,) int64
        The cubic, its piece at which the run begins, and the one before which it ends.
    a, b : (n, 3) float64
        Ends.
    deviation : (n,) float64
        The pieces are no further than this from the straight line between the ends.
    """

    cubic: Ints
    first: Ints
    last: Ints
    a: Floats
    b: Floats
    deviation: Floats


class _Cubics:
    """The cubics of all axes, each divided evenly into straight pieces no longer than a step."""

    def __init__(self, axes: RodAxes, diameters: Floats) -> None:
        rows = self._rows = axes.rows
        self.start, self._stop, self._width = span_ends(rows.parameters, rows.offsets, axes.closed, rows.ends)
        self.strand = rows_of(rows.offsets)[self.start]
        self.diameter = diameters[self.strand]
        self.n_pieces = pieces_of(self._width, self.diameter / PIECES_PER_DIAMETER)
        # The parameter is the length of the chords: near enough to arc length.
        self._turn = np.where(axes.closed, rows.ends, np.inf)[self.strand]
        p, q, dp, dq = self._hermite(np.arange(len(self.start)))
        width = self._width[:, None]
        ends = (6 * (q - p) / width - (4 * dp + 2 * dq), (2 * dp + 4 * dq) - 6 * (q - p) / width)
        # Second derivatives are linear along a cubic, so they are greatest at its ends.
        self._curvature = np.max([np.linalg.norm(end, axis=1) for end in ends], axis=0) / self._width

    def _hermite(self, cubic: Ints) -> tuple[Floats, Floats, Floats, Floats]:
        """First and last points (n, 3) of cubics, and the derivatives (n, 3) there."""
        a, b, rows = self.start[cubic], self._stop[cubic], self._rows
        return rows.points[a], rows.points[b], rows.derivatives[a], rows.derivatives[b]

    def runs(self, cubic: Ints, first: Ints, last: Ints, size: int) -> _Runs:
        """Divide runs of pieces into runs of ``size``, the last of each may be shorter."""
        counts = -(-(last - first) // size)
        owner = np.repeat(np.arange(len(cubic)), counts)
        begin = first[owner] + size * ranks_in_rows(counts)
        end = np.minimum(begin + size, last[owner])
        cubic = cubic[owner]
        hermite, width, n = self._hermite(cubic), self._width[cubic], self.n_pieces[cubic]
        a, b = (cubic_points(*hermite, width, k / n)[0] for k in (begin, end))
        # A curve lies within h²/8 max|r''| of its chord.
        return _Runs(cubic, begin, end, a, b, self._curvature[cubic] * ((end - begin) / n * width) ** 2 / 8.0)

    def is_own(self, runs: _Runs, pairs: Ints) -> Bools:
        """Which pairs are of one rod and cannot clash: all their pieces are neighbours, or it hardly turns on its way.

        A curve that turns by less than a radian from end to end is at least cos(1/2) times as wide as it is long.
        """
        cubic = runs.cubic[pairs]
        at, part = self._rows.parameters[self.start[cubic]], self._width[cubic] / self.n_pieces[cubic]
        begin, end = at + part * runs.first[pairs], at + part * (runs.last[pairs] - 1)
        apart = end.max(1) - begin.min(1)
        is_single = (runs.last - runs.first == 1)[pairs].all(1)
        apart = np.where(is_single, np.minimum(apart, self._turn[cubic[:, 0]] - apart), apart)
        near = apart < _OWN_REACH * self.diameter[cubic[:, 0]]
        is_hardly_bent = self._curvature[cubic].max(1) * (end.max(1) - begin.min(1)) < _LITTLE_TURN
        is_hardly_bent &= np.abs(cubic[:, 0] - cubic[:, 1]) <= 1
        own: Bools = (self.strand[cubic[:, 0]] == self.strand[cubic[:, 1]]) & (near | is_hardly_bent)
        return own


def _near_pairs(cubics: _Cubics, runs: _Runs, pairs: Ints) -> Ints:
    """The pairs of runs that may have pieces nearer than rods may be, neighbours on one rod left out."""
    parts = each(pairs[begin : begin + _PAIRS_AT_ONCE] for begin in range(0, len(pairs), _PAIRS_AT_ONCE))
    return np.concatenate([_near_pairs_of(cubics, runs, part) for part in parts] or [pairs])


def _near_pairs_of(cubics: _Cubics, runs: _Runs, pairs: Ints) -> Ints:
    one, other = pairs.T
    is_single = (runs.last - runs.first == 1)[pairs]
    slack = np.where(is_single, 0.0, runs.deviation[pairs]).sum(1)
    least = (1.0 - CLASH) * cubics.diameter[runs.cubic[pairs]].mean(1) + slack
    a, b, c, d = runs.a[one], runs.b[one], runs.a[other], runs.b[other]
    # Pairs whose middles are further apart than half of both lengths and the bound need not be measured.
    gap, u, v = (a + b - c - d) / 2.0, b - a, d - c
    may_be = np.flatnonzero(np.sqrt(dots(gap, gap)) <= (np.sqrt(dots(u, u)) + np.sqrt(dots(v, v))) / 2.0 + least)
    distance, _ = segment_distances(a[may_be], b[may_be], c[may_be], d[may_be])
    pairs = pairs[may_be[distance < least[may_be]]]
    return pairs[~cubics.is_own(runs, pairs)]


def _split(cubics: _Cubics, runs: _Runs, pairs: Ints, size: int) -> tuple[_Runs, Ints]:
    """Divide the runs of all pairs further, and pair the parts of one with those of the other."""
    used, pairs = np.unique(pairs, return_inverse=True)
    pairs = pairs.reshape(-1, 2)
    first, last = runs.first[used], runs.last[used]
    parts = cubics.runs(runs.cubic[used], first, last, size)
    counts = -(-(last - first) // size)
    begin = np.cumsum(counts) - counts
    one, other = pairs.T
    n = counts[one] * counts[other]
    row, nth = np.repeat(np.arange(len(pairs)), n), ranks_in_rows(n)
    found = np.stack(
        [begin[one[row]] + nth // counts[other[row]], begin[other[row]] + nth % counts[other[row]]], axis=1
    )
    return parts, found[found[:, 0] <= found[:, 1]]


def gaps_at_joints(
    points: Floats, rows: SplineRows, strands: Strands, joints: Joints, apart: Floats, counts_overhangs: Bools
) -> Floats:
    """Least distance between the axes of the two rods of each contact, near the joint.

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

    Returns
    -------
    (C,) float64
    """
    visits = joints.visit[joints.contacts]
    spans = _VisitCubics(points, rows, strands)
    least = np.empty(len(visits))
    for begin in each(range(0, len(visits), _CONTACTS_AT_ONCE)):
        part = slice(begin, begin + _CONTACTS_AT_ONCE)
        reach = _REACH * apart[part]
        beyond = np.where(counts_overhangs[part], reach, 0.0)
        least[part] = _least_distances(*(spans.around(v, reach, beyond) for v in visits[part].T))
    return least


def _least_distances(one: Floats, other: Floats) -> Floats:
    """Least distances (k,) between two rows of polylines (k, m, 3): between the segments at their nearest corners."""
    n, m = one.shape[:2]
    centre = one[:, m // 2, None]
    a, b = one - centre, other - centre
    square = (a * a).sum(2)[:, :, None] + (b * b).sum(2)[:, None] - 2.0 * small_products(a, b.transpose(0, 2, 1))
    p, q = np.divmod(square.reshape(n, -1).argmin(1), m)
    row = np.arange(n)
    least = np.full(n, np.inf)
    for i in (np.maximum(p - 1, 0), np.minimum(p, m - 2)):
        for j in (np.maximum(q - 1, 0), np.minimum(q, m - 2)):
            distance, _ = segment_distances(one[row, i], one[row, i + 1], other[row, j], other[row, j + 1])
            least = np.minimum(least, distance)
    return least


class _VisitCubics:
    """The cubics before and after each visit, as polynomials in t from 0 to 1."""

    def __init__(self, points: Floats, rows: SplineRows, strands: Strands) -> None:
        start, stop, self._width = span_ends(rows.parameters, strands.offsets, strands.closed, rows.ends)
        self._ahead, self._behind = np.full(len(points), -1), np.full(len(points), -1)
        self._ahead[start], self._behind[stop] = np.arange(len(start)), np.arange(len(start))
        width = self._width[:, None]
        rise = points[stop] - points[start]
        slope, last = width * rows.derivatives[start], width * rows.derivatives[stop]
        self._points = points
        speed = np.linalg.norm(rows.derivatives, axis=1, keepdims=True)
        self._tangents = rows.derivatives / np.maximum(speed, np.finfo(float).tiny)
        self._coefficients = (points[start], slope, 3.0 * rise - 2.0 * slope - last, slope + last - 2.0 * rise)

    def around(self, visits: Ints, reach: Floats, beyond: Floats) -> Floats:
        """Points (k, 2 · pieces + 1, 3) on both sides of visits, and ``beyond`` the end of a rod straight on."""
        steps = (np.arange(_PIECES + 1) / _PIECES) ** 2
        straight = (beyond[:, None] * steps)[:, :, None] * self._tangents[visits][:, None]
        sides = []
        for span, is_ahead in ((self._behind[visits], False), (self._ahead[visits], True)):
            part = np.minimum(reach / self._width[span], 0.5)[:, None] * steps
            t = (part if is_ahead else 1.0 - part)[:, :, None]
            first, second, third, fourth = (one[span][:, None] for one in self._coefficients)
            place = ((fourth * t + third) * t + second) * t + first
            tip = self._points[visits][:, None] + (straight if is_ahead else -straight)
            sides.append(np.where((span >= 0)[:, None, None], place, tip))
        return np.concatenate([sides[0][:, :0:-1], sides[1]], axis=1)
