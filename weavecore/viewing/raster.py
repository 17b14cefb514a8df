"""A z-buffer in NumPy: which triangle and which rod is seen at each sample of a picture.

Samples lie at half-integer places; a *span* is the run of samples of one row that a shape covers.  All
shapes are cut into spans, and all spans into samples, at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints

Nearness = NDArray[np.float32]

NOTHING = -1
_CHUNK = 1 << 18
"""Samples worked on at a time: enough to be quick, few enough to need little memory."""


@dataclass(frozen=True, eq=False)
class Spans:
    """Runs of samples: the shape that each belongs to, its row, first column and number of columns."""

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
            yield (
                np.repeat(self.shape[part], count),
                np.repeat(shift, count) + np.arange(count.sum()),
                np.repeat(self.row[part], count),
            )
            start = end


class Buffer:
    """What is nearest at each sample.

    Parameters
    ----------
    size : (int, int)
        Width and height in samples.
    before : (height * width,) float32, optional
        Only what is nearer than this is seen.

    Attributes
    ----------
    nearness : (height * width,) float32
        0 where nothing is.
    shape : (height * width,) int32
        The shape that is seen, or `NOTHING`.
    """

    def __init__(self, size: tuple[int, int], before: Nearness | None = None) -> None:
        self.width, self.height = size
        n = self.width * self.height
        self.nearness: Nearness = np.zeros(n, np.float32) if before is None else before.copy()
        self.shape: NDArray[np.int32] = np.full(n, NOTHING, np.int32)

    def put(self, shape: Ints, column: Ints, row: Ints, nearness: Floats) -> None:
        """Keep of each sample what is nearest."""
        at = row * self.width + column
        near = nearness.astype(np.float32)
        np.maximum.at(self.nearness, at, near)
        wins = near >= self.nearness[at]
        self.shape[at[wins]] = shape[wins]

    def seen(self) -> Iterator[tuple[Ints, Ints, Ints, Ints]]:
        """Sample, shape, column and row wherever a shape is seen, in chunks."""
        for start in range(0, len(self.shape), _CHUNK):
            at = np.flatnonzero(self.shape[start : start + _CHUNK] != NOTHING) + start
            row, column = np.divmod(at, self.width)
            yield at, self.shape[at].astype(np.int64), column, row


def planes_over(place: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Factors (T,) of x, y and 1 of the linear functions with ``values`` (T, 3) at the corners (T, 3, 2)."""
    (x0, y0), (x1, y1), (x2, y2) = (place[:, k].T for k in range(3))
    twice_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    d1, d2 = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    safe = np.where(twice_area == 0, 1.0, twice_area)
    a = (d1 * (y2 - y0) - d2 * (y1 - y0)) / safe
    b = (d2 * (x1 - x0) - d1 * (x2 - x0)) / safe
    return a, b, values[:, 0] - a * x0 - b * y0


def draw_triangles(buffer: Buffer, place: Floats, nearness: Floats) -> None:
    """Put triangles with corners (T, 3, 2) of nearness (T, 3) into the buffer; a shape is a triangle's number."""
    a, b, c = planes_over(place, nearness)
    for triangle, column, row in _triangle_spans(place, buffer).samples():
        buffer.put(triangle, column, row, a[triangle] * (column + 0.5) + b[triangle] * (row + 0.5) + c[triangle])


def rows_between(low: Floats, high: Floats, height: int) -> tuple[Ints, Ints]:
    """Shape and row of each row of samples that lies between ``low`` (n,) and ``high`` (n,) of a shape."""
    first = np.clip(np.ceil(low - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.floor(high - 0.5), -1, height - 1).astype(np.int64)
    count = np.maximum(last - first + 1, 0)
    shape = np.repeat(np.arange(len(low)), count)
    return shape, np.arange(len(shape)) - np.repeat(np.cumsum(count) - count, count) + first[shape]


def spans_between(shape: Ints, row: Ints, left: Floats, right: Floats, width: int) -> Spans:
    """The spans of samples between ``left`` and ``right``, those without any left out."""
    first = np.ceil(np.clip(left, 0, width) - 0.5).astype(np.int64)
    last = np.floor(np.clip(right, 0, width) - 0.5).astype(np.int64)
    some = (last >= first) & np.isfinite(left) & np.isfinite(right)
    return Spans(shape[some], row[some], first[some], (last - first + 1)[some])


def _triangle_spans(place: Floats, buffer: Buffer) -> Spans:
    """Spans of triangles: an edge that goes up, taken counter-clockwise, bounds them on the right."""
    x, y = place[..., 0], place[..., 1]
    shape, row = rows_between(y.min(1), y.max(1), buffer.height)
    left, right = np.full(len(shape), -np.inf), np.full(len(shape), np.inf)
    turn = np.sign((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))
    for k, m in ((0, 1), (1, 2), (2, 0)):
        rise = y[:, m] - y[:, k]
        slope = np.divide(x[:, m] - x[:, k], rise, out=np.zeros_like(rise), where=rise != 0)
        at = (x[:, k] - slope * y[:, k])[shape] + slope[shape] * (row + 0.5)
        side = (turn * np.sign(rise))[shape]
        np.minimum(right, at, out=right, where=side > 0)
        np.maximum(left, at, out=left, where=side < 0)
    return spans_between(shape, row, left, right, buffer.width)
