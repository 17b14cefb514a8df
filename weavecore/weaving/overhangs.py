"""How far the free ends of rods run past their outermost ties: `with_overhangs`.

::

    tip                                      tip
     ────┼──────────┼──────────┼──────────┼────        the axis runs on straight beyond the outermost visits
     overhang                          overhang

Only the ends change: stations shift by what the start of their rod gains.  Linear in the visits, but for the clashes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import rows_of
from weavecore.geometry.splines import SplineRows, as_b_splines
from weavecore.model.rod_axes import tip_parameters, with_tips
from weavecore.model.weave import Weave
from weavecore.weaving.clearance import find_clashes


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
    axes, strands = weave.axes, weave.strands
    overhangs = np.where(axes.closed[:, None], 0.0, np.full((len(axes.closed), 2), overhang))
    gained = overhangs - axes.overhangs
    # The splines between the outermost visits, whose parameters begin at 0.
    first, last = axes.offsets[:-1], axes.offsets[1:] - 1
    bare = axes.parameters - axes.parameters[first][rows_of(axes.offsets)]
    inner = SplineRows(axes.derivatives, bare, np.where(axes.closed, axes.ends, bare[last]))
    parameters, ends = tip_parameters(inner, axes.offsets, overhangs)
    tipped = with_tips(axes.points, axes.derivatives, parameters, axes.offsets, axes.closed, ends, overhangs)
    drawn = as_b_splines(
        SplineRows(tipped.derivatives, tipped.parameters, ends), tipped.points, tipped.offsets, axes.closed
    )
    longer = replace(
        axes,
        parameters=parameters,
        ends=ends,
        overhangs=overhangs,
        knot_offsets=drawn.knot_offsets,
        knots=drawn.knots,
        control_offsets=drawn.control_offsets,
        controls=drawn.controls,
        stations=axes.stations + gained[rows_of(strands.offsets), 0],
        lengths=axes.lengths + gained.sum(axis=1),
    )
    bending = replace(weave.bending, station_at_min=weave.bending.station_at_min + gained[:, 0])
    return replace(weave, axes=longer, bending=bending, clashes=find_clashes(longer, weave.diameters))
