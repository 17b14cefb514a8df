"""`Structure`: rods and ties on plain arrays, with energy, gradient and sparse Hessian of the whole.

The Hessian's pattern does not change, so where each entry of each element goes is found once; after
that a Hessian is one `numpy.bincount`.  Supported coordinates have no rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Optional

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import splu

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.polling import each, poll, poll_during
from weavecore.simulating.elements import (
    BEND_SIGNS,
    SCISSOR_SIGNS,
    STRETCH_SIGNS,
    TIE_SIGNS,
    Bends,
    Scissors,
    Stretches,
    TieElements,
    bend_gradient,
    bend_hessian,
    scissor_gradient,
    scissor_hessian,
    stretch_hessian,
    stretch_values,
    tie_hessian,
    tie_values,
)


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces of the stiff elements: axial ones (M,) and those of ties (T, 3), in N."""

    axial: Floats
    tie: Floats

    def without_compression(self) -> Forces:
        """Those that add no negative curvature: rods in tension, ties at rest."""
        return Forces(np.maximum(self.axial, 0.0), 0.0 * self.tie)


NO_RELAXATION = 1
"""SuperLU's `relax`: by default it pads small subtrees of the elimination tree to dense blocks, which takes up to 14
times as long for rods of many segments, whose subtrees are chains."""

NO_SCISSORS = Scissors(np.zeros((0, 4), np.int64), np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Structure:
    """What the solver works on; SI units.

    Parameters
    ----------
    n_points : int
    bends : Bends
    stretches : Stretches
    ties : TieElements
    loads : (n, 3) float64
        Forces on the points, which keep their direction.
    is_fixed : (n, 3) bool
        Coordinates that do not move.
    scissors : Scissors, optional
        On pairs of rods that ties hold; their points are among those of the ties.
    """

    n_points: int
    bends: Bends
    stretches: Stretches
    ties: TieElements
    loads: Floats
    is_fixed: Bools
    scissors: Scissors = NO_SCISSORS

    def cut_to(self, rest: Floats) -> Structure:
        """The same with other rest lengths (M,) in m; what depends on the elements' points alone is shared."""
        stretches = self.stretches
        cut = replace(stretches, rest=rest, stiffness=stretches.stiffness * stretches.rest / rest)
        changed = replace(self, stretches=cut)
        for name in ("free", "_order", "_pairs", "_pattern"):
            changed.__dict__[name] = getattr(self, name)
        return changed

    @cached_property
    def free(self) -> Ints:
        """(f,) the coordinates that may move, ``3 * point + axis``, in an order in which the factors fill in little.

        The order is minimum degree on the points: as little fill as on the coordinates, in 1/30 of the time or less.
        """
        coordinates = (3 * self._order[:, None] + np.arange(3)).ravel()
        free: Ints = coordinates[~self.is_fixed.ravel()[coordinates]]
        return free

    @cached_property
    def _order(self) -> Ints:
        """(n,) the points by minimum degree, which SuperLU finds for a diagonally dominant matrix of their pattern."""
        rows, columns = self._pairs
        graph = csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(self.n_points, self.n_points))
        graph.data[:] = -1.0
        degrees = np.asarray(-graph.sum(axis=1)).ravel()
        dominant = (graph + diags(degrees + 2.0)).tocsc()
        return poll_during(_minimum_degree, dominant)

    @cached_property
    def _pairs(self) -> tuple[Ints, Ints]:
        """Row and column of each pair of points of each element."""
        rows, columns = [], []
        for points in (self.bends.points, self.stretches.points, self.ties.points, self.scissors.points):
            k = points.shape[1]
            rows.append(np.repeat(points, k, axis=1).ravel())
            columns.append(np.tile(points, (1, k)).ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def energy(self, x: Floats) -> float:
        """Elastic energy and that of the loads, in J."""
        return self.elastic_energy(x) - float((self.loads * x).sum())

    def elastic_energy(self, x: Floats) -> float:
        """Energy of bending, stretching and ties, in J."""
        return float(sum(self.energies(x).values()))

    def energies(self, x: Floats) -> dict[str, float]:
        """Elastic energy by kind, in J."""
        stretch, _ = stretch_values(x, self.stretches)
        tie = tie_values(x, self.ties.points, self.ties.slides)[0] - self.ties.rest
        return {
            "bending": float(bend_gradient(x, self.bends)[0].sum()),
            "axial": float((self.stretches.stiffness * stretch**2).sum() / 2),
            "ties": self.ties.energy(tie) + float(scissor_gradient(x, self.scissors)[0].sum()),
        }

    def forces(self, x: Floats) -> Forces:
        """Forces of segments and ties at the points ``x`` (n, 3)."""
        stretch, _ = stretch_values(x, self.stretches)
        tie = tie_values(x, self.ties.points, self.ties.slides)[0] - self.ties.rest
        return Forces(self.stretches.stiffness * stretch, self.ties.forces(tie))

    def forces_after(self, x: Floats, step: Floats) -> Forces:
        """Forces after a step (n, 3), with the elongations taken as linear in it."""
        stretch, unit = stretch_values(x, self.stretches)
        a, b = self.stretches.points.T
        stretch = stretch + np.einsum("nd,nd->n", unit, step[b] - step[a])
        tie, slopes = tie_values(x, self.ties.points, self.ties.slides)
        moved = np.einsum("vp,npd->nvd", TIE_SIGNS, step[self.ties.points], optimize=True)
        tie = tie - self.ties.rest + np.einsum("nkvd,nvd->nk", slopes, moved, optimize=True)
        return Forces(self.stretches.stiffness * stretch, self.ties.forces(tie))

    def gradient(self, x: Floats) -> Floats:
        """(n, 3) derivative of the energy: minus the force that is left on each point, reactions included."""
        stretch, unit = stretch_values(x, self.stretches)
        values, slopes = tie_values(x, self.ties.points, self.ties.slides)
        force = self.ties.forces(values - self.ties.rest)
        parts = [
            (self.bends.points, BEND_SIGNS, bend_gradient(x, self.bends)[1]),
            (self.stretches.points, STRETCH_SIGNS, ((self.stretches.stiffness * stretch)[:, None] * unit)[:, None]),
            (self.ties.points, TIE_SIGNS, np.einsum("nk,nkvd->nvd", force, slopes, optimize=True)),
            (self.scissors.points, SCISSOR_SIGNS, scissor_gradient(x, self.scissors)[1]),
        ]
        total = np.zeros((self.n_points, 3))
        for points, signs, by_vector in parts:
            by_point = np.einsum("vp,nvd->npd", signs, by_vector, optimize=True)
            for d in range(3):
                total[:, d] += np.bincount(points.ravel(), by_point[..., d].ravel(), minlength=self.n_points)
        return total - self.loads

    def hessian(self, x: Floats, forces: Optional[Forces] = None, *, convex: bool = False) -> csc_matrix:
        """Second derivatives by the free coordinates, in the order of ``free``.

        Parameters
        ----------
        x : (n, 3) float64
        forces : Forces, optional
            Taken for those of the stiff elements; by default the exact ones.
        convex : bool
            Whether the negative eigenvalues of every element are left out.
        """
        axial, tie = (None, None) if forces is None else (forces.axial, forces.tie)
        parts = [
            (BEND_SIGNS, bend_hessian(x, self.bends)),
            (STRETCH_SIGNS, stretch_hessian(x, self.stretches, axial)),
            (TIE_SIGNS, tie_hessian(x, self.ties, tie)),
            (SCISSOR_SIGNS, scissor_hessian(x, self.scissors)),
        ]
        entries = [_at_points(signs, _convex(blocks) if convex else blocks) for signs, blocks in each(parts)]
        slots, indices, starts = self._pattern
        n = len(self.free)
        data = np.bincount(slots, np.concatenate(entries), minlength=len(indices) + 1)[:-1]
        return csc_matrix((data, indices, starts), shape=(n, n))

    @cached_property
    def _pattern(self) -> tuple[Ints, Ints, Ints]:
        """Where each entry of each element goes in the sparse matrix (beyond it where its coordinate is fixed)."""
        rows, columns = self._pairs
        blocks, block_of = np.unique(columns * self.n_points + rows, return_inverse=True)
        poll()
        place = np.full(3 * self.n_points, -1)
        place[self.free] = np.arange(len(self.free))
        column, row = np.divmod(blocks, self.n_points)
        i, j = np.divmod(np.arange(9), 3)
        rows, columns = place[3 * row[:, None] + i].ravel(), place[3 * column[:, None] + j].ravel()
        used = np.flatnonzero((rows >= 0) & (columns >= 0))
        poll()
        order = used[np.lexsort((rows[used], columns[used]))]
        poll()
        slot_of = np.full(9 * len(blocks), len(order))
        slot_of[order] = np.arange(len(order))
        slots = slot_of[(9 * block_of.reshape(-1, 1) + np.arange(9)).ravel()]
        starts = np.concatenate([[0], np.cumsum(np.bincount(columns[order], minlength=len(self.free)))])
        return slots, rows[order].astype(np.int32), starts.astype(np.int32)


def _convex(blocks: Floats) -> Floats:
    """The nearest positive semi-definite matrices to those of elements, (n, k, k, 3, 3)."""
    n, k = blocks.shape[:2]
    values, vectors = np.linalg.eigh(blocks.transpose(0, 1, 3, 2, 4).reshape(n, 3 * k, 3 * k))
    kept: Floats = (vectors * np.maximum(values, 0.0)[:, None]) @ vectors.transpose(0, 2, 1)
    return kept.reshape(n, k, 3, k, 3).transpose(0, 1, 3, 2, 4)


def _at_points(signs: Floats, by_vectors: Floats) -> Floats:
    """Hessians by differences of points as those by the points, flat: element, point, point, axis, axis."""
    flat: Floats = np.einsum("vp,wq,nvwij->npqij", signs, signs, by_vectors, optimize=True).ravel()
    return flat


def _minimum_degree(matrix: csc_matrix) -> Ints:
    """SuperLU's order of a matrix; its factors are freed in the thread that made them, see `factors`."""
    options = {"SymmetricMode": True}
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, relax=NO_RELAXATION, options=options)
    order: Ints = np.argsort(factors.perm_c).astype(np.int64)
    return order
