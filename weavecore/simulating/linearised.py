"""`LinearisedWeave`: how a weave near its drawing departs when springs go, nodes are held and marks move.

At a state ``x`` on springs ``k D`` with the Hessian ``H`` and the force ``f`` that the springs carry, weaker springs
let the points move by ``u``, and holding nodes adds reactions ``r`` on the rows ``E`` of their points::

    (H + k D) u = f - k D e + E r        E^T (e + u) = 0        e = x - drawn

A node that is held costs a few solves with the factors of ``H + k D`` and is let go at no cost.  With ``G = E^T (H + k
D)^-1 E`` the weave with its held nodes has ``n(H + k D) - n(G)`` negative eigenvalues (inertia additivity, Haynsworth
1968), so each set of supports is known to be stable or not.  Rod and tie forces of the drawing are in ``H``, so it
holds near the drawing only; `weavecore.simulating.newton` says what it is worth.
"""

from __future__ import annotations

from typing import Any, Callable

import numpy as np
from scipy.sparse import csr_matrix, diags, identity, kron
from scipy.sparse.linalg import LinearOperator, lsmr

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.polling import poll
from weavecore.simulating.anchored import Anchored, NearDrawing
from weavecore.simulating.newton import factorised

_SOLVES = 40
"""Iterations of LSMR at most."""

_EXACT = 1e-4
"""Of LSMR: the model is no better."""


class LinearisedWeave:
    """A weave near its drawing with some nodes held, linear about a state on springs."""

    def __init__(self, near: NearDrawing, structure: Anchored, points: Floats) -> None:
        self._near, self._structure, self.points = near, structure, points
        bare = structure.on_springs(np.zeros(structure.n_points))
        self._hessian, self._force = bare.hessian(points), -bare.gradient(points)
        self._off = points - near.anchors
        self._average: csr_matrix = kron(near.average, identity(3), format="csr")[:, structure.free].tocsr()
        self._place = np.full(3 * structure.n_points, -1)
        self._place[structure.free] = np.arange(len(structure.free))
        nodes = near.weave.strands.nodes
        order = np.argsort(nodes, kind="stable")
        starts = np.searchsorted(nodes[order], np.arange(near.weave.lattice.n_nodes + 1))
        self._points, self._starts = near.rods.of_visit[order], starts
        self.held: list[int] = []
        self._columns: list[tuple[Floats, Floats]] = []

    def on_springs(self, stiffness: float) -> None:
        """Make the springs that are left as stiff as this, in ``EI / l^3`` of a median segment."""
        structure = self._structure
        springs = self._near.springs(structure, stiffness)
        hessian = (self._hessian + diags(np.repeat(springs, 3)[structure.free])).tocsc()
        self._factors, self._n_negative = factorised(structure, hessian)
        force = self._force - springs[:, None] * self._off
        self._free = self._factors.solve(force.ravel()[structure.free])
        self._columns = [self._column(node) for node in self.held]
        self._update()

    def hold(self, node: int) -> None:
        """Hold a node where it was drawn."""
        self.held.append(node)
        self._columns.append(self._column(node))
        self._update()

    def keep(self, is_kept: Bools) -> None:
        """Hold only some of the held nodes, (h,) of them."""
        kept = np.flatnonzero(is_kept).tolist()
        self.held, self._columns = [self.held[k] for k in kept], [self._columns[k] for k in kept]
        self._update()

    def without(self, is_kept: Bools) -> tuple[Floats, int]:
        """Departure (N,) and negative eigenvalues with only some of the held nodes kept."""
        rows = is_kept[self._holder]
        return self._departure(self._moved(rows)), self._negative(rows)

    @property
    def departure(self) -> Floats:
        """(N,) of the nodes, in metres."""
        return self._departure(self._moved(self._holder >= 0))

    @property
    def n_negative(self) -> int:
        """Negative eigenvalues: ways in which the weave leaves the drawing."""
        return self._negative(self._holder >= 0)

    def fitted(self, forces_by_moves: csr_matrix, damping: float) -> tuple[Floats, Floats]:
        """Moves (N, 3) of the target by which the held weave departs least, and how far it then does (N,).

        ``forces_by_moves`` (3n, 3N) is the derivative of the gradient by the moves; the damping is on the moves.
        """
        by_moves = forces_by_moves[self._structure.free]
        off = self._moved(self._holder >= 0)
        moves, left = damped_least_squares(by_moves, self._average, self._inverse(), off, damping)
        return moves, self._departure(left)

    def _rows(self, node: int) -> Ints:
        """Free coordinates of the rods at a node."""
        points = self._points[self._starts[node] : self._starts[node + 1]]
        rows: Ints = self._place[(3 * points[:, None] + np.arange(3)).ravel()]
        return rows[rows >= 0]

    def _column(self, node: int) -> tuple[Floats, Floats]:
        """Moves of the free coordinates and of the nodes by forces on a held node."""
        rows = self._rows(node)
        unit = np.zeros((len(self._free), len(rows)))
        unit[rows, np.arange(len(rows))] = 1.0
        column = self._factors.solve(unit)
        return column, np.asarray(self._average @ column)

    def _update(self) -> None:
        """What all figures of the held nodes are made of: G, and moves of nodes by reactions."""
        start = np.asarray(self._average @ self._free) + np.asarray(self._near.average @ self._off).ravel()
        self._start: Floats = start
        rows = [self._rows(node) for node in self.held]
        self._held_rows: Ints = np.concatenate([*rows, np.zeros(0, np.int64)])
        self._holder: Ints = np.repeat(np.arange(len(rows)), [len(row) for row in rows]).astype(np.int64)
        compliance = np.zeros((0, len(self._held_rows)))
        if rows:
            compliance = np.concatenate([column[self._held_rows] for column, _ in self._columns], axis=1)
        self._compliance: Floats = (compliance + compliance.T) / 2
        nodal = [moved for _, moved in self._columns]
        self._nodal: Floats = np.concatenate(nodal, axis=1) if nodal else np.zeros((len(start), 0))

    def _moved(self, rows: Bools) -> Floats:
        """(3N,) from where the nodes were drawn, with some rows (r,) of the held nodes fixed."""
        poll()
        if not rows.any():
            return self._start
        off = self._off.ravel()[self._structure.free][self._held_rows] + self._free[self._held_rows]
        reaction = np.linalg.solve(self._compliance[np.ix_(rows, rows)], -off[rows])
        moved: Floats = self._start + self._nodal[:, rows] @ reaction
        return moved

    def _negative(self, rows: Bools) -> int:
        if not self._n_negative or not rows.any():
            return self._n_negative
        values = np.linalg.eigvalsh(self._compliance[np.ix_(rows, rows)])
        return self._n_negative - int((values < 0).sum())

    def _inverse(self) -> Callable[[Floats], Floats]:
        """Solves with the Hessian of the weave with its held nodes."""
        factors: Any = self._factors
        if not self.held:
            solve: Callable[[Floats], Floats] = factors.solve
            return solve
        columns, reaction = (
            np.concatenate([column for column, _ in self._columns], axis=1),
            np.linalg.inv(self._compliance),
        )

        def held_solve(force: Floats) -> Floats:
            moved = factors.solve(force)
            held: Floats = moved - columns @ (reaction @ moved[self._held_rows])
            return held

        return held_solve

    @staticmethod
    def _departure(moved: Floats) -> Floats:
        departure: Floats = np.linalg.norm(moved.reshape(-1, 3), axis=1)
        return departure


def damped_least_squares(
    by_moves: csr_matrix, average: csr_matrix, inverse: Callable[[Floats], Floats], off: Floats, damping: float
) -> tuple[Floats, Floats]:
    """Moves (N, 3) of the target that lead nodes back by ``off`` (3N,), and how far off they are left (3N,).

    Parameters
    ----------
    by_moves : (f, 3N) sparse
        Derivative of the gradient by the moves.
    average : (3N, f) sparse
        Nodes of the free coordinates.
    inverse : callable
        Solves with the Hessian (f, f), which is symmetric.
    off : (3N,) float64
    damping : float
        On the moves.
    """
    transposed, back = by_moves.T.tocsr(), average.T.tocsr()

    def product(moves: Floats) -> Floats:
        poll()
        moved: Floats = -(average @ inverse(by_moves @ moves))
        return moved

    def adjoint(error: Floats) -> Floats:
        moved: Floats = -(transposed @ inverse(back @ error))
        return moved

    operator = LinearOperator((len(off), by_moves.shape[1]), matvec=product, rmatvec=adjoint, dtype=np.float64)
    found = lsmr(operator, -off, damp=damping, atol=_EXACT, btol=_EXACT, maxiter=_SOLVES)[0]
    moves: Floats = found.reshape(-1, 3)
    return moves, off + product(found)
