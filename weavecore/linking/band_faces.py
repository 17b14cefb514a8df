"""The faces of a zip: triangles, or quads wherever the counts of the rings agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.matching import ALONE, match_best
from weavecore.linking.strips import Zip

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


# ----------------------------------------------------------------------
# Joining triangles in pairs to quads, where the pattern wants quads and a band had to be filled with triangles.

WORST_CORNER = np.radians(50.0)
"""The corners of a quad differ from a right angle by no more than this."""
_NOT_REENTRANT = np.radians(85.0)
"""The same of a cell that is a quad for the sake of an even number of sides."""


def pair_triangles(faces: BandFaces, nodes: Floats, ring_edges: Ints, *, leave_few: bool) -> BandFaces:
    """The same faces with pairs of triangles joined where that makes a good quad.

    Parameters
    ----------
    faces : BandFaces
    nodes : (N, 3) float64
    ring_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    leave_few : bool
        Whether triangles that are left are joined even where the quad is not a good one.
    """
    faces = _paired(faces, nodes, ring_edges, WORST_CORNER)
    return _paired(faces, nodes, ring_edges, _NOT_REENTRANT) if leave_few else faces


def _paired(faces: BandFaces, nodes: Floats, ring_edges: Ints, worst: float) -> BandFaces:
    tail, head, face = faces.sides()
    is_open = (faces.corners[face, 3] == NO_CORNER) & ~are_among(tail, head, ring_edges)
    tail, head, face = tail[is_open], head[is_open], face[is_open]
    n = np.int64(len(nodes))
    order = np.argsort(tail * n + head)
    key = (tail * n + head)[order]
    at = np.minimum(np.searchsorted(key, head * n + tail), len(key) - 1) if len(key) else np.zeros(0, np.int64)
    h = np.flatnonzero((key[at] == head * n + tail) & (tail < head))
    t = order[at[h]]
    one, other = face[h], face[t]
    tips = faces.corners[:, :3].sum(1)
    quads = np.c_[tail[h], tips[other] - tail[h] - head[h], head[h], tips[one] - tail[h] - head[h]]
    cost = _worst_corner(nodes, quads)
    good = cost <= worst
    partner = match_best(one[good], other[good], cost[good], len(faces.corners))
    joined = good & (partner[one] == other)
    kept = partner == ALONE
    corners = np.concatenate([faces.corners[kept], quads[joined]])
    return BandFaces(corners, np.concatenate([faces.band[kept], faces.band[one[joined]]]))


def _worst_corner(nodes: Floats, quads: Ints) -> Floats:
    """How far (k,) the worst corner of each quad is from a right angle."""
    worst = np.zeros(len(quads))
    for k in range(4):
        corner = nodes[quads[:, k]]
        u, v = nodes[quads[:, (k + 1) % 4]] - corner, nodes[quads[:, (k + 3) % 4]] - corner
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1))
        worst = np.maximum(worst, np.abs(angle - np.pi / 2))
    return worst


# ----------------------------------------------------------------------
# Putting a filling in the place of the parts of a zip that are no good.
#
# A zip and a filling of the same band both cut it along links.  Along the links that they share the band
# falls into *stretches*, each with the same pieces of the two rings on its border in either; so any stretch may
# be taken from the one or from the other.


def faces_with_long_links(faces: BandFaces, places: Floats, ring_edges: Ints, longest: float) -> Bools:
    """(k,) whether a face has a side, other than along its rings, that is longer than ``longest``."""
    tail, head, face = faces.sides()
    is_long = np.linalg.norm(places[head] - places[tail], axis=1) > longest
    is_long &= ~are_among(tail, head, ring_edges)
    flag = np.zeros(len(faces.corners), bool)
    flag[face[is_long]] = True
    return flag


def splice(zipped: BandFaces, bad: Bools, filled: BandFaces, ring_edges: Ints) -> BandFaces:
    """The faces of both, where each stretch is taken from the zip unless a face of it is bad.

    Parameters
    ----------
    zipped : BandFaces
        Of some bands.
    bad : (k,) bool
        Which of its faces are no good.
    filled : BandFaces
        Of bands that are not zipped, and of all those that have a bad face.
    ring_edges : (N, 2) int64
        The edges along the rings, the lesser node first.
    """
    both = BandFaces.of([zipped, filled])
    n_zipped, n = len(zipped.corners), len(both.corners)
    tail, head, face = both.sides()
    from_zip = face < n_zipped
    # Two bands share each ring, so sides are told apart by the band as well.
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    side = np.unique(np.c_[both.band[face], low, high], axis=0, return_inverse=True)[1].ravel()
    is_shared = np.isin(side, np.intersect1d(side[from_zip], side[~from_zip]))
    on_ring = are_among(tail, head, ring_edges)
    # Faces of one kind hang together across sides that only they have; the two kinds hang together along the rings.
    joins = on_ring == is_shared
    group = 3 * side + np.where(on_ring, 2, from_zip)
    stretch = _components(face[joins], group[joins], n)
    is_bad = np.zeros(stretch.max(initial=-1) + 1, bool)
    is_bad[stretch[:n_zipped][bad]] = True
    is_zipped = np.zeros(len(is_bad), bool)
    is_zipped[stretch[:n_zipped]] = True
    in_zip = np.arange(n) < n_zipped
    kept = np.where(in_zip, ~is_bad[stretch], is_bad[stretch] | ~is_zipped[stretch])
    # Around small rings two nodes may be joined on either side; then the two kinds do not go together.
    clashing = np.isin(both.band, _bands_with_double_sides(both.where(kept))) & np.isin(both.band, filled.band)
    return both.where(np.where(clashing, ~in_zip, kept))


def _bands_with_double_sides(faces: BandFaces) -> Ints:
    """Bands of the faces that have a side in common with another one, run the same way."""
    tail, head, face = faces.sides()
    _, side, times = np.unique(np.c_[tail, head], axis=0, return_inverse=True, return_counts=True)
    bands: Ints = np.unique(faces.band[face[times[side.ravel()] > 1]])
    return bands


def are_among(tail: Ints, head: Ints, edges: Ints) -> Bools:
    """Whether each side is one of the edges."""
    n = np.int64(max(tail.max(initial=0), head.max(initial=0), edges.max(initial=0)) + 1)
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    return np.isin(key, edges[:, 0] * n + edges[:, 1])


def _components(face: Ints, group: Ints, n: int) -> Ints:
    """Component (n,) of each face, where faces that have a group in common belong together."""
    names, place = np.unique(group, return_inverse=True)
    size = n + len(names)
    links = coo_matrix((np.ones(len(face), np.int8), (face, n + place)), shape=(size, size))
    return connected_components(links, directed=False)[1][:n].astype(np.int64)
