"""Plain weave: at every joint a rod lies on the other side than at the joint before.

A joint of two rods has one unknown: which of them is over.  Two joints that follow each other
along a rod tie their unknowns to each other.  Where no loop of such ties contradicts itself all are met;
elsewhere the fewest that can be found are broken (`frustration`), and what is left is improved joint by joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from weavecore.geometry.arrays import Floats, Ints, connected, next_in_loop, rows_of
from weavecore.geometry.matching import match_best
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.geometry.spanning import spread_signs
from weavecore.model.lattice import Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.strands import Meetings, steps_along

_MOST_ROUNDS = 50


def alternate(lattice: Lattice, strands: Strands, meetings: Meetings) -> list[Floats]:
    """Two ways how each visit may want to lie among its joint's: above the others with greater numbers (M,).

    One breaks what contradicts a spanning forest of the ties, the other the fewest ties between joints of
    two rods; where joints of more are many, either may be the better one.

    At joints of two rods it is 1 and -1.  At joints of more it is the mean of what the
    neighbours along the rod leave; a ring of a border lies between the ends of the rods that it holds.
    """
    sign = visit_signs(strands, meetings)
    before, after = steps_along(strands)
    tied = (sign[before] != 0) & (sign[after] != 0)
    a, b = meetings.joint_of_visit[before[tied]], meetings.joint_of_visit[after[tied]]
    # Of the unknowns x: sides are sign · x, and they must differ.
    product = -sign[before[tied]] * sign[after[tied]]
    tie = _ties_of_edges(lattice, strands.nodes[before[tied]], strands.nodes[after[tied]])
    bent = product.copy()
    bent[ties_to_break(lattice, tie, product)] *= -1
    n = len(meetings.node)
    ways = [solve_signs(a, b, product, spread_signs(a, b, wanted, n)) for wanted in (product, bent)]
    return [with_wishes((sign * x[meetings.joint_of_visit]).astype(np.float64), strands) for x in ways]


def _ties_of_edges(lattice: Lattice, one: Ints, other: Ints) -> Ints:
    """Tie (E,) of each edge of the lattice, -1 of those that tie nothing."""
    tie = np.full(lattice.n_edges, UNTIED, np.int64)
    tie[edges_between(lattice.edges, one, other)] = np.arange(len(one))
    return tie


def visit_signs(strands: Strands, meetings: Meetings) -> Ints:
    """(M,) 1 for the first visit of each joint of two rods, -1 for the second, 0 elsewhere."""
    first = meetings.offsets[:-1][meetings.counts == 2]
    sign = np.zeros(len(strands.nodes), np.int64)
    sign[meetings.visit[first]], sign[meetings.visit[first + 1]] = 1, -1
    return sign


def with_wishes(side: Floats, strands: Strands) -> Floats:
    """Sides (M,), and where there is none what the joints before and after along the rod leave."""
    before, after = steps_along(strands)
    wish = np.zeros(len(side))
    np.subtract.at(wish, before, side[after])
    np.subtract.at(wish, after, side[before])
    return np.where(side != 0, side, wish)


def solve_signs(a: Ints, b: Ints, product: Ints, start: Ints) -> Ints:
    """Signs x (n,) with ``x[a] * x[b] == product`` for as many ties as turning single ones of ``start`` can reach."""
    loop = a == b
    a, b, product = a[~loop], b[~loop], product[~loop]
    x, n = start.copy(), len(start)
    for _ in range(_MOST_ROUNDS):
        is_met = x[a] * x[b] == product
        gain = np.bincount(a, 1 - 2 * is_met, n) + np.bincount(b, 1 - 2 * is_met, n)
        # Neighbours must not be turned in the same round.
        best = np.full(n, -1.0)
        np.maximum.at(best, a, gain[b])
        np.maximum.at(best, b, gain[a])
        turned = (gain > 0) & (gain > best)
        if not turned.any():
            break
        x[turned] *= -1
    return x


# ----------------------------------------------------------------------
# Cells around which rods cannot alternate, and which ties to break so that they can everywhere else.
#
# Going around a cell of the lattice, from joint to joint along its sides, the sides of the rods must come
# back to what they were.  Where they do not, the cell is *frustrated*, as one with an odd number of
# sides is in a plain weave, and one of its ties at least is broken.  A broken tie frees the cells on
# both of its sides; so the fewest are broken along shortest ways that join the frustrated cells in pairs (the
# T-joins of Edmonds and Johnson, "Matching, Euler tours and the Chinese postman", 1973).

UNTIED = -1
_NEIGHBOURS = 12
"""Each frustrated cell is joined with one of so many that are nearest to it."""
_MOST_WORK = 20_000_000
"""Frustrated cells times cells up to which ways are looked for: their table must fit into memory."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a lattice and its borders, joined where no tie runs between them.

    Parameters
    ----------
    left, right : (E,) int64
        The cells beside each edge.
    n : int
    """

    left: Ints
    right: Ints
    n: int


def ties_to_break(lattice: Lattice, tie: Ints, product: Ints) -> Ints:
    """Ties (b,) whose products are to be turned so that hardly any cell is frustrated.

    Parameters
    ----------
    lattice : Lattice
    tie : (E,) int64
        Tie of each edge of the lattice, or -1.
    product : (k,) int64
        What the unknowns at the ends of each tie are to give: 1 or -1.
    """
    cells = _cells_of(lattice, tie)
    tied = np.flatnonzero(tie != UNTIED)
    wrong = tied[product[tie[tied]] < 0]
    count = np.bincount(np.r_[cells.left[wrong], cells.right[wrong]], minlength=cells.n)
    frustrated = np.flatnonzero(count % 2)
    if len(frustrated) == 0 or len(frustrated) * cells.n > _MOST_WORK:
        return np.zeros(0, np.int64)
    graph, key, edge = _ways_between(cells, tied)
    distance, before = dijkstra(graph, indices=frustrated, unweighted=True, return_predecessors=True)
    one, other = _nearest_pairs(distance[:, frustrated])
    partner = match_best(one, other, distance[one, frustrated[other]], len(frustrated))
    times = np.zeros(len(tie), np.int64)
    for a in np.flatnonzero(partner > np.arange(len(partner))).tolist():
        at, root = int(frustrated[partner[a]]), int(frustrated[a])
        while at != root:
            last = int(before[a, at])
            times[edge[np.searchsorted(key, min(at, last) * cells.n + max(at, last))]] += 1
            at = last
    broken: Ints = tie[times % 2 == 1]
    return broken


def _cells_of(lattice: Lattice, tie: Ints) -> Cells:
    left, right, n = _sides_of_edges(lattice)
    free = tie == UNTIED
    n, number = connected(left[free], right[free], n)
    return Cells(number[left], number[right], n)


def _sides_of_edges(lattice: Lattice) -> tuple[Ints, Ints, int]:
    """Cells (E,) on both sides of every edge; each border is a cell too."""
    n_nodes, n_faces = lattice.n_nodes, lattice.n_faces
    tail, head = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    at = edges_between(lattice.edges, tail, head)
    cell = np.full((2, len(lattice.edges)), -1, np.int64)
    cell[np.where(tail < head, 0, 1), at] = rows_of(lattice.face_offsets)
    is_border = (cell < 0).any(axis=0)
    ends = lattice.edges[is_border]
    _, part = connected(ends[:, 0], ends[:, 1], n_nodes)
    loop, number = np.unique(part[ends[:, 0]], return_inverse=True)
    cell[:, is_border] = np.where(cell[:, is_border] < 0, n_faces + number.ravel(), cell[:, is_border])
    return cell[0], cell[1], n_faces + len(loop)


def _ways_between(cells: Cells, tied: Ints) -> tuple[csr_matrix, Ints, Ints]:
    """The graph of cells beside each other, and an edge of the lattice for each key of two cells, rising."""
    a, b = cells.left[tied], cells.right[tied]
    apart = a != b
    key, first = np.unique(np.minimum(a, b)[apart] * np.int64(cells.n) + np.maximum(a, b)[apart], return_index=True)
    edge = tied[apart][first]
    both = key // cells.n, key % cells.n
    rows, columns = np.concatenate(both), np.concatenate(both[::-1])
    graph = coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape=(cells.n, cells.n)).tocsr()
    return graph, key, edge


def _nearest_pairs(distance: Floats) -> tuple[Ints, Ints]:
    """Pairs of frustrated cells, the lesser number first, each with those that are nearest."""
    n = len(distance)
    apart = distance + np.where(np.eye(n, dtype=bool), np.inf, 0.0)
    nearest = np.argsort(apart, axis=1, kind="stable")[:, :_NEIGHBOURS]
    one, other = np.repeat(np.arange(n), nearest.shape[1]), nearest.ravel()
    reached = np.isfinite(apart[one, other])
    pairs = np.unique(np.sort(np.c_[one[reached], other[reached]], axis=1), axis=0)
    return pairs[:, 0], pairs[:, 1]
