r"""Edge flips (Lawson 1977) and vertex shifts that improve a triangulated surface.

Of the two triangles on an edge ``ab``, ``c`` is the third corner on its left and ``d`` that on its right; a flip
replaces ``ab`` by ``cd``::

          c                   c
        /   \               / | \            `turn_edges`   any gain, the greatest first
       a --> b      ->      a  |  b            `flip_edges`   Delaunay in space, while a plane embedding stays one
        \   /               \ | /
          d                   d

`flip_edges`, `wanted_shift` and `take_back_folds` relax patches that are also laid out in the plane: all triangles stay
counter-clockwise there, so that a patch stays an embedding.  Several patches may be relaxed at once, as components.

Work: linear in the triangles, for each round; a round flips an independent set of edges.
"""

from __future__ import annotations

from typing import Callable

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, cross
from weavecore.geometry.elementary import arctangents
from weavecore.geometry.halfedges import find_twins, halfedge_ends, next_halfedge, previous_halfedge
from weavecore.polling import poll

_MAX_TURN_ROUNDS = 100  # as long as a gain is left; a Delaunay triangulation needs some ten
_MAX_FLIP_ROUNDS = 60
_MAX_UNDO_ROUNDS = 6  # of vertices whose shifts are taken back, before all are

_MIN_GAIN = 1e-6
"""Radians or cotangents that a flip must gain: above what rounding changes, so that no edge flips to and fro."""

_MIN_AREA_SHARE = 1e-3
"""Of its quad's area in the plane, or of its own before a shift: what a triangle keeps at least."""

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
    for _ in range(_MAX_TURN_ROUNDS):
        poll()
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
    able = (gained > _MIN_GAIN) & (c != d) & ~_is_in(new, np.unique(key)) & ~_is_in(new, taken)
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
    """Angle at one corner of triangles, in radians.

    Parameters
    ----------
    points : (N, 3) float64
    apex, a, b : (n,) int64
        The corner, and the other two.

    Returns
    -------
    (n,) float64
    """
    u, v = points[a] - points[apex], points[b] - points[apex]
    along: Floats = (u * v).sum(1)
    return arctangents(np.linalg.norm(cross(u, v), axis=1), along)


def stays_upright(points: Floats, a: Ints, b: Ints, c: Ints, d: Ints) -> Bools:
    """Whether both triangles after a flip face the way the two before it face together.

    Parameters
    ----------
    points : (N, 3) float64
    a, b, c, d : (n,) int64
        As in the figure of this module.

    Returns
    -------
    (n,) bool
    """
    pa, pb, pc, pd = points[a], points[b], points[c], points[d]
    old = cross(pb - pa, pc - pa) + cross(pa - pb, pd - pb)
    one, other = cross(pa - pc, pd - pc), cross(pb - pd, pc - pd)
    upright: Bools = ((one * old).sum(1) > 0) & ((other * old).sum(1) > 0)
    return upright


def doubled_areas(plane: Floats, faces: Ints) -> Floats:
    """Twice the signed areas of triangles in the plane.

    Parameters
    ----------
    plane : (N, 2) float64
    faces : (F, 3) int64

    Returns
    -------
    (F,) float64
        Positive for counter-clockwise ones.
    """
    a, b, c = plane[faces[:, 0]], plane[faces[:, 1]], plane[faces[:, 2]]
    u, v = b - a, c - a
    areas: Floats = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return areas


def corner_cotangents(points: Floats, a: Ints, b: Ints, c: Ints) -> Floats:
    """Cotangents of the angles at ``c`` of triangles in space.

    Parameters
    ----------
    points : (N, 3) float64
    a, b, c : (n,) int64

    Returns
    -------
    (n,) float64
    """
    u, v = points[a] - points[c], points[b] - points[c]
    dot = np.einsum("ij,ij->i", u, v)
    area = np.linalg.norm(cross(u, v), axis=1)
    cotangents: Floats = dot / np.maximum(area, 1e-12 * np.abs(dot) + 1e-300)
    return cotangents


def flip_edges(faces: Ints, plane: Floats, points: Floats, names: Ints, held: Ints) -> Ints:
    """Flip edges until the triangles are Delaunay in space, as far as the plane lets them.

    Parameters
    ----------
    faces : (F, 3)
        Counter-clockwise in ``plane``.
    plane : (N, 2)
    points : (N, 3)
    names : (N,)
        Which vertices will be one: those of one name.  No flip makes an edge that is there under these names.
    held : (K, 2)
        Edges that are not flipped.
    """
    faces = faces.copy()
    collapsed = _collapsed(names[faces])
    for _ in range(_MAX_FLIP_ROUNDS):
        poll()
        twins = find_twins(faces, len(plane))
        h = np.flatnonzero(twins > np.arange(len(twins)))
        h = h[~collapsed[h // 3] & ~collapsed[twins[h] // 3] & ~_are_held(faces, h, held, len(plane))]
        gain, h = _flip_gains(faces, twins, h, plane, points)
        fresh = _makes_no_double(faces, twins, h, names)
        h = _apart(h[fresh], twins, gain[fresh], len(faces))
        if len(h) == 0:
            break
        a, b, c, d = _quad(faces, twins, h)
        faces[h // 3] = np.column_stack([a, d, c])
        faces[twins[h] // 3] = np.column_stack([b, c, d])
    return faces


def _are_held(faces: Ints, h: Ints, held: Ints, n: int) -> Bools:
    if len(held) == 0:
        return np.zeros(len(h), bool)
    tail, head = faces.ravel()[h], faces.ravel()[next_halfedge(h)]
    keys = held.min(1) * np.int64(n) + held.max(1)
    are: Bools = np.isin(np.minimum(tail, head) * np.int64(n) + np.maximum(tail, head), keys)
    return are


def _collapsed(named: Ints) -> Bools:
    a, b, c = named.T
    collapsed: Bools = (a == b) | (b == c) | (c == a)
    return collapsed


def _quad(faces: Ints, twins: Ints, h: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Tail and head of halfedges, and the corners that face them on the left and on the right."""
    flat = faces.ravel()
    return flat[h], flat[next_halfedge(h)], flat[previous_halfedge(h)], flat[previous_halfedge(twins[h])]


def _flip_gains(faces: Ints, twins: Ints, h: Ints, plane: Floats, points: Floats) -> tuple[Floats, Ints]:
    """Halfedges whose flip makes things better and keeps the plane whole, and by how much."""
    a, b, c, d = _quad(faces, twins, h)
    gain = -(corner_cotangents(points, a, b, c) + corner_cotangents(points, b, a, d))
    one = doubled_areas(plane, np.column_stack([a, d, c]))
    other = doubled_areas(plane, np.column_stack([b, c, d]))
    # Of two diagonals that are equally good the one with the least vertex is kept, whatever the last bit says.
    tied = (np.abs(gain) <= _MIN_GAIN) & (np.minimum(c, d) < np.minimum(a, b))
    good = ((gain > _MIN_GAIN) | tied) & (np.minimum(one, other) > _MIN_AREA_SHARE * (one + other))
    return gain[good], h[good]


def _makes_no_double(faces: Ints, twins: Ints, h: Ints, names: Ints) -> Bools:
    named = names[faces]
    n = np.int64(names.max() + 1) if len(names) else np.int64(1)
    tail, head = named.ravel(), named[:, [1, 2, 0]].ravel()
    there = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head))
    _, _, c, d = _quad(faces, twins, h)
    c, d = names[c], names[d]
    fresh: Bools = ~np.isin(np.minimum(c, d) * n + np.maximum(c, d), there) & (c != d)
    return fresh


def _apart(h: Ints, twins: Ints, gain: Floats, n_faces: int) -> Ints:
    """A set of halfedges no two of which touch the same face, the best first."""
    rank = np.empty(len(h), np.int64)
    rank[np.lexsort((h, -gain))] = np.arange(len(h))
    best = np.full(n_faces, len(h), np.int64)
    np.minimum.at(best, h // 3, rank)
    np.minimum.at(best, twins[h] // 3, rank)
    apart: Ints = h[(best[h // 3] == rank) & (best[twins[h] // 3] == rank)]
    return apart


def wanted_shift(faces: Ints, points: Floats, sizes: Floats) -> Floats:
    """Shift of each vertex to the weighted mean of the centroids of its triangles.

    The weights are area over the fourth power of the wanted edge length, which leads to triangles of that size (Du
    and Wang 2003, centroidal Voronoi tessellation with a density).

    Parameters
    ----------
    faces : (F, 3) int64
    points : (N, 3) float64
    sizes : (N,) float64
        Wanted edge length at each vertex.

    Returns
    -------
    (N, 3) float64
    """
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    square = sizes[faces].mean(1) ** 2
    weight = np.linalg.norm(np.cross(b - a, c - a), axis=1) / (square * square)
    centre = (a + b + c) / 3
    total = np.zeros(len(points))
    moment = np.zeros_like(points)
    for k in range(3):
        total += np.bincount(faces[:, k], weight, len(points))
        for axis in range(3):
            moment[:, axis] += np.bincount(faces[:, k], weight * centre[:, axis], len(points))
    shift: Floats = moment / np.maximum(total, 1e-300)[:, None] - points
    shift[total == 0] = 0.0
    return shift


def take_back_folds(faces: Ints, before: Floats, after: Floats) -> Floats:
    """Take back the shifts that would turn a triangle over.

    Parameters
    ----------
    faces : (F, 3) int64
    before, after : (N, 2) float64
        Vertices in the plane before and after the shift.

    Returns
    -------
    (N, 2) float64
        The vertices after it, those at inverted triangles as before.
    """
    after = after.copy()
    floor = _MIN_AREA_SHARE * doubled_areas(before, faces)
    for _ in range(_MAX_UNDO_ROUNDS):
        poll()
        folded = faces[doubled_areas(after, faces) <= floor].ravel()
        if len(folded) == 0:
            return after
        after[folded] = before[folded]
    return before


def least_angles(points: Floats, faces: Ints) -> Floats:
    """Least angle of each triangle, in degrees.

    Parameters
    ----------
    points : (N, 2) or (N, 3) float64
    faces : (F, 3) int64

    Returns
    -------
    (F,) float64
    """
    corners = points[faces]
    angles = []
    for k in range(3):
        u, v = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angles.append(arctangents(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v)))
    least: Floats = np.degrees(np.min(angles, axis=0))
    return least
