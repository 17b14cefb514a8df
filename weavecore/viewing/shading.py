"""Light: how bright a surface, a rod and the background are in a picture.

    light = ambient + diffuse · max(n · l, 0) + sky · (1 + n · up) / 2        with gloss · max(n · h, 0)^24 on rods

Depth is shown by unsharp masking of the depth buffer (Luft, Colditz and Deussen 2006): a pixel is darkened by how far
it lies behind the blurred depth around it.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Bools, Floats, Ints, unit_vectors
from weavecore.polling import each, poll
from weavecore.viewing.camera import Camera
from weavecore.viewing.raster import Spans

Colours = NDArray[np.float32]
Numbers = NDArray[np.floating[Any]]

_KEY = np.array([-0.45, 0.62, 0.64])
"""Direction to the key light in the camera's axes: from the left, above and before the subject."""

_GLOSS = np.array([-0.32, 0.45, 0.83])
"""Normal at which a rod reflects the light to the eye (the half vector of Blinn 1977)."""

_GLOSS_HEIGHT = 70
"""Greatest gloss in 0…255."""

_ROD_BASE, _ROD_GAIN = 0.35, 0.85
"""Light on rods is base + gain · light: their colours stay recognizable in the shade."""

_DEEPEST_SHADE = 0.45
"""Part of the light that is lost in full shade."""

_BLUR_REACH, _LEAST_COVER = 2.5, 1e-4
"""Reach of a blur in sigmas, and the least weight that a mean is divided by."""

_SIGMA_IN_PIXELS = 1.6
"""A blur is made on squares of pixels, so that its sigma is about so many of these."""

_AMBIENT, _DIFFUSE, _SKY = 0.30, 0.52, 0.18
"""Parts of the light: from everywhere, from the key light, and from the sky above; they sum to 1."""

_CREASE = np.cos(np.radians(35))
"""Faces that turn more than this from the mean about a vertex keep their own shade there."""

OUTSIDE = ((112, 106, 116), (196, 188, 180), (250, 246, 239))
INSIDE = ((84, 90, 108), (158, 166, 180), (214, 220, 228))
MARKED = ((138, 72, 88), (232, 176, 178), (255, 232, 228))
"""Colours of the surface from full shade to full light: warm white outside, cool white inside, rose in pockets."""

_SKY_TOP, _SKY_BOTTOM = (252, 252, 253), (228, 231, 236)
"""Colours of the background."""


def ramp(colours: tuple[tuple[int, int, int], ...]) -> Colours:
    """Interpolate between colours.

    Parameters
    ----------
    colours : sequence of (int, int, int)
        From full shade to full light.

    Returns
    -------
    (256, 3) float32
    """
    at = np.linspace(0, 1, len(colours))
    light = np.linspace(0, 1, 256)
    return np.stack([np.interp(light, at, channel) for channel in zip(*colours)], axis=1).astype(np.float32)


def light_on_triangles(vertices: Floats, triangles: Ints, camera: Camera) -> tuple[Floats, Bools]:
    """Light on triangles, smooth across them except at creases.

    Parameters
    ----------
    vertices : (V, 3) float64
    triangles : (T, 3) int64
    camera : Camera

    Returns
    -------
    light : (T, 3) float64
        At the corners, from 0 to 1.
    shows_outside : (T,) bool
        Whether the eye sees the outside of the triangle.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    smooth = np.zeros_like(vertices)
    for k in range(3):
        for axis in range(3):
            smooth[:, axis] += np.bincount(triangles[:, k], normal[:, axis], minlength=len(vertices))
    normal, smooth = unit_vectors(normal), unit_vectors(smooth)
    shows_outside = ((camera.eye - a) * normal).sum(1) >= 0
    at_corner = smooth[triangles]
    is_crease = (at_corner * normal[:, None]).sum(2) < _CREASE
    at_corner = np.where(is_crease[..., None], normal[:, None], at_corner)
    at_corner = np.where(shows_outside[:, None, None], at_corner, -at_corner)
    return _light_on(at_corner @ camera.axes.T, at_corner[..., 2]), shows_outside


class RodLight:
    """Light on samples of rods; round ends are lit as the tube beside them, so that bends of a polyline do not show.

    The normal at the distance q from the axis is q · side + sqrt(1 - q²) · towards the eye: each product of it with a
    direction is a number of the rod times q, and a number times the root.

    Parameters
    ----------
    axis : (n, 2) float64
        Unit direction of each rod in the picture, y down.
    camera : Camera
    """

    def __init__(self, axis: Floats, camera: Camera) -> None:
        # The picture's y runs down, the eye's runs up.
        side = -axis[:, ::-1]
        directions = np.stack([_KEY / np.linalg.norm(_KEY), camera.axes[:, 2], _GLOSS])
        aside = directions[:, 0, None] * side[:, 0] + directions[:, 1, None] * side[:, 1]
        self._aside = np.ascontiguousarray(aside.T, np.float32)
        self._towards = directions[:, 2].astype(np.float32)

    def __call__(self, spans: Spans, off: Numbers) -> tuple[Numbers, Numbers]:
        """Light from 0 to 1 and gloss from 0 to 255 (n,), at signed distances (n,) from the axes, in radii."""
        off = np.clip(off, -1, 1)
        front = np.sqrt(1 - off * off)
        aside = map(spans.spread, self._aside[spans.shape].T)
        key, up, gloss = (one * off + towards * front for one, towards in zip(aside, self._towards))
        light = _AMBIENT + _DIFFUSE * np.maximum(key, 0) + _SKY * (0.5 + 0.5 * up)
        return _ROD_BASE + _ROD_GAIN * light, _GLOSS_HEIGHT * _sharpened(np.maximum(gloss, 0))


def _sharpened(gloss: Numbers) -> Numbers:
    """The 24th power, by products."""
    cube = gloss * gloss * gloss
    for _ in range(3):
        cube *= cube
    return cube


def _light_on(normal: Floats, upward: Floats) -> Floats:
    """Light from 0 to 1 on normals (…, 3) in the camera's axes; ``upward`` (…,) is their component along z."""
    key = np.maximum(normal @ (_KEY / np.linalg.norm(_KEY)), 0)
    light: Floats = _AMBIENT + _DIFFUSE * key + _SKY * (0.5 + 0.5 * upward)
    return light


def background(height: int) -> Colours:
    """Colours of the background.

    Parameters
    ----------
    height : int
        Rows of the picture.

    Returns
    -------
    (height, 3) float32
        From the top row down.
    """
    part = np.linspace(0, 1, height)[:, None]
    return (np.array(_SKY_TOP) * (1 - part) + np.array(_SKY_BOTTOM) * part).astype(np.float32)


def darkening(distance: Numbers, covered: Bools, scales: Iterable[tuple[float, float]]) -> Numbers:
    """How much light reaches places that lie behind their neighbours in the picture.

    Parameters
    ----------
    distance : (height, width) float32
        From the eye.
    covered : (height, width) bool
        Whether a pixel shows anything.
    scales : pairs of float
        Sigma of the blur in pixels, and the step in distance that gives full shade.

    Returns
    -------
    (height, width) float32
        From 1 - `_DEEPEST_SHADE` to 1.
    """
    shade = np.zeros_like(distance)
    for sigma, step_of_full_shade in each(scales):
        # A blur needs only a few pixels for each sigma.
        step = max(round(sigma / _SIGMA_IN_PIXELS), 1)
        weight = _blurred(_block_sums(covered.astype(np.float32), step), sigma / step)
        total = _blurred(_block_sums(np.where(covered, distance, 0), step), sigma / step)
        mean = total / np.maximum(weight, _LEAST_COVER)
        behind = (distance - _enlarged(mean, step, distance.shape)) / step_of_full_shade
        shade += np.clip(behind, 0, 1)
    light: Numbers = np.where(covered, 1 - _DEEPEST_SHADE * np.minimum(shade, 1), 1)
    return light


def _block_sums(image: Numbers, step: int) -> Numbers:
    """Sums over squares of ``step`` by ``step`` pixels, less at the far edges."""
    for _ in range(2):
        total = image[::step].copy()
        for k in range(1, step):
            rows = image[k::step]
            total[: len(rows)] += rows
        image = total.T
    return image


def _blurred(image: Numbers, sigma: float) -> Numbers:
    """The image convolved with a Gaussian, cut off at `_BLUR_REACH` sigmas and mirrored at its edges.

    SciPy's filter does the same, but its package takes longer to load than a picture to blur.
    """
    reach = int(_BLUR_REACH * sigma + 0.5)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    taps /= taps.sum()
    for axis in (0, 1):
        width = image.shape[axis]
        padded = np.pad(image, [(reach, reach) if k == axis else (0, 0) for k in (0, 1)], mode="symmetric")
        parts = (padded[k : k + width] if axis == 0 else padded[:, k : k + width] for k in range(len(taps)))
        image = reduce(np.add, (np.float32(tap) * part for tap, part in zip(taps, parts)))
    return image


def _enlarged(image: Numbers, step: int, shape: tuple[int, ...]) -> Numbers:
    """The image of squares of ``step`` by ``step`` pixels, interpolated linearly between their middles."""
    tall = np.empty((shape[0], image.shape[1]), image.dtype)
    _stretch(image, tall, step)
    whole = np.empty(shape, image.dtype)
    _stretch(tall.T, whole.T, step)
    return whole


def _stretch(rows: Numbers, out: Numbers, step: int) -> None:
    """Write rows of the means of ``step`` pixels as rows of pixels."""
    poll()
    before, stop = step // 2, step // 2 + (len(rows) - 1) * step  # Pixels to the first middle, and to the last.
    out[:before], out[stop:] = rows[:1], rows[-1:]
    for k in range(step):
        part = np.float32((k + before - (step - 1) / 2) / step)
        between = out[before + k : stop : step]
        np.multiply(rows[: len(between)], 1 - part, out=between)
        between += rows[1 : len(between) + 1] * part
