"""Evening out how many edges the nodes have, where that costs little: between two rings an inner node wants six."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.bisecting import unique_edges
from weavecore.geometry.delaunay import angle_at, stays_upright, turn_edges

_INSIDE, _ON_BORDER = 6, 4
_LEAST_ANGLE = np.radians(30.0)


def even_out(
    nodes: Floats, latitude: Ints, is_border: Bools, triangles: Ints, ring_edges: Ints, longest: float
) -> Ints:
    """Turn edges where the nodes then have more even numbers of edges, and the triangles are still good ones.

    Parameters
    ----------
    nodes : (N, 3) float64
    latitude : (N,) int64
        Polyline of each node, -1 of a hub.
    is_border : (N,) bool
    triangles : (T, 3) int64
    ring_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    longest : float
        No edge longer than this is made.

    Returns
    -------
    (T, 3) int64
    """
    wanted = np.where(is_border, _ON_BORDER, _INSIDE)

    def gain(triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        edges, _ = unique_edges(triangles)
        excess = np.bincount(edges.ravel(), minlength=len(nodes)) - wanted
        # A corner with k edges too many counts for k squared.
        gained = 2.0 * (excess[a] + excess[b] - excess[c] - excess[d]) - 4.0
        at = np.flatnonzero((gained > 0) & ((latitude[c] != latitude[d]) | (latitude[c] < 0)))
        a, b, c, d = a[at], b[at], c[at], d[at]
        good = np.linalg.norm(nodes[c] - nodes[d], axis=1) <= longest
        good &= stays_upright(nodes, a, b, c, d)
        for corner, one, other in ((a, c, d), (b, c, d), (c, a, d), (d, a, c), (c, d, b), (d, c, b)):
            good &= angle_at(nodes, corner, one, other) >= _LEAST_ANGLE
        worth = np.zeros(len(gained))
        worth[at[good]] = gained[at[good]]
        return worth

    n = np.int64(len(nodes))
    fixed = np.unique(ring_edges[:, 0] * n + ring_edges[:, 1])
    return turn_edges(triangles, len(nodes), fixed, gain, one_a_corner=True)
