"""`RodPlan`: a weave in millimetres, which all of fabrication starts from.

A *station* is an arc length along the axis of a rod, from its start.  A *visit* is a place where a rod passes a node
of the lattice; the M visits of all rods are rows in the order of ``strands.nodes``, rod by rod.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.splines import CurveSamples, points_at_stations
from weavecore.model import RodAxes, Weave
from weavecore.model.strands import first_generations

STEP_IN_DIAMETERS = 2.0
"""The bending along a rod is sampled in steps of so many diameters where places for splices are rated."""


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

    @property
    def diameter(self) -> float:
        """Diameter of the rods."""
        return self.weave.rod_diameter * self.scale

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

    @cached_property
    def bending(self) -> BendingProfile:
        """The utilisation of all rods along their length."""
        samples = self.axes.samples(STEP_IN_DIAMETERS * self.diameter)
        return BendingProfile(samples, self.weave.material.least_bend * self.diameter * samples.curvatures)

    def visits_at_joints(self, rod: int) -> Ints:
        """The visits of a rod that lie at joints, in order."""
        offsets = self.weave.strands.offsets
        visits = np.arange(offsets[rod], offsets[rod + 1])
        return visits[self.joint_of_visit[visits] >= 0]


@dataclass(frozen=True, eq=False)
class BendingProfile:
    """The bending utilisation along all rods, point by point.

    Parameters
    ----------
    samples : CurveSamples
        Points along the axes.
    utilisation : (n,) float64
        Least admissible radius over the radius at each sample.
    """

    samples: CurveSamples
    utilisation: Floats

    def greatest(self, rod: int, length: float, low: float, high: float) -> float:
        """The greatest utilisation of a rod between two stations, which may exceed the ends of a ring."""
        part = slice(self.samples.offsets[rod], self.samples.offsets[rod + 1])
        stations = self.samples.stations[part]
        found = [
            self.utilisation[part][
                max(np.searchsorted(stations, low + lap) - 1, 0) : np.searchsorted(stations, high + lap) + 1
            ]
            for lap in (-length, 0.0, length)
            if low + lap <= stations[-1] and high + lap >= stations[0]
        ]
        return float(max((one.max(initial=0.0) for one in found), default=0.0))

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
