"""The largest diameters with which rods can be bent to their places, if all rods grow in proportion.

The utilisation of a span at diameters f times as large is a function of f alone (`weavecore.weaving.bent_rods`), and
the thickest rod that passes is its root, by bisection and Newton's method.  All spans together are measured at single
factors; roots are found only where a rod may be the least that is asked for.  Linear in the visits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, small_products
from weavecore.geometry.splines import polynomial_values, squares_of
from weavecore.polling import each
from weavecore.weaving.bent_rods import SAMPLES_PER_SPAN, SPANS_AT_ONCE, BentRods, cross_of_columns

_LEAST_FACTOR, _MOST_FACTOR = 1e-3, 1e3
"""Range of the factors that are looked for."""

_STEP = 2.0
"""Ratio of the factors between which roots are bracketed."""

_WORTH_A_COPY = 0.8
"""Share of the samples still looked at below which they are copied together."""

_BISECTIONS, _NEWTON_STEPS = 10, 3
"""Halvings of the logarithm of the factor, which leave 1.4 % from a range of 1e6 to 1, and the steps that follow: each
squares what is left, to a part of 1e-12 at the end."""


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
    for begin in each(range(0, len(spans), SPANS_AT_ONCE)):
        part = slice(begin, begin + SPANS_AT_ONCE)
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
        t = np.arange(SAMPLES_PER_SPAN) / SAMPLES_PER_SPAN
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
            cross_of_columns(one[:3], two[:3]),
            cross_of_columns(one[:3], two[3:]) + cross_of_columns(one[3:], two[:3]),
            cross_of_columns(one[3:], two[3:]),
        ]
        return _Samples(squares_of(np.stack([one[:3], one[3:]])), squares_of(np.stack(turn)))


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
