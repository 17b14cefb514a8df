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

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, cross, dots
from weavecore.geometry.splines import cubic_curvatures, cubic_points, fit_derivatives, span_ends
from weavecore.model.bending import Bending, Material
from weavecore.model.rod_axes import RodAxes
from weavecore.polling import poll

_SAMPLES_PER_SPAN = 8
"""Samples of each span, its first end included: with 16 the least radius of the samples' rods moves by under 0.5 %."""

_BISECTIONS = 30
"""Halvings of the logarithm of the factor: 1e-8 of it at the end, from a range of 1e6 to 1."""

_STRAIGHT = 1e-9
"""An axis whose curvature times its length is below this is straight."""


@dataclass(frozen=True, eq=False)
class _Samples:
    """Places on the spans of all axes: the span's two visits, its width by the parameter, and t from 0 to 1."""

    rod: Ints
    start: Ints
    stop: Ints
    width: Floats
    t: Floats


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
        The largest diameter that passes in the half spans on both sides of each visit, if all rods grow in
        proportion; infinite where any passes.
    """
    places = _sample_spans(axes)
    hermite = _hermite(places, axes.points, axes.derivatives)
    curvature = cubic_curvatures(*hermite, places.width, places.t)
    curvature[curvature * axes.lengths[places.rod] < _STRAIGHT] = 0.0
    worst = _first_greatest(curvature, places.rod, len(axes))
    with np.errstate(divide="ignore"):
        radius = 1.0 / curvature[worst]
    p, q, dp, dq = (part[worst] for part in hermite)
    point, _ = cubic_points(p, q, dp, dq, places.width[worst], places.t[worst])
    least_radius = material.least_bend * diameters
    largest = diameters[axes.strand] * _largest_factors(axes, normals, places, least_radius)
    bending = Bending(
        min_radius=radius,
        station_at_min=_stations(axes, places)[worst],
        point_at_min=point,
        utilisation=least_radius / radius,
        largest_diameter=np.minimum.reduceat(largest, axes.offsets[:-1]) if len(axes) else largest,
    )
    return bending, largest


def _sample_spans(axes: RodAxes) -> _Samples:
    start, stop, width = span_ends(axes.parameters, axes.offsets, axes.closed, axes.ends)
    span = np.repeat(np.arange(len(start)), _SAMPLES_PER_SPAN + 1)
    t = np.tile(np.linspace(0.0, 1.0, _SAMPLES_PER_SPAN + 1), len(start))
    return _Samples(axes.strand[start[span]], start[span], stop[span], width[span], t)


def _stations(axes: RodAxes, places: _Samples) -> Floats:
    """Arc length (n,) to each sample, to first order between two visits."""
    ahead = np.where(places.stop > places.start, axes.stations[places.stop], axes.lengths[places.rod])
    stations: Floats = axes.stations[places.start] + places.t * (ahead - axes.stations[places.start])
    return stations


def _hermite(places: _Samples, points: Floats, derivatives: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    return points[places.start], points[places.stop], derivatives[places.start], derivatives[places.stop]


def _first_greatest(values: Floats, row: Ints, n_rows: int) -> Ints:
    """Index of the greatest value of each row, the first of equals; rows rise."""
    greatest = np.zeros(n_rows)
    np.maximum.at(greatest, row, values)
    at = np.flatnonzero(values == greatest[row])
    _, first = np.unique(row[at], return_index=True)
    return at[first]


def _largest_factors(axes: RodAxes, normals: Floats, places: _Samples, least_radius: Floats) -> Floats:
    """(M,) factor of all diameters at which the utilisation reaches 1 near each visit; infinite where any passes.

    ``least_radius`` (S,) is that of the rods as they are.
    """
    shift = axes.layer_offsets[:, None] * normals
    still = axes.points - shift
    chord = np.ones(len(still))
    chord[places.start] = places.width
    slopes = fit_derivatives(np.hstack([still, shift]), axes.offsets, axes.closed, chord)
    first, second = [], []
    for values, derivatives in ((still, slopes[:, :3]), (shift, slopes[:, 3:])):
        p, q, dp, dq = _hermite(places, values, derivatives)
        first.append(cubic_points(p, q, dp, dq, places.width, places.t)[1])
        t, width = places.t[:, None], places.width[:, None]
        second.append((6 - 12 * t) / width**2 * (q - p) + ((6 * t - 4) * dp + (6 * t - 2) * dq) / width)
    # The squares of the speed |r'| and of |r' x r''| are polynomials in the factor: coefficients from degree 0 on.
    turn = [
        cross(first[0], second[0]),
        cross(first[0], second[1]) + cross(first[1], second[0]),
        cross(first[1], second[1]),
    ]
    speed, bend = _square(first), _square(turn)
    visit = np.where(places.t < 0.5, places.start, places.stop)
    allowed_radius = least_radius[places.rod]
    low, high = np.full(len(still), 1e-3), np.full(len(still), 1e3)

    def passes(trial: Floats) -> Bools:
        f = trial[visit]
        allowed = np.ones(len(still), bool)
        allowed[visit[(allowed_radius * f) ** 2 * _polynomial(bend, f) > _polynomial(speed, f) ** 3]] = False
        return allowed

    endless = passes(high)
    for _ in range(_BISECTIONS):
        poll()
        middle = np.sqrt(low * high)
        good = passes(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(endless, np.inf, low)


def _square(vectors: list[Floats]) -> list[Floats]:
    """Square of the length of a polynomial with vectors (n, 3) as its coefficients, from degree 0 on."""
    degree = len(vectors) - 1
    found = [np.zeros(len(vectors[0])) for _ in range(2 * degree + 1)]
    for i, one in enumerate(vectors):
        for j, other in enumerate(vectors):
            found[i + j] += dots(one, other)
    return found


def _polynomial(coefficients: list[Floats], at: Floats) -> Floats:
    value = coefficients[-1]
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
