"""The faces of the bands: from strips, paired to quads, and spliced with the fillings of pockets.

*Faces of a strip.*  The apexes of the parent's edges determine all links (`strip_triangulation`).  With diagonals
each edge of either ring gets a triangle; without, a quad lies wherever both rings advance by one edge:

      child   k ──────── k+1        child   k ─── k+1 ── k+2      edges that only one ring has are taken
              │           │                  ╲     │     ╱        two at a time, so that cells have an even
      parent  i ──────── i+1        parent       ─ i ─            number of sides; a last single one gives
                                                                  a triangle

*Pairing.*  Triangles of a filling are paired to quads by a matching of most pairs and least sum of the worst corners.

*Splicing.*  A strip and a filling of the same band are two triangulations of one surface with the same boundary.
Along the links that both have, the band falls into stretches; on the boundary of a stretch both have the same
nodes, so any stretch may be taken from either.  Those with an overlong link are taken from the filling.

All are linear in the number of faces, but for sorting and the matching.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, sorted_unique
from weavecore.geometry.elementary import arctangents
from weavecore.geometry.matching import ALONE, match_best
from weavecore.linking.ring_to_parent import Strip
from weavecore.polling import poll

NO_CORNER = -1
"""The fourth corner of a triangle."""
_WORST_CORNER = np.radians(50.0)
"""The corners of a paired quad differ from a right angle by no more than this, so they are 40° to 140°."""
_NOT_REENTRANT = np.radians(85.0)
"""The same where an even number of sides matters more than shape: any quad with corners below 175°."""


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
    def concatenate(parts: list[BandFaces]) -> BandFaces:
        """The faces of all parts, one after the other."""
        corners = np.concatenate([np.zeros((0, 4), np.int64), *(part.corners for part in parts)])
        return BandFaces(corners, np.concatenate([np.zeros(0, np.int64), *(part.band for part in parts)]))

    def where(self, flag: Bools) -> BandFaces:
        """The flagged faces."""
        return BandFaces(self.corners[flag], self.band[flag])

    def sides(self) -> tuple[Ints, Ints, Ints]:
        """Tail and head node of every side of every face, and its face."""
        poll()
        after = np.roll(self.corners, -1, axis=1)
        is_triangle = self.corners[:, 3] == NO_CORNER
        after[is_triangle, 2] = self.corners[is_triangle, 0]
        face, corner = np.nonzero(self.corners != NO_CORNER)
        return self.corners[face, corner], after[face, corner], face

    def edges(self) -> Ints:
        """(E, 2) the edges, each once, the lesser node first, sorted."""
        tail, head, _ = self.sides()
        n = np.int64(max(tail.max(initial=0), head.max(initial=0)) + 1)
        keys = sorted_unique(np.minimum(tail, head) * n + np.maximum(tail, head))
        return np.stack([keys // n, keys % n], axis=1)


def faces_of_strip(strip: Strip, parent_nodes: Ints, child_nodes: Ints, *, has_diagonals: bool) -> Ints:
    """The faces between a parent and its child.

    Parameters
    ----------
    strip : Strip
    parent_nodes, child_nodes : (n,), (m,) int64
        Numbers of the nodes of the two polylines, in their order.
    has_diagonals : bool
        Triangles only; the apex of an edge is the node over it.  Otherwise the apex is the node in line with
        the first node of the edge, and quads lie between.

    Returns
    -------
    (k, 4) int64
        Corners, counter-clockwise seen from outside; the fourth corner of a triangle is -1.
    """
    parent = parent_nodes if strip.is_left else np.roll(parent_nodes[::-1], 1 if strip.closed else 0)
    faces = (_strip_triangles if has_diagonals else _strip_quads)(parent, child_nodes, strip.apexes)
    if strip.closed:
        return faces
    tail, head, face = BandFaces(faces, np.zeros(len(faces), np.int64)).sides()
    closing = (tail == parent[-1]) & (head == parent[0]) | (tail == child_nodes[0]) & (head == child_nodes[-1])
    return np.delete(faces, face[closing], axis=0)


def _strip_triangles(parent: Ints, child: Ints, apexes: Ints) -> Ints:
    """A triangle on each edge of the parent, then one on each edge of the child."""
    n, m = len(parent), len(child)
    edge = np.arange(n)
    over = np.c_[parent[edge], parent[(edge + 1) % n], child[apexes % m], np.full(n, NO_CORNER)]
    i, k = _child_edges(np.append(apexes[-1] - m, apexes[:-1]), apexes)
    under = np.c_[child[(k + 1) % m], child[k % m], parent[i], np.full(len(i), NO_CORNER)]
    return np.concatenate([over, under])


def _strip_quads(parent: Ints, child: Ints, apexes: Ints) -> Ints:
    """Quads where both rings advance; what is left of either is taken two edges at a time, a last one by itself."""
    after = np.append(apexes[1:], apexes[0] + len(child))
    rises = after > apexes
    a, b = parent, np.roll(parent, -1)
    # Of the child's edges over one edge of the parent one closes a quad, with an even number before it.
    closing = apexes + (after - apexes - 1) // 4 * 2
    m = len(child)
    quads = np.c_[a, b, child[(closing + 1) % m], child[closing % m]][rises]
    return np.concatenate(
        [quads, _child_fans(a, b, child, apexes, after, closing), _parent_fans(parent, child, apexes, rises)]
    )


def _child_fans(a: Ints, b: Ints, child: Ints, apexes: Ints, after: Ints, closing: Ints) -> Ints:
    """Cells on the edges of the child that close no quad, about the node of the parent before or after them."""
    m = len(child)
    i, k = _child_edges(apexes, after)
    before = k < closing[i]
    place = np.where(before, k - apexes[i], k - closing[i] - 1)
    left = np.where(before, closing[i] - k, after[i] - k)
    begins = (k != closing[i]) & (place % 2 == 0)
    i, k, is_last = i[begins], k[begins], left[begins] == 1
    centre = np.where(before[begins], a[i], b[i])
    fans = np.c_[child[(k + 2 - is_last) % m], child[(k + 1 - is_last) % m], child[k % m], centre]
    fans[is_last] = np.c_[fans[is_last, 0], fans[is_last, 2:], np.full(is_last.sum(), NO_CORNER)]
    cells: Ints = fans
    return cells


def _parent_fans(parent: Ints, child: Ints, apexes: Ints, rises: Bools) -> Ints:
    """Cells on the edges of the parent that share one node of the child, counted from the last advance before them."""
    n = len(parent)
    edge = np.arange(n)
    since = edge - np.maximum.accumulate(np.where(np.tile(rises, 2), np.arange(2 * n), -1))[n:] % n
    begins = ~rises & (since % n % 2 == 1)
    is_last = np.roll(rises, -1)[begins]
    i = edge[begins]
    fans = np.c_[parent[i], parent[(i + 1) % n], parent[(i + 2) % n], child[apexes[i] % len(child)]]
    fans[is_last] = np.c_[fans[is_last, :2], fans[is_last, 3], np.full(is_last.sum(), NO_CORNER)]
    cells: Ints = fans
    return cells


def _child_edges(first: Ints, last: Ints) -> tuple[Ints, Ints]:
    """All edges of the child from ``first`` to ``last`` of each row: the row, and the edge's first node."""
    count = last - first
    row = np.repeat(np.arange(len(first)), count)
    within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return row, first[row] + within


def triangles_as_faces(triangles: Ints) -> Ints:
    """Triangles with a missing fourth corner.

    Parameters
    ----------
    triangles : (k, 3) int64

    Returns
    -------
    (k, 4) int64
    """
    faces: Ints = np.c_[triangles, np.full(len(triangles), NO_CORNER)]
    return faces


def pair_triangles(faces: BandFaces, nodes: Floats, fixed_edges: Ints, *, leave_few: bool) -> BandFaces:
    """Join pairs of triangles where that makes a good quad.

    Parameters
    ----------
    faces : BandFaces
    nodes : (N, 3) float64
    fixed_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    leave_few : bool
        Whether remaining triangles are joined even to poor quads, as long as these are convex.
    """
    faces = _paired(faces, nodes, fixed_edges, _WORST_CORNER)
    return _paired(faces, nodes, fixed_edges, _NOT_REENTRANT) if leave_few else faces


def _paired(faces: BandFaces, nodes: Floats, fixed_edges: Ints, worst: float) -> BandFaces:
    tail, head, face = faces.sides()
    is_free = (faces.corners[face, 3] == NO_CORNER) & ~are_among(tail, head, fixed_edges)
    tail, head, face = tail[is_free], head[is_free], face[is_free]
    n = np.int64(len(nodes))
    order = np.argsort(tail * n + head)
    key = (tail * n + head)[order]
    at = np.minimum(np.searchsorted(key, head * n + tail), len(key) - 1) if len(key) else np.zeros(0, np.int64)
    h = np.flatnonzero((key[at] == head * n + tail) & (tail < head))
    t = order[at[h]]
    one, other = face[h], face[t]
    opposite = faces.corners[:, :3].sum(1)[np.c_[one, other]] - (tail[h] + head[h])[:, None]
    quads = np.c_[tail[h], opposite[:, 1], head[h], opposite[:, 0]]
    cost = _worst_corner(nodes, quads)
    good = cost <= worst
    partner = match_best(one[good], other[good], cost[good], len(faces.corners))
    joined = good & (partner[one] == other)
    kept = partner == ALONE
    corners = np.concatenate([faces.corners[kept], quads[joined]])
    return BandFaces(corners, np.concatenate([faces.band[kept], faces.band[one[joined]]]))


def _worst_corner(nodes: Floats, quads: Ints) -> Floats:
    """How far (k,) the worst corner of each quad is from a right angle, in radians."""
    worst = np.zeros(len(quads))
    for k in range(4):
        corner = nodes[quads[:, k]]
        u, v = nodes[quads[:, (k + 1) % 4]] - corner, nodes[quads[:, (k + 3) % 4]] - corner
        angle = arctangents(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1))
        worst = np.maximum(worst, np.abs(angle - np.pi / 2))
    return worst


def faces_with_long_links(faces: BandFaces, nodes: Floats, ring_edges: Ints, longest: float) -> Bools:
    """Which faces have a side across the band that is longer than ``longest``.

    Parameters
    ----------
    faces : BandFaces
    nodes : (N, 3) float64
    ring_edges : (E, 2) int64
        Edges along polylines and borders, the lesser node first; their length does not matter.
    longest : float

    Returns
    -------
    (k,) bool
    """
    tail, head, face = faces.sides()
    is_long = np.linalg.norm(nodes[head] - nodes[tail], axis=1) > longest
    is_long &= ~are_among(tail, head, ring_edges)
    flag = np.zeros(len(faces.corners), bool)
    flag[face[is_long]] = True
    return flag


def splice(strips: BandFaces, bad: Bools, filled: BandFaces, ring_edges: Ints, partial: Ints) -> tuple[BandFaces, Ints]:
    """The faces of strips, with every stretch that has a bad face replaced by that of the filling.

    Parameters
    ----------
    strips : BandFaces
        Of some bands.
    bad : (k,) bool
        Which of its faces are to be replaced.
    filled : BandFaces
        Of bands without a strip, and of all those that have a bad face.
    ring_edges : (N, 2) int64
        The edges along the rings, the lesser node first.
    partial : (b,) int64
        Bands that are filled in part.

    Returns
    -------
    faces : BandFaces
    lacking : (l,) int64
        Of the partial bands those whose filling is too small for their strips: the faces are wrong there.
    """
    both = BandFaces.concatenate([strips, filled])
    n_strips, n = len(strips.corners), len(both.corners)
    tail, head, face = both.sides()
    of_strip = face < n_strips
    # Two bands share each ring, so sides of two bands are different even where their nodes are the same.
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    n_nodes = np.int64(high.max(initial=0) + 1)
    side = np.unique((both.band[face] * n_nodes + low) * n_nodes + high, return_inverse=True)[1].ravel()
    has = [np.zeros(side.max(initial=-1) + 1, bool) for _ in range(2)]
    has[0][side[of_strip]] = has[1][side[~of_strip]] = True
    is_shared = (has[0] & has[1])[side]
    on_ring = are_among(tail, head, ring_edges)
    # Faces of one kind are connected across sides that only they have; the two kinds are connected along the rings.
    connects = on_ring == is_shared
    group = 3 * side + np.where(on_ring, 2, of_strip)
    stretch = _components(face[connects], group[connects], n)
    n_stretches = int(stretch.max(initial=-1)) + 1
    is_bad = np.zeros(n_stretches, bool)
    is_bad[stretch[:n_strips][bad]] = True
    has_strip = np.zeros(n_stretches, bool)
    has_strip[stretch[:n_strips]] = True
    from_strip = np.arange(n) < n_strips
    kept = np.where(from_strip, ~is_bad[stretch], is_bad[stretch] | ~has_strip[stretch])
    # Around small rings two nodes may be joined on either side; then the two kinds cannot be mixed.
    clashing = _bands_with_double_sides(both.where(kept))
    kept = np.where(np.isin(both.band, clashing) & np.isin(both.band, filled.band), ~from_strip, kept)
    # The two kinds of a stretch have the same border where the filling goes on to its ends.
    place = np.unique(stretch[face] * np.int64(len(has[0])) + side, return_inverse=True)[1].ravel()
    excess = np.bincount(place, np.where((tail < head) == of_strip, 1.0, -1.0))
    differs = is_bad[stretch[face]] & (excess[place] != 0)
    return both.where(kept), np.intersect1d(partial, np.concatenate([both.band[face[differs]], clashing]))


def _bands_with_double_sides(faces: BandFaces) -> Ints:
    """Bands in which two faces run the same way along one side."""
    tail, head, face = faces.sides()
    keys = tail * np.int64(head.max(initial=0) + 1) + head
    _, side, times = np.unique(keys, return_inverse=True, return_counts=True)
    bands: Ints = np.unique(faces.band[face[times[side.ravel()] > 1]])
    return bands


def are_among(tail: Ints, head: Ints, edges: Ints) -> Bools:
    """Whether each side is one of the edges, in either direction.

    Parameters
    ----------
    tail, head : (k,) int64
    edges : (E, 2) int64
        The lesser node first.

    Returns
    -------
    (k,) bool
    """
    n = np.int64(max(tail.max(initial=0), head.max(initial=0), edges.max(initial=0)) + 1)
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    return np.isin(key, edges[:, 0] * n + edges[:, 1])


def _components(face: Ints, group: Ints, n: int) -> Ints:
    """Component (n,) of each face, where faces that have a group in common belong together."""
    names, place = np.unique(group, return_inverse=True)
    size = n + len(names)
    links = coo_matrix((np.ones(len(face), np.int8), (face, n + place)), shape=(size, size))
    return connected_components(links, directed=False)[1][:n].astype(np.int64)
