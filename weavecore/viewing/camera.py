"""The camera: where the eye is, and where a point falls in the picture.

*Nearness* is 1 / (distance from the eye along the view): larger is nearer, and it varies linearly across the
picture of a plane, which the distance itself does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats

_EYE_DISTANCE = 3.6
"""Distance of the eye in radii of what is seen: near enough for depth, far enough not to distort."""


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
    """Right, up and towards the eye (3, 3); z is up, or y where the view runs along z."""
    back = direction / np.linalg.norm(direction)
    up = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def _project(points: Floats, axes: Floats, eye: Floats) -> tuple[Floats, Floats]:
    seen = (points - eye) @ axes.T
    nearness = -1.0 / seen[:, 2]
    return seen[:, :2] * nearness[:, None], nearness
