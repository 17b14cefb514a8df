"""Bending: the least radius of every rod, and what its material says to it.

A straight rod of diameter d that is bent to radius R carries the stress E·d / (2R), so it is
admissible while R ≥ E·d / (2σ).
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.splines import CurveSamples
from weavecore.model.bending import Bending
from weavecore.model.material import Material
from weavecore.model.rod_axes import RodAxes
from weavecore.units import METRES

WINDOW_DIAMETERS, WINDOW_METRES = 5.0, 0.050
"""The curvature is taken over so many diameters, and over 50 mm at least."""

_SAMPLES_PER_WINDOW = 8
_STRAIGHT = 1e-9
"""A rod that turns by less than this over its length is straight."""


def bending_window(rod_diameter: float, unit: str) -> float:
    """The arc length that curvature is taken over; without a known unit 50 mm mean nothing and are left out."""
    window = WINDOW_DIAMETERS * rod_diameter
    return max(window, WINDOW_METRES / METRES[unit]) if unit in METRES else window


def measure_bending(axes: RodAxes, *, rod_diameter: float, material: Material, unit: str) -> Bending:
    """Find the sharpest bend of every rod.

    Parameters
    ----------
    axes : RodAxes
    rod_diameter : float
        In the model's unit.
    material : Material
    unit : str
        Rhino's name of the model's unit.
    """
    window = bending_window(rod_diameter, unit)
    samples = axes.samples(window / _SAMPLES_PER_WINDOW)
    curvature, middle = mean_curvature(samples, axes.closed, window)
    sharpest = _first_greatest(curvature, samples.offsets)
    station = np.where(axes.closed, middle[sharpest] % axes.lengths, middle[sharpest])
    with np.errstate(divide="ignore"):
        radius = 1.0 / curvature[sharpest]
    return Bending(
        window=window,
        min_radius=radius,
        station_at_min=station,
        point_at_min=points_at_stations(samples, np.arange(len(axes)), station),
        utilisation=material.least_bend * rod_diameter / radius,
        largest_diameter=radius / material.least_bend,
    )


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


def _first_greatest(values: Floats, offsets: Ints) -> Ints:
    """Index of the greatest value of each row, the first of equals."""
    row = rows_of(offsets)
    is_greatest = np.flatnonzero(values == np.maximum.reduceat(values, offsets[:-1])[row])
    _, first = np.unique(row[is_greatest], return_index=True)
    return is_greatest[first]
