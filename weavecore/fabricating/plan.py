"""What fabrication starts from: `Workshop`, the options of a workshop, and `RodPlan`, a weave in millimetres.

A *station* is an arc length along the axis of a rod, from its start.  A *visit* is a place where a rod passes a node
of the lattice; the M visits of all rods are rows in the order of ``strands.nodes``, rod by rod.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.splines import CurveSamples, mean_curvature, points_at_stations
from weavecore.model import RodAxes, Weave
from weavecore.model.strands import first_generations

OVERLAP, SLEEVE = "overlap", "sleeve"
SPLICES = (OVERLAP, SLEEVE)
DXF, SVG, PDF = "dxf", "svg", "pdf"
TEMPLATES = (DXF, SVG, PDF)
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}
"""Width and height in millimetres, landscape (ISO 216)."""

OVERLAP_DIAMETERS = 30.0
"""Least length of an overlap, in diameters of the rod, as is usual for rods that are tied."""

SLEEVE_DIAMETERS = 20.0
"""Length of a sleeve, in diameters: each piece reaches ten diameters into it."""

TAIL_DIAMETERS = 5.0
"""How far an overlap reaches beyond the two crossings that hold it, in diameters: a tie on the very end slips off."""

SPLICE_UTILISATION = 0.8
"""Greatest bending utilisation where a rod is spliced: a fifth of the allowable stress is kept for the splice, which
is stiffer than the rod and adds stress at its ends."""

LABELS_PER_PIECE = 2
"""One at each end."""

KG_PER_MM3 = 1e-9
"""One kg/m³ in kg/mm³."""

_MOST_MM = 1e6
"""Lengths of a workshop are below this (1 km): above it the unit was mistaken."""

_SAMPLES_PER_WINDOW = 8
"""Samples of an axis in one window of curvature; as `weavecore.weaving.bending` has, so that utilisations agree."""


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
        How far the free ends of rods reach beyond their last joint.
    kerf : float
        Length that the saw removes at each cut.
    templates : tuple of str
        Which of ``"dxf"``, ``"svg"`` and ``"pdf"`` are drawn.
    paper : str
        Paper of the PDF: ``"A4"`` to ``"A0"``.

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
            if not least <= value < _MOST_MM:
                raise Unsupported(
                    f"The {label} must be at least {least:g} mm and below 1 km (got {value:g} mm)",
                    remedy=f"Change the {label}.",
                )
        known = (("splice", (self.splice,), SPLICES), ("template", self.templates, TEMPLATES))
        for label, names, all_known in (*known, ("paper", (self.paper,), tuple(PAPERS))):
            for name in names:
                if name not in all_known:
                    raise Unsupported(f"Unknown {label} {name!r}", remedy=f"Use one of: {', '.join(all_known)}.")

    def sleeve_length(self, diameter: float) -> float:
        """Length of the tube over a sleeved splice of rods of this diameter."""
        return SLEEVE_DIAMETERS * diameter


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
        window = self.weave.bending.window * self.scale
        samples = self.axes.samples(window / _SAMPLES_PER_WINDOW)
        curvature, middle = mean_curvature(samples, self.axes.closed, window)
        return BendingProfile(samples, middle, self.weave.material.least_bend * self.diameter * curvature)

    def visits_at_joints(self, rod: int) -> Ints:
        """The visits of a rod that lie at joints, in order."""
        offsets = self.weave.strands.offsets
        visits = np.arange(offsets[rod], offsets[rod + 1])
        return visits[self.joint_of_visit[visits] >= 0]


@dataclass(frozen=True, eq=False)
class BendingProfile:
    """The bending utilisation along all rods, in windows of arc length.

    Parameters
    ----------
    samples : CurveSamples
        Points along the axes.
    middle : (n,) float64
        Station of the middle of the window around each sample.
    utilisation : (n,) float64
        Least admissible radius over the mean radius in that window.
    """

    samples: CurveSamples
    middle: Floats
    utilisation: Floats

    def greatest(self, rod: int, length: float, low: float, high: float) -> float:
        """The greatest utilisation of a rod between two stations, which may exceed the ends of a ring."""
        part = slice(self.samples.offsets[rod], self.samples.offsets[rod + 1])
        middle = self.middle[part]
        found = [
            self.utilisation[part][
                max(np.searchsorted(middle, low + lap) - 1, 0) : np.searchsorted(middle, high + lap) + 1
            ]
            for lap in (-length, 0.0, length)
            if low + lap <= middle[-1] and high + lap >= middle[0]
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
    lengths = ("points", "parameters", "ends", "knots", "controls", "stations", "lengths", "layer_offsets")
    # Derivatives by a parameter that is a length have no unit.
    in_mm = replace(axes, **{name: getattr(axes, name) * scale for name in lengths})
    return RodPlan(weave, scale, in_mm, weave.lattice.nodes * scale)
