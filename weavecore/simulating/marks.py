"""Marks that allow for spring-back: the target to cut a weave for, so that it rests near its drawing.

Rods are nearly inextensible, so distances between marks set the metric of the woven surface, and bending chooses among
the shapes of that metric.  A shape can be balanced by axial and tie forces where the bending energy is level along all
*flexes*, the motions that stretch no rod.  The drawn shape is not; a shape near to it may be.  So a *target* is woven
instead of the drawing: its nodes are moved by ``z``, which gives the rest lengths, and ``z`` is chosen so that the
weave rests near the drawing.  With ``x(z)`` the equilibrium, ``K`` its Hessian, and ``B`` the forces by ``z``::

    min |e + A dz|^2 + d^2 |dz|^2       e = x - drawn,  A = -K^-1 B       (Levenberg-Marquardt)

Each product with A or its transpose costs a solve with the factors of K, which the equilibrium leaves; LSMR (Fong and
Saunders 2011) needs a few dozen.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Callable, Optional

import numpy as np
from scipy.sparse import csr_matrix, diags, identity, kron

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model import Weave
from weavecore.simulating.anchored import Anchored, NearDrawing
from weavecore.simulating.boundary import Loads
from weavecore.simulating.discretise import RodPoints
from weavecore.simulating.elements import normalised
from weavecore.simulating.linearised import damped_least_squares
from weavecore.simulating.newton import Solution, find_equilibrium
from weavecore.simulating.simulate import SEGMENTS
from weavecore.simulating.structure import Forces

Progress = Callable[[float, str], None]

FIRST_DAMPING, _LEAST_DAMPING = 0.3, 0.1
"""On the target's moves, against departures: chosen on the hemisphere and the hourglass; smaller ones give rods sharper
bends."""

_WEAK = 1e-7
"""Springs to the drawing in ``EI / l^3`` of a median segment: they only keep a released weave from drifting."""

FIT_WORK = 8
"""Factorisations that take as long as one least-squares fit of the moves."""

_PARTS = (1.0, 0.5, 0.0)
"""Of the moves that a linear model gives, to begin with: those with which an equilibrium is found."""

_MOST_STEPS = 5
"""Steps of the marks; each costs a search."""

_MOST_SEARCH = 20
"""Factorisations of one search: one that takes longer has left the neighbourhood of the drawing."""


@dataclass(frozen=True, eq=False)
class MarkedState:
    """Moves of the target (N, 3), where the weave that is cut for it rests, and departures (N,); in metres."""

    moves: Floats
    points: Floats
    solution: Solution
    structure: Anchored
    departure: Floats

    @property
    def worst(self) -> float:
        """Largest departure."""
        return float(self.departure.max())

    @property
    def mean_square(self) -> float:
        """Mean of the squared departures."""
        return float((self.departure**2).mean())


class MarkFit:
    """Fits the marks of a weave near its drawing until it rests within a limit, in metres."""

    def __init__(self, near: NearDrawing, limit: float, progress: Optional[Progress] = None) -> None:
        self.near, self.limit, self._progress = near, limit, progress
        self.n_factorised = 0

    def find(self, is_held: Bools, loads: Loads, *, start: Floats, moves: Optional[Floats] = None) -> MarkedState:
        """Marks with which the weave rests near the drawing, with some nodes (N,) held.

        Parameters
        ----------
        is_held : (N,) bool
        loads : Loads
        start : (n, 3) float64
            Points from which the first equilibrium is searched.
        moves : (N, 3) float64, optional
            Of the target, to begin with.
        """
        near, damping = self.near, FIRST_DAMPING
        structure = near.supported(is_held, loads)
        structure = structure.on_springs(near.springs(structure, _WEAK))
        moves = np.zeros((near.weave.lattice.n_nodes, 3)) if moves is None else moves
        for part in _PARTS:
            state = self._rest(structure, part * moves, near.at_anchors(structure, start))
            if state.solution.is_converged:
                break
        for k in range(_MOST_STEPS):
            if state.worst <= self.limit or not state.solution.is_converged:
                break
            if self._progress:
                self._progress(k / _MOST_STEPS, f"marks, within {state.worst / near.metres:.3g}")
            tried = self._rest(
                structure,
                state.moves + self._step(state, damping, is_held),
                state.points,
                state.structure.forces(state.points),
            )
            if tried.solution.is_converged and tried.mean_square < state.mean_square:
                state, damping = tried, max(damping / 2, _LEAST_DAMPING)
            else:
                damping *= 4
        return state

    def _rest(self, structure: Anchored, moves: Floats, start: Floats, forces: Optional[Forces] = None) -> MarkedState:
        """Where the weave rests that is cut for the drawing with its nodes moved."""
        rods = self.near.rods
        a, b = rods.segments.T
        target = rods.points + self._spread @ moves
        lengths, _ = normalised(target[b] - target[a])
        cut = structure.cut_to(lengths * rods.scale[a])
        assert isinstance(cut, Anchored)
        found = find_equilibrium(cut, start, forces=forces, most_steps=_MOST_SEARCH)
        self.n_factorised += found.n_steps
        return MarkedState(moves, found.points, found, cut, self.near.departure(found.points))

    def _step(self, state: MarkedState, damping: float, is_held: Bools) -> Floats:
        """(N, 3) move of the target that brings the weave nearer to the drawing."""
        structure = state.structure
        by_moves = self.forces_by_moves(structure, state.moves, state.points)[structure.free] @ moving(is_held)
        average = kron(self.near.average, identity(3), format="csr")[:, structure.free].tocsr()
        off = np.asarray(self.near.average @ (state.points - self.near.anchors)).ravel()
        self.n_factorised += FIT_WORK
        step, _ = damped_least_squares(by_moves, average, state.solution.factors.solve, off, damping)
        return step

    def forces_by_moves(self, structure: Anchored, moves: Floats, points: Floats) -> csr_matrix:
        """(3n, 3N) derivative of the gradient by the moves of the target's nodes, through the rest lengths."""
        rods = self.near.rods
        a, b = rods.segments.T
        target = rods.points + self._spread @ moves
        _, along = normalised(target[b] - target[a])
        length, unit = normalised(points[b] - points[a])
        stretches = structure.stretches
        # The force EA (l / r - 1) falls by EA l / r^2 with the rest length r, and EA is stiffness times r.
        slope = -stretches.stiffness * length / stretches.rest
        n = structure.n_points
        by_rest = _differences(rods.segments, slope[:, None] * unit, n).T
        of_points = _differences(rods.segments, along * rods.scale[a][:, None], n)
        of_moves = of_points @ kron(self._spread, identity(3), format="csr")
        product: csr_matrix = (by_rest @ of_moves).tocsr()
        return product

    @cached_property
    def _spread(self) -> csr_matrix:
        """(n, N) moves of points from those of nodes: a point between two joints takes its part of both."""
        return _spread_of(self.near.weave, self.near.rods)


def moving(is_held: Bools) -> csr_matrix:
    """(3N, 3N) moves of the nodes with those of held ones (N,) left out: the target has these where they were drawn."""
    return diags(np.repeat(~is_held, 3).astype(np.float64)).tocsr()


def _differences(segments: Ints, weights: Floats, n: int) -> csr_matrix:
    """(M, 3n) weights (M, 3) times the difference of the two points of each segment."""
    a, b = segments.T
    rows = np.repeat(np.arange(len(segments)), 6)
    columns = np.concatenate([3 * b[:, None] + np.arange(3), 3 * a[:, None] + np.arange(3)], axis=1)
    values = np.concatenate([weights, -weights], axis=1)
    return csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(len(segments), 3 * n))


def _spread_of(weave: Weave, rods: RodPoints) -> csr_matrix:
    nodes, n = weave.strands.nodes, len(rods.points)
    is_visit = np.zeros(n, bool)
    is_visit[rods.of_visit] = True
    index = np.arange(n)
    visit = np.cumsum(is_visit) - 1
    part = index - rods.of_visit[visit]
    between = np.flatnonzero(~is_visit)
    # The visit after a point between two: one on along the rod, or the first of a closed one.
    last = rods.offsets[1:][rods.rod[between]] - 1
    after = np.where(visit[last] == visit[between], visit[rods.offsets[:-1][rods.rod[between]]], visit[between] + 1)
    share = part[between] / SEGMENTS
    rows = np.concatenate([index[is_visit], between, between])
    columns = nodes[np.concatenate([visit[is_visit], visit[between], after])]
    values = np.concatenate([np.ones(int(is_visit.sum())), 1.0 - share, share])
    return csr_matrix((values, (rows, columns)), shape=(n, weave.lattice.n_nodes))
