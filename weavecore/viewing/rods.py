"""Rods in a picture: straight pieces with round ends, drawn as tubes in front of what they lie on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.viewing.camera import Camera
from weavecore.viewing.raster import Buffer, Spans, rows_between, spans_between

_LIFT = 0.6
"""How many radii a rod is moved towards the eye: the surface that it lies on must not hide its edge."""

Short = NDArray[np.float32]


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

    def across(self, rod: Ints, column: Ints, row: Ints) -> tuple[Short, Short]:
        """How far samples lie from the start along the axis, and from the axis to its left, both in radii."""
        a, b = ((self.axis[:, k] / self.radius).astype(np.float32)[rod] for k in (0, 1))
        x, y = ((at + 0.5 - self.start[rod, k]).astype(np.float32) for k, at in ((0, column), (1, row)))
        return a * x + b * y, a * y - b * x


def see_rods(camera: Camera, starts: Floats, ends: Floats, radius: Floats) -> SeenRods:
    """Project rods from ``starts`` (n, 3) to ``ends`` (n, 3) of the given radius (n,) in the model's unit."""
    place, nearness = camera.project(np.concatenate([starts, ends]))
    start, end = place[: len(starts)], place[len(starts) :]
    both = np.stack([nearness[: len(starts)], nearness[len(starts) :]], axis=1)
    length = np.maximum(np.linalg.norm(end - start, axis=1), 1e-6)
    # Rods are short beside the distance of the eye: one radius serves the whole of each.
    return SeenRods(start, (end - start) / length[:, None], length, radius * camera.scale * both.mean(1), both, radius)


def draw_rods(buffer: Buffer, rods: SeenRods) -> None:
    """Put the rods into the buffer; a shape is a rod's number."""
    lift = rods.model_radius.astype(np.float32)
    slope = ((rods.nearness[:, 1] - rods.nearness[:, 0]) * rods.radius / rods.length).astype(np.float32)
    first = rods.nearness[:, 0].astype(np.float32)
    reach = (rods.length / rods.radius).astype(np.float32)
    for rod, column, row in _spans(rods, buffer).samples():
        along, off = rods.across(rod, column, row)
        end = reach[rod]
        beyond = along - np.clip(along, 0, end)
        squared = beyond * beyond + off * off
        inside = np.flatnonzero(squared <= 1)
        seen = rod[inside]
        near = first[seen] + slope[seen] * np.clip(along[inside], 0, end[inside])
        towards = lift[seen] * (_LIFT + np.sqrt(1 - squared[inside]))
        buffer.put(seen, column[inside], row[inside], near / (1 - near * towards))


def _spans(rods: SeenRods, buffer: Buffer) -> Spans:
    """For each row the part of the strip about a rod's line that its bounding box leaves."""
    end = rods.start + rods.axis * rods.length[:, None]
    low = np.minimum(rods.start, end) - rods.radius[:, None]
    high = np.maximum(rods.start, end) + rods.radius[:, None]
    rod, row = rows_between(low[:, 1], high[:, 1], buffer.height)
    (x, y), (dx, dy) = rods.start.T, rods.axis.T
    is_flat = np.abs(dy) < 1e-9
    rise = np.where(is_flat, 1.0, dy)
    half = np.where(is_flat, np.inf, rods.radius / np.abs(rise))[rod]
    middle = x[rod] + (row + 0.5 - y[rod]) * np.where(is_flat, 0.0, dx / rise)[rod]
    left, right = np.maximum(middle - half, low[rod, 0]), np.minimum(middle + half, high[rod, 0])
    return spans_between(rod, row, left, right, buffer.width)
