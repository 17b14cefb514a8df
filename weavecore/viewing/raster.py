"""A z-buffer in NumPy: which triangle and which rod is visible at each sample of a picture.

Samples lie at half-integer places, x to the right and y down.  A *span* is the run of samples of one row that a shape
covers. All shapes are divided into spans and all spans into samples at once; each sample keeps the shape of the
greatest *nearness*, 1 / depth, which is linear across a triangle.  O(samples covered).

A rod is a segment with round ends, drawn as a tube: a sample at the distance q of its line (in radii) lies sqrt(1 - q²)
radii in front of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import each, poll
from weavecore.viewing.camera import Camera

Nearness = NDArray[np.float32]
Floats32 = NDArray[np.float32]

NOTHING = -1
"""In place of the shape of a sample where none is visible."""

_CHUNK = 1 << 18
"""Samples worked on at a time: a bound on memory."""

_RODS_AT_ONCE = 1 << 15
"""Rods whose spans are found at a time, between two polls."""

_LIFT = 0.6
"""How many radii a rod is moved towards the eye, so that the surface it lies on does not hide its edge."""

_LEAST_LENGTH = 1e-6
"""Shortest rod, in samples: shorter ones have no direction."""

_LEVEL = 1e-9
"""A rod whose direction rises less than this, as a sine, is horizontal in the picture."""


class DepthBuffer:
    """The nearest shape at each sample.

    Parameters
    ----------
    size : (int, int)
        Width and height in samples.

    Attributes
    ----------
    nearness : (height * width,) float32
        0 where nothing is.
    shape : (height * width,) int32
        The visible shape, or `NOTHING`.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.width, self.height = size
        n = self.width * self.height
        self.nearness: Nearness = np.zeros(n, np.float32)
        self.shape: NDArray[np.int32] = np.full(n, NOTHING, np.int32)

    def forget_shapes(self) -> None:
        """Keep the nearness alone: of what is drawn from now on only what is nearer is visible."""
        self.shape.fill(NOTHING)

    def put(self, shape: Ints, column: Ints, row: Ints, nearness: Floats) -> None:
        """Keep the nearest shape of each sample; all arrays (n,)."""
        at = row * self.width + column
        near = nearness.astype(np.float32)
        np.maximum.at(self.nearness, at, near)
        wins = near >= self.nearness[at]
        self.shape[at[wins]] = shape[wins]

    def seen(self) -> Iterator[tuple[Ints, Ints, Floats32, Floats32]]:
        """Sample, shape, and the place to the right and down wherever a shape is visible, in chunks."""
        rows_at_once = max(_CHUNK // self.width, 1)
        for first in each(range(0, self.height, rows_at_once)):
            start, stop = first * self.width, min(first + rows_at_once, self.height) * self.width
            at = np.flatnonzero(self.shape[start:stop] != NOTHING)
            row = at // self.width
            x, y = (at - row * self.width).astype(np.float32), row.astype(np.float32)
            x += 0.5
            y += first + 0.5
            at += start
            yield at, self.shape[at].astype(np.int64), x, y


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
    """

    start: Floats
    axis: Floats
    length: Floats
    radius: Floats
    nearness: Floats
    model_radius: Floats

    def across(self, rod: Ints, x: Floats32, y: Floats32) -> tuple[Floats32, Floats32]:
        """How far samples lie from the start along the axis, and from the axis to its left, both in radii."""
        of = self._frames[rod]
        x, y = x - of[:, 0], y - of[:, 1]
        a, b = of[:, 2], of[:, 3]
        return a * x + b * y, a * y - b * x

    @cached_property
    def _frames(self) -> Floats32:
        """(n, 4) start and direction over radius: one look-up for all that `across` needs."""
        return np.hstack([self.start, self.axis / self.radius[:, None]]).astype(np.float32)


def draw_triangles(buffer: DepthBuffer, place: Floats, nearness: Floats) -> None:
    """Draw triangles; a shape is the index of a triangle.

    Parameters
    ----------
    buffer : DepthBuffer
    place : (T, 3, 2) float64
        Corners in samples.
    nearness : (T, 3) float64
        Of the corners.
    """
    # In float64: the planes of triangles seen edge-on are steep.
    plane = np.stack(planes_over(place, nearness), axis=1)
    for triangle, column, row in each(_triangle_spans(place, buffer).samples()):
        of = plane[triangle]
        near = of[:, 0] * (column + 0.5)
        near += of[:, 1] * (row + 0.5)
        near += of[:, 2]
        buffer.put(triangle, column, row, near)


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


def see_rods(camera: Camera, starts: Floats, ends: Floats, radius: Floats) -> SeenRods:
    """Project rods into the picture.

    Parameters
    ----------
    camera : Camera
    starts, ends : (n, 3) float64
    radius : (n,) float64
        In the model's unit.

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
    return SeenRods(start, (end - start) / length[:, None], length, radius * camera.scale * both.mean(1), both, radius)


def draw_rods(buffer: DepthBuffer, rods: SeenRods) -> None:
    """Draw rods; a shape is the index of a rod.

    Parameters
    ----------
    buffer : DepthBuffer
    rods : SeenRods
    """
    lift = rods.model_radius.astype(np.float32)
    slope = ((rods.nearness[:, 1] - rods.nearness[:, 0]) * rods.radius / rods.length).astype(np.float32)
    first = rods.nearness[:, 0].astype(np.float32)
    reach = (rods.length / rods.radius).astype(np.float32)
    for rod, column, row in _rod_samples(rods, buffer):
        along, off = rods.across(rod, (column + 0.5).astype(np.float32), (row + 0.5).astype(np.float32))
        end = reach[rod]
        beyond = along - np.clip(along, 0, end)
        squared = beyond * beyond + off * off
        inside = np.flatnonzero(squared <= 1)
        seen = rod[inside]
        near = first[seen] + slope[seen] * np.clip(along[inside], 0, end[inside])
        towards = lift[seen] * (_LIFT + np.sqrt(1 - squared[inside]))
        buffer.put(seen, column[inside], row[inside], near / (1 - near * towards))


def _rod_samples(rods: SeenRods, buffer: DepthBuffer) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Rod, column and row of the samples of all rods, in chunks."""
    for first in each(range(0, len(rods.start), _RODS_AT_ONCE)):
        part = slice(first, first + _RODS_AT_ONCE)
        some = SeenRods(*(getattr(rods, field.name)[part] for field in fields(rods)))
        for rod, column, row in each(_rod_spans(some, buffer).samples()):
            yield rod + first, column, row


@dataclass(frozen=True, eq=False)
class _Spans:
    """Runs of samples (s,): the shape of each, its row, first column and count of columns."""

    shape: Ints
    row: Ints
    first: Ints
    count: Ints

    def samples(self) -> Iterator[tuple[Ints, Ints, Ints]]:
        """Shape, column and row of all samples, in chunks."""
        total = np.concatenate([[0], np.cumsum(self.count)])
        cuts = np.searchsorted(total, np.arange(_CHUNK, total[-1] + _CHUNK, _CHUNK), side="right") - 1
        start = 0
        for end in np.unique(np.maximum(cuts, 1)).tolist():
            part = slice(start, end)
            count = self.count[part]
            shift = self.first[part] - (total[start:end] - total[start])
            column = np.repeat(shift, count)
            column += np.arange(len(column))
            yield np.repeat(self.shape[part], count), column, np.repeat(self.row[part], count)
            start = end


def _triangle_spans(place: Floats, buffer: DepthBuffer) -> _Spans:
    """Spans of triangles: an edge that rises, taken counter-clockwise, bounds them on the right."""
    x, y = place[..., 0], place[..., 1]
    shape, row = _rows_between(y.min(1), y.max(1), buffer.height)
    left, right = np.full(len(shape), -np.inf), np.full(len(shape), np.inf)
    turn = np.sign((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))
    for k, m in ((0, 1), (1, 2), (2, 0)):
        rise = y[:, m] - y[:, k]
        slope = np.divide(x[:, m] - x[:, k], rise, out=np.zeros_like(rise), where=rise != 0)
        at = (x[:, k] - slope * y[:, k])[shape] + slope[shape] * (row + 0.5)
        side = (turn * np.sign(rise))[shape]
        np.minimum(right, at, out=right, where=side > 0)
        np.maximum(left, at, out=left, where=side < 0)
    return _spans_between(shape, row, left, right, buffer.width)


def _rod_spans(rods: SeenRods, buffer: DepthBuffer) -> _Spans:
    """Spans of rods: in each row the strip around the line, within the bounding box."""
    end = rods.start + rods.axis * rods.length[:, None]
    low = np.minimum(rods.start, end) - rods.radius[:, None]
    high = np.maximum(rods.start, end) + rods.radius[:, None]
    rod, row = _rows_between(low[:, 1], high[:, 1], buffer.height)
    (x, y), (dx, dy) = rods.start.T, rods.axis.T
    is_level = np.abs(dy) < _LEVEL
    rise = np.where(is_level, 1.0, dy)
    half = np.where(is_level, np.inf, rods.radius / np.abs(rise))[rod]
    middle = x[rod] + (row + 0.5 - y[rod]) * np.where(is_level, 0.0, dx / rise)[rod]
    left, right = np.maximum(middle - half, low[rod, 0]), np.minimum(middle + half, high[rod, 0])
    return _spans_between(rod, row, left, right, buffer.width)


def _rows_between(low: Floats, high: Floats, height: int) -> tuple[Ints, Ints]:
    """Shape and row of each row of samples between ``low`` and ``high`` (n,) of the shapes."""
    first = np.clip(np.ceil(low - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.floor(high - 0.5), -1, height - 1).astype(np.int64)
    count = np.maximum(last - first + 1, 0)
    shape = np.repeat(np.arange(len(low)), count)
    return shape, np.arange(len(shape)) - np.repeat(np.cumsum(count) - count, count) + first[shape]


def _spans_between(shape: Ints, row: Ints, left: Floats, right: Floats, width: int) -> _Spans:
    """Spans of the samples between ``left`` and ``right`` (n,), without empty ones."""
    first = np.ceil(np.clip(left, 0, width) - 0.5).astype(np.int64)
    last = np.floor(np.clip(right, 0, width) - 0.5).astype(np.int64)
    some = (last >= first) & np.isfinite(left) & np.isfinite(right)
    return _Spans(shape[some], row[some], first[some], (last - first + 1)[some])
