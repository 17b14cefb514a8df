"""Pictures: the shaded surface and the rods as PNG, by a z-buffer in NumPy.

    scene → camera → triangles, then rods into a z-buffer (2 × 2 samples a pixel) → colours · light · shade → PNG

A colour is tint · light, darkened beside nearer things (`weavecore.viewing.shading`).
"""

from __future__ import annotations

import struct
import zlib
from functools import partial, reduce
from typing import Any, Callable, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.polling import each
from weavecore.viewing.camera import Camera, choose_view, look_at
from weavecore.viewing.raster import DepthBuffer, SeenRods, draw_rods, draw_triangles, planes_over, see_rods
from weavecore.viewing.scene import Pictured, Scene, scene_of
from weavecore.viewing.shading import (
    INSIDE,
    MARKED,
    OUTSIDE,
    Numbers,
    background,
    darkening,
    light_on_rods,
    light_on_triangles,
    ramp,
)

_SAMPLES = 2
"""Samples along each side of a pixel, whose mean smooths edges."""

_MARGIN = 0.06
"""Free part of the picture on each side."""

_SMALLEST, _LARGEST = 16, 8192
"""Range of width and height, in pixels."""

_SHADES = ((0.02, 0.22), (0.005, 0.22))
"""How far shades reach, in parts of the picture's width, and the step of full shade, in parts of the subject's size."""

_ROD_SHADE = (0.002, 5.0)
"""The same for the shade beside a rod, the step in radii of the rod."""

_PNG_COLOUR_TYPES = {3: 2, 4: 6}
"""Colour type by the count of channels: RGB and RGBA."""

_PNG_UP = 2
"""The filter that subtracts the byte above: best for pictures with smooth shades."""

_PNG_COMPRESSION = 3
"""zlib's level: the default one, 6, takes twice the time and saves a twentieth."""

_LEAST_PIXELS, _MOST_PIXELS = 0.6, 4.5
"""Least and greatest radius of a rod in a picture 1600 pixels wide: visible, with room between rods."""

Nearness = NDArray[np.float32]
Bytes = NDArray[np.uint8]


_ROWS_AT_ONCE = 100
"""Rows that are compressed at once, between two polls."""


def encode_picture(value: Pictured, *, size: tuple[int, int] = (1600, 1200), view: Optional[ArrayLike] = None) -> bytes:
    """Draw a stage's result as PNG; see `draw_pixels`.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    size : (int, int)
        Width and height in pixels.
    view : (3,) array_like, optional
        Direction from the surface to the eye.

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        For a size or a view that cannot be drawn.
    """
    return encode_png(draw_pixels(value, size=size, view=view))


def draw_pixels(
    value: Pictured, *, size: tuple[int, int] = (1600, 1200), view: Optional[ArrayLike] = None
) -> NDArray[np.uint8]:
    """Draw a stage's result.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    size : (int, int)
        Width and height in pixels.
    view : (3,) array_like, optional
        Direction from the surface to the eye, z up; where it is not given, the one from
        which most of the surface and its borders is visible.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    Unsupported
        For a size or a view that cannot be drawn.
    """
    width, height = _checked_size(size)
    scene = scene_of(value)
    direction = choose_view(scene.vertices, scene.triangles, scene.borders) if view is None else _checked_view(view)
    samples = (width * _SAMPLES, height * _SAMPLES)
    camera = look_at(scene.vertices, direction, samples, margin=_MARGIN)
    colours = np.repeat(_as_bytes(background(samples[1])), samples[0], axis=0)
    surface = _draw_surface(scene, camera, samples, colours)
    radius = _visible_radius(scene, camera, samples[0])
    rods = see_rods(camera, scene.starts, scene.ends, radius)
    nearness = _draw_rods(scene, camera, rods, colours, surface)
    shade = _shade(nearness, samples, scene.size, float(np.median(radius)) if len(radius) else scene.size)
    total = _by_pixel(colours, samples, partial(np.add, dtype=np.uint16))
    return _as_bytes(total * (shade / _SAMPLES**2)[..., None])


def _draw_surface(scene: Scene, camera: Camera, samples: tuple[int, int], colours: Bytes) -> DepthBuffer:
    """Colour the samples in which the surface is visible; return its z-buffer."""
    if not scene.has_surface:
        return DepthBuffer(samples)
    place, nearness = camera.project(scene.vertices)
    nearness = nearness / (1.0 + scene.set_back * nearness)
    corners = place[scene.triangles]
    buffer = DepthBuffer(samples)
    draw_triangles(buffer, corners, nearness[scene.triangles])
    light, shows_outside = light_on_triangles(scene.vertices, scene.triangles, camera)
    a, b, c = planes_over(corners, light * 255)
    tone = np.where(scene.is_marked, 2, np.where(shows_outside, 0, 1)) * 256
    ramps = _as_bytes(np.concatenate([ramp(OUTSIDE), ramp(INSIDE), ramp(MARKED)]))
    for at, triangle, column, row in buffer.seen():
        bright = a[triangle] * (column + 0.5) + b[triangle] * (row + 0.5) + c[triangle]
        colours[at] = ramps[tone[triangle] + np.clip(bright, 0, 255).astype(np.int64)]
    return buffer


def _visible_radius(scene: Scene, camera: Camera, width: int) -> Floats:
    """(R,) the radius of each rod, neither too thin to be visible nor so thick that rods merge."""
    distance = float(np.linalg.norm(camera.eye - scene.vertices.mean(0)))
    pixel = width / 1600 * distance / camera.scale
    return np.clip(scene.radius, _LEAST_PIXELS * pixel, _MOST_PIXELS * pixel)


def _draw_rods(scene: Scene, camera: Camera, rods: SeenRods, colours: Bytes, before: DepthBuffer) -> Nearness:
    """Colour the samples in which a rod is visible in front of the surface; return the nearness of both."""
    buffer = DepthBuffer((before.width, before.height), before=before.nearness)
    draw_rods(buffer, rods)
    tint = scene.colours.astype(np.float32)
    for at, rod, column, row in buffer.seen():
        _, off = rods.across(rod, column, row)
        light, gloss = light_on_rods(rods.axis[rod], off, camera)
        colours[at] = _as_bytes(np.minimum(tint[rod] * light[:, None] + gloss[:, None], 255))
    return buffer.nearness


def _shade(nearness: Nearness, samples: tuple[int, int], size: float, radius: float) -> Numbers:
    """(height, width) the part of the light left at each pixel beside nearer things."""
    nearest = _by_pixel(nearness, samples, np.maximum)
    covered = nearest > 0
    distance = np.divide(1, nearest, out=np.zeros_like(nearest), where=covered)
    width = samples[0] / _SAMPLES
    scales = [(reach * width, step * size) for reach, step in _SHADES]
    return darkening(distance, covered, [*scales, (_ROD_SHADE[0] * width, _ROD_SHADE[1] * radius)])


def _as_bytes(values: NDArray[Any]) -> Bytes:
    """Rounded values from 0 to 255."""
    rounded: Bytes = np.rint(values).astype(np.uint8)
    return rounded


def _by_pixel(values: NDArray[Any], samples: tuple[int, int], join: Callable[..., Any]) -> NDArray[Any]:
    """Combine the values of each pixel's samples: (height, width) or, of colours, (height, width, 3)."""
    width, height = samples
    image = values.reshape(height, width, *values.shape[1:])
    rows = reduce(join, [image[k::_SAMPLES] for k in range(_SAMPLES)])
    joined: NDArray[Any] = reduce(join, [rows[:, k::_SAMPLES] for k in range(_SAMPLES)])
    return joined


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    width, height = (int(n) for n in size)
    if not (_SMALLEST <= width <= _LARGEST and _SMALLEST <= height <= _LARGEST):
        raise Unsupported(
            f"A picture of {width} by {height} pixels cannot be drawn",
            remedy=f"Use a width and a height from {_SMALLEST} to {_LARGEST}.",
        )
    return width, height


def _checked_view(view: ArrayLike) -> Floats:
    direction = np.asarray(view, np.float64)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise Unsupported(f"The view must be a direction (got {view!r})", remedy="Use three finite numbers, not all 0.")
    return direction


def encode_png(pixels: NDArray[np.uint8]) -> bytes:
    """Write pixels as PNG, eight bits a channel.

    Parameters
    ----------
    pixels : (height, width, 3 or 4) uint8
        Red, green, blue and, with four channels, opacity; the top row first.

    Returns
    -------
    bytes
    """
    height, width, n_channels = pixels.shape
    rows = pixels.reshape(height, -1)
    above = np.concatenate([np.zeros_like(rows[:1]), rows[:-1]])
    filtered = np.concatenate([np.full((height, 1), _PNG_UP, np.uint8), rows - above], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, _PNG_COLOUR_TYPES[n_channels], 0, 0, 0)
    packer = zlib.compressobj(_PNG_COMPRESSION)
    parts = [packer.compress(part.tobytes()) for part in each(np.array_split(filtered, height // _ROWS_AT_ONCE + 1))]
    chunks = ((b"IHDR", header), (b"IDAT", b"".join(parts) + packer.flush()), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, body) for kind, body in chunks)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
