"""Constrained triangulation of a region of the plane that is bounded by closed polygons.

The unconstrained Delaunay triangulation comes from Qhull; border segments that it lacks are
brought in by flipping the edges that cross them (Sloan 1993).  What lies inside is told from what lies
outside by flooding: each border that is crossed changes the side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import Delaunay

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.flipping import TriangleFan

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
