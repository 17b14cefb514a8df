"""Turning the inner edges of a triangulated surface while that pays, as until the angles are good (Lawson's flips).

Of the two triangles on an edge ``ab``, ``c`` is the third corner of the one on its left and ``d`` that of
the other; turning the edge puts ``cd`` in its place.
"""

from __future__ import annotations

from typing import Callable

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import find_twins, halfedge_ends, next_halfedge, previous_halfedge

_MOST_ROUNDS = 100
_LEAST_GAIN = 1e-6

Gain = Callable[[Ints, Ints, Ints, Ints, Ints], Floats]
"""What turning each edge gains, from all triangles and the corners a, b, c, d."""


def improve_triangles(points: Floats, triangles: Ints, taken: Ints) -> Ints:
    """Turn each inner edge whose two facing angles are together more than a half turn.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
        Oriented and manifold.
    taken : (K,) int64
        As of `turn_edges`.

    Returns
    -------
    (T, 3) int64
    """

    def excess(_triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        angles = angle_at(points, c, a, b) + angle_at(points, d, a, b)
        return np.where(stays_upright(points, a, b, c, d), angles - np.pi, 0.0)

    return turn_edges(triangles, len(points), taken, excess)


def turn_edges(triangles: Ints, n_points: int, taken: Ints, gain: Gain, *, one_a_corner: bool = False) -> Ints:
    """Turn inner edges while one has a gain, the greatest first; what surface the triangles make stays the same.

    Parameters
    ----------
    triangles : (T, 3) int64
        Oriented and manifold; no two of them get the same edge twice.
    n_points : int
    taken : (K,) int64
        Sorted keys ``low * n_points + high`` of pairs of points that are joined already: such an
        edge is neither turned nor made.
    gain : callable
    one_a_corner : bool
        Whether the gain of an edge also changes when another one at the same corners is turned.

    Returns
    -------
    (T, 3) int64
        Each in the place of one of the two that it was made of.
    """
    triangles = triangles.copy()
    for _ in range(_MOST_ROUNDS):
        h, t = _edges_to_turn(triangles, n_points, taken, gain, one_a_corner)
        if len(h) == 0:
            break
        flat = triangles.ravel()
        a, b = flat[h], flat[next_halfedge(h)]
        c, d = flat[previous_halfedge(h)], flat[previous_halfedge(t)]
        triangles[h // 3] = np.c_[c, a, d]
        triangles[t // 3] = np.c_[d, b, c]
    return triangles


def _edges_to_turn(triangles: Ints, n_points: int, taken: Ints, gain: Gain, one_a_corner: bool) -> tuple[Ints, Ints]:
    """Halfedges, with their twins, of edges to turn at once: no two of them in one triangle, or at one corner."""
    n = np.int64(n_points)
    twins = find_twins(triangles, n_points)
    tail, head = halfedge_ends(triangles)
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    h = np.flatnonzero((np.arange(len(twins)) < twins) & ~_is_in(key, taken))
    t = twins[h]
    c, d = tail[previous_halfedge(h)], tail[previous_halfedge(t)]
    gained = gain(triangles, tail[h], head[h], c, d)
    new = np.minimum(c, d) * n + np.maximum(c, d)
    able = (gained > _LEAST_GAIN) & (c != d) & ~_is_in(new, np.unique(key)) & ~_is_in(new, taken)
    h, t, gained, new = h[able], t[able], gained[able], new[able]
    # Greatest gains first; each new edge once; then those that are first in both their triangles.
    order = np.lexsort((h, -gained))
    h, t, new = h[order], t[order], new[order]
    once = np.sort(np.unique(new, return_index=True)[1])
    h, t = h[once], t[once]
    chosen = _are_first([h // 3, t // 3], len(triangles))
    if one_a_corner:
        sides = [tail[h], head[h], tail[previous_halfedge(h)], tail[previous_halfedge(t)]]
        chosen &= _are_first(sides, n_points)
    return h[chosen], t[chosen]


def _are_first(places: list[Ints], n: int) -> Bools:
    """Whether each edge is the first at all the places that it takes."""
    rank = np.arange(len(places[0]))
    first = np.full(n, len(rank))
    for place in places:
        np.minimum.at(first, place, rank)
    flags: Bools = np.all([first[place] == rank for place in places], axis=0)
    return flags


def _is_in(keys: Ints, ordered: Ints) -> Bools:
    if len(ordered) == 0:
        return np.zeros(len(keys), bool)
    at = np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)
    found: Bools = ordered[at] == keys
    return found


def angle_at(points: Floats, apex: Ints, a: Ints, b: Ints) -> Floats:
    """Angle at one corner of triangles."""
    u, v = points[a] - points[apex], points[b] - points[apex]
    along: Floats = (u * v).sum(1)
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), along).astype(np.float64)
    return angle


def stays_upright(points: Floats, a: Ints, b: Ints, c: Ints, d: Ints) -> Bools:
    """Whether both new triangles look the way the two old ones look together."""
    pa, pb, pc, pd = points[a], points[b], points[c], points[d]
    old = np.cross(pb - pa, pc - pa) + np.cross(pa - pb, pd - pb)
    one, other = np.cross(pa - pc, pd - pc), np.cross(pb - pd, pc - pd)
    upright: Bools = ((one * old).sum(1) > 0) & ((other * old).sum(1) > 0)
    return upright
