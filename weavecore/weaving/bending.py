"""Bending: the least radius of every rod, against what its material allows, and the thickest rod that passes.

A straight rod of diameter d that is bent to radius R carries the bending stress E·d / (2R); the allowable stress is
the strength divided by a safety factor, so R must be at least ``E·d / (2 σ/factor)``: `Material.least_bend` diameters.

The curvature is that of the axis, at each point: the axis is the spline through the ties, which is the curve that a
thin rod takes between them (least bending energy, to first order).  On a span the second derivative is linear,
so the curvature is greatest at a tie or near the middle of the span; it is sampled densely enough for both.

A thicker rod undulates more: at each tie the axis is shifted out of the surface by a multiple of the diameter.  The
spline is linear in the places that it goes through, ``r(t; f) = a(t) + f b(t)`` for diameters f times as large, so the
utilisation as a function of f follows from one more fit, and the thickest rod that passes is its root, by bisection.
All spans together are measured at single factors; roots are found only where a rod may be the least that is asked for.

The materials and their figures, with sources, are in ``materials.csv``.

Source: bending of gridshells, Navier laboratory (Créteil 2013); splines, de Boor 1978.  Linear in the visits.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from typing import Any, Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of, small_products
from weavecore.geometry.splines import (
    SplineRows,
    cubic_points,
    fit_derivatives,
    polynomial_values,
    slope_polynomials,
    span_ends,
    squares_of,
)
from weavecore.model.bending import Bending, Material
from weavecore.model.rod_axes import RodAxes
from weavecore.polling import each

_SAMPLES_PER_SPAN = 8
"""Samples of each span, its first end included: with 16 the least radius of the samples' rods moves by under 0.5 %.
The last end is the first of the next span, or the end of a rod, where it is straight."""

_SPANS_AT_ONCE = 2048
"""Spans between two polls; their arrays fit into a processor's cache."""

_LEAST_FACTOR, _MOST_FACTOR = 1e-3, 1e3
"""Range of the factors that are looked for."""

_STEP = 2.0
"""Ratio of the factors between which roots are bracketed."""

_WORTH_A_COPY = 0.8
"""Share of the samples still looked at below which they are copied together."""

_BISECTIONS, _NEWTON_STEPS = 10, 3
"""Halvings of the logarithm of the factor, which leave 1.4 % from a range of 1e6 to 1, and the steps that follow: each
squares what is left, to a part of 1e-12 at the end."""

_TINY = np.finfo(float).tiny

_STRAIGHT = 1e-9
"""An axis whose curvature times its length is below this is straight."""


@dataclass(frozen=True, eq=False)
class BentRods:
    """Splines of rods, with what they change by as the rods grow thicker.

    Parameters
    ----------
    points : (M, 3) float64
        Of the axes at the visits.
    rows : SplineRows
        Through the points.
    shift : (M, 3) float64
        By which the points are out of the surface; it grows with the diameters.
    offsets : (S+1,) int64
    closed : (S,) bool
    diameters : (S,) float64
        Of the rods, in the model's unit.
    material : Material
    """

    points: Floats
    rows: SplineRows
    shift: Floats
    offsets: Ints
    closed: Bools
    diameters: Floats
    material: Material

    @cached_property
    def spans(self) -> tuple[Ints, Ints, Floats]:
        """First and last visit (n,) of each span, and its width by the parameter."""
        return span_ends(self.rows.parameters, self.offsets, self.closed, self.rows.ends)

    @cached_property
    def rod(self) -> Ints:
        """(n,) rod of each span."""
        return rows_of(self.offsets)[self.spans[0]]

    @cached_property
    def least_radius(self) -> Floats:
        """(S,) that the material allows."""
        return self.material.least_bend * self.diameters

    @cached_property
    def shift_slopes(self) -> Floats:
        """(M, 3) derivatives of the shifts, over the parameters of the axes."""
        start, _, width = self.spans
        chord = np.ones(len(self.points))
        chord[start] = width
        return fit_derivatives(self.shift, self.offsets, self.closed, chord)

    def curvatures(self, spans: Ints, grown: Optional[Floats] = None) -> Floats:
        """Curvatures (8, n) of the samples of some spans, of rods whose diameters have grown by (n,); 0 at standstill.

        The derivative of a cubic is of degree 2, the square of its length of degree 4, and so is that of its vector
        product with the second derivative.
        """
        start, stop, width = self.spans
        places, derivatives = np.ascontiguousarray(self.points.T), np.ascontiguousarray(self.rows.derivatives.T)
        shifts = None if grown is None else (np.ascontiguousarray(self.shift.T), self.shift_slopes.T.copy())
        squares = np.empty((_SAMPLES_PER_SPAN, len(spans)))
        for begin in each(range(0, len(spans), _SPANS_AT_ONCE)):
            part = slice(begin, begin + _SPANS_AT_ONCE)
            some = spans[part]
            slopes = slope_polynomials(places, derivatives, start[some], stop[some], width[some])
            if grown is not None and shifts is not None:
                more = slope_polynomials(shifts[0], shifts[1], start[some], stop[some], width[some])
                slopes += (grown[part] - 1.0) * more
            one, two, three = slopes
            turns = squares_of(np.stack([_cross(one, two), 2.0 * _cross(one, three), _cross(two, three)]))
            speeds = squares_of(slopes)
            for k in range(_SAMPLES_PER_SPAN):
                t = k / _SAMPLES_PER_SPAN
                speed, turn = (np.maximum(polynomial_values(one, t), 0.0) for one in (speeds, turns))
                cube = np.maximum(speed * speed * speed, _TINY)
                squares[k, part] = np.where(speed > 0.0, turn / cube, 0.0)
            squares[:, part] /= width[some] ** 2
        return np.sqrt(squares)

    def halves_too_sharp(self, spans: Ints, factor: Floats) -> Bools:
        """Whether the halves (2, n) of some spans are bent too sharply when the diameters are ``factor`` (n,) times."""
        sharp = self.curvatures(spans, factor) * (self.least_radius[self.rod[spans]] * factor) > 1.0
        halves: Bools = np.logical_or.reduce(sharp.reshape(2, _SAMPLES_PER_SPAN // 2, -1), axis=1)
        return halves

    def greatest_at_visits(self, halves: Union[Floats, Bools]) -> Any:
        """The greater of the values (2, n) of half spans on both sides of each visit (M,); 0 where there is none."""
        start, stop, _ = self.spans
        values = np.zeros(len(self.points), halves.dtype)
        for at, half in ((start, halves[0]), (stop, halves[1])):  # Each visit begins and ends one span at most.
            values[at] = np.maximum(values[at], half)
        return values


@dataclass(frozen=True, eq=False)
class Sharpest:
    """Where rods are bent most sharply.

    Parameters
    ----------
    start, stop : (S,) int64
        The two visits of the span in which a rod is bent most sharply.
    width : (S,) float64
        Of that span, by the parameter.
    t : (S,) float64
        Where in the span, from 0 to 1.
    radius : (S,) float64
        Infinite for a straight rod.
    utilisation : (S,) float64
    at_visits : (M,) float64
        Utilisation in the half spans on both sides of each visit.
    """

    start: Ints
    stop: Ints
    width: Floats
    t: Floats
    radius: Floats
    utilisation: Floats
    at_visits: Floats


def measure_bending(axes: RodAxes, rods: BentRods, found: Sharpest) -> Bending:
    """Tell the sharpest bend of every rod, and how thick it could be.

    Parameters
    ----------
    axes : RodAxes
        Drawn through the points of the rods.
    rods : BentRods
    found : Sharpest
        From `find_sharpest`.

    Returns
    -------
    Bending
    """
    points, slopes, start, stop = axes.points, axes.derivatives, found.start, found.stop
    point, _ = cubic_points(points[start], points[stop], slopes[start], slopes[stop], found.width, found.t)
    # Arc length to the place, to first order between two visits.
    ahead = np.where(found.stop > found.start, axes.stations[found.stop], axes.lengths)
    station = axes.stations[found.start] + found.t * (ahead - axes.stations[found.start])
    return Bending(
        min_radius=found.radius,
        station_at_min=station,
        point_at_min=point,
        utilisation=found.utilisation,
        largest_diameter=largest_of_rods(rods),
    )


def find_sharpest(rods: BentRods) -> Sharpest:
    """Find where rods are bent most sharply, from their splines alone.

    Parameters
    ----------
    rods : BentRods

    Returns
    -------
    Sharpest
    """
    start, stop, width = rods.spans
    rod, n_rods = rods.rod, len(rods.diameters)
    curvature = rods.curvatures(np.arange(len(start)))
    length = np.bincount(rod, width, n_rods)
    curvature[curvature * length[rod] < _STRAIGHT] = 0.0
    at_most = curvature.max(axis=0)
    span = _first_greatest(at_most, rod, n_rods)
    sample = curvature[:, span].argmax(axis=0)
    with np.errstate(divide="ignore"):
        radius = 1.0 / at_most[span]
    halves = curvature.reshape(2, _SAMPLES_PER_SPAN // 2, -1).max(axis=1)
    return Sharpest(
        start[span],
        stop[span],
        width[span],
        sample / _SAMPLES_PER_SPAN,
        radius,
        rods.least_radius / radius,
        rods.greatest_at_visits(halves * rods.least_radius[rod]),
    )


def largest_at(rods: BentRods, visits: Bools) -> Floats:
    """The largest diameters that pass in the half spans on both sides of some visits, if all rods grow in proportion.

    Parameters
    ----------
    rods : BentRods
    visits : (M,) bool

    Returns
    -------
    (M,) float64
        Infinite where any passes, and at other visits.
    """
    start, stop, _ = rods.spans
    halves = np.stack([visits[start], visits[stop]])
    spans = np.flatnonzero(halves.any(axis=0))
    factor = np.full(halves.shape, np.inf)
    factor[:, spans] = _largest_factors(rods, spans)
    largest = np.full(len(visits), np.inf)
    for at, half in ((start, factor[0]), (stop, factor[1])):
        largest[at] = np.minimum(largest[at], half)
    return np.where(visits, largest * np.repeat(rods.diameters, np.diff(rods.offsets)), np.inf)


def least_largest(rods: BentRods, share: float) -> Floats:
    """The largest diameters that pass at visits, as of `largest_at`, for the visits where they are least.

    Parameters
    ----------
    rods : BentRods
    share : float
        Of the visits at least, of the least ones.

    Returns
    -------
    (M,) float64
        Infinite at all other visits.
    """
    n_asked = int(np.floor(share * len(rods.points))) + 1
    spans = np.arange(len(rods.rod))

    def too_sharp(factor: float) -> Bools:
        visits: Bools = rods.greatest_at_visits(rods.halves_too_sharp(spans, np.full(len(spans), factor)))
        return visits

    factor = 1.0
    chosen = too_sharp(factor)
    while chosen.sum() < n_asked and factor < _MOST_FACTOR:
        factor *= _STEP
        chosen = too_sharp(factor)
    while factor > _LEAST_FACTOR:
        factor /= np.sqrt(_STEP)
        fewer = too_sharp(factor)
        if fewer.sum() < n_asked:
            break
        chosen = fewer
    return largest_at(rods, chosen)


def largest_of_rods(rods: BentRods) -> Floats:
    """The largest diameter with which each rod passes everywhere, if all rods grow in proportion.

    Parameters
    ----------
    rods : BentRods

    Returns
    -------
    (S,) float64
        Infinite where any passes.
    """
    rod, n_rods = rods.rod, len(rods.diameters)
    factor = np.ones(n_rods)
    candidate = np.zeros(len(rod), bool)
    rises, falls, is_open = np.zeros(n_rods, bool), np.zeros(n_rods, bool), np.ones(n_rods, bool)
    while is_open.any():
        spans = np.flatnonzero(is_open[rod])
        before, after = rods.halves_too_sharp(spans, factor[rod[spans]])
        sharp = before | after
        fails = np.zeros(n_rods, bool)
        fails[rod[spans[sharp]]] = True
        # The spans that fail at the least factor at which any of the rod does.
        renewed = fails[rod[spans]]
        candidate[spans[renewed]] = sharp[renewed]
        falls |= is_open & fails & ~rises
        rises |= is_open & ~fails & ~falls
        is_open &= np.where(fails, falls & (factor > _LEAST_FACTOR), rises & (factor < _MOST_FACTOR))
        factor = np.where(falls, factor / _STEP, factor * _STEP)
    spans = np.flatnonzero(candidate)
    largest = np.full(n_rods, np.inf)
    np.minimum.at(largest, rod[spans], _largest_factors(rods, spans).min(axis=0))
    return largest * rods.diameters


def _largest_factors(rods: BentRods, spans: Ints) -> Floats:
    """(2, n) factor of all diameters at which the utilisation reaches 1 in each half of spans; infinite where never."""
    both, slopes = np.hstack([rods.points - rods.shift, rods.shift]), rods.shift_slopes
    slopes = np.hstack([rods.rows.derivatives - slopes, slopes])
    start, stop, width = rods.spans
    least_radius = rods.least_radius[rods.rod[spans]]
    factor = np.full((2, len(spans)), np.inf)
    for begin in each(range(0, len(spans), _SPANS_AT_ONCE)):
        part = slice(begin, begin + _SPANS_AT_ONCE)
        some = spans[part]
        samples = _Samples.of(both, slopes, start[some], stop[some], width[some])
        factor[:, part] = _factors_of_samples(samples, least_radius[part]).T
    return factor


@dataclass(frozen=True, eq=False)
class _Samples:
    """Samples of spans (n, k) as polynomials in the factor of all diameters, coefficients from degree 0 on.

    ``speed`` (3, n, k) is the square of |r'|, and ``bend`` (5, n, k) that of |r' x r''|.
    """

    speed: Floats
    bend: Floats

    @staticmethod
    def of(values: Floats, slopes: Floats, start: Ints, stop: Ints, width: Floats) -> _Samples:
        """Sample the cubics from ``start`` to ``stop`` of values (M, 6): a place on the surface, and the shift."""
        t = np.arange(_SAMPLES_PER_SPAN) / _SAMPLES_PER_SPAN
        wide = width[:, None]
        rise = values[stop] - values[start]
        first, last = wide * slopes[start], wide * slopes[stop]
        # r = … + first t + (3 rise - 2 first - last) t² + (first + last - 2 rise) t³
        quadratic, cubic = 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise
        basis = np.stack([np.ones_like(t), 2.0 * t, 3.0 * t**2]), np.stack([np.full_like(t, 2.0), 6.0 * t])
        speeds = np.stack([first, quadratic, cubic], axis=2) / wide[:, :, None]
        bends = np.stack([quadratic, cubic], axis=2) / wide[:, :, None] ** 2
        # (6, n, k): each coordinate of all samples together
        one, two = (small_products(part.transpose(1, 0, 2), by) for part, by in zip((speeds, bends), basis))
        turn = [
            _cross(one[:3], two[:3]),
            _cross(one[:3], two[3:]) + _cross(one[3:], two[:3]),
            _cross(one[3:], two[3:]),
        ]
        return _Samples(squares_of(np.stack([one[:3], one[3:]])), squares_of(np.stack(turn)))


def _first_greatest(values: Floats, row: Ints, n_rows: int) -> Ints:
    """Index of the greatest value of each row, the first of equals; rows rise."""
    first = np.searchsorted(row, np.arange(n_rows))
    greatest = np.maximum.reduceat(values, first) if n_rows else np.zeros(0)
    at = np.flatnonzero(values == greatest[row])
    return at[np.flatnonzero(np.diff(row[at], prepend=-1))]


def _factors_of_samples(samples: _Samples, least_radius: Floats) -> Floats:
    """(n, 2) factor of all diameters at which the utilisation reaches 1 in each half of spans; infinite where never.

    ``least_radius`` (n,) is that of the rods as they are.
    """
    _, n, k = samples.bend.shape
    half = (2 * np.arange(n)[:, None] + (np.arange(k) >= k // 2)).ravel()
    square = np.repeat(least_radius**2, k)
    table = np.stack([square, *(one.ravel() for one in (*samples.bend, *samples.speed))])
    low, high = np.full(2 * n, _LEAST_FACTOR), np.full(2 * n, _MOST_FACTOR)
    # A sample that passes at a factor passes at all that are smaller, so it need not be looked at again below it.
    is_sharp = _fail(table, _MOST_FACTOR)
    half, table = half[is_sharp], table[:, is_sharp]
    is_unbounded = np.ones(2 * n, bool)
    is_unbounded[half] = False
    for _ in range(_BISECTIONS):
        middle = np.sqrt(low * high)
        is_sharp = _fail(table, middle[half])
        bad = np.zeros(2 * n, bool)
        bad[half[is_sharp]] = True
        low, high = np.where(bad, low, middle), np.where(bad, middle, high)
        kept = is_sharp | ~bad[half]
        if kept.sum() < _WORTH_A_COPY * len(kept):
            half, table = half[kept], table[:, kept]
    is_sharp = _fail(table, high[half])
    half, table = half[is_sharp], table[:, is_sharp]
    factor = high.copy()
    np.minimum.at(factor, half, _roots_below(table, low[half], high[half]))
    return np.where(is_unbounded, np.inf, factor).reshape(n, 2)


def _fail(table: Floats, factor: Union[float, Floats]) -> Bools:
    """Which samples (n,) are bent too sharply at a factor of all diameters.

    Rows of the table (9, n) are the square of the least radius, the 5 coefficients of ``bend`` and the 3 of ``speed``.
    """
    speed = polynomial_values(table[6:], factor)
    too_sharp: Bools = table[0] * factor**2 * polynomial_values(table[1:6], factor) > speed * speed * speed
    return too_sharp


def _roots_below(table: Floats, low: Floats, high: Floats) -> Floats:
    """The factor (n,) between two near ones from which on a sample is too sharp, by Newton's method."""
    degrees = np.arange(1, 5)[:, None]
    bend_slopes, speed_slopes = table[2:6] * degrees, table[7:] * degrees[:2]
    factor = high
    for _ in range(_NEWTON_STEPS):
        bend, speed = polynomial_values(table[1:6], factor), polynomial_values(table[6:], factor)
        value = table[0] * factor**2 * bend - speed * speed * speed
        slope = table[0] * factor * (2.0 * bend + factor * polynomial_values(bend_slopes, factor))
        slope -= 3.0 * speed**2 * polynomial_values(speed_slopes, factor)
        step = np.divide(value, slope, out=np.zeros_like(value), where=slope > 0)
        factor = np.clip(factor - step, low, high)
    return factor


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of vectors (3, n, k)."""
    product: Floats = np.stack([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])
    return product


@lru_cache(maxsize=1)
def known_materials() -> dict[str, Material]:
    """All materials of the table ``materials.csv`` by name, each with the source of its figures."""
    text = resources.files("weavecore.weaving").joinpath("materials.csv").read_text("utf-8")
    return {
        row["name"]: Material(
            row["name"],
            modulus=float(row["modulus_gpa"]),
            strength=float(row["strength_mpa"]),
            factor=float(row["factor"]),
            density=float(row["density_kg_m3"]),
            source=row["source"],
        )
        for row in csv.DictReader(text.splitlines())
    }


def material_named(name: str) -> Material:
    """The material of that name.

    Parameters
    ----------
    name : str
        As in ``materials.csv``, such as ``"gfrp"``.

    Returns
    -------
    Material

    Raises
    ------
    Unsupported
        When the table has none of that name.
    """
    known = known_materials()
    if name not in known:
        raise Unsupported(
            f"Unknown material {name!r}",
            remedy=f"Take one of: {', '.join(known)}; or give a Material of your own.",
        )
    return known[name]
