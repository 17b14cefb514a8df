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
    n, m = len(parent_nodes), len(child_nodes)
    parent = parent_nodes if zipped.is_left else np.roll(parent_nodes[::-1], 1)
    tips = zipped.tips
    edge = np.arange(n)
    if has_diagonals:
        over = np.c_[parent[edge], parent[(edge + 1) % n], child_nodes[tips % m], np.full(n, NO_CORNER)]
        i, k = _child_edges(np.append(tips[-1] - m, tips[:-1]), tips)
        under = np.c_[child_nodes[(k + 1) % m], child_nodes[k % m], parent[i], np.full(len(i), NO_CORNER)]
        return np.concatenate([over, under])
    after = np.append(tips[1:], tips[0] + m)
    # Of the child's edges over one edge of the parent the middle one closes a quad.
    rises = after > tips
    middle = tips + (after - tips - 1) // 2
    a, b = parent[edge], parent[(edge + 1) % n]
    fourth = np.where(rises, child_nodes[middle % m], NO_CORNER)
    third = child_nodes[np.where(rises, middle + 1, tips) % m]
    i, k = _child_edges(tips, after)
    aside = k != middle[i]
    i, k = i[aside], k[aside]
    nearest = np.where(k < middle[i], a[i], b[i])
    fans = np.c_[child_nodes[(k + 1) % m], child_nodes[k % m], nearest, np.full(len(i), NO_CORNER)]
    return np.concatenate([np.c_[a, b, third, fourth], fans])


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
