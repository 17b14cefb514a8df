"""Curvature along sampled curves, as a mean over a window of arc length: at a point it would tell of noise."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.splines import CurveSamples

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
