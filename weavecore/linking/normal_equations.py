"""Gauss-Newton systems of least squares over nodes that move on a surface, with a fixed pattern of entries.

With B the derivative of the residuals by the unknowns, two, one or none for each node,

    H = Σ_rows Bᵀ B        g = Σ_rows Bᵀ residual

The residuals of a rod depend on a few places in a row (`rod_runs`), so the products of their derivatives are summed
along the rods first, by the distance of the two places; what is left are a few numbers for each place.  Corners add
the products of three nodes.  Where each number goes in H is found once.  Linear in the number of places.

Source: Nocedal and Wright 2006, *Numerical Optimization*, §10.2 (Gauss-Newton).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np
from scipy.sparse import csr_matrix

from weavecore.geometry.arrays import Floats, Ints, dots, offsets_of, order_by
from weavecore.geometry.conjugate_gradients import conjugate_gradients
from weavecore.linking.rod_runs import GHOSTS, RodRuns
from weavecore.polling import each, poll

_TOLERANCE, _MOST_ITERATIONS = 1e-2, 300
"""Relative residual and iterations at which conjugate gradients stop: a rough step is enough, as more follow."""

_FEW = 0.2
"""Share of places with two unknowns up to which the second ones are treated apart."""

Rows = Callable[[Optional[Ints], Floats], Floats]
"""Derivatives (S, m, w, Q) of w residuals at each place by m unknowns of S places in a row; takes the places to look at
(all where None), and the directions (m, 3, Q) of their nodes."""


@dataclass(frozen=True, eq=False)
class BandTerm:
    """A part of the sum whose residuals depend on places in a row.

    Parameters
    ----------
    first : int
        Where the first of these places is, counted from that of the residual.
    rows : Rows
    """

    first: int
    rows: Rows


@dataclass(frozen=True, eq=False)
class _Pass:
    """Products that are made together: of so many unknowns of each place, at some places or all."""

    places: Optional[Ints]
    n_unknowns: int
    pairs: list[tuple[int, int]]


class NormalEquations:
    """Systems over the unknowns of all nodes, none to two for each.

    Parameters
    ----------
    runs : RodRuns
    diagonals : (2, K) int64
        Pairs of nodes that corners join, but edges do not.
    n_unknowns : (N,) int64
        Of each node: how many of its directions count.
    """

    def __init__(self, runs: RodRuns, diagonals: Ints, n_unknowns: Ints) -> None:
        self._runs, self._counts = runs, n_unknowns
        self.first = offsets_of(n_unknowns)
        self._n = int(self.first[-1])
        self._passes = self._find_passes()
        # Unknown of each node by its number, one beyond all where it has none.
        self._unknown = np.where(np.arange(2)[:, None] < n_unknowns, self.first[:-1] + np.arange(2)[:, None], self._n)
        self._set_pattern(*np.concatenate([self._band_keys(), self._diagonal_keys(diagonals)], axis=1))

    def _find_passes(self) -> list[_Pass]:
        """All first unknowns at once; second ones too, or these apart where they are few."""
        is_wide = self._counts[self._runs.node] > 1
        if not is_wide.any():
            return [_Pass(None, 1, [(0, 0)])]
        seconds = [(0, 1), (1, 0), (1, 1)]
        if is_wide.mean() > _FEW:
            return [_Pass(None, 2, [(0, 0), *seconds])]
        # Joints as far as a stencil reaches have such an unknown in theirs, which reaches as far again.
        near = is_wide
        for _ in range(2 * GHOSTS):
            near = near | np.append(near[1:], False) | np.insert(near[:-1], 0, False)
        return [_Pass(None, 1, [(0, 0)]), _Pass(np.flatnonzero(near), 2, seconds)]

    def _band_keys(self) -> Ints:
        """(2, K) unknowns of the numbers of all passes, in the order of `_banded`."""
        keys = []
        for one in self._passes:
            node = self._runs.node if one.places is None else self._runs.node[one.places]
            for d in range(2 * GHOSTS + 1):
                other = np.append(node[d:], np.zeros(d, np.int64))
                keys += [np.stack([self._unknown[a][node], self._unknown[b][other]]) for a, b in one.pairs]
        return np.concatenate(keys, axis=1)

    def _diagonal_keys(self, diagonals: Ints) -> Ints:
        """(2, K) unknowns of nodes that share faces but no edge."""
        one, other = self._unknown[:, diagonals[0]], self._unknown[:, diagonals[1]]
        return np.stack([np.repeat(one, 2, axis=0).ravel(), np.tile(other, (2, 1)).ravel()])

    def _set_pattern(self, row: Ints, column: Ints) -> None:
        """Find the entries of H on and above its diagonal, the one of each number, and those of the whole."""
        poll()
        n = self._n
        low, high = np.minimum(row, column), np.maximum(row, column)
        order = order_by(high, n + 1)
        order = order[order_by(low[order], n + 1)]
        order = order[high[order] < n]
        low, high = low[order], high[order]
        is_new = np.ones(len(order), bool)
        is_new[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
        self._n_entries = int(is_new.sum())
        self._slots = np.full(len(row), self._n_entries)
        self._slots[order] = np.cumsum(is_new) - 1
        low, high = low[is_new], high[is_new]
        self._keys = low * n + high
        poll()
        upper = np.flatnonzero(low != high)
        rows = np.concatenate([high[upper], low])
        columns = np.concatenate([low[upper], high])
        # In each row the entries below the diagonal come first; both parts are in order of their columns.
        self._source = np.concatenate([upper, np.arange(self._n_entries)])
        order = order_by(rows, n)
        # SciPy would copy indices of 64 bits to ones of 32 for each matrix.
        self._source, self._columns = self._source[order], columns[order].astype(np.int32)
        self._offsets = offsets_of(np.bincount(rows, minlength=n)).astype(np.int32)
        self._diagonal = np.flatnonzero(self._columns == rows[order])

    def assemble(self, bands: list[BandTerm], corners: tuple[Ints, Floats], directions: Floats) -> csr_matrix:
        """Find the Hessian over the unknowns.

        Parameters
        ----------
        bands : list of BandTerm
        corners : (3, T) int64 and (3, 3, T) float64
            Nodes of corners, and the derivatives of their residuals by the coordinates of each.
        directions : (N, 3, 2) float64
            Unit vectors along which each node moves, 0 beyond its unknowns.

        Returns
        -------
        (U, U) csr_matrix
        """
        ways = directions.transpose(2, 1, 0)
        numbers = [self._banded(one, bands, ways) for one in self._passes]
        entries = np.bincount(self._slots[: sum(map(len, numbers))], np.concatenate(numbers), self._n_entries + 1)
        slots, values = self._cornered(*corners, ways)
        entries = (entries + np.bincount(slots, values, self._n_entries + 1))[:-1]
        n = self._n
        return csr_matrix((entries[self._source], self._columns, self._offsets), shape=(n, n))

    def _banded(self, one: _Pass, bands: list[BandTerm], ways: Floats) -> Floats:
        """Sums of the products of unknowns of two places, by the distance of the places."""
        node = self._runs.node if one.places is None else self._runs.node[one.places]
        at_places = np.ascontiguousarray(ways[: one.n_unknowns]).take(node, axis=2)
        sums = np.zeros((2 * GHOSTS + 1, len(one.pairs), len(node)))
        for term in bands:
            rows = term.rows(one.places, at_places)
            n_places = len(rows)
            for d in each(range(n_places)):
                for s in range(n_places - d):
                    begin = term.first + s
                    for which, (a, b) in enumerate(one.pairs):
                        if d == 0 and a > b:
                            continue
                        product = rows[s, a, 0] * rows[s + d, b, 0]
                        for k in range(1, rows.shape[2]):
                            product += rows[s, a, k] * rows[s + d, b, k]
                        if begin < 0:
                            sums[d, which, :begin] += product[-begin:]
                        else:
                            sums[d, which, begin:] += product[: len(node) - begin]
        # Two places of one node, in a short closed rod: the product counts for its mirror image too.
        for d in range(1, 2 * GHOSTS + 1):
            again = np.flatnonzero(node[d:] == node[:-d])
            for which, (a, b) in enumerate(one.pairs):
                sums[d, which, again] *= 2.0 if a == b else 1.0
        return sums.ravel()

    def _cornered(self, nodes: Ints, slopes: Floats, ways: Floats) -> tuple[Ints, Floats]:
        """Entries of the products of corners, and their values."""
        n_unknowns = int(self._counts.max(initial=0))
        moves = [[_dot(slope, way[:, at]) for way in ways[:n_unknowns]] for slope, at in zip(slopes, nodes)]
        keys, values = [np.zeros(0, np.int64)], [np.zeros(0)]
        unknown = [(i, a) for i in range(3) for a in range(n_unknowns)]
        for k, (i, a) in enumerate(unknown):
            for j, b in unknown[k:]:
                one, other = self._unknown[a, nodes[i]], self._unknown[b, nodes[j]]
                known = np.maximum(one, other) < self._n
                keys.append((np.minimum(one, other) * self._n + np.maximum(one, other))[known])
                values.append((moves[i][a] * moves[j][b])[known])
        return np.searchsorted(self._keys, np.concatenate(keys)), np.concatenate(values)

    def gradient(self, by_nodes: Floats, directions: Floats) -> Floats:
        """The gradient (U,) over the unknowns, from that (N, 3) by the coordinates of the nodes."""
        along = [dots(by_nodes, directions[:, :, k]) for k in range(2)]
        return np.stack(along, axis=1)[np.arange(2) < self._counts[:, None]]

    def solve(self, hessian: csr_matrix, damping: Floats, right: Floats) -> Floats:
        """Solve for a step by conjugate gradients, roughly: more steps follow, for the sum is not quadratic.

        The preconditioner inverts the block of each node, those of two unknowns as a whole: so no step depends on the
        directions that span the tangent planes, and a surface that is turned gives the same lattice.

        Parameters
        ----------
        hessian : (U, U) csr_matrix
        damping : (N,) float64
            Added to its diagonal, for each node.
        right : (U,) float64

        Returns
        -------
        (U,) float64
        """
        n = len(right)
        data = hessian.data.copy()
        data[self._diagonal] += np.repeat(damping, self._counts)
        matrix = csr_matrix((data, hessian.indices, hessian.indptr), shape=(n, n))
        pairs = self.first[:-1][self._counts == 2]
        inverse, beside = 1.0 / data[self._diagonal], np.zeros(n)
        a, b, c = data[self._diagonal[pairs]], data[self._diagonal[pairs] + 1], data[self._diagonal[pairs + 1]]
        determinant = a * c - b * b
        inverse[pairs], inverse[pairs + 1] = c / determinant, a / determinant
        beside[pairs] = beside[pairs + 1] = -b / determinant
        other = np.arange(n)
        other[pairs], other[pairs + 1] = pairs + 1, pairs

        def precondition(residual: Floats) -> Floats:
            preconditioned: Floats = inverse * residual
            if len(pairs):
                preconditioned += beside * residual[other]
            return preconditioned

        step, _ = conjugate_gradients(
            matrix, right, tolerance=_TOLERANCE, most_iterations=_MOST_ITERATIONS, precondition=precondition
        )
        return step


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product
