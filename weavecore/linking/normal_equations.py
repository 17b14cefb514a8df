"""Gauss-Newton systems of least squares over nodes that move on a surface, with a fixed pattern of entries.

A term of the sum has residuals that depend on the few nodes of a *stencil* each.  With B the derivative of the
residuals of a row by the coordinates of its nodes, and D the directions in which these may go,

    H = Σ_rows (B D)ᵀ (B D)        g = Dᵀ Σ_rows (gradient by the coordinates)

Which entries of H there are depends on the stencils alone, so each entry of each row's small dense product is given its
place in H once, and a system is assembled by one weighted count: linear in rows times the square of the stencil.

Source: Nocedal and Wright 2006, *Numerical Optimization*, §10.2 (Gauss-Newton).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of, small_products
from weavecore.geometry.conjugate_gradients import conjugate_gradients
from weavecore.polling import each, poll

_ROWS_AT_ONCE = 8192
"""Rows whose products are made between two polls; their arrays fit into a processor's cache."""

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


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows of a term whose nodes have as many unknowns at most, and where the entries of their products go.

    Parameters
    ----------
    n_unknowns : int
        1 or 2 for each node.
    number : (R,) int64
        Of each row of the term among these, -1 of the others.
    row, column : (t,) int64
        Of the entries on and above the diagonal of a product.
    slots : (r, t) int64
        Where in the matrix each of them goes.
    times : (r, t) uint8
        How often it counts: see `_upper`.
    """

    n_unknowns: int
    number: Ints
    row: Ints
    column: Ints
    slots: Ints
    times: NDArray[np.uint8]

    def products(self, blocks: Floats, directions: Floats, which: Ints) -> Floats:
        """Entries (n, t) of the products of rows, from blocks (n, k, w, 3) and the directions (n, k, 3, 2)."""
        n, k, w = blocks.shape[:3]
        # (rows, nodes, residuals, unknowns of a node) to (rows, unknowns, residuals)
        slopes = small_products(blocks, directions[..., : self.n_unknowns]).transpose(0, 1, 3, 2)
        slopes = slopes.reshape(n, k * self.n_unknowns, w)
        products = small_products(slopes, slopes.transpose(0, 2, 1))
        entries: Floats = products[:, self.row, self.column] * self.times[which]
        return entries


def _upper(square: Ints, row: Ints, column: Ints, mirror: Ints) -> tuple[Ints, NDArray[np.uint8]]:
    """Slots (r, t) on or above the diagonal of the matrix for the upper entries of products, and how often these count.

    Where a stencil names a node twice, an entry beside the diagonal of the product and its mirror image both go to one
    place on the diagonal of the matrix: it counts twice.
    """
    one, other = square[:, row, column], square[:, column, row]
    times = np.where((one == other) & (row != column), 2, 1).astype(np.uint8)
    return mirror[one], times


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
        poll()
        pairs, place = np.unique(np.concatenate(keys), return_inverse=True)
        poll()
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
        # The matrix is symmetric: what lies below its diagonal is copied from above.
        mirrored = slots[np.searchsorted(pairs, column * n + row)].transpose(0, 2, 1)
        self._mirror = np.arange(self._n_entries + 1)
        below = (row > column)[:, None, None] | ((row == column)[:, None, None] & (p > q))
        self._mirror[slots[below]] = mirrored[below]
        ends = np.cumsum([len(key) for key in keys])
        parts = np.split(place.ravel(), ends[:-1])
        self._groups = [self._grouped(nodes, part, slots) for nodes, part in zip(stencils, parts)]

    def _grouped(self, nodes: Ints, place: Ints, slots: Ints) -> list[_Rows]:
        """The rows of a term, those whose nodes have one unknown at most apart from the others."""
        k = nodes.shape[1]
        place = place.reshape(len(nodes), k, k)
        is_wide = (self._counts[nodes] > 1).any(axis=1)
        groups = []
        for most, members in each(((1, np.flatnonzero(~is_wide)), (2, np.flatnonzero(is_wide)))):
            of_rows = slots[place[members], :most, :most]
            # (rows, nodes, nodes, unknowns of a node, again) to (rows, unknowns, unknowns)
            square = of_rows.transpose(0, 1, 3, 2, 4).reshape(len(members), most * k, most * k)
            number = np.full(len(nodes), -1, np.int64)
            number[members] = np.arange(len(members))
            row, column = np.triu_indices(most * k)
            groups.append(_Rows(most, number, row, column, *_upper(square, row, column, self._mirror)))
        return groups

    def assemble(self, terms: list[Term], directions: Floats) -> tuple[csr_matrix, Floats]:
        """Find the Hessian and the gradient over the unknowns.

        Parameters
        ----------
        terms : list of Term
            One for each of the stencils.
        directions : (N, 3, 2) float64
            Unit vectors along which each node moves; columns beyond its unknowns are not used.

        Returns
        -------
        hessian : (U, U) csr_matrix
        gradient : (U,) float64
        """
        entries = np.zeros(self._n_entries + 1)
        for term, nodes, groups in zip(terms, self._stencils, self._groups):
            for group in groups:
                at = np.flatnonzero(group.number[term.rows] >= 0)
                which = group.number[term.rows[at]]
                products = np.empty((len(at), len(group.row)))
                for begin in each(range(0, len(at), _ROWS_AT_ONCE)):
                    part = slice(begin, begin + _ROWS_AT_ONCE)
                    products[part] = group.products(
                        term.blocks[at[part]], directions[nodes[term.rows[at[part]]]], which[part]
                    )
                entries += np.bincount(group.slots[which].ravel(), products.ravel(), self._n_entries + 1)
                poll()
        entries = entries[self._mirror]
        n = int(self.first[-1])
        hessian = csr_matrix((entries[:-1], self._columns[:-1], self._offsets), shape=(n, n))
        gradient = np.sum([term.gradient for term in terms], axis=0)
        along = small_products(gradient[:, None], directions)[:, 0]
        return hessian, along[np.arange(2) < self._counts[:, None]]

    def solve(self, hessian: csr_matrix, damping: float, right: Floats) -> Floats:
        """Solve for a step by conjugate gradients, roughly: more steps follow, for the sum is not quadratic.

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

        def precondition(residual: Floats) -> Floats:
            preconditioned: Floats = inverse * residual + beside * residual[other]
            return preconditioned

        step, _ = conjugate_gradients(
            matrix, right, tolerance=_TOLERANCE, most_iterations=_MOST_ITERATIONS, precondition=precondition
        )
        return step
