"""Bending: the least radius of every rod, against what its material allows, and the thickest rod that passes.

A straight rod of diameter d that is bent to radius R carries the bending stress E·d / (2R); the allowable stress is
the strength divided by a safety factor, so R must be at least ``E·d / (2 σ/factor)``: `Material.least_bend` diameters.
The curvature is that of the axis, at each point (`weavecore.weaving.bent_rods`).

Source: bending of gridshells, Navier laboratory (Créteil 2013).  Linear in the visits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.splines import cubic_points
from weavecore.model.bending import Bending
from weavecore.model.rod_axes import RodAxes
from weavecore.weaving.bent_rods import SAMPLES_PER_SPAN, BentRods
from weavecore.weaving.largest_diameters import largest_of_rods

_STRAIGHT = 1e-9
"""An axis whose curvature times its length is below this is straight."""


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
    halves = curvature.reshape(2, SAMPLES_PER_SPAN // 2, -1).max(axis=1)
    return Sharpest(
        start[span],
        stop[span],
        width[span],
        sample / SAMPLES_PER_SPAN,
        radius,
        rods.least_radius / radius,
        rods.greatest_at_visits(halves * rods.least_radius[rod]),
    )


def _first_greatest(values: Floats, row: Ints, n_rows: int) -> Ints:
    """Index of the greatest value of each row, the first of equals; rows rise."""
    first = np.searchsorted(row, np.arange(n_rows))
    greatest = np.maximum.reduceat(values, first) if n_rows else np.zeros(0)
    at = np.flatnonzero(values == greatest[row])
    return at[np.flatnonzero(np.diff(row[at], prepend=-1))]
