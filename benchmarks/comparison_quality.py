"""What polylines are worth: how far they lie from where they should, whether they are closed and simple."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from exact import ExactDistance, Places

_NEAREST_FACES = 16
_TOUCH = 1e-9
"""Parts of the size of a mesh below which two segments meet."""


@dataclass(frozen=True, eq=False)
class Result:
    """What a worker found.

    Attributes
    ----------
    seconds, memory : float
        Processor seconds and MB.
    points : (N, 3) float64
    counts : (P,) int64
        Points of each polyline.
    distance : (P,) float64
        Where each polyline should be.
    closed : (P,) bool
    """

    seconds: float
    memory: float
    points: np.ndarray
    counts: np.ndarray
    distance: np.ndarray
    closed: np.ndarray


def locate(vertices: np.ndarray, faces: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Face (n,) and barycentric coordinates (n, 3) of points on a mesh: in the nearest of the faces near by."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    n_near = min(_NEAREST_FACES, len(faces))
    _, near = cKDTree((a + b + c) / 3).query(points, k=n_near)
    near = near.reshape(len(points), n_near)
    u, v, w = (b - a)[near], (c - a)[near], points[:, None] - a[near]
    uu, uv, vv, uw, vw = (np.einsum("nkd,nkd->nk", p, q) for p, q in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    area = uu * vv - uv * uv
    second, third = (vv * uw - uv * vw) / area, (uu * vw - uv * uw) / area
    weights = np.clip(np.stack([1 - second - third, second, third], axis=2), 0, None)
    weights /= weights.sum(2, keepdims=True)
    corners = np.stack([a[near], b[near], c[near]], axis=2)
    away = np.linalg.norm(np.einsum("nkc,nkcd->nkd", weights, corners) - points[:, None], axis=2)
    best, row = away.argmin(1), np.arange(len(points))
    return near[row, best], weights[row, best]


def errors(exact: ExactDistance, vertices: np.ndarray, faces: np.ndarray, result: Result) -> np.ndarray:
    """How far the points off the ridges are from the distance that they should have."""
    face, weights = locate(vertices, faces, result.points)
    wanted = np.repeat(result.distance, result.counts)
    return exact.errors_at(Places(vertices, faces, face, weights, wanted))


def count_crossed(result: Result) -> int:
    """How many polylines touch or cross themselves or others of the same distance."""
    starts, ends, line, follower = _segments(result)
    length = np.linalg.norm(ends - starts, axis=1)
    drawn = length > 0
    pairs = cKDTree((starts + ends) / 2).query_pairs(float(length.max(initial=0.0)), output_type="ndarray")
    i, j = pairs.T
    apart = (follower[i] != j) & (follower[j] != i) & drawn[i] & drawn[j]
    apart &= result.distance[line[i]] == result.distance[line[j]]
    i, j = i[apart], j[apart]
    size = float(np.linalg.norm(np.ptp(result.points, axis=0)))
    meets = _distances(starts[i], ends[i], starts[j], ends[j]) < _TOUCH * size
    return len(np.unique(np.concatenate([line[i[meets]], line[j[meets]]])))


def _segments(result: Result) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Starts and ends (m, 3), the polyline of each segment, and the segment that follows, -1 after the last."""
    offsets = np.concatenate([[0], np.cumsum(result.counts)])
    after = np.arange(1, offsets[-1] + 1)
    after[offsets[1:] - 1] = np.where(result.closed, offsets[:-1], -1)
    has = after >= 0
    number = np.where(has, np.cumsum(has) - 1, -1)
    follower = np.where(after[has] >= 0, number[after[has]], -1)
    line = np.repeat(np.arange(len(result.counts)), result.counts)[has]
    return result.points[has], result.points[after[has]], line, follower


def _distances(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The least distance (n,) of segments ab and cd, by their inner closest points and by their ends."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    area = uu * vv - uv * uv
    safe = np.where(area > 0, area, 1.0)
    s = np.clip(np.where(area > 0, (uv * vw - vv * uw) / safe, 0.0), 0, 1)[:, None]
    t = np.clip(np.where(area > 0, (uu * vw - uv * uw) / safe, 0.0), 0, 1)[:, None]
    inner = np.linalg.norm(w + s * u - t * v, axis=1)
    ends = [_to_segment(p, q, r) for p, q, r in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))]
    return np.minimum(inner, np.min(ends, axis=0))


def _to_segment(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    u, w = b - a, point - a
    part = np.clip(np.einsum("ij,ij->i", u, w) / np.maximum(np.einsum("ij,ij->i", u, u), 1e-300), 0, 1)
    return np.linalg.norm(w - part[:, None] * u, axis=1)
