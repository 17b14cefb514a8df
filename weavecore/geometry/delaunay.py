"""Turning the inner edges of a triangulated surface until the angles are good (Lawson's flips)."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import find_twins, halfedge_ends, next_halfedge, previous_halfedge

_MOST_ROUNDS = 100


def improve_triangles(points: Floats, triangles: Ints, taken: Ints, *, least_gain: float = 1e-6) -> Ints:
    """Flip each inner edge whose two facing angles are together more than a half turn.

    The surface that the triangles make stays the same, and no two triangles get the same edge twice.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
        Oriented and manifold.
    taken : (K,) int64
        Sorted keys ``low * N + high`` of pairs of points that are joined already: such an
        edge is neither flipped away nor made.
    least_gain : float
        An edge is left alone while its angles exceed the half turn by no more than this.

    Returns
    -------
    (T, 3) int64
    """
    triangles = triangles.copy()
    for _ in range(_MOST_ROUNDS):
        h = _edges_to_flip(points, triangles, taken, least_gain)
        if len(h) == 0:
            break
        flat = triangles.ravel()
        t = find_twins(triangles, len(points))[h]
        a, b = flat[h], flat[next_halfedge(h)]
        c, d = flat[previous_halfedge(h)], flat[previous_halfedge(t)]
        triangles[h // 3] = np.c_[c, a, d]
        triangles[t // 3] = np.c_[d, b, c]
    return triangles


def _edges_to_flip(points: Floats, triangles: Ints, taken: Ints, least_gain: float) -> Ints:
    """Halfedges of edges to flip at once: no two of them in one triangle."""
    n = np.int64(len(points))
    twins = find_twins(triangles, len(points))
    tail, head = halfedge_ends(triangles)
    h = np.flatnonzero(np.arange(len(twins)) < twins)
    t = twins[h]
    facing = _facing_angles(points, triangles)
    excess = facing[h] + facing[t] - np.pi
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    wanted = (excess > least_gain) & ~_is_in(key[h], taken)
    h, t, excess = h[wanted], t[wanted], excess[wanted]
    a, b = tail[h], head[h]
    c, d = tail[previous_halfedge(h)], tail[previous_halfedge(t)]
    new = np.minimum(c, d) * n + np.maximum(c, d)
    able = (c != d) & ~_is_in(new, np.unique(key)) & ~_is_in(new, taken) & _stays_upright(points, a, b, c, d)
    h, t, excess, new = h[able], t[able], excess[able], new[able]
    # Worst edges first; each new edge once; then those that are first in both their triangles.
    order = np.lexsort((h, -excess))
    h, t, new = h[order], t[order], new[order]
    once = np.sort(np.unique(new, return_index=True)[1])
    h, t = h[once], t[once]
    first = np.full(len(triangles), len(h))
    rank = np.arange(len(h))
    np.minimum.at(first, h // 3, rank)
    np.minimum.at(first, t // 3, rank)
    chosen: Ints = h[(first[h // 3] == rank) & (first[t // 3] == rank)]
    return chosen


def _is_in(keys: Ints, ordered: Ints) -> Bools:
    if len(ordered) == 0:
        return np.zeros(len(keys), bool)
    at = np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)
    found: Bools = ordered[at] == keys
    return found


def _facing_angles(points: Floats, triangles: Ints) -> Floats:
    """(3T,) angle at the corner that faces each halfedge."""
    p = points[triangles]
    angles = np.empty((len(triangles), 3))
    for k in range(3):
        u, v = p[:, k] - p[:, (k + 2) % 3], p[:, (k + 1) % 3] - p[:, (k + 2) % 3]
        angles[:, k] = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1))
    return angles.ravel()


def _stays_upright(points: Floats, a: Ints, b: Ints, c: Ints, d: Ints) -> Bools:
    """Whether both new triangles look the way the two old ones look together."""
    pa, pb, pc, pd = points[a], points[b], points[c], points[d]
    old = np.cross(pb - pa, pc - pa) + np.cross(pa - pb, pd - pb)
    one, other = np.cross(pa - pc, pd - pc), np.cross(pb - pd, pc - pd)
    upright: Bools = ((one * old).sum(1) > 0) & ((other * old).sum(1) > 0)
    return upright
