"""A z-buffer in NumPy: which triangle and which rod is visible at each sample of a picture.

Samples lie at half-integer places, x to the right and y down.  A *span* is the run of samples of one row that a shape
covers. All shapes are divided into spans at once, and a picture is drawn in *bands* of rows, whose buffer stays in the
processor's cache: the spans of a band are divided into samples, and each sample keeps the shape of the greatest
*nearness*, 1 / depth, which is linear across a triangle.  O(samples covered).

A rod is a segment with round ends, drawn as a tube: a sample at the distance q of its line (in radii) lies sqrt(1 - q²)
radii in front of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import each, poll
from weavecore.viewing.camera import Camera

Nearness = NDArray[np.float32]
Floats32 = NDArray[np.float32]
Shapes = NDArray[np.int32]

NOTHING = -1
"""In place of the shape of a sample where none is visible."""

_CHUNK = 1 << 18
"""Samples worked on at a time, as many as the processor's cache holds."""

_RODS_AT_ONCE = 1 << 15
"""Rods whose spans are found at a time, between two polls."""

_LIFT = 0.6
"""How many radii a rod is moved towards the eye, so that the surface it lies on does not hide its edge."""

_LEAST_LENGTH = 1e-6
"""Shortest rod, in samples: shorter ones have no direction."""

_LEVEL = 1e-9
"""A rod whose direction rises less than this, as a sine, is horizontal in the picture."""


class DepthBuffer:
    """The nearest shape at each sample of a band of rows.

    Parameters
    ----------
    size : (int, int)
        Width and height in samples.
    first_row : int
        Row of the picture at which the band begins.

    Attributes
    ----------
    nearness : (height * width,) float32
        0 where nothing is.
    shape : (height * width,) int32
        The visible shape, or `NOTHING`.
    """

    def __init__(self, size: tuple[int, int], *, first_row: int = 0) -> None:
        self.width, self.height = size
        self.first_row = first_row
        n = self.width * self.height
        self.nearness: Nearness = np.zeros(n, np.float32)
        self.shape: Shapes = np.full(n, NOTHING, np.int32)

    def forget_shapes(self) -> None:
        """Keep the nearness alone: of what is drawn from now on only what is nearer is visible."""
        self.shape.fill(NOTHING)

    def put(self, at: Ints, shape: Shapes, near: Nearness) -> None:
        """Keep the nearest shape of each sample; all arrays (n,)."""
        np.maximum.at(self.nearness, at, near)
        wins = near >= self.nearness[at]
        self.shape[at[wins]] = shape[wins]

    def seen(self) -> Spans:
        """Where shapes are visible."""
        begins = np.ones(len(self.shape), np.bool_)
        np.not_equal(self.shape[1:], self.shape[:-1], out=begins[1:])
        begins[:: self.width] = True
        start = np.flatnonzero(begins)
        count = np.diff(start, append=len(self.shape))
        some = self.shape[start] != NOTHING
        start, count = start[some], count[some]
        row = start // self.width
        return Spans(self.shape[start], row + self.first_row, start - row * self.width, count)


@dataclass(frozen=True, eq=False)
class SeenRods:
    """Rods in the picture; lengths in samples.

    Parameters
    ----------
    start : (n, 2) float64
    axis : (n, 2) float64
        Unit vector from the start to the end.
    length : (n,) float64
    radius : (n,) float64
    nearness : (n, 2) float64
        At the start and at the end.
    model_radius : (n,) float64
        In the model's unit.
    size : (int, int)
        Width and height of the picture.
    """

    start: Floats
    axis: Floats
    length: Floats
    radius: Floats
    nearness: Floats
    model_radius: Floats
    size: tuple[int, int]

    def across(self, spans: Spans) -> tuple[Floats32, Floats32]:
        """How far samples lie from the start along the axis, and from the axis to its left, both in radii."""
        x0, y0, a, b = self._frames[spans.shape].T
        x, y = spans.columns(np.float32) - spans.spread(x0), (spans.row + 0.5).astype(np.float32) - y0
        return spans.spread(a) * x + spans.spread(b * y), spans.spread(a * y) - spans.spread(b) * x

    @cached_property
    def _frames(self) -> Floats32:
        """(n, 4) start and direction over radius."""
        return np.hstack([self.start, self.axis / self.radius[:, None]]).astype(np.float32)

    @cached_property
    def depths(self) -> Floats32:
        """(n, 4) length in radii, nearness at the start, what it gains in a radius, and the radius in the model."""
        slope = (self.nearness[:, 1] - self.nearness[:, 0]) * self.radius / self.length
        columns = (self.length / self.radius, self.nearness[:, 0], slope, self.model_radius)
        return np.stack(columns, axis=1).astype(np.float32)

    @cached_property
    def spans(self) -> Spans:
        """The samples that may be covered."""
        parts = []
        for first in each(range(0, len(self.start), _RODS_AT_ONCE)):
            part = slice(first, first + _RODS_AT_ONCE)
            some = _rod_spans(self.start[part], self.axis[part], self.length[part], self.radius[part], self.size)
            parts.append(replace(some, shape=some.shape + np.int32(first)))
        return _by_rows(parts)


@dataclass(frozen=True, eq=False)
class SeenTriangles:
    """Triangles in the picture.

    Parameters
    ----------
    place : (T, 3, 2) float64
        Corners in samples.
    nearness : (T, 3) float64
        Of the corners.
    size : (int, int)
        Width and height of the picture.
    """

    place: Floats
    nearness: Floats
    size: tuple[int, int]

    @cached_property
    def plane(self) -> Floats:
        """(T, 3) nearness as a linear function; in float64, for those of triangles seen edge-on are steep."""
        return np.stack(planes_over(self.place, self.nearness), axis=1)

    @cached_property
    def spans(self) -> Spans:
        """The samples that are covered."""
        return _by_rows([_triangle_spans(self.place, self.size)])


def draw_triangles(buffer: DepthBuffer, triangles: SeenTriangles) -> None:
    """Draw triangles; a shape is the index of a triangle.

    Parameters
    ----------
    buffer : DepthBuffer
    triangles : SeenTriangles
    """
    for spans in each(triangles.spans.within(buffer)):
        a, b, c = triangles.plane[spans.shape].T
        near = spans.spread(a) * spans.columns(np.float64)
        near += spans.spread(b * (spans.row + 0.5))
        near += spans.spread(c)
        buffer.put(spans.samples(buffer), spans.spread(spans.shape), near.astype(np.float32))


def planes_over(place: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Linear functions over triangles, a x + b y + c.

    Parameters
    ----------
    place : (T, 3, 2) float64
        Corners in samples.
    values : (T, 3) float64
        Values of the function there.

    Returns
    -------
    a, b, c : (T,) float64
    """
    (x0, y0), (x1, y1), (x2, y2) = (place[:, k].T for k in range(3))
    twice_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    d1, d2 = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    safe = np.where(twice_area == 0, 1.0, twice_area)
    a = (d1 * (y2 - y0) - d2 * (y1 - y0)) / safe
    b = (d2 * (x1 - x0) - d1 * (x2 - x0)) / safe
    return a, b, values[:, 0] - a * x0 - b * y0


def see_rods(camera: Camera, starts: Floats, ends: Floats, radius: Floats, size: tuple[int, int]) -> SeenRods:
    """Project rods into the picture.

    Parameters
    ----------
    camera : Camera
    starts, ends : (n, 3) float64
    radius : (n,) float64
        In the model's unit.
    size : (int, int)
        Width and height of the picture.

    Returns
    -------
    SeenRods
    """
    place, nearness = camera.project(np.concatenate([starts, ends]))
    poll()
    start, end = place[: len(starts)], place[len(starts) :]
    both = np.stack([nearness[: len(starts)], nearness[len(starts) :]], axis=1)
    length = np.maximum(np.linalg.norm(end - start, axis=1), _LEAST_LENGTH)
    # Segments are short against the distance of the eye: one radius holds for all of each.
    axis = (end - start) / length[:, None]
    return SeenRods(start, axis, length, radius * camera.scale * both.mean(1), both, radius, size)


def draw_rods(buffer: DepthBuffer, rods: SeenRods) -> None:
    """Draw rods; a shape is the index of a rod.

    Parameters
    ----------
    buffer : DepthBuffer
    rods : SeenRods
    """
    for spans in each(rods.spans.within(buffer)):
        along, off = rods.across(spans)
        reach, first, slope, lift = rods.depths[spans.shape].T
        beside = np.clip(along, 0, spans.spread(reach))
        squared = (along - beside) ** 2 + off * off
        inside = squared <= 1
        near = spans.spread(first) + spans.spread(slope) * beside
        towards = spans.spread(lift) * (_LIFT + np.sqrt(np.maximum(1 - squared, 0)))
        near /= 1 - near * towards
        buffer.put(spans.samples(buffer)[inside], spans.spread(spans.shape)[inside], near[inside])


@dataclass(frozen=True, eq=False)
class Spans:
    """Runs of samples (s,) in the order of their rows: the shape of each, row, first column and count of columns."""

    shape: Shapes
    row: Ints
    first: Ints
    count: Ints

    def within(self, buffer: DepthBuffer) -> Iterator[Spans]:
        """Those of a band of rows, in chunks."""
        start, stop = np.searchsorted(self.row, [buffer.first_row, buffer.first_row + buffer.height]).tolist()
        total = np.cumsum(self.count[start:stop])
        n_samples = int(total[-1]) if len(total) else 0
        cuts = start + np.searchsorted(total, np.arange(_CHUNK, n_samples, _CHUNK), side="right")
        ends = np.unique([start, *cuts, stop]).tolist()
        for part in map(slice, ends, ends[1:]):
            yield Spans(self.shape[part], self.row[part], self.first[part], self.count[part])

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the spans (s,), for each of their samples."""
        return np.repeat(values, self.count)

    def columns(self, kind: type[np.floating[Any]]) -> NDArray[Any]:
        """Place of each sample to the right."""
        return self._from(self.first + 0.5).astype(kind)

    def samples(self, buffer: DepthBuffer) -> Ints:
        """Index of each sample in a buffer."""
        return self._from((self.row - buffer.first_row) * buffer.width + self.first)

    def _from(self, first: NDArray[Any]) -> NDArray[Any]:
        """Numbers that rise by one along each span."""
        numbers = self.spread(first - (np.cumsum(self.count) - self.count))
        numbers += np.arange(len(numbers))
        return numbers


def _by_rows(parts: list[Spans]) -> Spans:
    """Spans end to end, in the order of their rows; those of one row keep theirs."""
    if not parts:
        return Spans(np.zeros(0, np.int32), *np.zeros((3, 0), np.int64))
    shape, row, first, count = (np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Spans))
    order = np.argsort(row.astype(np.int16), kind="stable")  # By radix; no picture is higher.
    return Spans(shape[order], row[order], first[order], count[order])


def _triangle_spans(place: Floats, size: tuple[int, int]) -> Spans:
    """Spans of triangles: an edge that rises, taken counter-clockwise, bounds them on the right."""
    x, y = place[..., 0], place[..., 1]
    width, height = size
    shape, row = _rows_between(y.min(1), y.max(1), height)
    left, right = np.full(len(shape), -np.inf), np.full(len(shape), np.inf)
    turn = np.sign((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))
    for k, m in ((0, 1), (1, 2), (2, 0)):
        rise = y[:, m] - y[:, k]
        slope = np.divide(x[:, m] - x[:, k], rise, out=np.zeros_like(rise), where=rise != 0)
        at = (x[:, k] - slope * y[:, k])[shape] + slope[shape] * (row + 0.5)
        side = (turn * np.sign(rise))[shape]
        np.minimum(right, at, out=right, where=side > 0)
        np.maximum(left, at, out=left, where=side < 0)
    return _spans_between(shape, row, left, right, width)


def _rod_spans(start: Floats, axis: Floats, length: Floats, radius: Floats, size: tuple[int, int]) -> Spans:
    """Spans of rods: in each row the strip around the line, within the bounding box."""
    end = start + axis * length[:, None]
    low = np.minimum(start, end) - radius[:, None]
    high = np.maximum(start, end) + radius[:, None]
    rod, row = _rows_between(low[:, 1], high[:, 1], size[1])
    (x, y), (dx, dy) = start.T, axis.T
    is_level = np.abs(dy) < _LEVEL
    rise = np.where(is_level, 1.0, dy)
    half = np.where(is_level, np.inf, radius / np.abs(rise))[rod]
    middle = x[rod] + (row + 0.5 - y[rod]) * np.where(is_level, 0.0, dx / rise)[rod]
    left, right = np.maximum(middle - half, low[rod, 0]), np.minimum(middle + half, high[rod, 0])
    return _spans_between(rod, row, left, right, size[0])


def _rows_between(low: Floats, high: Floats, height: int) -> tuple[Ints, Ints]:
    """Shape and row of each row of samples between ``low`` and ``high`` (n,) of the shapes."""
    first = np.clip(np.ceil(low - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.floor(high - 0.5), -1, height - 1).astype(np.int64)
    count = np.maximum(last - first + 1, 0)
    shape = np.repeat(np.arange(len(low)), count)
    return shape, np.arange(len(shape)) - np.repeat(np.cumsum(count) - count, count) + first[shape]


def _spans_between(shape: Ints, row: Ints, left: Floats, right: Floats, width: int) -> Spans:
    """Spans of the samples between ``left`` and ``right`` (n,), without empty ones."""
    first = np.ceil(np.clip(left, 0, width) - 0.5).astype(np.int64)
    last = np.floor(np.clip(right, 0, width) - 0.5).astype(np.int64)
    some = (last >= first) & np.isfinite(left) & np.isfinite(right)
    return Spans(shape[some].astype(np.int32), row[some], first[some], (last - first + 1)[some])
