"""Plain weave: at every joint a rod lies on the other side than at the joint before.

A joint of two rods has one unknown, the sign x = ±1 that says which of them is over.  Two joints that follow each
other along a rod are *tied*: the product of their unknowns is given.  Where no loop of ties contradicts itself all
hold; elsewhere the fewest that can be found are broken, and what is left is improved joint by joint.

Around a cell of the lattice, from joint to joint along its sides, the sides of the rods must come back to where they
started.  A cell where they do not, as one with an odd number of sides in a plain weave, is *frustrated*: at least one
of its ties is broken.  A broken tie frees the cells on both of its sides::

        +-----+-----+-----+
        |  F  /     /  F  |       F frustrated; the ties marked / are broken
        +-----+-----+-----+       along the shortest path between the two

So the fewest are broken along shortest paths that join the frustrated cells in pairs (T-joins: Edmonds and Johnson,
"Matching, Euler tours and the Chinese postman", 1973).  O(F E) for F frustrated cells and E edges, and the matching.
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
from weavecore.polling import each
from weavecore.weaving.strands import SharedNodes, steps_along

_MOST_ROUNDS = 50
"""Rounds of turning signs at most; each round lowers the number of broken ties."""

UNTIED = -1
"""An edge of the lattice without a tie."""

_NEIGHBOURS = 12
"""Each frustrated cell is joined with one of this many nearest ones."""

_MOST_WORK = 20_000_000
"""Frustrated cells times cells up to which paths are searched for: their table must fit into memory."""


def alternate(lattice: Lattice, strands: Strands, shared_nodes: SharedNodes) -> list[Floats]:
    """Find two sets of heights with which rods go over and under in turn as far as they can.

    The first breaks the ties that contradict a spanning forest of the ties, the second the fewest ties between joints
    of two rods.  Where many joints have more than two rods, either may be the better one.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    shared_nodes : SharedNodes

    Returns
    -------
    list of (M,) float64
        Wanted height of each visit among those of its joint.  At joints of two rods it is 1 or -1.  At joints of more
        it is minus the sum of those of its neighbours along the rod; a ring of a border lies between the ends of the
        rods that it holds.
    """
    sign = visit_signs(strands, shared_nodes)
    before, after = steps_along(strands)
    tied = (sign[before] != 0) & (sign[after] != 0)
    a, b = shared_nodes.joint_of_visit[before[tied]], shared_nodes.joint_of_visit[after[tied]]
    # Of the unknowns x: sides are sign · x, and they must differ.
    product = -sign[before[tied]] * sign[after[tied]]
    tie = _ties_of_edges(lattice, strands.nodes[before[tied]], strands.nodes[after[tied]])
    bent = product.copy()
    bent[ties_to_break(lattice, tie, product)] *= -1
    n = len(shared_nodes.node)
    solutions = [solve_signs(a, b, product, spread_signs(a, b, wanted, n)) for wanted in (product, bent)]
    return [fill_heights((sign * x[shared_nodes.joint_of_visit]).astype(np.float64), strands) for x in solutions]


def visit_signs(strands: Strands, shared_nodes: SharedNodes) -> Ints:
    """Signs by which the unknown of a joint gives the side of its two rods.

    Parameters
    ----------
    strands : Strands
    shared_nodes : SharedNodes

    Returns
    -------
    (M,) int64
        1 for the first visit of each joint of two rods, -1 for the second, 0 elsewhere.
    """
    first = shared_nodes.offsets[:-1][shared_nodes.counts == 2]
    sign = np.zeros(len(strands.nodes), np.int64)
    sign[shared_nodes.visit[first]], sign[shared_nodes.visit[first + 1]] = 1, -1
    return sign


def _ties_of_edges(lattice: Lattice, one: Ints, other: Ints) -> Ints:
    """Tie (E,) of each edge of the lattice, `UNTIED` where there is none."""
    tie = np.full(lattice.n_edges, UNTIED, np.int64)
    tie[edges_between(lattice.edges, one, other)] = np.arange(len(one))
    return tie


def ties_to_break(lattice: Lattice, tie: Ints, product: Ints) -> Ints:
    """Choose ties whose products are turned so that hardly any cell is frustrated.

    Parameters
    ----------
    lattice : Lattice
    tie : (E,) int64
        Tie of each edge of the lattice, or `UNTIED`.
    product : (k,) int64
        Wanted product of the unknowns at the ends of each tie: 1 or -1.

    Returns
    -------
    (b,) int64
        Ties; empty where no cell is frustrated, or so many that their table of distances would not fit into memory.
    """
    cells = _cells_of(lattice, tie)
    tied = np.flatnonzero(tie != UNTIED)
    wrong = tied[product[tie[tied]] < 0]
    count = np.bincount(np.r_[cells.left[wrong], cells.right[wrong]], minlength=cells.n)
    frustrated = np.flatnonzero(count % 2)
    if len(frustrated) == 0 or len(frustrated) * cells.n > _MOST_WORK:
        return np.zeros(0, np.int64)
    graph, key, edge = _paths_between(cells, tied)
    distance = dijkstra(graph, indices=frustrated, unweighted=True)
    one, other = _nearest_pairs(distance[:, frustrated])
    partner = match_best(one, other, distance[one, frustrated[other]], len(frustrated))
    times = np.zeros(len(tie), np.int64)
    for a in each(np.flatnonzero(partner > np.arange(len(partner))).tolist()):
        at, root = int(frustrated[partner[a]]), int(frustrated[a])
        while at != root:
            # Of several shortest ways the one over the least numbers: releases of SciPy take different ones.
            beside = graph.indices[graph.indptr[at] : graph.indptr[at + 1]]
            last = int(beside[distance[a, beside] < distance[a, at]].min())
            times[edge[np.searchsorted(key, min(at, last) * cells.n + max(at, last))]] += 1
            at = last
    broken: Ints = tie[times % 2 == 1]
    return broken


@dataclass(frozen=True, eq=False)
class _Cells:
    """_Cells of a lattice and its borders, joined where no tie runs between them.

    Parameters
    ----------
    left, right : (E,) int64
        The cells beside each edge.
    n : int
    """

    left: Ints
    right: Ints
    n: int


def _cells_of(lattice: Lattice, tie: Ints) -> _Cells:
    left, right, n = _sides_of_edges(lattice)
    free = tie == UNTIED
    n, number = connected(left[free], right[free], n)
    return _Cells(number[left], number[right], n)


def _sides_of_edges(lattice: Lattice) -> tuple[Ints, Ints, int]:
    """_Cells (E,) on both sides of every edge; each border is a cell too."""
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


def _paths_between(cells: _Cells, tied: Ints) -> tuple[csr_matrix, Ints, Ints]:
    """The graph of neighbouring cells, and for each key of two cells, rising, an edge of the lattice between them."""
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


def solve_signs(a: Ints, b: Ints, product: Ints, start: Ints) -> Ints:
    """Find signs x with ``x[a] * x[b] == product`` for as many ties as turning single signs can reach.

    Parameters
    ----------
    a, b : (k,) int64
        Joints at the ends of each tie.
    product : (k,) int64
        1 or -1.
    start : (n,) int64
        Signs to start from.

    Returns
    -------
    (n,) int64
    """
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


def fill_heights(side: Floats, strands: Strands) -> Floats:
    """Complete heights: a visit without one gets minus the sum of those before and after it along the rod.

    Parameters
    ----------
    side : (M,) float64
        Height of each visit, 0 where it has none.
    strands : Strands

    Returns
    -------
    (M,) float64
    """
    before, after = steps_along(strands)
    height = np.zeros(len(side))
    np.subtract.at(height, before, side[after])
    np.subtract.at(height, after, side[before])
    return np.where(side != 0, side, height)
