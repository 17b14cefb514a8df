"""`Equilibrium`: where a weave comes to rest, and the forces in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen, next_in_loop, rows_of
from weavecore.model.weave import Weave


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium:
    """Rods at rest.  Lengths are in the model's unit, forces in N, moments in N·m, stresses in MPa, energies in J.

    Points lie along the rods, joints among them; a *contact* is a row of ``weave.joints.contacts``.

    Parameters
    ----------
    weave : Weave
        As it was drawn.
    points : (n, 3) float64
        At rest; without supports laid over the drawn ones as well as they fit.
    drawn : (n, 3) float64
        Where the same points were drawn.
    offsets : (S+1,) int64
        Points of rod ``s``: ``offsets[s]:offsets[s + 1]``; the first of a closed one is not repeated.
    point_of_visit : (M,) int64
        The point of each entry of ``weave.strands.nodes``.
    axial_force : (n,) float64
        Positive in tension.
    moment : (n,) float64
    stress : (n,) float64
        Largest in the section: of the moment and the axial force.
    tie_force : (C, 3) float64
        On the upper rod of each contact: away from the lower one, along the lower rod, and along its own.
    reaction : (N, 3) float64
        Of the support at each node; 0 where there is none.
    is_supported : (N,) bool
    is_converged : bool
    n_negative : int
        Negative eigenvalues of the stiffness: none in a stable equilibrium.
    n_steps : int
    residual : float
        Largest force that is left on a point.
    energies : mapping
        Of ``"bending"``, ``"axial"`` and ``"ties"``.
    drawn_energy : float
        Elastic energy of the weave as drawn.
    supports, loads : str
        What was asked for, in words.
    load : (N, 3) float64, optional
        Of the loads on the rods near each node, self-weight included; with the reactions they add up to 0.
    buckling_factor : float, optional
        By which the loads grow until the stiffness has a zero eigenvalue, to first order; infinite where it never has.
    spread : tuple of int
        Generations whose rods are set far from each other in turn, where the replay of the sequence was improved so.
    """

    weave: Weave
    points: Floats
    drawn: Floats
    offsets: Ints
    point_of_visit: Ints
    axial_force: Floats
    moment: Floats
    stress: Floats
    tie_force: Floats
    reaction: Floats
    is_supported: Bools
    is_converged: bool
    n_negative: int
    n_steps: int
    residual: float
    energies: Mapping[str, float] = field(default_factory=dict)
    drawn_energy: float = 0.0
    supports: str = "none"
    loads: str = "none"
    buckling_factor: Optional[float] = None
    load: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    spread: tuple[int, ...] = ()

    def __repr__(self) -> str:
        return f"<Equilibrium: {len(self.weave)} rods, departure {self.departure_max:.3g}, {self.supports}>"

    def __post_init__(self) -> None:
        n, n_nodes = len(self.points), self.weave.lattice.n_nodes
        if len(self.load) == 0:
            object.__setattr__(self, "load", np.zeros((n_nodes, 3)))
        for name, dtype, shape in (
            ("points", np.float64, (n, 3)),
            ("drawn", np.float64, (n, 3)),
            ("offsets", np.int64, (len(self.weave) + 1,)),
            ("point_of_visit", np.int64, (len(self.weave.strands.nodes),)),
            ("axial_force", np.float64, (n,)),
            ("moment", np.float64, (n,)),
            ("stress", np.float64, (n,)),
            ("tie_force", np.float64, (len(self.weave.joints.contacts), 3)),
            ("reaction", np.float64, (n_nodes, 3)),
            ("load", np.float64, (n_nodes, 3)),
            ("is_supported", np.bool_, (n_nodes,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))
        object.__setattr__(self, "energies", dict(self.energies))

    @property
    def is_stable(self) -> bool:
        """Whether it is at rest, and no small push makes it leave."""
        return self.is_converged and self.n_negative == 0

    @cached_property
    def rod(self) -> Ints:
        """(n,) the rod of each point."""
        return rows_of(self.offsets)

    @cached_property
    def node_move(self) -> Floats:
        """(N, 3) from where each node was drawn to where it rests: the mean move of its rods."""
        nodes = self.weave.strands.nodes
        move = (self.points - self.drawn)[self.point_of_visit]
        count = np.maximum(np.bincount(nodes, minlength=self.weave.lattice.n_nodes), 1)
        mean: Floats = np.stack([np.bincount(nodes, move[:, d], len(count)) for d in range(3)], axis=1) / count[:, None]
        return mean

    @cached_property
    def departure(self) -> Floats:
        """(N,) distance of each node from where it was drawn."""
        distance: Floats = np.linalg.norm(self.node_move, axis=1)
        return distance

    @cached_property
    def rod_departure(self) -> Floats:
        """(S,) the largest departure of the nodes of each rod."""
        strands = self.weave.strands
        largest: Floats = np.maximum.reduceat(self.departure[strands.nodes], strands.offsets[:-1])
        return largest

    @property
    def departure_mean(self) -> float:
        return float(self.departure.mean())

    @property
    def departure_p95(self) -> float:
        """What 95% of the nodes do not exceed."""
        return float(np.percentile(self.departure, 95))

    @property
    def departure_max(self) -> float:
        return float(self.departure.max())

    @property
    def utilisation(self) -> Floats:
        """(n,) stress over the admissible one, which is the strength over the material's factor."""
        material = self.weave.material
        return self.stress * material.factor / material.strength

    @property
    def stress_max(self) -> float:
        return float(self.stress.max())

    @property
    def utilisation_max(self) -> float:
        return float(self.utilisation.max())

    @cached_property
    def tie_force_size(self) -> Floats:
        """(C,) size of the force in each contact: exact where the rods cross at right angles."""
        size: Floats = np.linalg.norm(self.tie_force, axis=1)
        return size

    @cached_property
    def contact_rods(self) -> Ints:
        """(C, 3) joint, lower rod and upper rod of each contact."""
        joints = self.weave.joints
        lower, upper = joints.contacts.T
        return np.stack([joints.joint[lower], joints.strand[lower], joints.strand[upper]], axis=1)

    @cached_property
    def segments(self) -> Ints:
        """(M, 2) the points at the ends of each straight segment, rod after rod."""
        after = next_in_loop(self.offsets)
        goes_on = self.weave.strands.closed[self.rod] | (after > np.arange(len(after)))
        start = np.flatnonzero(goes_on)
        return np.stack([start, after[start]], axis=1)

    def greatest_of_rods(self, values: Floats) -> Floats:
        """(S,) the greatest of the values (n,) at the points of each rod."""
        greatest: Floats = np.maximum.reduceat(values, self.offsets[:-1])
        return greatest
