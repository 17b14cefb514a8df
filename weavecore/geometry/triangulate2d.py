r"""Constrained triangulation in the plane: of a region bounded by closed polygons, and of a polygon with a crowded
side.

1. Qhull gives the Delaunay triangulation of all points and a frame around them.
2. Segments of the border that it lacks are inserted by flips of the edges that cross them (Sloan 1993).
3. Inside and outside alternate at each border that is crossed from the frame: the even-odd rule, by flooding.

`triangulate_crowded_side` fills a nearly convex polygon of which one straight side has many points.  A fan about its
centroid would join each of them to one far point; instead rows of points are placed over that side, each with half as
many as the one below::

         ___________           top: the other sides
        /__|____|___\          row 2: every fourth
       /_|__|__|__|__\         row 1: every other
      *-*-*-*-*-*-*-*-*        crowded side

Work: that of the Delaunay triangulation, and the flips of the missing segments.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.geometry.elementary import sines_and_cosines

_FRAME_POINTS = 16  # on a circle around all points, so that the region does not touch the convex hull
_FRAME_RADIUS = 8.0  # in extents of the points: far enough that the frame takes part in no circle of inner points
_JITTER = 1e-10  # of the extent: above rounding, below any distance that matters
_MAX_PAIRS = 4_000_000  # of points and segments compared at once, to bound memory
_FLAT = 1e-14  # doubled area of a triangle without area, in squares of the extent
_FLIPS_PER_PAIR = 20  # of crossed edges, after which a segment counts as missing


@dataclass(frozen=True, eq=False)
class PlanarRegion:
    """Triangulation of a region.

    Parameters
    ----------
    faces : (F, 3) int64
        Inside the borders, counter-clockwise.
    missing : (k,) int64
        Segments that cross others.
    """

    faces: Ints
    missing: Ints


def inside_polygons(points: Floats, tails: Floats, heads: Floats) -> Bools:
    """Whether points lie inside closed polygons, by the even-odd rule.

    Parameters
    ----------
    points : (N, 2) float64
    tails, heads : (S, 2) float64
        Ends of the polygons' sides.

    Returns
    -------
    (N,) bool
    """
    inside = np.zeros(len(points), bool)
    step = max(1, _MAX_PAIRS // max(len(tails), 1))
    slope = (heads[:, 0] - tails[:, 0]) / np.where(heads[:, 1] == tails[:, 1], 1.0, heads[:, 1] - tails[:, 1])
    for start in range(0, len(points), step):
        x, y = points[start : start + step, 0, None], points[start : start + step, 1, None]
        straddles = (tails[:, 1] > y) != (heads[:, 1] > y)
        right = x < tails[:, 0] + (y - tails[:, 1]) * slope
        inside[start : start + step] = ((straddles & right).sum(1) % 2) == 1
    return inside


def triangulate_region(points: Floats, segments: Ints) -> PlanarRegion:
    """Triangulate the region that closed polygons bound, with all points.

    Parameters
    ----------
    points : (N, 2) float64
        All different from one another.
    segments : (S, 2) int64
        The polygons' sides.  A side that occurs twice bounds nothing (a slit) but is kept as an edge.

    Returns
    -------
    PlanarRegion
        Without faces where segments are missing: bisect those and call again.
    """
    faces, missing = _triangulated(points, segments)
    if len(missing):
        return PlanarRegion(np.zeros((0, 3), np.int64), missing)
    return PlanarRegion(_inside_of(faces, segments, len(points)), missing)


def _triangulated(points: Floats, segments: Ints) -> tuple[Ints, Ints]:
    """Triangles between all points and the frame around them, and the segments that are no edges of theirs."""
    low, high = points.min(0), points.max(0)
    extent = float((high - low).max()) or 1.0
    unit = (points - (low + high) / 2) / extent
    angle = 2 * np.pi * (np.arange(_FRAME_POINTS) + 0.1234) / _FRAME_POINTS
    frame = _FRAME_RADIUS * np.column_stack(sines_and_cosines(angle)[::-1])
    faces = _delaunay(np.vstack([unit + _jitter(len(points)), frame]))
    return _with_segments(faces, unit, segments, frame)


def triangulate_polygon(polygon: Floats, normal: Floats) -> Ints | None:
    """Triangulate a plane polygon in space with its own corners.

    Parameters
    ----------
    polygon : (n, 3) float64
    normal : (3,) float64
        Seen from there it runs counter-clockwise; of any length.

    Returns
    -------
    (n - 2, 3) int64 or None
        Corners of triangles that run as it does; None if it crosses itself.
    """
    n = len(polygon)
    across = np.linalg.svd(normal[None])[2][1:]
    flat = (polygon - polygon.mean(0)) @ across.T
    if np.cross(across[0], across[1]) @ normal < 0:
        flat = flat[:, ::-1]
    corner = np.arange(n)
    faces, missing = _triangulated(flat, np.stack([corner, (corner + 1) % n], axis=1))
    # Inside, the corners of a triangle run around as the polygon does; in the bays outside, against it.
    a, b, c = faces.T
    runs_along = ((a < b) & (b < c)) | ((b < c) & (c < a)) | ((c < a) & (a < b))
    inside: Ints = faces[runs_along & (faces < n).all(1)]
    return inside if len(missing) == 0 and len(inside) == n - 2 else None


def _jitter(n: int) -> Floats:
    """A fixed, evenly spread shift (Roberts' R2 sequence): cocircular points would make Qhull's result arbitrary."""
    k = np.arange(n)[:, None]
    golden: Floats = (k * np.array([0.7548776662466927, 0.5698402909980532])) % 1.0
    return _JITTER * (golden - 0.5)


def _delaunay(points: Floats) -> Ints:
    from scipy.spatial import Delaunay

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
    fan = _FlippableTriangulation(faces, np.vstack([unit, frame]), segments)
    missing = [s for index in absent.tolist() for s in fan.bring_in(index)]
    return fan.faces(), np.unique(np.array(missing, np.int64))


def _inside_of(faces: Ints, segments: Ints, n: int) -> Ints:
    """Faces that an odd number of borders separates from the frame."""
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
    count, label = connected(first[~is_border], second[~is_border], len(faces))
    outside = label[np.flatnonzero((faces >= n).any(1))[0]]
    across = coo_matrix((np.ones(is_border.sum()), (label[first[is_border]], label[second[is_border]])), (count, count))
    walk, before = breadth_first_order((across + across.T).tocsr(), outside, directed=False)
    depth = np.zeros(count, np.int64)
    for region in walk[1:].tolist():
        depth[region] = depth[before[region]] + 1
    kept: Ints = faces[(depth[label] % 2 == 1) & (faces < n).all(1)]
    return kept


class _FlippableTriangulation:
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
            apex = self._facing.get((left, right))
            if apex is None:
                return None
            if apex == b:
                return crossed
            side = self._side(a, b, apex)
            if abs(side) <= _FLAT or len(crossed) > len(self._xy):
                return None
            if side > 0:
                left = apex
            else:
                right = apex

    def _flip_away(self, a: int, b: int, crossed: list[tuple[int, int]]) -> bool:
        waiting = deque(crossed)
        patience = _FLIPS_PER_PAIR * (len(crossed) + 1) ** 2
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


MIN_CROWD = 12
"""Points between the ends of a side from which rows are placed over it: with fewer a fan has no long triangles."""

_STRAIGHT = 1e-6  # sine of the turn from which a polygon has a corner
_MIN_ROW = 2  # points in the top row


@dataclass(frozen=True, eq=False)
class GradedTriangulation:
    """Triangles of a polygon's corners, in its order, and of points numbered on from these.

    Parameters
    ----------
    points : (k, 3) float64
    triangles : (t, 3) int64
        Running the same way around as the polygon.
    """

    points: Floats
    triangles: Ints


def triangulate_crowded_side(polygon: Floats) -> Optional[GradedTriangulation]:
    """Triangulate a polygon of which one straight side has many points.

    Parameters
    ----------
    polygon : (n, 3) float64
        Plane and nearly convex.

    Returns
    -------
    GradedTriangulation or None
        None if no side has `MIN_CROWD` points, or the other sides do not lie over it.
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
    n_rows = int(np.log2((count - 2) / _MIN_ROW))
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
    return GradedTriangulation(np.concatenate(points), np.concatenate(strips))


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
    return (int(corners[best]), int(counts[best])) if counts[best] - 2 >= MIN_CROWD else None


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
