"""The camera: projection of points into the picture, and the choice of a view.

A point p is seen at v = A (p - eye), A the axes of the camera in rows; its *nearness* is 1 / depth = -1 / v_z, and its
place (v_x, v_y) · nearness.  Nearness varies linearly across the picture of a plane, which depth does not.

The view is the one of 144 directions from which most of the surface and of its borders is visible, by a coarse
z-buffer: first by few points from all of them, then by many from the best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, cross, face_vectors, unit_vectors
from weavecore.polling import each

_EYE_DISTANCE = 3.6
"""Distance of the eye in radii of what is seen: near enough for depth, far enough not to distort."""

_N_SAMPLES = 6000
"""Points on the surface by which directions of view are rated."""

_CELLS = 64
"""Cells along a side of the z-buffer for that rating."""

_FEW, _LIKELY = 8, 12
"""All directions are rated by every so many-th point, and so many of the best then by all points."""

_AZIMUTHS, _ELEVATIONS = 24, (12.0, 22.0, 32.0, 44.0, 58.0, 75.0)
"""Directions tried: so many around, at these degrees above the horizon."""

_HOME = (-60.0, 30.0)
"""Azimuth and elevation of Rhino's perspective view, in degrees: among equals the nearest to it wins."""

_ELEVATION_SPREAD, _AZIMUTH_PREFERENCE = 40.0, 0.04
"""How fast the preference for these falls with elevation (degrees), and how much it changes with azimuth."""

_BORDER_WEIGHT = 0.35
"""Weight of the visible part of the borders against that of the surface."""

_FULLY_SEEN = 0.4
"""From this cosine between normal and view on, a patch counts as seen from the front."""

_STRAIGHT_DOWN = 0.999
"""From this cosine between view and z axis on, y is up in the picture."""

_R2_SEQUENCE = (0.7548776662466927, 0.5698402909980532)
"""1/ρ and 1/ρ² of the plastic number ρ: their multiples fill the unit square evenly (Roberts 2018)."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective camera.

    Parameters
    ----------
    axes : (3, 3) float64
        Rows: to the right, up, and from the subject towards the eye.
    eye : (3,) float64
    scale : float
        Samples that a unit length covers at nearness 1.
    shift : (2,) float64
        Where the axis of the view meets the picture, in samples.
    """

    axes: Floats
    eye: Floats
    scale: float
    shift: Floats

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Place (n, 2) in samples, x to the right and y down, and nearness (n,) of points (n, 3)."""
        plane, nearness = _project(points, self.axes, self.eye)
        return plane * (self.scale, -self.scale) + self.shift, nearness


def look_at(points: Floats, direction: Floats, size: tuple[int, int], *, margin: float) -> Camera:
    """The camera that looks against ``direction`` and fits the points into ``size`` samples.

    Parameters
    ----------
    points : (n, 3) float64
    direction : (3,) float64
        From the points to the eye.
    size : (int, int)
        Width and height.
    margin : float
        Part of each dimension that stays free on each side.
    """
    axes = view_axes(direction)
    low, high = points.min(0), points.max(0)
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(points - centre, axis=1).max()), np.finfo(float).tiny)
    eye = centre + axes[2] * radius * _EYE_DISTANCE
    plane, _ = _project(points, axes, eye)
    low, high = plane.min(0), plane.max(0)
    room = np.array(size) * (1 - 2 * margin)
    scale = float(np.min(room / np.maximum(high - low, 1e-12)))
    shift = np.array(size) / 2 - (low + high) / 2 * (scale, -scale)
    return Camera(axes, eye, scale, shift)


def view_axes(direction: Floats) -> Floats:
    """The axes of a camera; z is up in the picture, or y where the view runs along z.

    Parameters
    ----------
    direction : (3,) float64
        From the subject to the eye.

    Returns
    -------
    (3, 3) float64
        Rows: right, up, and towards the eye.
    """
    back = direction / np.linalg.norm(direction)
    up = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < _STRAIGHT_DOWN else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def _project(points: Floats, axes: Floats, eye: Floats) -> tuple[Floats, Floats]:
    seen = (points - eye) @ axes.T
    nearness = -1.0 / seen[:, 2]
    return seen[:, :2] * nearness[:, None], nearness


def choose_view(vertices: Floats, faces: Ints, borders: Floats) -> Floats:
    """Choose the direction from which most of a surface and of its borders is visible.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    borders : (n, 3) float64
        Points of the borders.

    Returns
    -------
    (3,) float64
        From the surface to the eye.
    """
    points, normals = _spread_points(vertices, faces)
    openings = borders[np.linspace(0, len(borders) - 1, min(len(borders), _N_SAMPLES // 4)).astype(int)]
    directions, preference = _candidates()
    few, few_openings = slice(None, None, _FEW), openings[::_FEW]
    rough = [_score(points[few], normals[few], few_openings, direction, _CELLS // 2) for direction in each(directions)]
    likely = np.sort(np.argsort(-np.array(rough) * preference, kind="stable")[:_LIKELY])
    scores = [_score(points, normals, openings, direction, _CELLS) for direction in each(directions[likely])]
    best: Floats = directions[likely[int(np.argmax(np.array(scores) * preference[likely]))]]
    return best


def _candidates() -> tuple[Floats, Floats]:
    """(n, 3) unit directions that are tried, and the preference (n,) for each."""
    azimuth, elevation = np.meshgrid(
        _HOME[0] + np.arange(_AZIMUTHS) * 360.0 / _AZIMUTHS, np.array(_ELEVATIONS), indexing="ij"
    )
    preference = np.exp(-(((elevation - _HOME[1]) / _ELEVATION_SPREAD) ** 2)) * (
        1 + _AZIMUTH_PREFERENCE * np.cos(np.radians(azimuth - _HOME[0]))
    )
    a, e = np.radians(azimuth.ravel()), np.radians(elevation.ravel())
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1), preference.ravel()


def _spread_points(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Points spread evenly over the area, and the unit normals there."""
    areas = [np.linalg.norm(face_vectors(vertices, faces[k]), axis=1) for k in blocks(len(faces))]
    total = np.cumsum(np.concatenate(areas))
    k = np.arange(_N_SAMPLES)
    face = np.minimum(np.searchsorted(total, (k + 0.5) / _N_SAMPLES * total[-1]), len(faces) - 1)
    u, v = (0.5 + k * _R2_SEQUENCE[0]) % 1, (0.5 + k * _R2_SEQUENCE[1]) % 1
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    a, b, c = (vertices[faces[face, k]] for k in range(3))
    points = a + (b - a) * u[:, None] + (c - a) * v[:, None]
    return points, unit_vectors(cross(b - a, c - a))


def _score(points: Floats, normals: Floats, openings: Floats, direction: Floats, cells: int) -> float:
    seen, seen_openings = _visible(points, openings, direction, cells)
    facing = np.minimum(np.abs(normals @ direction) / _FULLY_SEEN, 1.0)
    score = float((facing * seen).mean())
    if len(openings):
        score += _BORDER_WEIGHT * float(seen_openings.mean())
    return score


def _visible(points: Floats, openings: Floats, direction: Floats, cells: int) -> tuple[Bools, Bools]:
    """Which points, and which of the borders, have no other point before them, by a z-buffer so many cells wide."""
    seen = np.concatenate([points, openings]) @ view_axes(direction).T
    low = seen.min(0)
    cell_size = max(float(np.ptp(seen[:, :2], axis=0).max()), np.finfo(float).tiny) / cells
    column, row = ((seen[:, :2] - low[:2]) / cell_size).astype(int).T
    cell = row * (cells + 1) + column
    front = np.full((cells + 1) ** 2, -np.inf)
    np.maximum.at(front, cell[: len(points)], seen[: len(points), 2])
    is_seen = seen[:, 2] > front[cell] - 2 * cell_size
    return is_seen[: len(points)], is_seen[len(points) :]
