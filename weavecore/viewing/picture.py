"""Pictures: the shaded surface and the rods as PNG, by a z-buffer in NumPy.

    scene → camera → triangles, then rods into a z-buffer (2 × 2 samples a pixel) → colours · light · shade → PNG

A colour is tint · light, darkened beside nearer things (`weavecore.viewing.shading`).  While samples are drawn a colour
is one number, red, green and blue in ten bits each, so that the sum over the samples of a pixel is one sum too.
"""

from __future__ import annotations

import struct
import zlib
from functools import reduce
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

_SHIFTS = (0, 10, 20)
"""Bits below red, green and blue in a packed colour: the sum of four needs ten."""

Nearness = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Packed = NDArray[np.uint32]


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
    colours = np.repeat(_packed(background(samples[1])), samples[0])
    buffer = DepthBuffer(samples)
    _draw_surface(scene, camera, buffer, colours)
    radius = _visible_radius(scene, camera, samples[0])
    rods = see_rods(camera, scene.starts, scene.ends, radius)
    _draw_rods(scene, camera, rods, buffer, colours)
    shade = _shade(buffer.nearness, samples, scene.size, float(np.median(radius)) if len(radius) else scene.size)
    total = _by_pixel(colours, samples, np.add)
    shade /= _SAMPLES**2
    pixels = np.empty((height, width, 3), np.uint8)
    for channel, shift in enumerate(_SHIFTS):
        pixels[..., channel] = _as_bytes((total >> shift & 0x3FF).astype(np.float32) * shade)
    return pixels


def _draw_surface(scene: Scene, camera: Camera, buffer: DepthBuffer, colours: Packed) -> None:
    """Colour the samples in which the surface is visible."""
    if not scene.has_surface:
        return
    place, nearness = camera.project(scene.vertices)
    nearness = nearness / (1.0 + scene.set_back * nearness)
    corners = place[scene.triangles]
    draw_triangles(buffer, corners, nearness[scene.triangles])
    light, shows_outside = light_on_triangles(scene.vertices, scene.triangles, camera)
    plane = np.stack(planes_over(corners, light * 255), axis=1).astype(np.float32)
    ramps = _packed(np.concatenate([ramp(OUTSIDE), ramp(INSIDE), ramp(MARKED)]))
    tone = np.where(scene.is_marked, 2, np.where(shows_outside, 0, 1)) * 256
    for at, triangle, column, row in buffer.seen():
        of = plane[triangle]
        bright = of[:, 0] * column
        bright += of[:, 1] * row
        bright += of[:, 2]
        np.clip(bright, 0, 255, out=bright)
        colours[at] = ramps[tone[triangle] + bright.astype(np.int64)]


def _visible_radius(scene: Scene, camera: Camera, width: int) -> Floats:
    """(R,) the radius of each rod, neither too thin to be visible nor so thick that rods merge."""
    distance = float(np.linalg.norm(camera.eye - scene.vertices.mean(0)))
    pixel = width / 1600 * distance / camera.scale
    return np.clip(scene.radius, _LEAST_PIXELS * pixel, _MOST_PIXELS * pixel)


def _draw_rods(scene: Scene, camera: Camera, rods: SeenRods, buffer: DepthBuffer, colours: Packed) -> None:
    """Colour the samples in which a rod is visible in front of the surface."""
    buffer.forget_shapes()
    draw_rods(buffer, rods)
    tint = scene.colours.astype(np.float32)
    for at, rod, column, row in buffer.seen():
        _, off = rods.across(rod, column, row)
        light, gloss = light_on_rods(rods.axis[rod], off, camera)
        colours[at] = _packed(np.minimum(tint[rod] * light[:, None] + gloss[:, None], 255))


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


def _packed(values: NDArray[Any]) -> Packed:
    """Rounded colours (n, 3) from 0 to 255, each as one number."""
    rounded = np.rint(values).astype(np.uint32)
    packed: Packed = rounded[:, 0] << _SHIFTS[0] | rounded[:, 1] << _SHIFTS[1] | rounded[:, 2] << _SHIFTS[2]
    return packed


def _by_pixel(values: NDArray[Any], samples: tuple[int, int], join: Callable[..., Any]) -> NDArray[Any]:
    """Combine the values of each pixel's samples, (height, width)."""
    width, height = samples
    image = values.reshape(height, width)
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
