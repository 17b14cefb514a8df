"""`RodPlan`: the rods of a weave in millimetres, as the tables take them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.splines import CurveSamples, points_at_stations
from weavecore.model import RodAxes, Weave
from weavecore.model.strands import first_generations

_STEP_IN_DIAMETERS = 2.0
"""Step in which the bending along rods is sampled for splices."""


@dataclass(frozen=True, eq=False)
class RodPlan:
    """A weave in millimetres.

    Parameters
    ----------
    weave : Weave
        Names, rods and joints; its lengths are in the model's unit.
    scale : float
        Millimetres in one of the model's units.
    axes : RodAxes
        In millimetres.
    nodes : (N, 3) float64
        In millimetres.
    """

    weave: Weave
    scale: float
    axes: RodAxes
    nodes: Floats

    @property
    def ids(self) -> tuple[str, ...]:
        """Names of the rods."""
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
        """(M,) the joint at which each visit lies, or -1."""
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
    def bend(self) -> BendProfile:
        """How much the rods are bent along their length."""
        samples = self.axes.samples(_STEP_IN_DIAMETERS * self.diameter)
        return BendProfile(samples, self.weave.material.least_bend * self.diameter * samples.curvatures)


@dataclass(frozen=True, eq=False)
class BendProfile:
    """Utilisation (n,) at points along the rods, in the order of the samples."""

    samples: CurveSamples
    utilisation: Floats

    def greatest(self, rod: int, length: float, low: float, high: float) -> float:
        """The greatest utilisation of a rod between two stations, which may lie beyond the ends of a ring."""
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
        """Points (n, 3) at stations along a rod."""
        return points_at_stations(self.samples, np.full(len(stations), rod), stations)


def plan_rods(weave: Weave, scale: float) -> RodPlan:
    """The weave in millimetres, of which there are ``scale`` in one of its units."""
    axes = weave.axes
    lengths = ("points", "parameters", "ends", "knots", "controls", "stations", "lengths", "layer_offsets", "overhangs")
    # Derivatives by a parameter that is a length have no unit.
    in_mm = replace(axes, **{name: getattr(axes, name) * scale for name in lengths})
    return RodPlan(weave, scale, in_mm, weave.lattice.nodes * scale)


def visits_of(plan: RodPlan, rod: int) -> Ints:
    """The visits of a rod that lie at joints, in order."""
    offsets = plan.weave.strands.offsets
    visits = np.arange(offsets[rod], offsets[rod + 1])
    return visits[plan.joint_of_visit[visits] >= 0]


def owners(plan: RodPlan) -> Ints:
    """(M,) the rod of each visit."""
    return rows_of(plan.weave.strands.offsets)


# ----------------------------------------------------------------------
# `Workshop`: what the workshop has and how it works; its own choice, not the model's.

OVERLAP, SLEEVE = "overlap", "sleeve"
SPLICES = (OVERLAP, SLEEVE)
DXF, SVG, PDF = "dxf", "svg", "pdf"
TEMPLATES = (DXF, SVG, PDF)
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}
"""Width and height in millimetres, on the long side."""

OVERLAP_DIAMETERS = 30.0
SLEEVE_DIAMETERS = 20.0
TAIL_DIAMETERS = 5.0
"""An overlap reaches so many diameters beyond the two crossings that hold it."""

MOST_UTILISED = 0.8
"""No splice where a rod is bent beyond this part of what it bears."""


@dataclass(frozen=True)
class Workshop:
    """Options of `fabricate`, in millimetres.

    Parameters
    ----------
    stock : float
        Length of the bars.
    splice : str
        ``"overlap"``: two pieces side by side past two crossings and 30 diameters; ``"sleeve"``: end to end in
        a tube of 20 diameters between two crossings.
    overhang : float
        How far the free ends of rods stand out beyond their last joint.
    kerf : float
        What the saw takes for each cut.
    templates : tuple of str
        Which of ``"dxf"``, ``"svg"`` and ``"pdf"`` are drawn.
    paper : str
        Of the PDF: ``"A4"`` to ``"A0"``.

    Raises
    ------
    Unsupported
    """

    stock: float = 6000.0
    splice: str = OVERLAP
    overhang: float = 0.0
    kerf: float = 0.0
    templates: tuple[str, ...] = TEMPLATES
    paper: str = "A3"

    def __post_init__(self) -> None:
        object.__setattr__(self, "templates", tuple(self.templates))
        for label, least in (("stock", 1.0), ("overhang", 0.0), ("kerf", 0.0)):
            value = getattr(self, label)
            if not least <= value < 1e6:
                raise Unsupported(f"The {label} of {value:g} mm", remedy=f"Give {least:g} mm or more, below 1 km.")
        known = (("splice", (self.splice,), SPLICES), ("template", self.templates, TEMPLATES))
        for label, names, all_known in (*known, ("paper", (self.paper,), tuple(PAPERS))):
            for name in names:
                if name not in all_known:
                    raise Unsupported(f"There is no {label} {name!r}", remedy=f"Take one of: {', '.join(all_known)}.")

    def sleeve_length(self, diameter: float) -> float:
        """Length of the tube over a sleeved splice."""
        return SLEEVE_DIAMETERS * diameter
