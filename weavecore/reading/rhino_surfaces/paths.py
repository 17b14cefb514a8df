"""Brep edges by arc length, and where along them the mesh's border vertices lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import NurbsCurve, curve_points
from weavecore.reading.rhino_surfaces.shape import BrepShape, fine_parameters

_KINK = np.radians(20.0)
_LEAST_CLOSED = 4
_LEAST_TWIN = 2


@dataclass(frozen=True, eq=False)
class EdgePath:
    """An edge as a table: parameters, points and arc lengths (M,), curvature (M,), and where its kinks are."""

    curve: NurbsCurve
    parameters: Floats
    points: Floats
    lengths: Floats
    curvature: Floats
    kinks: Ints

    @property
    def length(self) -> float:
        """Arc length of the whole edge."""
        return float(self.lengths[-1])

    def at(self, lengths: Floats) -> Floats:
        """Points (K, 3) of the curve at arc lengths (K,)."""
        return curve_points(self.curve, np.interp(lengths, self.lengths, self.parameters))


def edge_path(curve: NurbsCurve) -> EdgePath:
    """Measure an edge."""
    parameters = fine_parameters(curve)
    points = curve_points(curve, parameters)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    directions = np.diff(points, axis=0) / np.maximum(steps, 1e-300)[:, None]
    turn = 2 * np.arcsin(np.clip(np.linalg.norm(np.diff(directions, axis=0), axis=1) / 2, 0, 1))
    turn[(steps[1:] == 0) | (steps[:-1] == 0)] = 0.0
    curvature = np.zeros(len(points))
    curvature[1:-1] = np.where(turn < _KINK, 2 * turn / np.maximum(steps[1:] + steps[:-1], 1e-300), 0.0)
    if len(points) > 2:
        curvature[0], curvature[-1] = curvature[1], curvature[-2]
    return EdgePath(curve, parameters, points, lengths, curvature, np.flatnonzero(turn >= _KINK) + 1)


def least_segments(shape: BrepShape) -> Ints:
    """How many segments (E,) each edge must have, so that no two of all segments join the same vertices."""
    ends = np.sort(shape.edge_vertices, axis=1)
    _, group, times = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(times[group.ravel()] > 1, _LEAST_TWIN, 1)
    least[ends[:, 0] == ends[:, 1]] = _LEAST_CLOSED
    return least.astype(np.int64)


def divide_path(path: EdgePath, sizes: Floats, least: int) -> Floats:
    """Arc lengths (K,), ends and kinks among them, spaced by the wanted sizes (M,) at the table's points."""
    if path.length == 0:
        return np.linspace(0.0, 0.0, least + 1)
    density = 1.0 / sizes
    count = np.concatenate([[0.0], np.cumsum(np.diff(path.lengths) * (density[1:] + density[:-1]) / 2)])
    stops = np.concatenate([[0], path.kinks, [len(count) - 1]])
    pieces = []
    for i, j in zip(stops[:-1].tolist(), stops[1:].tolist()):
        n = max(round(float(count[j] - count[i])), -(-least // (len(stops) - 1)), 1)
        pieces.append(np.interp(np.linspace(count[i], count[j], n + 1)[:-1], count, path.lengths))
    return np.append(np.concatenate(pieces), path.length)
