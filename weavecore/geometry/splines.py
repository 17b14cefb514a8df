"""Cubic splines through many rows of points at once, sampling of them, and curvature along the samples.

A *row* is one curve: points ``offsets[r]:offsets[r + 1]``.  The parameter t is the length of the chords.  An open
spline has no curvature at its ends, as a rod that is pinned at its points; a closed one is periodic.  Between two
points p and q, with derivatives dp and dq and the parameter width w, the curve is a Hermite cubic in s = (t - t_p) /
w::

    p (1 - s)² (1 + 2s) + q s² (3 - 2s) + w s (1 - s) (dp (1 - s) - dq s)

Arc lengths are integrals over four Gauss points for each sample.  Work: linear in points and samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Union

import numpy as np
from scipy.linalg import solve_banded

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, ranks_in_rows, rows_of
from weavecore.polling import each, poll

DEGREE = 3
_NEAR, _FAR = (np.sqrt(3 / 7 + sign * (2 / 7) * np.sqrt(6 / 5)) for sign in (-1, 1))
_HEAVY, _LIGHT = ((18 + sign * np.sqrt(30)) / 36 for sign in (1, -1))
_GAUSS = np.array([-_FAR, -_NEAR, _NEAR, _FAR]), np.array([_LIGHT, _HEAVY, _HEAVY, _LIGHT])
"""Places and weights of Gauss and Legendre, exact for polynomials of degree 7."""

_LENGTH_OF_CHORD = 1.2
"""Arc length over chord for which room is left: a cubic through smooth data is little longer than its chord."""

_SAMPLES_AT_ONCE = 1 << 17
"""Samples that are worked on between two polls."""


@dataclass(frozen=True, eq=False)
class SplineRows:
    """Splines through rows of points, as cubics between them.

    Parameters
    ----------
    derivatives : (N, 3) float64
        By the parameter, at each point.
    parameters : (N,) float64
        Of each point.
    ends : (R,) float64
        At the end of each row; of a closed one where it comes back to its first point.
    """

    derivatives: Floats
    parameters: Floats
    ends: Floats


@dataclass(frozen=True, eq=False)
class BSplineRows:
    """The same splines as B-splines of degree `DEGREE`.

    Parameters
    ----------
    knot_offsets, knots : ragged float64
    control_offsets, controls : ragged (n, 3) float64
    """

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
    curvatures : (N,) float64
        Of the curve at the sample, not negative.
    is_given : (N,) bool
        Whether the sample is one of the points that the curve was fitted to, once each.
    """

    offsets: Ints
    points: Floats
    tangents: Floats
    stations: Floats
    curvatures: Floats
    is_given: Bools


def fit_splines(points: Floats, offsets: Ints, closed: Bools) -> SplineRows:
    """Interpolate each row of points by a cubic spline whose parameter is the length of the chords.

    Parameters
    ----------
    points : (N, 3) float64
    offsets : (R+1,) int64
        Row ``r`` is ``points[offsets[r]:offsets[r + 1]]``: two points at least, three of a closed row.
    closed : (R,) bool

    Returns
    -------
    SplineRows
    """
    chord = _chords(points, offsets, closed)
    parameters, last = np.zeros(len(points)), offsets[1:] - 1
    # Sums of single rows do not depend on the rows before.
    for begin, end in zip(offsets[:-1].tolist(), last.tolist()):
        np.cumsum(chord[begin:end], out=parameters[begin + 1 : end + 1])
    ends = parameters[last] + np.where(closed, chord[last], 0.0)
    return SplineRows(fit_derivatives(points, offsets, closed, chord), parameters, ends)


def fit_derivatives(values: Floats, offsets: Ints, closed: Bools, chord: Floats) -> Floats:
    """Derivatives at the points of the splines through rows of values, over given steps of the parameter.

    With steps h and values y, the derivatives m of a spline satisfy (de Boor 1978, chapter IV)::

        m[i-1]/h[i-1] + 2 m[i] (1/h[i-1] + 1/h[i]) + m[i+1]/h[i] = 3 (y[i]-y[i-1])/h[i-1]² + 3 (y[i+1]-y[i])/h[i]²

    At a free end the step beyond it is left out, which makes the second derivative zero.  All rows are one
    tridiagonal system; the corner entries of a closed row are a change of rank one (Sherman and Morrison 1950).

    Parameters
    ----------
    values : (N, k) float64
    offsets : (R+1,) int64
    closed : (R,) bool
    chord : (N,) float64
        Parameter from each point to the next of its row; positive, of no meaning at the last point of an open row.

    Returns
    -------
    (N, k) float64
    """
    poll()
    n = len(values)
    if n == 0:
        return np.zeros_like(values)
    after = next_in_loop(offsets)
    before = np.empty_like(after)
    before[after] = np.arange(n)
    first, last = offsets[:-1], offsets[1:] - 1
    ahead, behind = 1.0 / chord, 1.0 / chord[before]
    ahead[last[~closed]] = behind[first[~closed]] = 0.0
    rise = (values[after] - values) * (3.0 * ahead**2)[:, None]
    corner = np.zeros(n)
    corner[first[closed]] = corner[last[closed]] = ahead[last[closed]]
    banded = np.zeros((3, n))
    banded[0, 1:], banded[1], banded[2, :-1] = ahead[:-1], 2.0 * (ahead + behind) - corner, behind[1:]
    banded[0, first] = banded[2, last] = 0.0
    found: Floats = solve_banded((1, 1), banded, np.column_stack([rise + rise[before], corner]))
    derivatives, response = found[:, :-1], found[:, -1:]
    share = (derivatives[first] + derivatives[last]) / (1.0 + response[first] + response[last])
    fitted: Floats = derivatives - response * np.where(closed[:, None], share, 0.0)[rows_of(offsets)]
    return fitted


def as_b_splines(rows: SplineRows, points: Floats, offsets: Ints, closed: Bools) -> BSplineRows:
    """Knots and control points of the splines in B-spline form.

    The control point of the knots ``a, b, c`` is the blossom of the cubic there (Ramshaw 1987); with b a point of
    the row, y, m and s its value and derivatives, it is ``y + m/3 (a + c - 2 b) + s/6 (a - b) (c - b)``.

    Parameters
    ----------
    rows : SplineRows
    points : (N, 3) float64
    offsets : (R+1,) int64
    closed : (R,) bool
    """
    second = second_derivatives(points, rows, offsets, closed)
    n = np.diff(offsets)
    n_knots = n + 2 * DEGREE + closed
    row = np.repeat(np.arange(len(n)), n_knots)
    nth = ranks_in_rows(n_knots) - DEGREE
    # Before its first and after its last point a closed row goes round again, an open one stays there.
    within = np.where(closed[row], nth % n[row], np.clip(nth, 0, n[row] - 1))
    lap = np.where(closed[row], nth // n[row], 0)
    knots = rows.parameters[offsets[row] + within] + lap * rows.ends[row]
    n_controls = n_knots - DEGREE - 1
    # The knots a, b and c of a control point are the three that follow the knot of its own number.
    middle = np.repeat(offsets_of(n_knots)[:-1], n_controls) + ranks_in_rows(n_controls) + 2
    at = offsets[row[middle]] + within[middle]
    back, forth = ((knots[middle + k] - knots[middle])[:, None] for k in (-1, 1))
    controls = points[at] + rows.derivatives[at] * (back + forth) / 3.0 + second[at] * back * forth / 6.0
    return BSplineRows(offsets_of(n_knots), knots, offsets_of(n_controls), controls)


def b_spline_points(splines: BSplineRows, row: Ints, at: Floats) -> Floats:
    """Points of B-splines by de Boor's algorithm (de Boor 1978, chapter X).

    Parameters
    ----------
    splines : BSplineRows
    row : (n,) int64
        The spline of each point.
    at : (n,) float64
        Parameters, within the first and the last knot that are not beyond the ends.

    Returns
    -------
    (n, 3) float64
    """
    first, last = splines.knot_offsets[row] + DEGREE, splines.knot_offsets[row + 1] - DEGREE - 1
    low, high = first, last - 1  # The knot before which each parameter begins, by bisection.
    while (low < high).any():
        middle = (low + high + 1) // 2
        is_beyond = splines.knots[middle] <= at
        low, high = np.where(is_beyond, middle, low), np.where(is_beyond, high, np.maximum(middle - 1, low))
    knot = low - DEGREE
    control = splines.control_offsets[row] + low - first
    points: list[Floats] = [splines.controls[control + k] for k in range(DEGREE + 1)]
    for level in range(1, DEGREE + 1):
        for k in range(DEGREE, level - 1, -1):
            start, stop = splines.knots[knot + k], splines.knots[knot + k + DEGREE + 1 - level]
            part = ((at - start) / (stop - start))[:, None]
            points[k] = (1.0 - part) * points[k - 1] + part * points[k]
    return points[DEGREE]


def second_derivatives(points: Floats, rows: SplineRows, offsets: Ints, closed: Bools) -> Floats:
    """Second derivatives (N, 3) at the points of fitted splines, which are the same from both sides."""
    start, stop, reach = span_ends(rows.parameters, offsets, closed, rows.ends)
    reach = reach[:, None]
    rise = 6.0 * (points[stop] - points[start]) / reach**2
    second = np.zeros_like(points)
    second[stop] = (2.0 * rows.derivatives[start] + 4.0 * rows.derivatives[stop]) / reach - rise
    second[start] = rise - (4.0 * rows.derivatives[start] + 2.0 * rows.derivatives[stop]) / reach
    return second


def _chords(points: Floats, offsets: Ints, closed: Bools) -> Floats:
    """Length (N,) from each point to the next of its row, around closed ones; 1 at the last point of an open row."""
    chord: Floats = np.linalg.norm(points[next_in_loop(offsets)] - points, axis=1)
    chord[offsets[1:][~closed] - 1] = 0.0
    total = np.add.reduceat(chord, offsets[:-1]) if len(chord) else chord
    # Two visits at one place would make no spline at all.
    chord = np.maximum(chord, 1e-9 * np.maximum(total, np.finfo(float).tiny)[rows_of(offsets)])
    chord[offsets[1:][~closed] - 1] = 1.0
    return chord


def span_ends(parameters: Floats, offsets: Ints, closed: Bools, ends: Floats) -> tuple[Ints, Ints, Floats]:
    """Ends of every cubic, in the order of the points.

    Parameters
    ----------
    parameters : (N,) float64
    offsets : (R+1,) int64
    closed : (R,) bool
    ends : (R,) float64
        Parameter at the end of each row.

    Returns
    -------
    start, stop : (n,) int64
        First and last point of each cubic.
    width : (n,) float64
        Of its parameter.
    """
    after = next_in_loop(offsets)
    owner = rows_of(offsets)
    start = np.flatnonzero(closed[owner] | (after > np.arange(len(owner))))
    stop = after[start]
    reach = np.where(stop > start, parameters[stop], ends[owner[start]]) - parameters[start]
    return start, stop, reach


def slope_polynomials(places: Floats, slopes: Floats, start: Ints, stop: Ints, width: Floats) -> Floats:
    """Derivatives of Hermite cubics by their parameter, as polynomials in t from 0 to 1.

    Parameters
    ----------
    places, slopes : (3, N) float64
        Points and derivatives by the parameter, with x, y and z in rows.
    start, stop : (n,) int64
        First and last point of each cubic.
    width : (n,) float64
        Of its parameter.

    Returns
    -------
    (3, 3, n) float64
        Coefficients from degree 0 on, each with x, y and z in rows.
    """
    first, last = slopes[:, start], slopes[:, stop]
    mean = (places[:, stop] - places[:, start]) / width
    return np.stack([first, 6.0 * mean - 4.0 * first - 2.0 * last, 3.0 * (first + last) - 6.0 * mean])


def squares_of(vectors: Floats) -> Floats:
    """Squares of the lengths of polynomials with vectors as coefficients.

    Parameters
    ----------
    vectors : (d, 3, ...) float64
        From degree 0 on.

    Returns
    -------
    (2 d - 1, ...) float64
    """
    degree = len(vectors) - 1
    squares = np.zeros((2 * degree + 1, *vectors.shape[2:]))
    for i, one in enumerate(vectors):
        for j, other in enumerate(vectors[: i + 1]):
            product = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
            squares[i + j] += product if i == j else 2.0 * product
    return squares


def polynomial_values(coefficients: Floats, at: Union[float, Floats]) -> Floats:
    """Values of polynomials by Horner's rule.

    Parameters
    ----------
    coefficients : (d, ...) float64
        From degree 0 on.
    at : float or array
    """
    value: Floats = coefficients[-1] * at
    for coefficient in coefficients[-2:0:-1]:
        value += coefficient
        value *= at
    value += coefficients[0]
    return value


def cubic_points(p: Floats, q: Floats, dp: Floats, dq: Floats, width: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Points and derivatives of Hermite cubics.

    Parameters
    ----------
    p, q, dp, dq : (n, 3) float64
        Points and derivatives by the parameter at both ends.
    width : (n,) float64
        Of the parameter.
    t : (n,) float64
        From 0 to 1.

    Returns
    -------
    points, derivatives : (n, 3) float64
    """
    poll()
    t, width = t[:, None], width[:, None]
    s = 1.0 - t
    place = s * s * (1 + 2 * t) * p + t * t * (3 - 2 * t) * q + width * t * s * (s * dp - t * dq)
    slope = 6 * t * s / width * (q - p) + s * (1 - 3 * t) * dp + t * (3 * t - 2) * dq
    return place, slope


def cubic_curvatures(p: Floats, q: Floats, dp: Floats, dq: Floats, width: Floats, t: Floats) -> Floats:
    """Curvature of Hermite cubics; 0 where one stands still.

    Parameters
    ----------
    p, q, dp, dq, width, t
        As of `cubic_points`.

    Returns
    -------
    (n,) float64
        Not negative.
    """
    _, slope = cubic_points(p, q, dp, dq, width, t)
    t, width = t[:, None], width[:, None]
    bend = (6.0 - 12.0 * t) / width**2 * (q - p) + ((6.0 * t - 4.0) * dp + (6.0 * t - 2.0) * dq) / width
    speed = np.linalg.norm(slope, axis=1)
    turn = np.linalg.norm(np.cross(slope, bend), axis=1)
    curvatures: Floats = np.divide(turn, speed * speed * speed, out=np.zeros_like(speed), where=speed > 0)
    return curvatures


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
    """Sample all rows; the rows' own points are among the samples.

    Parameters
    ----------
    points : (N, 3) float64
    derivatives, parameters, offsets, closed, ends
        As of `fit_splines` and its result.
    step : float or (n,) float64
        Greatest distance between two samples, for all or for each cubic of `span_ends`.

    Returns
    -------
    CurveSamples
    """
    start, stop, reach = span_ends(parameters, offsets, closed, ends)
    pieces = pieces_of(reach, step)
    span = np.repeat(np.arange(len(start)), pieces)
    nth = ranks_in_rows(pieces)
    share = 1.0 / pieces[span]

    def cubics(span: Ints) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        a, b = start[span], stop[span]
        return points[a], points[b], derivatives[a], derivatives[b], reach[span]

    piece_length = np.zeros(len(span))
    for part in _parts_of(len(span)):
        for x, weight in zip(*_GAUSS):
            _, slope = cubic_points(*cubics(span[part]), (nth[part] + (1 + x) / 2) * share[part])
            piece_length[part] += weight / 2 * share[part] * reach[span[part]] * np.linalg.norm(slope, axis=1)
    row = rows_of(offsets)[start][span]
    n_pieces = np.bincount(row, minlength=len(closed))
    sample_offsets = offsets_of(n_pieces + 1)
    is_last = np.zeros(sample_offsets[-1], bool)
    is_last[sample_offsets[1:] - 1] = True
    final = np.cumsum(n_pieces) - 1
    of_sample = np.empty(len(is_last), np.int64)
    of_sample[~is_last], of_sample[is_last] = span, span[final]
    t = np.ones(len(is_last))
    t[~is_last] = nth * share
    place, tangents, curvatures = np.empty((len(t), 3)), np.empty((len(t), 3)), np.empty(len(t))
    for part in _parts_of(len(t)):
        ends_of_part = cubics(of_sample[part])
        place[part], slope = cubic_points(*ends_of_part, t[part])
        curvatures[part] = cubic_curvatures(*ends_of_part, t[part])
        tangents[part] = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), np.finfo(float).tiny)
    total = np.concatenate([[0.0], np.cumsum(piece_length)])
    upto = np.empty(len(is_last), np.int64)
    upto[~is_last], upto[is_last] = np.arange(len(span)), final + 1
    stations = total[upto] - np.repeat(total[upto[sample_offsets[:-1]]], n_pieces + 1)
    is_given = is_last & ~closed[rows_of(sample_offsets)]
    is_given[~is_last] = nth == 0
    return CurveSamples(sample_offsets, place, tangents, stations, curvatures, is_given)


def arc_stations(
    points: Floats,
    derivatives: Floats,
    parameters: Floats,
    offsets: Ints,
    closed: Bools,
    ends: Floats,
    *,
    step: float,
) -> tuple[Floats, Floats]:
    """Arc lengths of all rows, as of the samples of `sample_curves`, without their points.

    The square of the speed of a cubic is a polynomial of degree 4.

    Parameters
    ----------
    points : (N, 3) float64
    derivatives, parameters, offsets, closed, ends
        As of `fit_splines` and its result.
    step : float
        Greatest length of the pieces that are integrated over.

    Returns
    -------
    stations : (N,) float64
        From the start of the row to each point.
    lengths : (R,) float64
    """
    start, stop, reach = span_ends(parameters, offsets, closed, ends)
    columns = np.ascontiguousarray(points.T), np.ascontiguousarray(derivatives.T)
    square = squares_of(slope_polynomials(*columns, start, stop, reach))
    pieces = pieces_of(reach, step)
    part = np.cumsum(pieces) // _SAMPLES_AT_ONCE
    begins = np.flatnonzero(np.diff(part, prepend=-1))
    length = np.zeros(len(start))
    for first, last in each(zip(begins.tolist(), [*begins[1:].tolist(), len(start)])):
        count = pieces[first:last]
        span = np.repeat(np.arange(first, last), count)
        nth, share = ranks_in_rows(count), (1.0 / pieces)[span]
        coefficients = square[:, span]
        piece = np.zeros(len(span))
        for x, weight in zip(*_GAUSS):
            speed = polynomial_values(coefficients, (nth + (1 + x) / 2) * share)
            piece += weight / 2 * np.sqrt(np.maximum(speed, 0.0))
        length[first:last] = np.bincount(span - first, piece * share * reach[span], last - first)
    total = np.concatenate([[0.0], np.cumsum(length)])
    n_points = np.diff(offsets)
    begin = offsets_of(n_points - ~closed)
    before = np.repeat(begin[:-1], n_points) + ranks_in_rows(n_points)
    return total[before] - total[np.repeat(begin[:-1], n_points)], total[begin[1:]] - total[begin[:-1]]


def _parts_of(n: int) -> Iterator[slice]:
    """Slices that cover n samples, few enough in each for work on it to take a tenth of a second at most."""
    return (slice(k, k + _SAMPLES_AT_ONCE) for k in each(range(0, n, _SAMPLES_AT_ONCE)))


def pieces_of(width: Floats, step: Union[float, Floats]) -> Ints:
    """Number of pieces that each cubic is divided into, so that none is longer than a step.

    Parameters
    ----------
    width : (n,) float64
        Of the parameter.
    step : float or (n,) float64

    Returns
    -------
    (n,) int64
    """
    pieces: Ints = np.maximum(np.ceil(_LENGTH_OF_CHORD * width / step), 1).astype(np.int64)
    return pieces


def points_at_stations(samples: CurveSamples, curve: Ints, station: Floats) -> Floats:
    """Points at stations along curves, linear between samples.

    Parameters
    ----------
    samples : CurveSamples
    curve : (n,) int64
    station : (n,) float64
        Arc length from the start of the curve.

    Returns
    -------
    (n, 3) float64
    """
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
