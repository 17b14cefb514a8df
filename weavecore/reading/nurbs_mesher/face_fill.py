"""The inside of a face: points in rows, scaled by the local metric, and triangles between them and the border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.nurbs import surface_points
from weavecore.geometry.triangulate2d import inside_polygons, triangulate_region
from weavecore.reading.nurbs_mesher.brep_shape import FaceShape
from weavecore.reading.nurbs_mesher.creases import FaceCreases, face_creases
from weavecore.reading.nurbs_mesher.face_borders import FaceBorder
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, lookup

FREE, HELD = -1, -2
"""Names of points inside a face: those that may be shifted, and those on a crease."""

_ROW = np.sqrt(3) / 2
_FROM_BORDER = 0.55
_FROM_EACH_OTHER = 0.7
_NEAREST = 12
_CLEARLY_LESS = 0.999
_SCATTER = 0.02
_IRRATIONAL = np.array([0.7548776662466927, 0.5698402909980532])
_MOST_ROUNDS = 40


@dataclass(frozen=True, eq=False)
class FacePatch:
    """A triangulated face by itself: parameters (N, 2), names (N,), triangles (F, 3), crease segments (K, 2).

    Points inside are named `FREE`, or `HELD` where they lie on a crease.  Triangles are counter-clockwise in
    (u, v).  ``missing`` are border segments that cross others.
    """

    uv: Floats
    names: Ints
    faces: Ints
    creases: Ints
    missing: Ints


def fill_face(face: FaceShape, grid: FaceGrid, sizes: Floats, border: FaceBorder) -> FacePatch:
    """Fill a face with points and triangles; no triangles where border segments are missing."""
    creases = face_creases(face, grid, sizes, border)
    seeds = _seeds(face, grid, sizes, border, creases)
    uv = np.concatenate([border.uv, creases.uv, seeds])
    names = np.concatenate([border.names, np.full(len(creases.uv), HELD), np.full(len(seeds), FREE)])
    chart, n = grid.to_chart(uv), len(border.segments)
    rows = creases.segments
    # A segment that is given twice bounds nothing: both its sides belong to the face.
    region = triangulate_region(chart, np.concatenate([border.segments, rows, rows]))
    if len(region.missing) and len(rows):
        lost = (region.missing[region.missing >= n] - n) % len(rows)
        rows = np.delete(rows, lost, axis=0)
        region = triangulate_region(chart, np.concatenate([border.segments, rows, rows]))
    return FacePatch(uv, names, region.faces, rows, region.missing[region.missing < n])


def _seeds(face: FaceShape, grid: FaceGrid, sizes: Floats, border: FaceBorder, creases: FaceCreases) -> Floats:
    uv = _scattered(_rows(grid, sizes), grid, sizes)
    chart, ring = grid.to_chart(uv), grid.to_chart(border.uv)
    uv = uv[inside_polygons(chart, ring[border.segments[:, 0]], ring[border.segments[:, 1]])]
    if len(uv) == 0:
        return uv
    points = surface_points(face.surface, uv)
    wanted = lookup(grid, sizes, uv)
    free = ~_near_segments(face, border, creases, points, wanted)
    uv, points, wanted = uv[free], points[free], wanted[free]
    return uv[_spread(points, wanted)]


def _rows(grid: FaceGrid, sizes: Floats) -> Floats:
    """Rows of parameters at even spacing on the surface, every other one shifted by half a step.

    Rows run the way in which the distance between them varies less; they are as close as they must be
    where they are furthest apart.
    """
    across = [_row_density(grid, sizes, way) for way in (0, 1)]
    # Both ways are as good on a plane: the last bit must not choose.
    way = int(across[1][1] < _CLEARLY_LESS * across[0][1])
    density = across[way][0]
    axis, other = (grid.u, grid.v) if way == 0 else (grid.v, grid.u)
    count = np.concatenate([[0.0], np.cumsum(np.diff(axis) * (density[1:] + density[:-1]) / 2)])
    n_rows = max(round(float(count[-1])), 2)
    rows = np.interp(np.arange(1, n_rows) * count[-1] / n_rows, count, axis)
    along = grid.speeds[..., 1 - way] / sizes
    along = along if way == 0 else along.T
    parts = []
    for k, at in enumerate(rows.tolist()):
        i = int(np.clip(np.searchsorted(axis, at) - 1, 0, len(axis) - 2))
        t = (at - axis[i]) / (axis[i + 1] - axis[i])
        speed = along[i] * (1 - t) + along[i + 1] * t
        total = np.concatenate([[0.0], np.cumsum(np.diff(other) * (speed[1:] + speed[:-1]) / 2)])
        n = max(round(float(total[-1])), 1)
        shares = np.arange(1, n) / n if k % 2 else (np.arange(n) + 0.5) / n
        places = np.interp(shares * total[-1], total, other)
        pair = (np.full(n - k % 2, at), places)
        parts.append(np.column_stack(pair if way == 0 else pair[::-1]))
    return np.concatenate(parts) if parts else np.zeros((0, 2))


def _scattered(uv: Floats, grid: FaceGrid, sizes: Floats) -> Floats:
    """Points moved a little, each its own way, by a part of the wanted edge length.

    Rows of even steps are full of ties: four points on a circle, two as near as a third.  How these fall would hang
    on the last bit of the coordinates, and so on where the surface lies and on its unit.
    """
    turns = np.arange(len(uv))[:, None] * _IRRATIONAL % 1.0 - 0.5
    steps = np.column_stack([lookup(grid, sizes / np.maximum(grid.speeds[..., way], 1e-300), uv) for way in (0, 1)])
    low, high = np.array([[grid.u[0], grid.v[0]], [grid.u[-1], grid.v[-1]]])
    moved = uv + _SCATTER * turns * np.minimum(steps, high - low)
    scattered: Floats = np.clip(moved, low, high)
    return scattered


def _row_density(grid: FaceGrid, sizes: Floats, way: int) -> tuple[Floats, float]:
    """Rows per parameter when rows follow each other along ``way``, and how much that varies within a row."""
    per_unit = np.where(grid.inside, grid.speeds[..., way] / (_ROW * sizes), 0.0)
    most = per_unit.max(1 - way)
    mean = per_unit.sum(1 - way) / np.maximum(grid.inside.sum(1 - way), 1)
    return np.maximum(most, 1e-300), float(most.sum() / max(float(mean.sum()), 1e-300))


def _near_segments(face: FaceShape, border: FaceBorder, creases: FaceCreases, points: Floats, wanted: Floats) -> Bools:
    """Which points are too near to the border or to a crease."""
    ends = np.concatenate([border.uv, creases.uv])[np.concatenate([border.segments, creases.segments])]
    tail, head = ends[:, 0], ends[:, 1]
    fine = np.concatenate([tail, tail * 0.75 + head * 0.25, (tail + head) / 2, tail * 0.25 + head * 0.75])
    distance, _ = cKDTree(surface_points(face.surface, fine)).query(points)
    near: Bools = np.asarray(distance) < _FROM_BORDER * wanted
    return near


def _spread(points: Floats, wanted: Floats) -> Bools:
    """A largest set of points no two of which are too near to each other, found in rounds.

    In each round the points that come first among their rivals stay, and their rivals go.
    """
    n = len(points)
    kept = np.ones(n, bool)
    if n < 2:
        return kept
    k = min(_NEAREST, n)
    distance, near = cKDTree(points).query(points, k=k)
    a, b = np.repeat(np.arange(n), k), np.ravel(near)
    close = (np.ravel(distance) < _FROM_EACH_OTHER * (wanted[a] + wanted[b]) / 2) & (a != b)
    a, b = a[close], b[close]
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    rank = np.argsort(np.argsort((np.arange(n) * 0.6180339887498949) % 1.0, kind="stable"), kind="stable")
    undecided = np.ones(n, bool)
    for _ in range(_MOST_ROUNDS):
        live = undecided[a] & undecided[b]
        a, b = a[live], b[live]
        if len(a) == 0:
            break
        first = np.full(n, n)
        np.minimum.at(first, a, rank[b])
        winner = undecided & (rank < first)
        loser = np.zeros(n, bool)
        loser[b[winner[a]]] = True
        kept[loser] = False
        undecided &= ~(winner | loser)
    return kept
