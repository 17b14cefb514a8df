"""Clashes: rods whose axes are nearer than half of both diameters, at the joints and everywhere else.

All axes are taken as straight pieces of half a diameter.  Runs of pieces that may come near each other are found in a
k-d tree and divided again and again, down to single pieces: a run of parameter length h lies within h² max|r''| / 8 of
its chord, so pairs whose chords are further apart are left out.  So are, before anything is divided, the runs of two
rods that part from their joint, which nearly all others are.  O(n log n) for n runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Optional, Union

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, ranks_in_rows, rows_of
from weavecore.geometry.closest import dots_of_columns, segment_distances
from weavecore.geometry.splines import (
    pieces_of,
    polynomial_values,
    slope_polynomials,
    span_ends,
    squares_of,
)
from weavecore.model.joints import Clashes
from weavecore.model.rod_axes import CurveRows, RodAxes
from weavecore.polling import each
from weavecore.tolerances import CLASH
from weavecore.weaving.clash_work import LARGEST_RUN, PIECES_PER_DIAMETER

_SIZES = (16, 4, 1)
"""Pieces of the runs that are compared after the first round, in which they are about half an edge long."""

_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are neighbours and do not clash."""

_LITTLE_TURN = 1.0
"""Radians; half of them leave the two ends of four diameters of a rod three and a half diameters apart."""

_TINY = np.finfo(float).tiny

_ROUNDING = 1e-9
"""Part by which the bound of a first look is larger, so that rounding leaves no pair out."""

_PAIRS_AT_ONCE = 32_768
"""Pairs of runs that are compared between two polls."""

_LEAST_SINE = 0.4
"""Of the angle between runs that are looked at for whether they part from their ends."""


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
    begins_at, ends_at : (n,) float64
        Parameter at the start of the first and of the last piece.
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
    begins_at: Floats
    ends_at: Floats
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
        n, places, at = self.n_pieces[cubic], self._places[:, :, cubic], self._at[cubic]
        piece = self.piece(cubic)
        a, b = (polynomial_values(places, k / n) for k in (begin, end))
        # A curve lies within h²/8 max|r''| of its chord.
        deviation = self.most_bend[cubic] * ((end - begin) / n * self._width[cubic]) ** 2 / 8.0
        half = np.sqrt(_squares(b - a)) / 2.0
        slack = np.where(end - begin == 1, 0.0, deviation)
        bound = slack + (1.0 - CLASH) / 2.0 * self.diameter[cubic]
        reach = (half + bound) * (1.0 + _ROUNDING)
        along = at + piece * begin, at + piece * (end - 1)
        return _Runs(cubic, begin, end, self.strand[cubic], *along, a, b, (a + b) / 2.0, bound, reach)

    def is_own(self, runs: _Runs, pairs: Ints) -> Bools:
        """Which pairs of one rod cannot clash: all their pieces are neighbours, or it hardly turns on its way.

        A curve that turns by less than a radian from end to end is at least cos(1/2) times as wide as it is long.
        """
        one, other = pairs.T
        cubic, beside = runs.cubic[one], runs.cubic[other]
        apart = np.maximum(runs.ends_at[one], runs.ends_at[other]) - np.minimum(
            runs.begins_at[one], runs.begins_at[other]
        )
        bend = np.maximum(self.most_bend[cubic], self.most_bend[beside])
        # Cubics of one rod that follow each other have numbers that do.
        is_hardly_bent = (bend * apart < _LITTLE_TURN) & (np.abs(cubic - beside) <= 1)
        is_single = (runs.last[one] - runs.first[one] == 1) & (runs.last[other] - runs.first[other] == 1)
        apart = np.where(is_single, np.minimum(apart, self._turn[cubic] - apart), apart)
        own: Bools = is_hardly_bent | (apart < _OWN_REACH * self.diameter[cubic])
        return own

    def may_meet_themselves(self, runs: _Runs) -> Ints:
        """The runs that pieces of their own may clash with: those that are long, and turn much on their way."""
        cubic, length = runs.cubic, runs.ends_at - runs.begins_at
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
