"""Gauss-Newton systems of least squares over nodes that move on a surface, with a fixed pattern of entries.

A term of the sum has residuals that depend on the few nodes of a *stencil* each.  With B the derivative of the
residuals of a row by the coordinates of its nodes, and D the directions in which these may go,

    H = Σ_rows (B D)ᵀ (B D)        g = Dᵀ Σ_rows (gradient by the coordinates)

Which entries of H there are depends on the stencils alone, so each entry of each row's small dense product is given its
place in H once, and a system is assembled by one weighted count: linear in rows times the square of the stencil.

Source: Nocedal and Wright 2006, *Numerical Optimization*, §10.2 (Gauss-Newton), algorithm 5.3 (conjugate gradients).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from weavecore.geometry.arrays import Floats, Ints, inner, offsets_of, rows_of, small_products
from weavecore.polling import each, poll

_TOLERANCE, _MOST_ITERATIONS = 1e-2, 300
"""Relative residual and iterations at which conjugate gradients stop: a rough step is enough, as more follow."""


@dataclass(frozen=True, eq=False)
class Term:
    """A part of the sum to be made least.

    Parameters
    ----------
    value : float
    gradient : (N, 3) float64
        By the coordinates of the nodes.
    blocks : (R, k, w, 3) float64
        Derivatives of the w residuals of each row by the coordinates of the k nodes of its stencil.
    rows : (R,) int64
        Which rows of the stencils these are; the others have no residuals.
    """

    value: float
    gradient: Floats
    blocks: Floats
    rows: Ints


class NormalEquations:
    """Systems over the unknowns of all nodes, none to two for each.

    Parameters
    ----------
    stencils : list of (R, k) int64
        The nodes of each row, of one term after the other; a node may come more than once.
    n_unknowns : (N,) int64
        Of each node: how many of its directions count.
    """

    def __init__(self, stencils: list[Ints], n_unknowns: Ints) -> None:
        n = len(n_unknowns)
        self._stencils, self._counts = stencils, n_unknowns
        self.first = offsets_of(n_unknowns)
        keys = [(nodes[:, :, None] * n + nodes[:, None, :]).ravel() for nodes in stencils]
        pairs, place = np.unique(np.concatenate(keys), return_inverse=True)
        row, column = np.divmod(pairs, n)
        widths = n_unknowns[column]
        before = offsets_of(widths)
        row_start = before[np.searchsorted(row, np.arange(n + 1))]
        length = np.diff(row_start)
        base = offsets_of(n_unknowns * length)
        # Entries are stored by unknowns: first those of a node's first unknown, then those of its second.
        p, q = np.arange(2)[:, None], np.arange(2)
        slots = (base[row] + before[:-1] - row_start[row])[:, None, None] + p * length[row][:, None, None] + q
        self._n_entries = int(base[-1])
        is_entry = (p < n_unknowns[row][:, None, None]) & (q < widths[:, None, None])
        slots = np.where(is_entry, slots, self._n_entries)
        self._columns = np.zeros(self._n_entries + 1, np.int64)
        self._columns[slots] = self.first[column][:, None, None] + q
        self._offsets = offsets_of(np.repeat(length, n_unknowns))
        ends = np.cumsum([len(key) for key in keys])
        self._slots = [
            slots[part].reshape(len(nodes), k, k, 2, 2).transpose(0, 1, 3, 2, 4).reshape(len(nodes), 2 * k, 2 * k)
            for nodes, part in zip(stencils, np.split(place.ravel(), ends[:-1]))
            for k in (nodes.shape[1],)
        ]

    def assemble(self, terms: list[Term], directions: Floats) -> tuple[csr_matrix, Floats]:
        """Find the Hessian and the gradient over the unknowns.

        Parameters
        ----------
        terms : list of Term
            One for each of the stencils.
        directions : (N, 3, 2) float64
            In which way each node goes; columns beyond its unknowns are not used.

        Returns
        -------
        hessian : (U, U) csr_matrix
        gradient : (U,) float64
        """
        entries = np.zeros(self._n_entries + 1)
        for term, nodes, slots in each(zip(terms, self._stencils, self._slots)):
            at = nodes[term.rows]
            # (rows, nodes, residuals, ways) to (rows, residuals, unknowns)
            slopes = small_products(term.blocks, directions[at]).transpose(0, 1, 3, 2)
            slopes = slopes.reshape(len(at), 2 * nodes.shape[1], term.blocks.shape[2])
            poll()
            products = small_products(slopes, slopes.transpose(0, 2, 1))
            poll()
            entries += np.bincount(slots[term.rows].ravel(), products.ravel(), self._n_entries + 1)
        n = int(self.first[-1])
        hessian = csr_matrix((entries[:-1], self._columns[:-1], self._offsets), shape=(n, n))
        gradient = np.sum([term.gradient for term in terms], axis=0)
        along = small_products(gradient[:, None], directions)[:, 0]
        return hessian, along[np.arange(2) < self._counts[:, None]]

    def solve(self, hessian: csr_matrix, damping: float, right: Floats) -> Floats:
        """Take a step by conjugate gradients; a rough one does, for the sum is not quadratic.

        The preconditioner inverts the block of each node, those of two unknowns as a whole: so no step depends on the
        directions that span the tangent planes, and a surface that is turned gives the same lattice.

        Parameters
        ----------
        hessian : (U, U) csr_matrix
        damping : float
            Added to its diagonal.
        right : (U,) float64

        Returns
        -------
        (U,) float64
        """
        n = len(right)
        row = rows_of(self._offsets)
        diagonal = np.flatnonzero(hessian.indices == row)
        data = hessian.data.copy()
        data[diagonal] += damping
        matrix = csr_matrix((data, hessian.indices, hessian.indptr), shape=(n, n))
        pairs = self.first[:-1][self._counts == 2]
        inverse, beside = 1.0 / data[diagonal], np.zeros(n)
        a, b, c = data[diagonal[pairs]], data[diagonal[pairs] + 1], data[diagonal[pairs + 1]]
        determinant = a * c - b * b
        inverse[pairs], inverse[pairs + 1] = c / determinant, a / determinant
        beside[pairs] = beside[pairs + 1] = -b / determinant
        other = np.arange(n)
        other[pairs], other[pairs + 1] = pairs + 1, pairs
        return conjugate_gradients(
            matrix,
            right,
            lambda rest: inverse * rest + beside * rest[other],
            tolerance=_TOLERANCE,
            most=_MOST_ITERATIONS,
        )[0]


def conjugate_gradients(
    matrix: csr_matrix, right: Floats, precondition: Callable[[Floats], Floats], *, tolerance: float, most: int
) -> tuple[Floats, bool]:
    """Solve a symmetric, positive definite system, with the same last bit on every processor: without BLAS.

    Parameters
    ----------
    matrix : (U, U) csr_matrix
    right : (U,) float64
    precondition : callable
        Times an approximation of the inverse.
    tolerance : float
        Relative residual at which the iterations stop.
    most : int
        Iterations.

    Returns
    -------
    solution : (U,) float64
    is_converged : bool
    """
    step, rest = np.zeros(len(right)), right.copy()
    least = tolerance**2 * inner(right, right)
    way, last = np.zeros(len(right)), 1.0
    for _ in range(most):
        if inner(rest, rest) <= least:
            return step, True
        steered = precondition(rest)
        size = inner(rest, steered)
        way = steered + (size / last) * way
        pushed = matrix @ way
        share = size / inner(way, pushed)
        step += share * way
        rest -= share * pushed
        last = size
    return step, inner(rest, rest) <= least
