"""The inside of a face: points in rows, spaced by the local metric, and triangles between them and the border.

Rows of points √3/2 of the wanted length apart, every other one shifted by half a step, make equilateral triangles
where the metric is even::

      •     •     •     •
         •     •     •            points too near to the border or to each other are dropped: a maximal
      •     •     •     •         independent set, found in rounds (Luby 1986)

The points are triangulated in the face's chart, constrained to border and creases.  O(n log n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.nurbs import surface_points
from weavecore.geometry.triangulate2d import inside_polygons, triangulate_region
from weavecore.reading.nurbs_mesher.brep_shape import FaceShape
from weavecore.reading.nurbs_mesher.creases import FaceCreases, face_creases
from weavecore.reading.nurbs_mesher.face_borders import FaceBorder
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, interpolate_grid

FREE, FIXED = -1, -2
"""Vertex ids of points inside a face before they are numbered: those that may be shifted, and those on a crease."""

_ROW = np.sqrt(3) / 2
"""Distance of rows of equilateral triangles, in edge lengths."""

_FROM_BORDER = 0.55
"""Least distance of a point from the border, in wanted lengths: nearer ones make triangles lower than half of
it."""

_FROM_EACH_OTHER = 0.7
"""Least distance between points, in wanted lengths: halfway, by ratio, between the wanted length and half of it."""

_NEAREST = 12
"""Nearest neighbours with which each point is compared."""

_CLEARLY_LESS = 0.999
"""Rows run the other way only if their density varies less by more than rounding."""

_JITTER = 0.02
"""Greatest shift of a point, in wanted lengths: far above rounding and far below what changes a triangle's
shape."""

_IRRATIONAL = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of the R2 sequence, 1/ρ and 1/ρ² with ρ³ = ρ + 1: evenly spread shifts that never repeat (Roberts 2018)."""

_MOST_ROUNDS = 40
"""Rounds of thinning; it ends after about the logarithm of the number of points."""


@dataclass(frozen=True, eq=False)
class FacePatch:
    """A triangulated face by itself.

    Parameters
    ----------
    uv : (N, 2) float64
        Parameters.
    vertex_ids : (N,) int64
        `FREE` inside, or `FIXED` on a crease.
    faces : (F, 3) int64
        Triangles, counter-clockwise in (u, v).
    creases : (K, 2) int64
        Segments of creases.
    missing : (M,) int64
        Border segments that cross others.
    """

    uv: Floats
    vertex_ids: Ints
    faces: Ints
    creases: Ints
    missing: Ints


def fill_face(face: FaceShape, grid: FaceGrid, sizes: Floats, border: FaceBorder) -> FacePatch:
    """Fill a face with points and triangles; it has no triangles if border segments are missing.

    Parameters
    ----------
    face : FaceShape
    grid : FaceGrid
    sizes : (N, M) float64
        Wanted edge lengths at the grid.
    border : FaceBorder

    Returns
    -------
    FacePatch
    """
    creases = face_creases(face, grid, sizes, border)
    interior = _interior_points(face, grid, sizes, border, creases)
    uv = np.concatenate([border.uv, creases.uv, interior])
    vertex_ids = np.concatenate([border.vertex_ids, np.full(len(creases.uv), FIXED), np.full(len(interior), FREE)])
    chart, n = grid.to_chart(uv), len(border.segments)
    rows = creases.segments
    # A segment that is passed twice bounds nothing: both its sides belong to the face.
    region = triangulate_region(chart, np.concatenate([border.segments, rows, rows]))
    if len(region.missing) and len(rows):
        lost = (region.missing[region.missing >= n] - n) % len(rows)
        rows = np.delete(rows, lost, axis=0)
        region = triangulate_region(chart, np.concatenate([border.segments, rows, rows]))
    return FacePatch(uv, vertex_ids, region.faces, rows, region.missing[region.missing < n])


def _interior_points(
    face: FaceShape, grid: FaceGrid, sizes: Floats, border: FaceBorder, creases: FaceCreases
) -> Floats:
    uv = _jittered(_rows(grid, sizes), grid, sizes)
    chart, ring = grid.to_chart(uv), grid.to_chart(border.uv)
    uv = uv[inside_polygons(chart, ring[border.segments[:, 0]], ring[border.segments[:, 1]])]
    if len(uv) == 0:
        return uv
    points = surface_points(face.surface, uv)
    wanted = interpolate_grid(grid, sizes, uv)
    free = ~_near_segments(face, border, creases, points, wanted)
    uv, points, wanted = uv[free], points[free], wanted[free]
    return uv[_thinned(points, wanted)]


def _rows(grid: FaceGrid, sizes: Floats) -> Floats:
    """Rows of parameters at even spacing on the surface, every other one shifted by half a step.

    Rows run along the parameter across which their distance varies less, and are close enough where they are
    furthest apart.
    """
    across = [_row_density(grid, sizes, way) for way in (0, 1)]
    # On a plane both ways are equally good: rounding must not decide.
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


def _jittered(uv: Floats, grid: FaceGrid, sizes: Floats) -> Floats:
    """Points shifted by a small part of the wanted edge length, each differently.

    Rows of even steps are full of ties: four points on a circle, two equally near to a third.  Rounding would decide
    them, and with it the place of the surface and its unit.
    """
    turns = np.arange(len(uv))[:, None] * _IRRATIONAL % 1.0 - 0.5
    steps = np.column_stack(
        [interpolate_grid(grid, sizes / np.maximum(grid.speeds[..., way], 1e-300), uv) for way in (0, 1)]
    )
    low, high = np.array([[grid.u[0], grid.v[0]], [grid.u[-1], grid.v[-1]]])
    moved = uv + _JITTER * turns * np.minimum(steps, high - low)
    jittered: Floats = np.clip(moved, low, high)
    return jittered


def _row_density(grid: FaceGrid, sizes: Floats, way: int) -> tuple[Floats, float]:
    """Rows per parameter if rows follow each other along ``way``, and how much that varies within a row."""
    per_unit = np.where(grid.inside, grid.speeds[..., way] / (_ROW * sizes), 0.0)
    most = per_unit.max(1 - way)
    mean = per_unit.sum(1 - way) / np.maximum(grid.inside.sum(1 - way), 1)
    return np.maximum(most, 1e-300), float(most.sum() / max(float(mean.sum()), 1e-300))


def _near_segments(face: FaceShape, border: FaceBorder, creases: FaceCreases, points: Floats, wanted: Floats) -> Bools:
    """Which points are too near to the border or to a crease."""
    from scipy.spatial import cKDTree

    ends = np.concatenate([border.uv, creases.uv])[np.concatenate([border.segments, creases.segments])]
    tail, head = ends[:, 0], ends[:, 1]
    fine = np.concatenate([tail, tail * 0.75 + head * 0.25, (tail + head) / 2, tail * 0.25 + head * 0.75])
    distance, _ = cKDTree(surface_points(face.surface, fine)).query(points)
    near: Bools = np.asarray(distance) < _FROM_BORDER * wanted
    return near


def _thinned(points: Floats, wanted: Floats) -> Bools:
    """A maximal set of points of which no two are too near to each other, found in rounds.

    In each round the points that come first among their neighbours stay, and their neighbours are removed.
    """
    from scipy.spatial import cKDTree

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
        selected = undecided & (rank < first)
        removed = np.zeros(n, bool)
        removed[b[selected[a]]] = True
        kept[removed] = False
        undecided &= ~(selected | removed)
    return kept
