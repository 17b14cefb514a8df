"""Closest points: of a triangle mesh, of triangles, and between segments.

The face with the nearest centroid bounds the distance to the mesh, so a closest face has its centroid no further than
that bound plus the face's radius; a k-d tree of centroids gives the candidates, and the exact distance decides.  Faces
of like size (a factor of two) are searched together, so that a few large ones do not widen the search among the small.

Work: for each point the logarithm of the faces, and its candidates.
"""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, cross, dots
from weavecore.polling import each, poll

_POINTS_AT_ONCE = 4096  # bounds the memory of the candidates
_TINY = np.finfo(float).tiny
_PARALLEL = 1e-12  # squared sine of the angle of segments that count as parallel


class FaceFinder:
    """Finds the closest faces of a mesh for one set of points after the other.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    """

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        from scipy.spatial import cKDTree

        self._corners = vertices[faces]
        middle = self._corners.mean(1)
        radius = np.sqrt(np.max([dots(arm, arm) for arm in (self._corners[:, k] - middle for k in range(3))], axis=0))
        poll()
        size = np.frexp(radius)[1]
        classes = [np.flatnonzero(size == s) for s in np.unique(size)]

        def tree_of(places: Floats) -> Any:
            # Trees that are not balanced are built twice as fast, and searched as fast among points that lie evenly.
            poll()
            return cKDTree(places, balanced_tree=False, compact_nodes=False)

        self._trees = [(ids, tree_of(middle[ids]), float(radius[ids].max())) for ids in each(classes)]
        self._centroids = tree_of(middle)

    def find(self, points: Floats) -> tuple[Ints, Floats]:
        """Find the closest face of each point; see `closest_faces`.

        Parameters
        ----------
        points : (n, 3) float64

        Returns
        -------
        face : (n,) int64
        place : (n, 3) float64
        """
        guess = np.asarray(self._centroids.query(points)[1], np.int64)
        bound = _distances(nearest_on_triangles(points, self._corners[guess]), points)
        best = np.zeros(len(points), np.int64)
        place = np.zeros((len(points), 3))
        for begin in each(range(0, len(points), _POINTS_AT_ONCE)):
            block = slice(begin, begin + _POINTS_AT_ONCE)
            row, face = _candidates(points[block], bound[block], self._trees)
            nearest = nearest_on_triangles(points[block][row], self._corners[face])
            gap = _distances(nearest, points[block][row])
            order = np.lexsort((face, gap, row))
            first = order[np.unique(row[order], return_index=True)[1]]
            best[block], place[block] = face[first], nearest[first]
        return best, place


def _distances(a: Floats, b: Floats) -> Floats:
    gap = a - b
    distances: Floats = np.sqrt(dots(gap, gap))
    return distances


def closest_faces(points: Floats, vertices: Floats, faces: Ints) -> tuple[Ints, Floats]:
    """Find the closest face of each point, and the place on it.

    Parameters
    ----------
    points : (n, 3) float64
    vertices : (V, 3) float64
    faces : (F, 3) int64

    Returns
    -------
    face : (n,) int64
        Where several are as close, the least.
    place : (n, 3) float64
    """
    return FaceFinder(vertices, faces).find(points)


def _candidates(points: Floats, bound: Floats, trees: list[tuple[Ints, Any, float]]) -> tuple[Ints, Ints]:
    """Pairs (point, face) of which one for each point is the closest."""
    rows, found = [], []
    for ids, tree, radius in trees:
        lists = tree.query_ball_point(points, (bound + radius) * (1 + 1e-9))
        counts = np.fromiter(map(len, lists), np.int64, len(lists))
        rows.append(np.repeat(np.arange(len(points)), counts))
        found.append(ids[np.fromiter(chain.from_iterable(lists), np.int64, int(counts.sum()))])
    return np.concatenate(rows), np.concatenate(found)


def nearest_on_triangles(points: Floats, corners: Floats) -> Floats:
    """Nearest place of each triangle to its point.

    Parameters
    ----------
    points : (n, 3) float64
    corners : (n, 3, 3) float64
        Of one triangle for each point; it may have no area.

    Returns
    -------
    (n, 3) float64
    """
    poll()
    a, b, c = (corners[:, k] for k in range(3))
    normal = cross(b - a, c - a)
    square = dots(normal, normal)
    height = np.divide(dots(points - a, normal), square, out=np.zeros(len(points)), where=square > 0)
    best = points - normal * height[:, None]
    inside = square > 0
    for tail, head in ((a, b), (b, c), (c, a)):
        inside &= dots(cross(head - tail, best - tail), normal) >= 0
    gap = np.where(inside, dots(best - points, best - points), np.inf)
    for tail, head in ((a, b), (b, c), (c, a)):
        along = head - tail
        square = dots(along, along)
        part = np.divide(dots(points - tail, along), square, out=np.zeros(len(points)), where=square > 0)
        nearest = tail + along * np.clip(part, 0, 1)[:, None]
        distance = dots(nearest - points, nearest - points)
        closer = distance < gap
        best[closer], gap[closer] = nearest[closer], distance[closer]
    places: Floats = best
    return places


def segment_distances(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Distances between pairs of segments (Ericson 2005, *Real-Time Collision Detection*, §5.1.9).

    Parameters
    ----------
    a, b, c, d : (n, 3) float64
        Ends of the segments ab and cd.

    Returns
    -------
    distance : (n,) float64
    middle : (n, 3) float64
        Midway between the nearest points.
    """
    poll()
    # Coordinates in rows of their own: several times as fast as short rows.
    p, q = np.ascontiguousarray(a.T), np.ascontiguousarray(c.T)
    u, v, w = b.T - p, d.T - q, p - q
    uu, vv, uv, uw, vw = (dots_of_columns(*pair) for pair in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    det = uu * vv - uv * uv
    s = _unit_clipped(np.divide(uv * vw - uw * vv, det, out=np.zeros_like(det), where=det > _PARALLEL * uu * vv))
    t = _unit_clipped((uv * s + vw) / np.maximum(vv, _TINY))
    s = _unit_clipped((uv * t - uw) / np.maximum(uu, _TINY))
    p += u * s
    q += v * t
    gap = p - q
    return np.sqrt(dots_of_columns(gap, gap)), ((p + q) / 2.0).T


def dots_of_columns(a: Floats, b: Floats) -> Floats:
    """Inner products of the columns of arrays with coordinates in rows, unlike those of `arrays.dots`.

    Parameters
    ----------
    a, b : (3, n) float64

    Returns
    -------
    (n,) float64
    """
    product: Floats = a[0] * b[0]
    product += a[1] * b[1]
    product += a[2] * b[2]
    return product


def _unit_clipped(values: Floats) -> Floats:
    clipped: Floats = np.minimum(np.maximum(values, 0.0), 1.0)
    return clipped
