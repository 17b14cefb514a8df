"""Flat triangle meshes of polygons with holes, for tests: conforming Delaunay of borders and a lattice."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, cKDTree

_MOST_ROUNDS = 60
_SHORTEST = 1e-6  # of an edge: borders may be that near to each other


def circle(radius, centre=(0.0, 0.0), n=48):
    """A regular polygon (n, 2)."""
    angle = 2 * np.pi * np.arange(n) / n
    return np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rectangle(width, height, centre=(0.0, 0.0)):
    """Four corners (4, 2)."""
    return np.asarray(centre) + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([width, height]) / 2


def is_inside(points, loops):
    """(N,) whether points lie in an odd number of the polygons."""
    a = np.concatenate(loops)
    b = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    inside = np.zeros(len(points), bool)
    for chunk in np.array_split(np.arange(len(points)), max(1, len(points) * len(a) // 4_000_000)):
        x, y = points[chunk, 0, None], points[chunk, 1, None]
        spans = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
        left = x < a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
        inside[chunk] = (spans & left).sum(1) % 2 == 1
    return inside


def plate(loops, edge, jitter=0.0, rng=None):
    """Mesh the inside of an outer polygon and outside of its holes; (vertices (V, 3), faces (F, 3)) at z = 0.

    Sides longer than ``edge`` are cut, and others where the Delaunay triangulation misses them.
    """
    fine = [_cut_sides(np.asarray(loop, float), edge) for loop in loops]
    border = np.concatenate(fine)
    points = np.concatenate([border, _lattice(fine, edge, jitter, rng)])
    starts = np.concatenate([[0], np.cumsum([len(loop) for loop in fine])])
    segments = np.concatenate(
        [np.stack([np.arange(s, t), np.roll(np.arange(s, t), -1)], axis=1) for s, t in zip(starts[:-1], starts[1:])]
    )
    for _ in range(_MOST_ROUNDS):
        triangles = Delaunay(points).simplices.astype(np.int64)
        missing = ~_are_sides(segments, triangles, len(points))
        # Delaunay leaves out points that rounding puts on a straight side: no cutting brings those back.
        missing &= np.linalg.norm(points[segments[:, 1]] - points[segments[:, 0]], axis=1) > _SHORTEST * edge
        if not missing.any():
            break
        a, b = segments[missing].T
        new = len(points) + np.arange(len(a))
        points = np.concatenate([points, (points[a] + points[b]) / 2])
        segments = np.concatenate([segments[~missing], np.stack([a, new], 1), np.stack([new, b], 1)])
    triangles = triangles[is_inside(points[triangles].mean(1), loops)]
    u, v = points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    # Along straight sides Delaunay makes triangles without area, of three points of the side.
    used, faces = np.unique(triangles[np.abs(area) > 1e-11 * edge**2], return_inverse=True)
    return np.concatenate([points[used], np.zeros((len(used), 1))], axis=1), faces.reshape(-1, 3)


def _cut_sides(loop, edge):
    after = np.roll(loop, -1, axis=0)
    counts = np.maximum(1, np.ceil(np.linalg.norm(after - loop, axis=1) / edge - 1e-9)).astype(int)
    return np.concatenate([p + (q - p) * (np.arange(n) / n)[:, None] for p, q, n in zip(loop, after, counts)])


def _lattice(loops, edge, jitter, rng):
    border = np.concatenate(loops)
    low, high = border.min(0), border.max(0)
    rows = np.arange(low[1], high[1] + edge, edge * np.sqrt(0.75))
    columns = np.arange(low[0], high[0] + edge, edge)
    x, y = np.meshgrid(columns, rows)
    x = x + (np.arange(len(rows)) % 2)[:, None] * edge / 2
    points = np.stack([x, y], axis=-1).reshape(-1, 2)
    if jitter:
        points = points + rng.uniform(-jitter, jitter, points.shape) * edge
    points = points[is_inside(points, loops)]
    return points[cKDTree(border).query(points)[0] > 0.6 * edge] if len(points) else points


def _are_sides(segments, triangles, n):
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    have = np.minimum(tail, head) * n + np.maximum(tail, head)
    return np.isin(segments.min(1) * n + segments.max(1), have)
