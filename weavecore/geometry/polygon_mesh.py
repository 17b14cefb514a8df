r"""Polygon meshes as ragged arrays, and the order of edges and faces about their nodes.

Face ``f`` has the corners ``corners[offsets[f]:offsets[f + 1]]``, counter-clockwise seen from outside.  A *corner* is
an entry of that array, one face at one node; its *side* is the edge to the next corner of the face.  About a node,
the corner after this one begins with the side that arrives here::

            \  face 2 /          fan of a node: corner 0, 1, 2, counter-clockwise
       side 1 \      / side 2    side of corner 1 = side 1; side that arrives at corner 0 = side 1
               \    /
         face 1  node            on a border the first corner's side lies on it

Work: linear in the corners, and one sort.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, inverted, next_in_loop, offsets_of, ranks_in_rows, rows_of


def fan_triangles(offsets: Ints, corners: Ints) -> tuple[Ints, Ints]:
    """Divide each face into a fan of triangles about its first corner.

    Parameters
    ----------
    offsets, corners : ragged int64
        Faces.

    Returns
    -------
    triangles : (T, 3) int64
    face : (T,) int64
        Face of each triangle.
    """
    parts, face = _fans(offsets, corners, np.diff(offsets) - 2)
    return parts[:, :3], face


def fan_quads(offsets: Ints, corners: Ints) -> tuple[Ints, Ints]:
    """Divide faces into quads and triangles: quads stay, larger faces become fans.

    Parameters
    ----------
    offsets, corners : ragged int64
        Faces.

    Returns
    -------
    quads : (Q, 4) int64
        Triangles with their last corner twice.
    face : (Q,) int64
        Face of each row.
    """
    sides = np.diff(offsets)
    return _fans(offsets, corners, np.where(sides == 4, 1, sides - 2))


def nodes_on_border(offsets: Ints, corners: Ints, n_nodes: int) -> Bools:
    """Whether each node is the end of an edge with a single face.

    Parameters
    ----------
    offsets, corners : ragged int64
        Faces.
    n_nodes : int

    Returns
    -------
    (N,) bool
    """
    a, b = corners, corners[next_in_loop(offsets)]
    key, count = np.unique(np.minimum(a, b) * n_nodes + np.maximum(a, b), return_counts=True)
    naked = key[count == 1]
    on_border = np.zeros(n_nodes, bool)
    on_border[np.concatenate([naked // n_nodes, naked % n_nodes])] = True
    return on_border


def _fans(offsets: Ints, corners: Ints, n_parts: Ints) -> tuple[Ints, Ints]:
    """Cut each face into that many triangles about its first corner; where that falls one short, into a quad."""
    n_parts = np.maximum(n_parts, 0)
    face, step = np.repeat(np.arange(len(n_parts)), n_parts), ranks_in_rows(n_parts)
    start, end = offsets[:-1][face], offsets[1:][face]
    is_quad = end - start - n_parts[face] == 3
    second = start + step + 1
    return corners[np.stack([start, second, second + 1, second + 1 + is_quad], axis=1)], face


NONE = -1


@dataclass(frozen=True, eq=False)
class Fans:
    """Corners about each node in order, counter-clockwise seen from outside.

    Parameters
    ----------
    side : (C,) int64
        Edge that leaves each corner.
    previous_side : (C,) int64
        Edge that arrives there.
    offsets : (N+1,) int64
    corner : (C,) int64
        Corners about node ``n``: ``corner[offsets[n]:offsets[n + 1]]``.  On a border the first one's side
        lies on it.
    on_border : (N,) bool
    n_faces : (E,) int64
        Faces on each edge, 1 or 2.
    """

    side: Ints
    previous_side: Ints
    offsets: Ints
    corner: Ints
    on_border: Bools
    n_faces: Ints

    @property
    def first_side(self) -> Ints:
        """(N,) the edge that the fan of a border node begins with."""
        return self.side[self.corner[self.offsets[:-1]]]

    @property
    def last_side(self) -> Ints:
        """(N,) the edge that the fan of a border node ends with."""
        return self.previous_side[self.corner[self.offsets[1:] - 1]]


def find_fans(face_offsets: Ints, face_nodes: Ints, edges: Ints, n_nodes: int) -> Fans:
    """Order the corners about all nodes of a manifold.

    Parameters
    ----------
    face_offsets, face_nodes : ragged int64
        Faces; every node lies in one.
    edges : (E, 2) int64
        The lesser node first.
    n_nodes : int

    Returns
    -------
    Fans
    """
    tail = face_nodes
    after = next_in_loop(face_offsets)
    before = inverted(after)
    head = tail[after]
    n = np.int64(n_nodes)
    side = edges_between(edges, tail, head)
    # The corner after this one about its node begins with the side that arrives here.
    twin = _twins(tail, head, n)
    following = twin[before]
    has_before = np.zeros(len(tail), bool)
    has_before[following[following != NONE]] = True
    offsets = offsets_of(np.bincount(tail, minlength=n_nodes))
    on_border = np.zeros(n_nodes, bool)
    on_border[tail[~has_before]] = True
    start = np.full(n_nodes, len(tail))
    np.minimum.at(start, tail, np.where(has_before & on_border[tail], len(tail), np.arange(len(tail))))
    corner = np.empty(len(tail), np.int64)
    at, node = start, np.arange(n_nodes)
    for place in range(int(np.diff(offsets).max(initial=0))):
        goes_on = place < np.diff(offsets)[node]
        node, at = node[goes_on], at[goes_on]
        corner[offsets[node] + place] = at
        at = following[at]
    return Fans(side, side[before], offsets, corner, on_border, np.bincount(side, minlength=len(edges)))


def _twins(tail: Ints, head: Ints, n: np.int64) -> Ints:
    """The corner whose side runs the other way, or -1."""
    forth, back = tail * n + head, head * n + tail
    order = np.argsort(forth)
    at = np.minimum(np.searchsorted(forth, back, sorter=order), len(forth) - 1)
    twins: Ints = np.where(forth[order[at]] == back, order[at], NONE)
    return twins


def darts_across(fans: Fans, edges: Ints) -> Ints:
    """For each dart the one that leaves the same node straight across, at inner nodes of four edges.

    Dart ``2 * e`` leaves the first node of edge ``e``, dart ``2 * e + 1`` its second.

    Parameters
    ----------
    fans : Fans
    edges : (E, 2) int64

    Returns
    -------
    (2E,) int64
        -1 at other nodes.
    """
    n_edges = np.diff(fans.offsets)
    first = fans.offsets[:-1][(n_edges == 4) & ~fans.on_border]
    node = np.flatnonzero((n_edges == 4) & ~fans.on_border)
    across = np.full(2 * len(edges), NONE, np.int64)
    darts = [2 * side + (edges[side, 1] == node) for side in (fans.side[fans.corner[first + k]] for k in range(4))]
    for k in range(4):
        across[darts[k]] = darts[k - 2]
    return across


def faces_about_nodes(fans: Fans, of_corner: Ints, first: Ints, last: Ints, of_node: Ints) -> tuple[Ints, Ints]:
    """Dual faces: one about each node, counter-clockwise, of what stands for its corners.

    Parameters
    ----------
    fans : Fans
    of_corner : (C,) int64
        What stands for each corner.
    first, last, of_node : (N,) int64
        On a border the face begins with ``of_node`` and ``first`` and ends with ``last``; -1 is left out.

    Returns
    -------
    offsets, corners : ragged int64
    """
    count = np.diff(fans.offsets)
    offsets = offsets_of(count + np.where(fans.on_border, 3, 0))
    corners = np.full(offsets[-1], NONE, np.int64)
    lead = np.where(fans.on_border, 2, 0)
    node = rows_of(fans.offsets)
    corners[offsets[node] + lead[node] + np.arange(len(node)) - fans.offsets[node]] = of_corner[fans.corner]
    border = np.flatnonzero(fans.on_border)
    corners[offsets[border]] = of_node[border]
    corners[offsets[border] + 1] = first[border]
    corners[offsets[border + 1] - 1] = last[border]
    kept = corners != NONE
    return offsets_of(np.bincount(rows_of(offsets)[kept], minlength=len(count))), corners[kept]


def edges_between(edges: Ints, one: Ints, other: Ints) -> Ints:
    """Number of the edge between each two nodes, in either order.

    Parameters
    ----------
    edges : (E, 2) int64
        Each once, the lesser node first.
    one, other : int64, any shape
        Nodes that are joined by one of them.

    Returns
    -------
    int64, same shape
    """
    n = np.int64(edges.max(initial=0) + 1)
    keys = edges[:, 0] * n + edges[:, 1]
    order = np.argsort(keys)
    wanted = np.minimum(one, other) * n + np.maximum(one, other)
    found: Ints = order[np.searchsorted(keys, wanted, sorter=order)]
    return found
