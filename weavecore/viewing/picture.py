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
from weavecore.viewing.raster import DepthBuffer, SeenTriangles, draw_rods, draw_triangles, planes_over, see_rods
from weavecore.viewing.scene import Pictured, Scene, scene_of
from weavecore.viewing.shading import (
    INSIDE,
    MARKED,
    OUTSIDE,
    Numbers,
    RodLight,
    background,
    darkening,
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


_PIXELS_AT_ONCE = 1 << 16
"""Pixels that are drawn at once: their samples lie in the processor's cache."""

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
    drawing = _Drawing(scene, look_at(scene.vertices, direction, samples, margin=_MARGIN), samples)
    total = np.empty((height, width), np.uint32)
    nearest = np.empty((height, width), np.float32)
    for rows in each(_bands(height, width)):
        total[rows], nearest[rows] = drawing.band(rows)
    radius = drawing.rods.model_radius
    shade = _shade(nearest, scene.size, float(np.median(radius)) if len(radius) else scene.size)
    shade /= _SAMPLES**2
    pixels = np.empty((height, width, 3), np.uint8)
    for channel, shift in enumerate(_SHIFTS):
        pixels[..., channel] = _as_bytes((total >> shift & 0x3FF).astype(np.float32) * shade)
    return pixels


def _bands(height: int, width: int) -> list[slice]:
    """Rows of pixels that are drawn at once."""
    n = max(_PIXELS_AT_ONCE // width, 1)
    return [slice(first, min(first + n, height)) for first in range(0, height, n)]


class _Drawing:
    """What is the same in all bands of a picture.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    samples : (int, int)
        Width and height in samples.
    """

    def __init__(self, scene: Scene, camera: Camera, samples: tuple[int, int]) -> None:
        self._samples = samples
        self._background = _packed(*background(samples[1]).T)
        self._triangles: Optional[SeenTriangles] = None
        if scene.has_surface:
            self._see_surface(scene, camera)
        radius = _visible_radius(scene, camera, samples[0])
        self.rods = see_rods(camera, scene.starts, scene.ends, radius, samples)
        self._light = RodLight(self.rods.axis, camera)
        self._tints = scene.colours.T.astype(np.float32)

    def _see_surface(self, scene: Scene, camera: Camera) -> None:
        place, nearness = camera.project(scene.vertices)
        nearness = nearness / (1.0 + scene.set_back * nearness)
        corners = place[scene.triangles]
        self._triangles = SeenTriangles(corners, nearness[scene.triangles], self._samples)
        light, shows_outside = light_on_triangles(scene.vertices, scene.triangles, camera)
        self._brightness = np.stack(planes_over(corners, light * 255), axis=1).astype(np.float32)
        self._tone = np.where(scene.is_marked, 2, np.where(shows_outside, 0, 1)) * 256

    def band(self, rows: slice) -> tuple[Packed, Nearness]:
        """Sum of the colours and greatest nearness of each pixel of some rows."""
        first, n_rows = rows.start * _SAMPLES, (rows.stop - rows.start) * _SAMPLES
        size = (self._samples[0], n_rows)
        buffer = DepthBuffer(size, first_row=first)
        colours = np.repeat(self._background[first : first + n_rows], size[0])
        if self._triangles is not None:
            draw_triangles(buffer, self._triangles)
            self._colour_surface(buffer, colours)
            buffer.forget_shapes()
        draw_rods(buffer, self.rods)
        self._colour_rods(buffer, colours)
        return _by_pixel(colours, size, np.add), _by_pixel(buffer.nearness, size, np.maximum)

    def _colour_surface(self, buffer: DepthBuffer, colours: Packed) -> None:
        """Colour the samples in which the surface is visible."""
        spans = buffer.seen()
        a, b, c = self._brightness[spans.shape].T
        bright = spans.spread(a) * spans.columns(np.float32)
        bright += spans.spread(b * (spans.row + 0.5).astype(np.float32))
        bright += spans.spread(c)
        np.clip(bright, 0, 255, out=bright)
        colours[spans.samples(buffer)] = _RAMPS[spans.spread(self._tone[spans.shape]) + bright.astype(np.int64)]

    def _colour_rods(self, buffer: DepthBuffer, colours: Packed) -> None:
        """Colour the samples in which a rod is visible in front of the surface."""
        spans = buffer.seen()
        light, gloss = self._light(spans, self.rods.across(spans)[1])
        tints = (spans.spread(tint[spans.shape]) for tint in self._tints)
        colours[spans.samples(buffer)] = _packed(*(np.minimum(tint * light + gloss, 255) for tint in tints))


def _visible_radius(scene: Scene, camera: Camera, width: int) -> Floats:
    """(R,) the radius of each rod, neither too thin to be visible nor so thick that rods merge."""
    distance = float(np.linalg.norm(camera.eye - scene.vertices.mean(0)))
    pixel = width / 1600 * distance / camera.scale
    return np.clip(scene.radius, _LEAST_PIXELS * pixel, _MOST_PIXELS * pixel)


def _shade(nearest: Nearness, size: float, radius: float) -> Numbers:
    """(height, width) the part of the light left at each pixel beside nearer things."""
    covered = nearest > 0
    distance = np.divide(1, nearest, out=np.zeros_like(nearest), where=covered)
    width = nearest.shape[1]
    scales = [(reach * width, step * size) for reach, step in _SHADES]
    return darkening(distance, covered, [*scales, (_ROD_SHADE[0] * width, _ROD_SHADE[1] * radius)])


def _as_bytes(values: NDArray[Any]) -> Bytes:
    """Rounded values from 0 to 255."""
    rounded: Bytes = np.rint(values).astype(np.uint8)
    return rounded


def _packed(*channels: NDArray[Any]) -> Packed:
    """Rounded colours from 0 to 255, red, green and blue each (n,), as one number each."""
    red, green, blue = (np.rint(channel).astype(np.uint32) for channel in channels)
    packed: Packed = red << _SHIFTS[0] | green << _SHIFTS[1] | blue << _SHIFTS[2]
    return packed


_RAMPS = _packed(*np.concatenate([ramp(OUTSIDE), ramp(INSIDE), ramp(MARKED)]).T)
"""Colours of the surface by tone and brightness."""


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
