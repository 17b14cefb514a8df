"""How far the free ends of rods run past their outermost ties, as asked for or as far as there is room.

::

    tip                                      tip
     ────┼──────────┼──────────┼──────────┼────        the axis runs on straight beyond the outermost visits
     overhang                          overhang

Where an overhang runs into another rod it is shortened, as far as a tie still holds.  Only the ends change: stations
shift by what the start of their rod gains.  Linear in the visits, but for the clashes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, dots, rows_of, unit_vectors
from weavecore.geometry.splines import SplineRows, as_b_splines
from weavecore.model.joints import Clashes
from weavecore.model.rod_axes import RodAxes, extend_to_tips
from weavecore.model.strands import Strands
from weavecore.model.weave import Weave
from weavecore.weaving.clashes import clashes_of, find_clashes

_LEAST, _GAP = 5.0, 2.0
"""Diameters: an overhang that is shortened keeps the first, and ends at least the second before the nearest place."""

_MOST_ROUNDS = 4
"""Each round shortens an overhang by two diameters or more, so that three lead from ten to the least length."""


def with_overhangs(weave: Weave, overhang: float) -> Weave:
    """Let all free ends run past their outermost ties by the same length.

    Parameters
    ----------
    weave : Weave
    overhang : float
        In the model's unit, not negative.

    Returns
    -------
    Weave

    Raises
    ------
    Unsupported
        Where the overhang is negative or not finite.
    """
    if not 0.0 <= overhang < np.inf:
        raise Unsupported(f"An overhang must not be negative (got {overhang:g})", remedy="Change the overhang.")
    axes = weave.axes
    longer = _with_lengths(axes, np.full((len(axes), 2), overhang))
    gained = longer.overhangs[:, 0] - axes.overhangs[:, 0]
    bending = replace(weave.bending, station_at_min=weave.bending.station_at_min + gained)
    return replace(weave, axes=longer, bending=bending, clashes=find_clashes(longer, weave.diameters))


def clear_overhangs(
    points: Floats, rows: SplineRows, strands: Strands, overhangs: Floats, diameters: Floats
) -> tuple[Floats, Clashes]:
    """Shorten overhangs that run into other rods, as far as a tie still holds.

    Parameters
    ----------
    points : (M, 3) float64
        Of the axes at the visits.
    rows : SplineRows
        Through the points.
    strands : Strands
    overhangs : (S, 2) float64
        Lengths to begin with; 0 of rings.
    diameters : (S,) float64
        Of the rods, in the model's unit.

    Returns
    -------
    overhangs : (S, 2) float64
    clashes : Clashes
        What is left.
    """
    offsets, closed = strands.offsets, strands.closed
    clashes = clashes_of(extend_to_tips(points, rows, offsets, closed, overhangs), closed, diameters)
    for _ in range(_MOST_ROUNDS):
        shorter = _shorter(points, rows, strands, overhangs, diameters, clashes)
        if np.array_equal(shorter, overhangs):
            break
        overhangs = shorter
        # Shorter rods clash with no others than before.
        curves = extend_to_tips(points, rows, offsets, closed, overhangs)
        clashes = clashes_of(curves, closed, diameters, among=clashes.strands)
    return overhangs, clashes


def _shorter(
    points: Floats, rows: SplineRows, strands: Strands, overhangs: Floats, diameters: Floats, clashes: Clashes
) -> Floats:
    """Overhangs (S, 2) that end before the places where they clash."""
    shorter = overhangs.copy()
    strand, place = clashes.strands.ravel(), np.repeat(clashes.point, 2, axis=0)
    diameter = diameters[strand]
    for end, way in ((0, -1.0), (1, 1.0)):
        outermost = strands.offsets[strand] if end == 0 else strands.offsets[strand + 1] - 1
        along = unit_vectors(way * rows.derivatives[outermost])
        beyond = place - points[outermost]
        reach = dots(beyond, along)
        aside = np.linalg.norm(beyond - reach[:, None] * along, axis=1)
        now = overhangs[strand, end]
        is_tip = (reach > 0.0) & (reach < now + diameter) & (aside < diameter)
        room = np.clip(reach - _GAP * diameter, np.minimum(_LEAST * diameter, now), now)
        np.minimum.at(shorter[:, end], strand[is_tip], room[is_tip])
    return shorter


def _with_lengths(axes: RodAxes, overhangs: Floats) -> RodAxes:
    """The axes with other overhangs (S, 2); rings have none."""
    overhangs = np.where(axes.closed[:, None], 0.0, overhangs)
    gained = overhangs - axes.overhangs
    first, last = axes.offsets[:-1], axes.offsets[1:] - 1
    at = axes.parameters - axes.parameters[first][axes.strand]
    inner = SplineRows(axes.derivatives, at, np.where(axes.closed, axes.ends, at[last]))
    tipped = extend_to_tips(axes.points, inner, axes.offsets, axes.closed, overhangs)
    drawn = as_b_splines(
        SplineRows(tipped.derivatives, tipped.parameters, tipped.ends), tipped.points, tipped.offsets, axes.closed
    )
    return replace(
        axes,
        parameters=tipped.parameters[tipped.visits],
        ends=tipped.ends,
        overhangs=overhangs,
        knot_offsets=drawn.knot_offsets,
        knots=drawn.knots,
        control_offsets=drawn.control_offsets,
        controls=drawn.controls,
        stations=axes.stations + gained[rows_of(axes.offsets), 0],
        lengths=axes.lengths + gained.sum(axis=1),
    )
