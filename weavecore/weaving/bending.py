"""Bending: the least radius of every rod, against what its material allows, and the thickest rod that passes.

A straight rod of diameter d that is bent to radius R carries the bending stress E·d / (2R); the allowable stress is
the strength divided by a safety factor, so R must be at least ``E·d / (2 σ/factor)``: `Material.least_bend` diameters.

The curvature is that of the axis, at each point: the axis is the spline through the ties, which is the curve that a
thin rod takes between them (least bending energy, to first order).  On a span the second derivative is linear,
so the curvature is greatest at a tie or near the middle of the span; it is sampled densely enough for both.

A thicker rod undulates more: at each tie the axis is shifted out of the surface by a multiple of the diameter.  The
spline is linear in the places that it goes through, ``r(t; f) = a(t) + f b(t)`` for diameters f times as large, so the
utilisation as a function of f follows from one more fit, and the thickest rod that passes is its root, by bisection.

The materials and their figures, with sources, are in ``materials.csv``.

Source: bending of gridshells, Navier laboratory (Créteil 2013); splines, de Boor 1978.  Linear in the visits.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of, small_products
from weavecore.geometry.splines import SplineRows, cubic_points, fit_derivatives, span_ends
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

_WORTH_A_COPY = 0.8
"""Share of the samples still looked at below which they are copied together."""

_BISECTIONS, _NEWTON_STEPS = 10, 3
"""Halvings of the logarithm of the factor, which leave 1.4 % from a range of 1e6 to 1, and the steps that follow: each
squares what is left, to a part of 1e-12 at the end."""

_STRAIGHT = 1e-9
"""An axis whose curvature times its length is below this is straight."""


@dataclass(frozen=True, eq=False)
class Sharpest:
    """Where rods are bent most sharply, and how thick they may be.

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
    largest : (M,) float64
        The largest diameter that passes in the half spans on both sides of each visit, if all rods grow in
        proportion; infinite where any passes.
    """

    start: Ints
    stop: Ints
    width: Floats
    t: Floats
    radius: Floats
    utilisation: Floats
    largest: Floats


def measure_bending(axes: RodAxes, normals: Floats, *, diameters: Floats, material: Material) -> tuple[Bending, Floats]:
    """Find the sharpest bend of every rod, and how thick it could be.

    Parameters
    ----------
    axes : RodAxes
    normals : (M, 3) float64
        Unit normal of the surface at each visit, along which the axis is shifted.
    diameters : (S,) float64
        Of the rods, in the model's unit.
    material : Material

    Returns
    -------
    bending : Bending
    largest : (M,) float64
        As of `Sharpest`.
    """
    rows = SplineRows(axes.derivatives, axes.parameters, axes.ends)
    shift = axes.layer_offsets[:, None] * normals
    found = find_sharpest(axes.points, rows, shift, axes.offsets, axes.closed, diameters=diameters, material=material)
    points, slopes, start, stop = axes.points, axes.derivatives, found.start, found.stop
    point, _ = cubic_points(points[start], points[stop], slopes[start], slopes[stop], found.width, found.t)
    # Arc length to the place, to first order between two visits.
    ahead = np.where(found.stop > found.start, axes.stations[found.stop], axes.lengths)
    station = axes.stations[found.start] + found.t * (ahead - axes.stations[found.start])
    bending = Bending(
        min_radius=found.radius,
        station_at_min=station,
        point_at_min=point,
        utilisation=found.utilisation,
        largest_diameter=np.minimum.reduceat(found.largest, axes.offsets[:-1]) if len(axes) else found.largest,
    )
    return bending, found.largest


def find_sharpest(
    points: Floats,
    rows: SplineRows,
    shift: Floats,
    offsets: Ints,
    closed: Bools,
    *,
    diameters: Floats,
    material: Material,
    known: Optional[Floats] = None,
) -> Sharpest:
    """Find where rods are bent most sharply, from their splines alone.

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
    known : (M,) float64, optional
        ``largest`` of `Sharpest` where it is known, else NaN.

    Returns
    -------
    Sharpest
    """
    start, stop, width = span_ends(rows.parameters, offsets, closed, rows.ends)
    chord = np.ones(len(points))
    chord[start] = width
    both = np.hstack([points - shift, shift])
    slopes = fit_derivatives(both, offsets, closed, chord)
    rod = rows_of(offsets)[start]
    least_radius = material.least_bend * diameters
    if known is None:
        known = np.full(len(points), np.nan)
    is_wanted = np.isnan(known[start]) | np.isnan(known[stop])
    curvature = np.empty((len(start), _SAMPLES_PER_SPAN))
    factor = np.full((len(start), 2), np.inf)
    for begin in each(range(0, len(start), _SPANS_AT_ONCE)):
        part = slice(begin, begin + _SPANS_AT_ONCE)
        spans = _Spans.of(both, slopes, start[part], stop[part], width[part])
        curvature[part] = spans.curvature()
        wanted = np.flatnonzero(is_wanted[part])
        factor[begin + wanted] = _largest_factors(spans.some(wanted), least_radius[rod[begin + wanted]])
    length = np.bincount(rod, width, len(diameters))
    curvature[curvature * length[rod][:, None] < _STRAIGHT] = 0.0
    worst = _first_greatest(curvature.ravel(), np.repeat(rod, _SAMPLES_PER_SPAN), len(diameters))
    span, sample = np.divmod(worst, _SAMPLES_PER_SPAN)
    with np.errstate(divide="ignore"):
        radius = 1.0 / curvature.ravel()[worst]
    largest = np.full(len(points), np.inf)
    for at, column in ((start, 0), (stop, 1)):  # Each visit begins one span at most and ends one at most.
        largest[at] = np.minimum(largest[at], factor[:, column])
    return Sharpest(
        start[span],
        stop[span],
        width[span],
        sample / _SAMPLES_PER_SPAN,
        radius,
        least_radius / radius,
        np.where(np.isnan(known), largest * np.repeat(diameters, np.diff(offsets)), known),
    )


@dataclass(frozen=True, eq=False)
class _Spans:
    """Samples of spans (n, k) as polynomials in the factor of all diameters, coefficients from degree 0 on.

    ``speed`` is the square of |r'|, of degree 2, and ``bend`` that of |r' x r''|, of degree 4.
    """

    speed: list[Floats]
    bend: list[Floats]

    @staticmethod
    def of(values: Floats, slopes: Floats, start: Ints, stop: Ints, width: Floats) -> _Spans:
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
        return _Spans(_square([one[:3], one[3:]]), _square(turn))

    def some(self, spans: Ints) -> _Spans:
        """Some of the spans."""
        return _Spans([one[spans] for one in self.speed], [one[spans] for one in self.bend])

    def curvature(self) -> Floats:
        """Of the rods as they are; 0 where a curve stands still."""
        speed = np.sqrt(np.maximum(_polynomial(self.speed, 1.0), 0.0))
        turn = np.sqrt(np.maximum(_polynomial(self.bend, 1.0), 0.0))
        curvature: Floats = np.divide(turn, speed * speed * speed, out=np.zeros_like(speed), where=speed > 0)
        return curvature


def _first_greatest(values: Floats, row: Ints, n_rows: int) -> Ints:
    """Index of the greatest value of each row, the first of equals; rows rise."""
    first = np.searchsorted(row, np.arange(n_rows))
    greatest = np.maximum.reduceat(values, first) if n_rows else np.zeros(0)
    at = np.flatnonzero(values == greatest[row])
    _, nth = np.unique(row[at], return_index=True)
    return at[nth]


def _largest_factors(spans: _Spans, least_radius: Floats) -> Floats:
    """(n, 2) factor of all diameters at which the utilisation reaches 1 in each half of spans; infinite where never.

    ``least_radius`` (n,) is that of the rods as they are.
    """
    n, k = spans.bend[0].shape
    half = (2 * np.arange(n)[:, None] + (np.arange(k) >= k // 2)).ravel()
    square = np.repeat(least_radius**2, k)
    table = np.stack([square, *(one.ravel() for one in (*spans.bend, *spans.speed))])
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
    speed = _polynomial(table[6:], factor)
    too_sharp: Bools = table[0] * factor**2 * _polynomial(table[1:6], factor) > speed * speed * speed
    return too_sharp


def _roots_below(table: Floats, low: Floats, high: Floats) -> Floats:
    """The factor (n,) between two near ones from which on a sample is too sharp, by Newton's method."""
    degrees = np.arange(1, 5)[:, None]
    bend_slopes, speed_slopes = table[2:6] * degrees, table[7:] * degrees[:2]
    factor = high
    for _ in range(_NEWTON_STEPS):
        bend, speed = _polynomial(table[1:6], factor), _polynomial(table[6:], factor)
        value = table[0] * factor**2 * bend - speed * speed * speed
        slope = table[0] * factor * (2.0 * bend + factor * _polynomial(bend_slopes, factor))
        slope -= 3.0 * speed**2 * _polynomial(speed_slopes, factor)
        step = np.divide(value, slope, out=np.zeros_like(value), where=slope > 0)
        factor = np.clip(factor - step, low, high)
    return factor


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of vectors (3, n, k)."""
    product: Floats = np.stack([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])
    return product


def _square(vectors: list[Floats]) -> list[Floats]:
    """Square of the length of a polynomial with vectors (3, n, k) as its coefficients, from degree 0 on."""
    degree = len(vectors) - 1
    found = [np.zeros(vectors[0].shape[1:]) for _ in range(2 * degree + 1)]
    for i, one in enumerate(vectors):
        for j, other in enumerate(vectors[: i + 1]):
            found[i + j] += (1.0 if i == j else 2.0) * (one * other).sum(0)
    return found


def _polynomial(coefficients: Union[Floats, list[Floats]], at: Union[float, Floats]) -> Floats:
    """Value of a polynomial by Horner's rule, coefficients from degree 0 on."""
    value: Floats = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * at + coefficient
    return value


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
