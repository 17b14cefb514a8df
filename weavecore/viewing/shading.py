"""Light: how bright a surface, a rod and the background are in a picture."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.viewing.camera import Camera

Colours = NDArray[np.float32]
Numbers = NDArray[np.floating[Any]]

_KEY = np.array([-0.45, 0.62, 0.64])
"""Where the light comes from, seen by the eye: from the left, above and before the subject."""

_GLOSS = np.array([-0.32, 0.45, 0.83])
"""Where a rod's surface looks when it mirrors the light to the eye."""

_GLOSS_HEIGHT, _GLOSS_SHARPNESS = 70, 24
_DEEPEST_SHADE = 0.45

_AMBIENT, _DIFFUSE, _SKY = 0.30, 0.52, 0.18
_CREASE = np.cos(np.radians(35))
"""Faces that turn more than this from the mean about a vertex keep their own shade there."""

# From full shade to full light: warm paper outside, cool paper inside, rose in pockets.
OUTSIDE = ((112, 106, 116), (196, 188, 180), (250, 246, 239))
INSIDE = ((84, 90, 108), (158, 166, 180), (214, 220, 228))
MARKED = ((138, 72, 88), (232, 176, 178), (255, 232, 228))
_SKY_TOP, _SKY_BOTTOM = (252, 252, 253), (228, 231, 236)


def ramp(colours: tuple[tuple[int, int, int], ...]) -> Colours:
    """256 colours from full shade to full light."""
    at = np.linspace(0, 1, len(colours))
    light = np.linspace(0, 1, 256)
    return np.stack([np.interp(light, at, channel) for channel in zip(*colours)], axis=1).astype(np.float32)


def light_on_triangles(vertices: Floats, triangles: Ints, camera: Camera) -> tuple[Floats, Bools]:
    """Light (T, 3) in 0…1 at the corners, and whether each triangle shows its outside to the eye."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    smooth = np.zeros_like(vertices)
    for k in range(3):
        for axis in range(3):
            smooth[:, axis] += np.bincount(triangles[:, k], normal[:, axis], minlength=len(vertices))
    normal, smooth = _unit(normal), _unit(smooth)
    shows_outside = ((camera.eye - a) * normal).sum(1) >= 0
    at_corner = smooth[triangles]
    is_crease = (at_corner * normal[:, None]).sum(2) < _CREASE
    at_corner = np.where(is_crease[..., None], normal[:, None], at_corner)
    at_corner = np.where(shows_outside[:, None, None], at_corner, -at_corner)
    return light_on(at_corner @ camera.axes.T, at_corner[..., 2]), shows_outside


def light_on_rods(axis: Floats, off: Numbers, camera: Camera) -> tuple[Floats, Floats]:
    """Light (n,) and gloss (n,), in 0…255, on rods ``off`` the axis (n, 2) in the picture by a part of the radius.

    The round ends are lit as the tube beside them, so that a bend of a polyline does not show.
    """
    off = np.clip(off, -1, 1)
    # The picture's y runs down, the eye's runs up.
    normal = np.stack([-axis[:, 1] * off, -axis[:, 0] * off, np.sqrt(1 - off * off)], axis=1)
    gloss: Floats = _GLOSS_HEIGHT * np.maximum(normal @ _GLOSS, 0) ** _GLOSS_SHARPNESS
    return 0.35 + 0.85 * light_on(normal, normal @ camera.axes[:, 2]), gloss


def light_on(normal: Floats, upward: Floats) -> Floats:
    """Light in 0…1 on normals (…, 3) as the eye sees them; ``upward`` is how much they face the sky."""
    key = np.maximum(normal @ (_KEY / np.linalg.norm(_KEY)), 0)
    light: Floats = _AMBIENT + _DIFFUSE * key + _SKY * (0.5 + 0.5 * upward)
    return light


def background(height: int) -> Colours:
    """Colours (height, 3) from the top of the picture to its bottom."""
    part = np.linspace(0, 1, height)[:, None]
    return (np.array(_SKY_TOP) * (1 - part) + np.array(_SKY_BOTTOM) * part).astype(np.float32)


def darkening(distance: Numbers, covered: Bools, scales: Iterable[tuple[float, float]]) -> Numbers:
    """How much light (height, width) reaches places that lie behind what is beside them in the picture.

    Luft, Colditz and Deussen 2006: unsharp masking of the depth buffer.

    Parameters
    ----------
    distance : (height, width) float32
        From the eye.
    covered : (height, width) bool
        Where there is anything.
    scales : pairs of float
        How far a shade reaches, in pixels, and the step in distance that gives a full one.
    """
    shade = np.zeros_like(distance)
    for sigma, step_of_full_shade in scales:
        # A blur needs no more pixels than a few for each sigma.
        step = max(int(sigma / 2), 1)
        weight = gaussian_filter(covered[::step, ::step].astype(np.float32), sigma / step, truncate=2.5)
        total = gaussian_filter(np.where(covered, distance, 0)[::step, ::step], sigma / step, truncate=2.5)
        mean = total / np.maximum(weight, 1e-4)
        behind = (distance - _enlarged(mean, step, distance.shape)) / step_of_full_shade
        shade += np.clip(behind, 0, 1)
    light: Numbers = np.where(covered, 1 - _DEEPEST_SHADE * np.minimum(shade, 1), 1)
    return light


def _enlarged(image: Numbers, step: int, shape: tuple[int, ...]) -> Numbers:
    """The image of every ``step``-th pixel drawn out to all of them, linearly."""
    for axis in (0, 1):
        at = np.minimum(np.arange(shape[axis], dtype=np.float32) / step, image.shape[axis] - 1)
        low = np.minimum(at.astype(np.int64), image.shape[axis] - 2)
        part = np.expand_dims(at - low, 1 - axis)
        image = np.take(image, low, axis) * (1 - part) + np.take(image, low + 1, axis) * part
    return image


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(float).tiny)
    return unit
