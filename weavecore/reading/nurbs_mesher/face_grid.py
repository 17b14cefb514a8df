"""A face at a grid of parameters: points, derivatives, curvature, and a chart of even scale.

The *chart* of a face stretches u and v, each by itself, by the mean length of the derivative over the points inside::

    U(u) = ∫ mean_v |S_u| du        V(v) = ∫ mean_u |S_v| dv

so that lengths in the chart are lengths on the surface on average.  Parameter lines stay straight, and borders that
do not cross in (u, v) do not cross in the chart.  Linear in the grid, of at most 65 by 65 points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.nurbs import SurfaceJet, greatest_curvature, surface_jet
from weavecore.geometry.triangulate2d import inside_polygons
from weavecore.reading.nurbs_mesher.brep_shape import FaceShape

_LEAST_STEPS = 16
"""Steps of the grid each way, at least: curvature on a single span is then seen at 17 places."""

_MOST_STEPS = 64
"""Steps of the grid each way, at most: 4,225 points a face."""

_LEAST_SPEED = 1e-3
"""Mean derivatives below this part of the greatest are raised to it, so that the chart stays one to one at a
pole."""

_POLE = 1e-6
"""Area below this part of the median area marks a pole."""

_BESIDE = 5e-3
"""At a pole the curvature is taken this part of the way towards the middle of the face."""


@dataclass(frozen=True, eq=False)
class FaceGrid:
    """A face at a grid of parameters ``u`` (N,) by ``v`` (M,), over the box of its trims.

    Attributes
    ----------
    points : (N, M, 3)
    speeds : (N, M, 2)
        Length of the surface's derivatives by u and by v.
    curvature : (N, M)
        The greater principal curvature, without sign.
    inside : (N, M) bool
        Whether the trims hold the point.
    stretch : two float arrays, (N,) and (M,)
        Chart coordinates of ``u`` and of ``v``.
    """

    u: Floats
    v: Floats
    points: Floats
    speeds: Floats
    curvature: Floats
    inside: Bools
    stretch: tuple[Floats, Floats]

    def to_chart(self, uv: Floats) -> Floats:
        """Chart coordinates (K, 2) of parameters (K, 2)."""
        return np.column_stack(
            [np.interp(uv[:, 0], self.u, self.stretch[0]), np.interp(uv[:, 1], self.v, self.stretch[1])]
        )

    def to_parameters(self, chart: Floats) -> Floats:
        """Parameters (K, 2) of chart coordinates (K, 2)."""
        return np.column_stack(
            [np.interp(chart[:, 0], self.stretch[0], self.u), np.interp(chart[:, 1], self.stretch[1], self.v)]
        )


def face_grid(face: FaceShape) -> FaceGrid:
    """Evaluate a face over the bounding box of its trims.

    Parameters
    ----------
    face : FaceShape

    Returns
    -------
    FaceGrid
    """
    rings = [np.concatenate([trim.uv for trim in loop]) for loop in face.loops]
    corners = np.concatenate(rings)
    low, high = corners.min(0), corners.max(0)
    u, v = (_parameters(face, way, low[way], high[way]) for way in (0, 1))
    uv = np.column_stack([axis.ravel() for axis in np.meshgrid(u, v, indexing="ij")])
    jet = surface_jet(face.surface, uv, 2)
    curvature = _curvature(face, jet, uv, (low + high) / 2)
    shape = (len(u), len(v))
    tails = np.concatenate(rings)
    heads = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    inside = inside_polygons(_moved_inside(uv, low, high), tails, heads).reshape(shape)
    if not inside.any():
        inside[:] = True
    speeds = np.stack([np.linalg.norm(jet.du, axis=1), np.linalg.norm(jet.dv, axis=1)], axis=1).reshape(*shape, 2)
    stretch = tuple(_stretch(axis, speeds[..., way], inside, 1 - way) for way, axis in enumerate((u, v)))
    return FaceGrid(
        u=u,
        v=v,
        points=jet.point.reshape(*shape, 3),
        speeds=speeds,
        curvature=curvature.reshape(shape),
        inside=inside,
        stretch=(stretch[0], stretch[1]),
    )


def _curvature(face: FaceShape, jet: SurfaceJet, uv: Floats, middle: Floats) -> Floats:
    """Curvature at ``uv``; at a pole that of a place close by."""
    curvature = greatest_curvature(jet)
    pole = np.flatnonzero(np.linalg.norm(np.cross(jet.du, jet.dv), axis=1) <= _POLE * _typical_area(jet))
    if len(pole):
        beside = surface_jet(face.surface, uv[pole] + _BESIDE * (middle - uv[pole]), 2)
        curvature[pole] = greatest_curvature(beside)
    return curvature


def _typical_area(jet: SurfaceJet) -> float:
    return float(np.median(np.linalg.norm(np.cross(jet.du, jet.dv), axis=1)))


def _parameters(face: FaceShape, way: int, low: float, high: float) -> Floats:
    """Parameters from low to high with some on every span of the surface."""
    knots = np.unique(face.surface.knots[way])
    spans = np.concatenate([[low], knots[(knots > low) & (knots < high)], [high]])
    steps = int(np.clip(-(-_LEAST_STEPS // (len(spans) - 1)), 3, _LEAST_STEPS))
    inner = spans[:-1, None] + np.diff(spans)[:, None] * np.arange(steps) / steps
    axis = np.append(inner.ravel(), high)
    if len(axis) > _MOST_STEPS + 1:
        axis = np.interp(np.linspace(0, len(axis) - 1, _MOST_STEPS + 1), np.arange(len(axis)), axis)
    return np.unique(axis) if high > low else np.array([low, low + 1.0])


def _moved_inside(uv: Floats, low: Floats, high: Floats) -> Floats:
    """Points on the border of the box moved in a little, so that they count as inside it."""
    margin = 1e-6 * (high - low)
    return np.clip(uv, low + margin, high - margin)


def _stretch(axis: Floats, speed: Floats, inside: Bools, along: int) -> Floats:
    """Chart coordinates of ``axis``: the integral of the mean speed of the points inside."""
    count = inside.sum(along)
    mean = np.where(inside, speed, 0.0).sum(along) / np.maximum(count, 1)
    if (count == 0).any():
        mean = np.interp(axis, axis[count > 0], mean[count > 0])
    mean = np.maximum(mean, max(_LEAST_SPEED * float(mean.max()), 1e-300))
    return np.concatenate([[0.0], np.cumsum(np.diff(axis) * (mean[1:] + mean[:-1]) / 2)])


def interpolate_grid(grid: FaceGrid, values: Floats, uv: Floats) -> Floats:
    """Bilinear interpolation of values at a grid.

    Parameters
    ----------
    grid : FaceGrid
    values : (N, M) float64
    uv : (K, 2) float64

    Returns
    -------
    (K,) float64
    """
    i, s = _cell(grid.u, uv[:, 0])
    j, t = _cell(grid.v, uv[:, 1])
    low = values[i, j] * (1 - t) + values[i, j + 1] * t
    high = values[i + 1, j] * (1 - t) + values[i + 1, j + 1] * t
    between: Floats = low * (1 - s) + high * s
    return between


def _cell(axis: Floats, at: Floats) -> tuple[Ints, Floats]:
    index: Ints = np.clip(np.searchsorted(axis, at, side="right") - 1, 0, len(axis) - 2)
    return index, np.clip((at - axis[index]) / (axis[index + 1] - axis[index]), 0.0, 1.0)
