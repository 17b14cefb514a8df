"""The faces of a zip: triangles, or quads wherever the counts of the rings agree."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Ints
from weavecore.linking.rings import Zip

NO_CORNER = -1


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


def edges_of(faces: Ints) -> Ints:
    """(E, 2) the edges of faces (k, 4), each once, the lesser node first, sorted."""
    after = np.roll(faces, -1, axis=1)
    is_triangle = faces[:, 3] == NO_CORNER
    after[is_triangle, 2] = faces[is_triangle, 0]
    sides = np.stack([faces, after], axis=2)[faces != NO_CORNER]
    edges: Ints = np.unique(np.sort(sides, axis=1), axis=0)
    return edges
