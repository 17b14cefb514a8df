"""`RodAxes`: the middle line of every rod as a smooth curve, and where it passes the joints.

::

    tip                                                              tip
     o---------x-----------------x-------------x-----------------x----o
     overhang  first visit                          last visit   overhang

Between its first and its last visit an axis is a cubic spline; an open one goes on straight to its tips, which
keeps its second derivative continuous, because it has no curvature at its outermost visits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Union

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen, offsets_of, rows_of
from weavecore.geometry.splines import CurveSamples, SplineRows, sample_curves


@dataclass(frozen=True, eq=False)
class RodAxes:
    """Cubic splines, one a strand, twice continuously differentiable, also where a ring closes.

    Visits are the entries of ``strands.nodes``; between two of them a curve is one cubic.

    Parameters
    ----------
    offsets : (S+1,) int64
        Visits of strand ``s``: ``offsets[s]:offsets[s + 1]``.
    closed : (S,) bool
    points : (M, 3) float64
        The axis at each visit.
    derivatives : (M, 3) float64
        Derivative there by the parameter.
    parameters : (M,) float64
        Rising along each strand, from 0 at its start: at the tip of an open one, at the first visit of a closed one.
    ends : (S,) float64
        Parameter at the end of each strand: at the tip of an open one; where a closed one is back at its first visit.
    overhangs : (S, 2) float64
        Arc length from the first visit back to the tip, and from the last visit on to the other tip; 0 of closed ones.
    knot_offsets : (S+1,) int64
    knots : (…,) float64
        Knots of each strand's B-spline of degree 3 in full form, four more than control points.
    control_offsets : (S+1,) int64
    controls : (…, 3) float64
        Control points; of a closed strand the first three are repeated at the end.
    stations : (M,) float64
        Arc length from the start of the strand to each visit.
    lengths : (S,) float64
        Arc length of each strand, from tip to tip, or once around for a closed one.
    layer_offsets : (M,) float64
        Distance of the axis from the surface at each visit, along the node's normal.
    """

    offsets: Ints
    closed: Bools
    points: Floats
    derivatives: Floats
    parameters: Floats
    ends: Floats
    overhangs: Floats
    knot_offsets: Ints
    knots: Floats
    control_offsets: Ints
    controls: Floats
    stations: Floats
    lengths: Floats
    layer_offsets: Floats

    def __post_init__(self) -> None:
        n, m = len(self.offsets) - 1, len(self.points)
        for name, dtype, shape in (
            ("offsets", np.int64, (n + 1,)),
            ("closed", np.bool_, (n,)),
            ("points", np.float64, (m, 3)),
            ("derivatives", np.float64, (m, 3)),
            ("parameters", np.float64, (m,)),
            ("ends", np.float64, (n,)),
            ("overhangs", np.float64, (n, 2)),
            ("knot_offsets", np.int64, (n + 1,)),
            ("knots", np.float64, (-1,)),
            ("control_offsets", np.int64, (n + 1,)),
            ("controls", np.float64, (-1, 3)),
            ("stations", np.float64, (m,)),
            ("lengths", np.float64, (n,)),
            ("layer_offsets", np.float64, (m,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def strand(self) -> Ints:
        """(M,) strand of each visit."""
        return rows_of(self.offsets)

    def bspline(self, s: int) -> tuple[Floats, Floats]:
        """Knots (k + 4,) in full form and control points (k, 3) of strand ``s``, degree 3."""
        knots = self.knots[self.knot_offsets[s] : self.knot_offsets[s + 1]]
        return knots, self.controls[self.control_offsets[s] : self.control_offsets[s + 1]]

    @cached_property
    def rows(self) -> CurveRows:
        """The axes with their tips as the first and last points of the open ones."""
        return with_tips(
            self.points, self.derivatives, self.parameters, self.offsets, self.closed, self.ends, self.overhangs
        )

    def samples(self, step: Union[float, Floats]) -> CurveSamples:
        """Points no further than ``step`` apart along every axis, tips and visits among them; the visits are given.

        Parameters
        ----------
        step : float or (n,) float64
            One for all, or one for each cubic of `CurveRows`.
        """
        rows = self.rows
        samples = sample_curves(
            rows.points, rows.derivatives, rows.parameters, rows.offsets, self.closed, rows.ends, step=step
        )
        is_visit = np.zeros(len(samples.stations), bool)
        is_visit[np.flatnonzero(samples.is_given)[rows.visits]] = True
        return replace(samples, is_given=is_visit)


@dataclass(frozen=True, eq=False)
class CurveRows:
    """Rows of points with derivatives, as `sample_curves` takes them; ``visits`` (M,) are those of the rods."""

    points: Floats
    derivatives: Floats
    parameters: Floats
    offsets: Ints
    ends: Floats
    visits: Ints


def with_tips(
    points: Floats,
    derivatives: Floats,
    parameters: Floats,
    offsets: Ints,
    closed: Bools,
    ends: Floats,
    overhangs: Floats,
) -> CurveRows:
    """Add the tips of rods that run on straight beyond their outermost visits; see `RodAxes` for the arrays."""
    has_tip = (overhangs > 0) & ~closed[:, None]
    first, last = np.flatnonzero(has_tip[:, 0]), np.flatnonzero(has_tip[:, 1])
    counts = np.diff(offsets) + has_tip.sum(1)
    row_offsets = offsets_of(counts)
    visits = np.arange(len(points)) + np.repeat(row_offsets[:-1] + has_tip[:, 0] - offsets[:-1], np.diff(offsets))
    places, slopes, at = np.zeros((row_offsets[-1], 3)), np.zeros((row_offsets[-1], 3)), np.zeros(row_offsets[-1])
    places[visits], slopes[visits], at[visits] = points, derivatives, parameters
    for rod, tip, visit, way, column in (
        (first, row_offsets[:-1][first], offsets[:-1][first], -1.0, 0),
        (last, row_offsets[1:][last] - 1, offsets[1:][last] - 1, 1.0, 1),
    ):
        reach = overhangs[rod, column] / np.maximum(np.linalg.norm(derivatives[visit], axis=1), np.finfo(float).tiny)
        places[tip] = points[visit] + way * reach[:, None] * derivatives[visit]
        slopes[tip] = derivatives[visit]
        at[tip] = parameters[visit] + way * reach
    return CurveRows(places, slopes, at, row_offsets, ends, visits)


def tip_parameters(rows: SplineRows, offsets: Ints, overhangs: Floats) -> tuple[Floats, Floats]:
    """Parameters (M,) of the visits and (S,) of the ends, when the splines begin and end at tips; see `RodAxes`.

    Parameters
    ----------
    rows : SplineRows
        Between the outermost visits.
    offsets : (S+1,) int64
    overhangs : (S, 2) float64
    """
    outermost = np.stack([offsets[:-1], offsets[1:] - 1], axis=1)
    speed = np.linalg.norm(rows.derivatives[outermost], axis=2)
    reach = overhangs / np.maximum(speed, np.finfo(float).tiny)
    return rows.parameters + reach[rows_of(offsets), 0], rows.ends + reach.sum(axis=1)


def extend_to_tips(points: Floats, rows: SplineRows, offsets: Ints, closed: Bools, overhangs: Floats) -> CurveRows:
    """Extend the splines of open rods straight to the tips of their overhangs.

    Parameters
    ----------
    points : (M, 3) float64
        Of the axes at the visits.
    rows : SplineRows
        Through the points, from the first visit of each rod to its last.
    offsets : (S+1,) int64
    closed : (S,) bool
    overhangs : (S, 2) float64
        At the start and the end of each rod; 0 of rings.

    Returns
    -------
    CurveRows
    """
    parameters, ends = tip_parameters(rows, offsets, overhangs)
    return with_tips(points, rows.derivatives, parameters, offsets, closed, ends, overhangs)
