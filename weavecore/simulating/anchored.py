"""`NearDrawing`: a weave near to where it was drawn, on springs to the drawn places of its nodes.

Springs keep a weave that springs back far, or that is a mechanism, where a linear model of it holds.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Optional

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags

from weavecore.geometry.arrays import Bools, Floats
from weavecore.model import Weave
from weavecore.simulating.boundary import Loads, load_forces
from weavecore.simulating.discretise import RodPoints, place_points
from weavecore.simulating.newton import stiffness_scale
from weavecore.simulating.simulate import SEGMENTS, structure_of
from weavecore.simulating.structure import Forces, Structure


@dataclass(frozen=True, eq=False)
class Anchored(Structure):
    """A structure with springs of a stiffness (n,) in N/m from its points to anchors (n, 3)."""

    springs: Floats = field(default_factory=lambda: np.zeros(0))
    anchors: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def energy(self, x: Floats) -> float:
        return super().energy(x) + float((self.springs[:, None] * (x - self.anchors) ** 2).sum()) / 2

    def gradient(self, x: Floats) -> Floats:
        gradient: Floats = super().gradient(x) + self.springs[:, None] * (x - self.anchors)
        return gradient

    def hessian(self, x: Floats, forces: Optional[Forces] = None, *, convex: bool = False) -> csc_matrix:
        springs = np.repeat(self.springs, 3)[self.free]
        return (super().hessian(x, forces, convex=convex) + diags(springs)).tocsc()

    def on_springs(self, springs: Floats) -> Anchored:
        """The same with other springs (n,); the pattern of the Hessian is shared."""
        changed = replace(self, springs=springs)
        for name in ("free", "_order", "_pairs", "_pattern"):
            changed.__dict__[name] = getattr(self, name)
        return changed


@dataclass(frozen=True, eq=False)
class NearDrawing:
    """The rods of a weave, and where its nodes were drawn; lengths are in metres.

    Parameters
    ----------
    weave : Weave
        Which is cut and marked.
    drawn : (M, 3) float64
        Where each visit of a joint was drawn.
    metres : float
        In one unit of the model.
    """

    weave: Weave
    drawn: Floats
    metres: float

    @cached_property
    def rods(self) -> RodPoints:
        """Points along the rods as they are cut."""
        return place_points(self.weave.axes, segments=SEGMENTS, metres=self.metres)

    @cached_property
    def anchors(self) -> Floats:
        """(n, 3) the rods' points, those of visits where they were drawn."""
        anchors: Floats = self.rods.points.copy()
        anchors[self.rods.of_visit] = self.drawn
        return anchors

    @cached_property
    def average(self) -> csr_matrix:
        """(N, n) the mean of the rods at each node."""
        nodes = self.weave.strands.nodes
        counts = np.maximum(np.bincount(nodes, minlength=self.weave.lattice.n_nodes), 1)
        share = 1.0 / counts.astype(np.float64)
        return csr_matrix((share[nodes], (nodes, self.rods.of_visit)), shape=(len(counts), len(self.rods.points)))

    def departure(self, points: Floats) -> Floats:
        """(N,) distance of the nodes from where they were drawn."""
        departure: Floats = np.linalg.norm(np.asarray(self.average @ (points - self.anchors)), axis=1)
        return departure

    def at_anchors(self, structure: Structure, points: Floats) -> Floats:
        """Points (n, 3) with the fixed ones where they were drawn."""
        return np.where(structure.is_fixed, self.anchors, points)

    def supported(self, is_held: Bools, loads: Loads) -> Anchored:
        """The structure with nodes (N,) held where they were drawn, and no springs yet."""
        weave, rods = self.weave, self.rods
        diameter = weave.diameters[rods.rod] * self.metres
        none = np.zeros(weave.lattice.n_nodes, bool)
        free = structure_of(weave, rods, none, Loads(), diameter=diameter, metres=self.metres)
        forces = load_forces(weave, rods, loads, diameter=diameter, metres=self.metres)
        fixed = np.zeros((len(rods.points), 3), bool)
        fixed[rods.of_visit[is_held[weave.strands.nodes]]] = True
        elements = (free.n_points, free.bends, free.stretches, free.ties)
        return Anchored(*elements, forces, fixed, springs=np.zeros(len(rods.points)), anchors=self.anchors)

    def springs(self, structure: Structure, stiffness: float) -> Floats:
        """(n,) springs at all visits, of a stiffness in ``EI / l^3`` of a median segment."""
        springs = np.zeros(structure.n_points)
        springs[self.rods.of_visit] = stiffness * stiffness_scale(structure)
        return springs
