"""Constrained triangulation of a region of the plane that is bounded by closed polygons.

The unconstrained Delaunay triangulation comes from Qhull; border segments that it lacks are
brought in by flipping the edges that cross them (Sloan 1993).  What lies inside is told from what lies
outside by flooding: each border that is crossed changes the side.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import Delaunay

from weavecore.geometry.arrays import Bools, Floats, Ints

_FRAME_POINTS = 16
_FRAME_RADIUS = 8.0
_JITTER = 1e-10
_MOST_PAIRS = 4_000_000


@dataclass(frozen=True, eq=False)
class PlanarRegion:
    """Triangles (F, 3) inside the borders, counter-clockwise; ``missing`` are segments that cross others."""

    faces: Ints
    missing: Ints


def inside_polygons(points: Floats, tails: Floats, heads: Floats) -> Bools:
    """Whether each point (N, 2) lies inside closed polygons, given as segments, by the even-odd rule."""
    inside = np.zeros(len(points), bool)
    step = max(1, _MOST_PAIRS // max(len(tails), 1))
    slope = (heads[:, 0] - tails[:, 0]) / np.where(heads[:, 1] == tails[:, 1], 1.0, heads[:, 1] - tails[:, 1])
    for start in range(0, len(points), step):
        x, y = points[start : start + step, 0, None], points[start : start + step, 1, None]
        straddles = (tails[:, 1] > y) != (heads[:, 1] > y)
        right = x < tails[:, 0] + (y - tails[:, 1]) * slope
        inside[start : start + step] = ((straddles & right).sum(1) % 2) == 1
    return inside


def triangulate_region(points: Floats, segments: Ints) -> PlanarRegion:
    """Triangulate the region that closed polygons bound, using all given points.

    Parameters
    ----------
    points : (N, 2)
        All different from one another.
    segments : (S, 2)
        The polygons' sides.  A side that is given twice bounds nothing (a slit) but is kept as an edge.

    Returns
    -------
    PlanarRegion
        With no faces where segments are missing: bisect those and call again.
    """
    low, high = points.min(0), points.max(0)
    extent = float((high - low).max()) or 1.0
    unit = (points - (low + high) / 2) / extent
    n = len(points)
    angle = 2 * np.pi * (np.arange(_FRAME_POINTS) + 0.1234) / _FRAME_POINTS
    frame = _FRAME_RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    faces = _delaunay(np.vstack([unit + _jitter(n), frame]))
    faces, missing = _with_segments(faces, unit, segments, frame)
    if len(missing):
        return PlanarRegion(np.zeros((0, 3), np.int64), missing)
    return PlanarRegion(_inside_of(faces, segments, n), missing)


def triangulate_polygon(polygon: Floats, normal: Floats) -> Ints | None:
    """Triangles (n - 2, 3) of the corners of a plane polygon, running as it does; None where it is no simple one.

    Parameters
    ----------
    polygon : (n, 3) float64
    normal : (3,) float64
        From where it runs counter-clockwise, of any length.
    """
    n = len(polygon)
    across = np.linalg.svd(normal[None])[2][1:]
    flat = (polygon - polygon.mean(0)) @ across.T
    if np.cross(across[0], across[1]) @ normal < 0:
        flat = flat[:, ::-1]
    corner = np.arange(n)
    faces = triangulate_region(flat, np.stack([corner, (corner + 1) % n], axis=1)).faces
    return faces if len(faces) == n - 2 else None


def _jitter(n: int) -> Floats:
    """A fixed, evenly spread shift: rows of points on one circle would make Qhull's result arbitrary."""
    k = np.arange(n)[:, None]
    golden: Floats = (k * np.array([0.7548776662466927, 0.5698402909980532])) % 1.0
    return _JITTER * (golden - 0.5)


def _delaunay(points: Floats) -> Ints:
    faces = Delaunay(points).simplices.astype(np.int64)
    turned = _doubled_areas(points, faces) < 0
    faces[turned] = faces[turned][:, [0, 2, 1]]
    return faces


def _doubled_areas(points: Floats, faces: Ints) -> Floats:
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    areas: Floats = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return areas


def _keys(pairs: Ints, n: int) -> Ints:
    low, high = pairs.min(1), pairs.max(1)
    keys: Ints = low * np.int64(n) + high
    return keys


def _with_segments(faces: Ints, unit: Floats, segments: Ints, frame: Floats) -> tuple[Ints, Ints]:
    """Flip the segments in that are not edges yet; those that cannot be are given back."""
    n = len(unit) + len(frame)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    absent = np.flatnonzero(~np.isin(_keys(segments, n), _keys(sides, n)))
    if len(absent) == 0:
        return faces, absent
    fan = TriangleFan(faces, np.vstack([unit, frame]), segments)
    missing = [s for index in absent.tolist() for s in fan.bring_in(index)]
    return fan.faces(), np.unique(np.array(missing, np.int64))


def _inside_of(faces: Ints, segments: Ints, n: int) -> Ints:
    """The faces that an odd number of borders parts from the frame."""
    n_all = n + _FRAME_POINTS
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(np.arange(len(faces)), 3)
    key = _keys(sides, n_all)
    border, times = np.unique(_keys(segments, n_all), return_counts=True)
    border = border[times % 2 == 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    first, second = owner[order[same]], owner[order[same + 1]]
    is_border = np.isin(key[order[same]], border)
    size = (len(faces), len(faces))
    free = coo_matrix((np.ones((~is_border).sum(), bool), (first[~is_border], second[~is_border])), shape=size)
    count, label = connected_components(free, directed=False)
    outside = label[np.flatnonzero((faces >= n).any(1))[0]]
    across = coo_matrix((np.ones(is_border.sum()), (label[first[is_border]], label[second[is_border]])), (count, count))
    walk, before = breadth_first_order((across + across.T).tocsr(), outside, directed=False)
    depth = np.zeros(count, np.int64)
    for region in walk[1:].tolist():
        depth[region] = depth[before[region]] + 1
    kept: Ints = faces[(depth[label] % 2 == 1) & (faces < n).all(1)]
    return kept


# ----------------------------------------------------------------------
# A triangulation of the plane into which single segments are brought by flips (Sloan 1993).

_FLAT = 1e-14
_PATIENCE = 20


class TriangleFan:
    """Triangles as a table from each directed edge to the corner that faces it.

    It serves the few segments that a Delaunay triangulation lacks; walking from
    triangle to triangle has no array form.
    """

    def __init__(self, faces: Ints, points: Floats, segments: Ints) -> None:
        self._xy = points.tolist()
        self._segments = segments.tolist()
        self._of_edge = {(min(a, b), max(a, b)): i for i, (a, b) in enumerate(self._segments)}
        self._facing: dict[tuple[int, int], int] = {}
        self._neighbours: list[set[int]] = [set() for _ in self._xy]
        for a, b, c in faces.tolist():
            self._add(a, b, c)

    def faces(self) -> Ints:
        """The triangles (F, 3), each once, beginning at its least corner."""
        rows = [(a, b, c) for (a, b), c in self._facing.items() if a < b and a < c]
        return np.array(sorted(rows), np.int64).reshape(-1, 3)

    def bring_in(self, index: int) -> list[int]:
        """Make a segment an edge; gives the segments that stand in the way, itself among them, if it cannot be."""
        a, b = self._segments[index]
        if b in self._neighbours[a]:
            return []
        crossed = self._crossed_edges(a, b)
        if crossed is None:
            return [index]
        in_the_way = [self._of_edge[e] for e in crossed if e in self._of_edge and e[1] in self._neighbours[e[0]]]
        if in_the_way:
            return [index, *in_the_way]
        return [] if self._flip_away(a, b, crossed) else [index]

    def _add(self, a: int, b: int, c: int) -> None:
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            self._facing[p, q] = r
            self._neighbours[p].add(q)
            self._neighbours[q].add(p)

    def _side(self, a: int, b: int, p: int) -> float:
        (ax, ay), (bx, by), (px, py) = self._xy[a], self._xy[b], self._xy[p]
        return float((bx - ax) * (py - ay) - (by - ay) * (px - ax))

    def _crossed_edges(self, a: int, b: int) -> list[tuple[int, int]] | None:
        """Edges between a and b, least corner first; None where a corner lies on the segment."""
        start = None
        for right in sorted(self._neighbours[a]):
            left = self._facing.get((a, right))
            if left is None or self._side(a, b, right) > -_FLAT or self._side(a, b, left) < _FLAT:
                continue
            if self._side(right, left, b) < 0:  # b lies beyond the side that faces a
                start = (right, left)
        if start is None:
            return None
        crossed = []
        right, left = start
        while True:
            crossed.append((min(right, left), max(right, left)))
            tip = self._facing.get((left, right))
            if tip is None:
                return None
            if tip == b:
                return crossed
            side = self._side(a, b, tip)
            if abs(side) <= _FLAT or len(crossed) > len(self._xy):
                return None
            if side > 0:
                left = tip
            else:
                right = tip

    def _flip_away(self, a: int, b: int, crossed: list[tuple[int, int]]) -> bool:
        waiting = deque(crossed)
        patience = _PATIENCE * (len(crossed) + 1) ** 2
        while waiting and patience:
            patience -= 1
            p, q = waiting.popleft()
            r, s = self._facing[p, q], self._facing[q, p]
            if self._side(s, q, r) <= _FLAT or self._side(r, p, s) <= _FLAT:
                waiting.append((p, q))
                continue
            self._flip(p, q, r, s)
            apart = {r, s}.isdisjoint((a, b))
            if apart and (self._side(a, b, r) > 0) != (self._side(a, b, s) > 0):
                waiting.append((min(r, s), max(r, s)))
        return not waiting

    def _flip(self, p: int, q: int, r: int, s: int) -> None:
        """Put the edge r–s in the place of p–q."""
        del self._facing[p, q], self._facing[q, p]
        self._neighbours[p].discard(q)
        self._neighbours[q].discard(p)
        self._add(s, q, r)
        self._add(r, p, s)


# ----------------------------------------------------------------------
# Triangles in a polygon of which one straight side has many points.
#
# A fan about the middle would join each of them to one far point.  Here rows of points are laid over that side, each
# with half as many as the one below, so that no triangle is much longer than it must be.

LEAST_CROWD = 12
"""A side with so many points between its ends is worth a ladder."""

_STRAIGHT = 1e-6  # sine of the turn from which on a polygon has a corner
_LEAST_ROW = 2


@dataclass(frozen=True, eq=False)
class Ladder:
    """Triangles of a polygon's corners, in its order, and of points numbered on from these.

    Parameters
    ----------
    points : (k, 3) float64
    triangles : (t, 3) int64
        Running the same way around as the polygon.
    """

    points: Floats
    triangles: Ints


def lay_ladder(polygon: Floats) -> Optional[Ladder]:
    """The ladder of a polygon (n, 3); None where no side is so crowded, or the others do not lie over it.

    Parameters
    ----------
    polygon : (n, 3) float64
        A piece of a plane, nearly convex.
    """
    base = _crowded_side(polygon)
    if base is None:
        return None
    first, count = base
    n = len(polygon)
    low = (first + np.arange(count)) % n
    top = (first + np.r_[0, np.arange(n - 1, count - 2, -1)]) % n
    along = polygon[low[-1]] - polygon[low[0]]
    place = (polygon - polygon[low[0]]) @ along / (along @ along)
    if len(top) < 3 or (np.diff(place[low]) <= 0).any() or (np.diff(place[top]) <= 0).any():
        return None
    over = np.stack([np.interp(place[low], place[top], polygon[top][:, k]) for k in range(3)], axis=1)
    rows, points = [low], [np.zeros((0, 3))]
    n_rows = int(np.log2((count - 2) / _LEAST_ROW))
    number = n
    for k in range(1, n_rows + 1):
        inner = np.arange(2**k, count - 1, 2**k)
        part = (2.0**k - 1.0) / 2.0**n_rows
        points.append(polygon[low[inner]] * (1.0 - part) + over[inner] * part)
        rows.append(np.concatenate([low[:1], number + np.arange(len(inner)), low[-1:]]))
        place = np.concatenate([place, place[low[inner]]])
        number += len(inner)
    rows.append(top)
    strips = [_between(one, other, place) for one, other in zip(rows, rows[1:])]
    return Ladder(np.concatenate(points), np.concatenate(strips))


def _crowded_side(polygon: Floats) -> Optional[tuple[int, int]]:
    """First point of the straight side with the most points, and their number, its ends among them."""
    ahead = np.roll(polygon, -1, axis=0) - polygon
    size = np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), np.finfo(float).tiny)
    ahead = ahead / size
    turn = np.linalg.norm(np.cross(np.roll(ahead, 1, axis=0), ahead), axis=1)
    corners = np.flatnonzero((turn > _STRAIGHT) | ((np.roll(ahead, 1, axis=0) * ahead).sum(1) < 0))
    if len(corners) < 3:
        return None
    counts = np.diff(np.append(corners, corners[0] + len(polygon))) + 1
    best = int(np.argmax(counts))
    return (int(corners[best]), int(counts[best])) if counts[best] - 2 >= LEAST_CROWD else None


def _between(low: Ints, top: Ints, place: Floats) -> Ints:
    """Triangles between two rows that begin and end together, places rising along both."""
    chain = np.concatenate([low[1:], top[1:-1]])
    is_low = np.arange(len(chain)) < len(low) - 1
    key = place[chain]
    # The first of either row go first: before them the other one lies in line with the end that both share.
    key[0] = key[len(low) - 1] = -np.inf
    order = np.lexsort((~is_low, key))
    is_low = is_low[order]
    i, j = np.cumsum(is_low), np.cumsum(~is_low)
    # Each step is along one row, and makes a triangle with where the other one is.
    triangles = np.where(
        is_low[:, None],
        np.stack([low[i - is_low], low[i], top[j]], axis=1),
        np.stack([low[i], top[j], top[j - ~is_low]], axis=1),
    )
    a, b, c = triangles.T
    kept: Ints = triangles[(a != b) & (b != c) & (c != a)]
    return kept
