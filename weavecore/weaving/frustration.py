"""Cells around which rods cannot alternate, and which ties to break so that they can everywhere else.

Going around a cell of the lattice, from joint to joint along its sides, the sides of the rods must come
back to what they were.  Where they do not, the cell is *frustrated*, as one with an odd number of
sides is in a plain weave, and one of its ties at least is broken.  A broken tie frees the cells on
both of its sides; so the fewest are broken along shortest ways that join the frustrated cells in pairs (the
T-joins of Edmonds and Johnson, "Matching, Euler tours and the Chinese postman", 1973).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from weavecore.geometry.arrays import Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.edges import edges_between
from weavecore.geometry.matching import match_best
from weavecore.model.lattice import Lattice

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
    links = coo_matrix((np.ones(int(free.sum()), np.int8), (left[free], right[free])), shape=(n, n))
    n, label = connected_components(links, directed=False)
    number = label.astype(np.int64)
    return Cells(number[left], number[right], int(n))


def _sides_of_edges(lattice: Lattice) -> tuple[Ints, Ints, int]:
    """Cells (E,) on both sides of every edge; each border is a cell too."""
    n_nodes, n_faces = lattice.n_nodes, lattice.n_faces
    tail, head = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    at = edges_between(lattice.edges, tail, head)
    cell = np.full((2, len(lattice.edges)), -1, np.int64)
    cell[np.where(tail < head, 0, 1), at] = rows_of(lattice.face_offsets)
    is_border = (cell < 0).any(axis=0)
    ends = lattice.edges[is_border]
    links = coo_matrix((np.ones(len(ends), np.int8), (ends[:, 0], ends[:, 1])), shape=(n_nodes, n_nodes))
    _, part = connected_components(links, directed=False)
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
