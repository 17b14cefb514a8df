"""`RodPlan`: a weave in millimetres, which all of fabrication starts from.

A *station* is an arc length along the axis of a rod, from its start.  A *visit* is a place where a rod passes a node
of the lattice; the M visits of all rods are rows in the order of ``strands.nodes``, rod by rod.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, range_maxima, rows_of
from weavecore.geometry.splines import CurveSamples, points_at_stations, span_ends
from weavecore.model import RodAxes, Weave
from weavecore.model.strands import first_generations

STEP_IN_DIAMETERS = 2.0
"""Bending is sampled in steps of so many diameters of the thinnest rod where places for splices are rated."""


@dataclass(frozen=True, eq=False)
class RodPlan:
    """A weave in millimetres.

    Parameters
    ----------
    weave : Weave
        Names, rods and joints; its lengths are in the model's unit.
    scale : float
        Millimetres in one unit of the model.
    axes : RodAxes
        In millimetres.
    nodes : (N, 3) float64
        Nodes of the lattice in millimetres.
    """

    weave: Weave
    scale: float
    axes: RodAxes
    nodes: Floats

    @property
    def ids(self) -> tuple[str, ...]:
        """Names of the S rods."""
        return self.weave.ids

    @cached_property
    def diameters(self) -> Floats:
        """(S,) diameter of each rod."""
        diameters: Floats = self.weave.diameters * self.scale
        return diameters

    @property
    def spacing(self) -> float:
        """Distance from one latitude to the next."""
        return float(self.weave.lattice.latitudes.spacing) * self.scale

    @cached_property
    def joint_of_visit(self) -> Ints:
        """(M,) the joint of each visit, or -1 where the rod passes the node alone."""
        joint = np.full(len(self.weave.strands.nodes), -1, np.int64)
        joint[self.weave.joints.visit] = self.weave.joints.joint
        return joint

    @cached_property
    def tangents(self) -> Floats:
        """(M, 3) unit direction of the rod at each visit."""
        size = np.linalg.norm(self.axes.derivatives, axis=1, keepdims=True)
        unit: Floats = self.axes.derivatives / np.maximum(size, np.finfo(float).tiny)
        return unit

    @cached_property
    def generation(self) -> Ints:
        """(S,) the least generation that each rod touches."""
        return first_generations(self.weave.strands, self.weave.lattice)

    def bending_along(self, rods: Bools) -> BendingProfile:
        """The utilisation of some of the rods (S,) along their length."""
        rows = self.axes.rows
        start, _, width = span_ends(rows.parameters, rows.offsets, self.axes.closed, rows.ends)
        rod = rows_of(rows.offsets)[start]
        # The other rods are sampled at their visits alone.
        samples = self.axes.samples(np.where(rods[rod], STEP_IN_DIAMETERS * self.diameters[rod], 2 * width))
        least_radius = self.weave.material.least_bend * self.diameters[rows_of(samples.offsets)]
        return BendingProfile(samples, least_radius * samples.curvatures)

    def visits_at_joints(self, rod: int) -> Ints:
        """The visits of a rod that lie at joints, in order."""
        offsets = self.weave.strands.offsets
        visits = np.arange(offsets[rod], offsets[rod + 1])
        return visits[self.joint_of_visit[visits] >= 0]


@dataclass(frozen=True, eq=False)
class BendingProfile:
    """The bending utilisation along rods, point by point.

    Parameters
    ----------
    samples : CurveSamples
        Points along the axes.
    utilisation : (n,) float64
        Least admissible radius over the radius at each sample.
    """

    samples: CurveSamples
    utilisation: Floats

    def greatest(self, rod: int, low: Floats, high: Floats, *, around: Optional[float]) -> Floats:
        """(m,) the greatest utilisation of a rod between stations ``low`` and ``high`` (m,).

        Of a ring, ``around`` is its length, and the stations may exceed its ends; None of an open rod.
        """
        part = slice(self.samples.offsets[rod], self.samples.offsets[rod + 1])
        stations, values = self.samples.stations[part], self.utilisation[part]
        if around is not None:
            stations = np.concatenate([stations[:-1] - around, stations[:-1], stations + around])
            values = np.concatenate([values[:-1], values[:-1], values])
        inside = range_maxima(values, np.searchsorted(stations, low), np.searchsorted(stations, high, side="right"))
        ends = np.maximum(np.interp(low, stations, values), np.interp(high, stations, values))
        greatest: Floats = np.maximum(inside, ends)
        return greatest

    def points(self, rod: int, stations: Floats) -> Floats:
        """(n, 3) the points of a rod at n stations."""
        return points_at_stations(self.samples, np.full(len(stations), rod), stations)


def plan_rods(weave: Weave, scale: float) -> RodPlan:
    """Convert a weave to millimetres.

    Parameters
    ----------
    weave : Weave
    scale : float
        Millimetres in one unit of the model.

    Returns
    -------
    RodPlan
    """
    axes = weave.axes
    lengths = ("points", "parameters", "ends", "knots", "controls", "stations", "lengths", "layer_offsets", "overhangs")
    # Derivatives by a parameter that is a length have no unit.
    in_mm = replace(axes, **{name: getattr(axes, name) * scale for name in lengths})
    return RodPlan(weave, scale, in_mm, weave.lattice.nodes * scale)
