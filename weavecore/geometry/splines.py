"""Cubic splines through many rows of points at once, fitted by SciPy.

A *row* is one curve: points ``offsets[r]:offsets[r + 1]``.  The parameter is the length of the chords.
An open spline has no curvature at its ends, as a rod has that is held at its points and free
at its ends; a closed one goes around smoothly.  Between two points the curve is one cubic, known
from the points and derivatives at its ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of

DEGREE = 3
_GAUSS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, eq=False)
class SplineRows:
    """Splines through rows of points, as cubics between them; see `RodAxes` for the arrays."""

    derivatives: Floats
    parameters: Floats
    ends: Floats


@dataclass(frozen=True, eq=False)
class BSplineRows:
    """The same splines as B-splines; see `RodAxes` for the arrays."""

    knot_offsets: Ints
    knots: Floats
    control_offsets: Ints
    controls: Floats


@dataclass(frozen=True, eq=False)
class CurveSamples:
    """Points along curves, ends included; of a closed curve the first one comes again at the end.

    Parameters
    ----------
    offsets : (R+1,) int64
    points, tangents : (N, 3) float64
        Tangents are of unit length.
    stations : (N,) float64
        Arc length from the start of the curve.
    is_given : (N,) bool
        Whether the sample is one of the points that the curve was fitted to, once each.
    """

    offsets: Ints
    points: Floats
    tangents: Floats
    stations: Floats
    is_given: Bools


def fit_splines(points: Floats, offsets: Ints, closed: Bools) -> SplineRows:
    """Interpolate each row of points (two at least, three of a closed row) by a cubic spline."""
    derivatives = np.zeros_like(points)
    parameters = np.zeros(len(points))
    ends = np.zeros(len(closed))
    for row, is_closed in enumerate(closed.tolist()):
        part = slice(offsets[row], offsets[row + 1])
        through = _points_through(points[part], is_closed)
        at = _chord_parameters(through)
        count = part.stop - part.start
        parameters[part], ends[row] = at[:count], at[-1]
        if count == 2:
            derivatives[part] = (through[1] - through[0]) / at[-1]
        else:
            spline = CubicSpline(at, through, bc_type="periodic" if is_closed else "natural")
            derivatives[part] = spline.c[2] if is_closed else spline(at, 1)
    return SplineRows(derivatives, parameters, ends)


def as_b_splines(points: Floats, offsets: Ints, closed: Bools) -> BSplineRows:
    """The splines of `fit_splines` with the knots and control points of B-splines."""
    knots: list[Floats] = []
    controls: list[Floats] = []
    for row, is_closed in enumerate(closed.tolist()):
        through = _points_through(points[offsets[row] : offsets[row + 1]], is_closed)
        at = _chord_parameters(through)
        if len(through) == 2:
            knots.append(np.repeat(at, DEGREE + 1))
            controls.append(through[0] + (through[1] - through[0]) * (np.arange(DEGREE + 1) / DEGREE)[:, None])
            continue
        spline: Any = make_interp_spline(at, through, k=DEGREE, bc_type="periodic" if is_closed else "natural")
        knots.append(spline.t)
        controls.append(spline.c)
    return BSplineRows(
        offsets_of([len(k) for k in knots]),
        np.concatenate([*knots, np.zeros(0)]),
        offsets_of([len(c) for c in controls]),
        np.concatenate([*controls, np.zeros((0, 3))]),
    )


def _points_through(points: Floats, is_closed: bool) -> Floats:
    return np.concatenate([points, points[:1]]) if is_closed else points


def _chord_parameters(through: Floats) -> Floats:
    chords = np.linalg.norm(np.diff(through, axis=0), axis=1)
    # Two visits at one place would make no spline at all.
    chords = np.maximum(chords, 1e-9 * max(float(chords.sum()), np.finfo(float).tiny))
    return np.concatenate([[0.0], np.cumsum(chords)])


def span_ends(parameters: Floats, offsets: Ints, closed: Bools, ends: Floats) -> tuple[Ints, Ints, Floats]:
    """First and last point of every cubic, and the length (n,) of its parameter; cubics in the order of the points."""
    after = next_in_loop(offsets)
    owner = rows_of(offsets)
    start = np.flatnonzero(closed[owner] | (after > np.arange(len(owner))))
    stop = after[start]
    reach = np.where(stop > start, parameters[stop], ends[owner[start]]) - parameters[start]
    return start, stop, reach


def cubic_points(p: Floats, q: Floats, dp: Floats, dq: Floats, width: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Points (n, 3) and derivatives by the parameter (n, 3) at ``t`` (n,) from 0 to 1 of cubics in Hermite form."""
    t, width = t[:, None], width[:, None]
    s = 1.0 - t
    place = s * s * (1 + 2 * t) * p + t * t * (3 - 2 * t) * q + width * t * s * (s * dp - t * dq)
    slope = 6 * t * s / width * (q - p) + s * (1 - 3 * t) * dp + t * (3 * t - 2) * dq
    return place, slope


def sample_curves(
    points: Floats,
    derivatives: Floats,
    parameters: Floats,
    offsets: Ints,
    closed: Bools,
    ends: Floats,
    *,
    step: Union[float, Floats],
) -> CurveSamples:
    """Sample all rows so that no two samples are further than ``step`` apart; the rows' points are among them.

    The step may be one for all, or one for each cubic of `span_ends`.
    """
    start, stop, reach = span_ends(parameters, offsets, closed, ends)
    # A cubic through smooth data is little longer than its chord; the rest is room.
    pieces = np.maximum(np.ceil(1.2 * reach / step), 1).astype(np.int64)
    span = np.repeat(np.arange(len(start)), pieces)
    nth = np.arange(len(span)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    part = 1.0 / pieces[span]

    def curve(span: Ints, t: Floats) -> tuple[Floats, Floats]:
        a, b = start[span], stop[span]
        return cubic_points(points[a], points[b], derivatives[a], derivatives[b], reach[span], t)

    piece_length = np.zeros(len(span))
    for x, weight in zip(*_GAUSS):
        _, slope = curve(span, (nth + (1 + x) / 2) * part)
        piece_length += weight / 2 * part * reach[span] * np.linalg.norm(slope, axis=1)
    row = rows_of(offsets)[start][span]
    n_pieces = np.bincount(row, minlength=len(closed))
    sample_offsets = offsets_of(n_pieces + 1)
    is_last = np.zeros(sample_offsets[-1], bool)
    is_last[sample_offsets[1:] - 1] = True
    final = np.cumsum(n_pieces) - 1
    place, slope = (np.empty((len(is_last), 3)) for _ in "ab")
    place[~is_last], slope[~is_last] = curve(span, nth * part)
    place[is_last], slope[is_last] = curve(span[final], np.ones(len(final)))
    total = np.concatenate([[0.0], np.cumsum(piece_length)])
    upto = np.empty(len(is_last), np.int64)
    upto[~is_last], upto[is_last] = np.arange(len(span)), final + 1
    stations = total[upto] - np.repeat(total[upto[sample_offsets[:-1]]], n_pieces + 1)
    size = np.linalg.norm(slope, axis=1, keepdims=True)
    is_given = is_last & ~closed[rows_of(sample_offsets)]
    is_given[~is_last] = nth == 0
    return CurveSamples(sample_offsets, place, slope / np.maximum(size, np.finfo(float).tiny), stations, is_given)


# ----------------------------------------------------------------------
# Curvature along sampled curves, as a mean over a window of arc length: at a point it would tell of noise.

_STRAIGHT = 1e-9
"""A curve that turns by less than this over its length is straight."""


def mean_curvature(samples: CurveSamples, closed: Bools, window: float) -> tuple[Floats, Floats]:
    """Mean curvature over the window that begins at each sample, and the station of its middle.

    The mean is of magnitudes: what bends one way does not make good what bends the other.
    At the end of an open curve the window is moved back; on a curve shorter than the window it is
    the curve.
    """
    row = rows_of(samples.offsets)
    last = samples.offsets[1:] - 1
    length = samples.stations[last]
    chord = np.linalg.norm(np.diff(samples.tangents, axis=0), axis=1)
    turn = 2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))
    turn[last[:-1]] = 0.0
    total = np.concatenate([[0.0], np.cumsum(turn)])
    within = total - total[samples.offsets[:-1]][row]
    width = np.minimum(window, length)
    latest = np.where(closed, length, length - width)
    begin = np.minimum(samples.stations, latest[row])
    end = begin + width[row]
    laps = np.where(end > length[row], 1.0, 0.0)
    turned = _interpolate(samples, within, row, end - laps * length[row]) + laps * within[last][row]
    turned -= _interpolate(samples, within, row, begin)
    curvature: Floats = np.divide(turned, width[row], out=np.zeros_like(turned), where=width[row] > 0)
    return np.where(curvature * length[row] > _STRAIGHT, curvature, 0.0), begin + width[row] / 2.0


def points_at_stations(samples: CurveSamples, curve: Ints, station: Floats) -> Floats:
    """Points (n, 3) at stations along the given curves."""
    columns = [_interpolate(samples, samples.points[:, k], curve, station) for k in range(3)]
    points: Floats = np.stack(columns, axis=1)
    return points


def _interpolate(samples: CurveSamples, values: Floats, curve: Ints, station: Floats) -> Floats:
    """Values at stations, linear between the samples of the same curve."""
    length = samples.stations[samples.offsets[1:] - 1]
    # All curves end to end, each a gap after the one before, make one rising row.
    gap = float(length.max(initial=0.0)) + 1.0
    base = np.concatenate([[0.0], np.cumsum(length + gap)])[:-1]
    return np.interp(base[curve] + station, base[rows_of(samples.offsets)] + samples.stations, values)
