"""Choosing a view: the direction from which most of a surface and of its borders is seen."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.viewing.camera import view_axes

_N_SAMPLES = 6000
_CELLS = 64
_AZIMUTHS, _ELEVATIONS = 24, (12.0, 22.0, 32.0, 44.0, 58.0, 75.0)
_HOME = (-60.0, 30.0)
"""Azimuth and elevation of Rhino's own perspective view, in degrees: what is nearest to it wins among equals."""

_BORDER_WEIGHT = 0.35
_FULLY_SEEN = 0.4
"""From this cosine between normal and view on, a patch counts as seen from the front."""


def choose_view(vertices: Floats, faces: Ints, borders: Floats) -> Floats:
    """Direction (3,) from the surface to the eye.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    borders : (n, 3) float64
        Points of the borders: openings are worth seeing.
    """
    points, normals = _spread_points(vertices, faces)
    openings = borders[np.linspace(0, len(borders) - 1, min(len(borders), _N_SAMPLES // 4)).astype(int)]
    directions, preference = _candidates()
    scores = [_score(points, normals, openings, direction) for direction in directions]
    best: Floats = directions[int(np.argmax(np.array(scores) * preference))]
    return best


def _candidates() -> tuple[Floats, Floats]:
    azimuth, elevation = np.meshgrid(
        _HOME[0] + np.arange(_AZIMUTHS) * 360.0 / _AZIMUTHS, np.array(_ELEVATIONS), indexing="ij"
    )
    preference = np.exp(-(((elevation - _HOME[1]) / 40.0) ** 2)) * (1 + 0.04 * np.cos(np.radians(azimuth - _HOME[0])))
    a, e = np.radians(azimuth.ravel()), np.radians(elevation.ravel())
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1), preference.ravel()


def _spread_points(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Points spread evenly over the area, and the unit normals there."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    total = np.cumsum(area)
    k = np.arange(_N_SAMPLES)
    face = np.minimum(np.searchsorted(total, (k + 0.5) / _N_SAMPLES * total[-1]), len(faces) - 1)
    # The additive recurrence of the plastic number fills the unit square evenly.
    u, v = (0.5 + k * 0.7548776662466927) % 1, (0.5 + k * 0.5698402909980532) % 1
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    points = a[face] + (b - a)[face] * u[:, None] + (c - a)[face] * v[:, None]
    return points, normal[face] / np.maximum(area[face], np.finfo(float).tiny)[:, None]


def _score(points: Floats, normals: Floats, openings: Floats, direction: Floats) -> float:
    seen, seen_openings = _visible(points, openings, direction)
    facing = np.minimum(np.abs(normals @ direction) / _FULLY_SEEN, 1.0)
    score = float((facing * seen).mean())
    if len(openings):
        score += _BORDER_WEIGHT * float(seen_openings.mean())
    return score


def _visible(points: Floats, openings: Floats, direction: Floats) -> tuple[Bools, Bools]:
    """Which points, and which of the borders', have no other point before them, by a coarse z-buffer."""
    seen = np.concatenate([points, openings]) @ view_axes(direction).T
    low = seen.min(0)
    cell_size = max(float(np.ptp(seen[:, :2], axis=0).max()), np.finfo(float).tiny) / _CELLS
    column, row = ((seen[:, :2] - low[:2]) / cell_size).astype(int).T
    cell = row * (_CELLS + 1) + column
    front = np.full((_CELLS + 1) ** 2, -np.inf)
    np.maximum.at(front, cell[: len(points)], seen[: len(points), 2])
    is_seen = seen[:, 2] > front[cell] - 2 * cell_size
    return is_seen[: len(points)], is_seen[len(points) :]
