"""Points along the axes, so near each other that straight lines between them keep within hundredths of a millimetre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.plan import RodPlan
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.splines import cubic_points, sample_curves, span_ends

SAG = 0.02
"""How far an axis may bulge from the straight line between two points, in millimetres."""

_LONGEST = 50.0
_PROBES = 5


@dataclass(frozen=True, eq=False)
class AxisPoints:
    """Points along the axes, by rod and station; of a ring the first comes again at the end.

    Between nodes ``layer_offset`` goes evenly from that of one to that of the next.
    """

    rod: Ints
    station: Floats
    point: Floats
    layer_offset: Floats


def sample_axes(plan: RodPlan) -> AxisPoints:
    """Sample all axes; the visits are among the points."""
    axes = plan.axes
    samples = sample_curves(
        axes.points, axes.derivatives, axes.parameters, axes.offsets, axes.closed, axes.ends, step=_steps(plan)
    )
    rod = rows_of(samples.offsets)
    given = np.flatnonzero(samples.is_given)
    # All rods end to end, each a gap after the one before, make one rising row to interpolate in.
    base = np.concatenate([[0.0], np.cumsum(axes.lengths + 1.0)])[:-1]
    is_end = samples.offsets[1:][axes.closed] - 1
    known = np.sort(np.concatenate([given, is_end]))
    visit = np.searchsorted(given, known)
    visit[np.searchsorted(known, is_end)] = axes.offsets[:-1][axes.closed]
    station = axes.stations[visit]
    station[np.searchsorted(known, is_end)] = axes.lengths[axes.closed]
    place = base[rod] + samples.stations
    # The visits keep the stations that the marks have, to the last bit; those between follow.
    told = np.interp(place, place[known], base[rod[known]] + station) - base[rod]
    told[known] = station
    heights = np.interp(place, place[known], axes.layer_offsets[visit])
    return AxisPoints(rod, told, samples.points, heights)


def _steps(plan: RodPlan) -> Floats:
    """(…,) for every cubic how far apart its points may be."""
    axes = plan.axes
    start, stop, width = span_ends(axes.parameters, axes.offsets, axes.closed, axes.ends)
    ends = (axes.points[start], axes.points[stop], axes.derivatives[start], axes.derivatives[stop])
    slopes = [cubic_points(*ends, width, np.full(len(start), t))[1] for t in np.linspace(0, 1, _PROBES)]
    unit = [slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), np.finfo(float).tiny) for slope in slopes]
    turn = np.max([np.linalg.norm(b - a, axis=1) for a, b in zip(unit, unit[1:])], axis=0)
    curvature = turn * (_PROBES - 1) / width
    steps: Floats = np.sqrt(8 * SAG / np.maximum(curvature, 8 * SAG / _LONGEST**2))
    return steps
