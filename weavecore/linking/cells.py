"""The faces of a zip: triangles, or quads wherever the counts of the rings agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints
from weavecore.linking.rings import Zip

NO_CORNER = -1


@dataclass(frozen=True, eq=False)
class BandFaces:
    """Faces, counter-clockwise seen from outside, and the band that each lies in.

    Parameters
    ----------
    corners : (k, 4) int64
        Nodes; the fourth corner of a triangle is -1.
    band : (k,) int64
    """

    corners: Ints
    band: Ints

    @staticmethod
    def of(parts: list[BandFaces]) -> BandFaces:
        """The faces of all parts, one after the other."""
        corners = np.concatenate([np.zeros((0, 4), np.int64), *(part.corners for part in parts)])
        return BandFaces(corners, np.concatenate([np.zeros(0, np.int64), *(part.band for part in parts)]))

    def where(self, flag: Bools) -> BandFaces:
        """Some of the faces."""
        return BandFaces(self.corners[flag], self.band[flag])

    def sides(self) -> tuple[Ints, Ints, Ints]:
        """Tail and head node of every side of every face, and its face."""
        after = np.roll(self.corners, -1, axis=1)
        is_triangle = self.corners[:, 3] == NO_CORNER
        after[is_triangle, 2] = self.corners[is_triangle, 0]
        face, corner = np.nonzero(self.corners != NO_CORNER)
        return self.corners[face, corner], after[face, corner], face

    def edges(self) -> Ints:
        """(E, 2) the edges, each once, the lesser node first, sorted."""
        tail, head, _ = self.sides()
        edges: Ints = np.unique(np.sort(np.c_[tail, head], axis=1), axis=0)
        return edges


def faces_of_zip(zipped: Zip, parent_nodes: Ints, child_nodes: Ints, *, has_diagonals: bool) -> Ints:
    """Faces (k, 4), counter-clockwise seen from outside; the fourth corner of a triangle is -1.

    Parameters
    ----------
    zipped : Zip
    parent_nodes, child_nodes : (n,), (m,) int64
        Numbers of the nodes of the two rings.
    has_diagonals : bool
        Triangles only; a tip is the node over an edge.  Else a tip is the node in line with
        the first node of an edge, and quads lie between.
    """
    parent = parent_nodes if zipped.is_left else np.roll(parent_nodes[::-1], 1 if zipped.closed else 0)
    faces = _faces_around(parent, child_nodes, zipped.tips, has_diagonals=has_diagonals)
    if zipped.closed:
        return faces
    tail, head, face = BandFaces(faces, np.zeros(len(faces), np.int64)).sides()
    closing = (tail == parent[-1]) & (head == parent[0]) | (tail == child_nodes[0]) & (head == child_nodes[-1])
    return np.delete(faces, face[closing], axis=0)


def _faces_around(parent: Ints, child_nodes: Ints, tips: Ints, *, has_diagonals: bool) -> Ints:
    n, m = len(parent), len(child_nodes)
    edge = np.arange(n)
    if has_diagonals:
        over = np.c_[parent[edge], parent[(edge + 1) % n], child_nodes[tips % m], np.full(n, NO_CORNER)]
        i, k = _child_edges(np.append(tips[-1] - m, tips[:-1]), tips)
        under = np.c_[child_nodes[(k + 1) % m], child_nodes[k % m], parent[i], np.full(len(i), NO_CORNER)]
        return np.concatenate([over, under])
    return _quads(parent, child_nodes, tips)


def _quads(parent: Ints, child: Ints, tips: Ints) -> Ints:
    """Quads where both rings advance; what is left of either is taken two edges at a time, and a last one by itself."""
    n, m = len(parent), len(child)
    after = np.append(tips[1:], tips[0] + m)
    edge, rises = np.arange(n), after > tips
    a, b = parent, np.roll(parent, -1)
    # Of the child's edges over one edge of the parent one closes a quad, with an even number before it.
    closing = tips + (after - tips - 1) // 4 * 2
    quads = np.c_[a, b, child[(closing + 1) % m], child[closing % m]][rises]
    i, k = _child_edges(tips, after)
    before = k < closing[i]
    place = np.where(before, k - tips[i], k - closing[i] - 1)
    left = np.where(before, closing[i] - k, after[i] - k)
    begins = (k != closing[i]) & (place % 2 == 0)
    i, k, is_last = i[begins], k[begins], left[begins] == 1
    tip = np.where(before[begins], a[i], b[i])
    fans = np.c_[child[(k + 2 - is_last) % m], child[(k + 1 - is_last) % m], child[k % m], tip]
    fans[is_last] = np.c_[fans[is_last, 0], fans[is_last, 2:], np.full(is_last.sum(), NO_CORNER)]
    # Edges of the parent under one node of the child: counted from the one after which it stays.
    since = edge - np.maximum.accumulate(np.where(np.tile(rises, 2), np.arange(2 * n), -1))[n:] % n
    begins = ~rises & (since % n % 2 == 1)
    is_last = np.roll(rises, -1)[begins]
    i = edge[begins]
    over = np.c_[a[i], b[i], parent[(i + 2) % n], child[tips[i] % m]]
    over[is_last] = np.c_[over[is_last, :2], over[is_last, 3], np.full(is_last.sum(), NO_CORNER)]
    return np.concatenate([quads, fans, over])


def _child_edges(first: Ints, last: Ints) -> tuple[Ints, Ints]:
    """All edges of the child from ``first`` to ``last``: the row that each belongs to, and its first node."""
    count = last - first
    row = np.repeat(np.arange(len(first)), count)
    within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return row, first[row] + within


def as_quads(triangles: Ints) -> Ints:
    """Triangles (k, 3) as faces (k, 4)."""
    faces: Ints = np.c_[triangles, np.full(len(triangles), NO_CORNER)]
    return faces
