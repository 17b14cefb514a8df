"""Checks that polylines are simple and disjoint, face by face.

The *carriers* of a point are the corners of its face with a weight: three inside a face, two on an edge, one at a
vertex. A segment is *held* by each face that has the carriers of both its ends; one along an edge by the faces on both
sides.  Two segments in a face cross where the ends of each lie on opposite sides of the other, in barycentric
coordinates. O(Σ k²) for faces of k segments.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.report import Finding, count

_PAIRS_AT_ONCE = 1_000_000
"""Pairs of segments compared at a time: a bound on memory."""

_LEAST_TURN = 1e-12
"""Twice an area in barycentric coordinates below which three points are collinear."""

_LEAST_WEIGHT = 1e-9
"""A corner with less weight does not carry a point."""


@dataclass(frozen=True, eq=False)
class HeldSegments:
    """Segments with the faces that hold them: one row for each pair, sorted by face.

    Parameters
    ----------
    start, end : (R,) int64
        Points of each segment.
    face : (R,) int64
    at_start, at_end : (R, 3) float64
        Barycentric coordinates of the ends in that face.
    lost : (L,) int64
        First points of segments that no face holds.
    """

    start: Ints
    end: Ints
    face: Ints
    at_start: Floats
    at_end: Floats
    lost: Ints


def check_crossings(surface: SurfaceMesh, polylines: Polylines, held: HeldSegments) -> Iterator[Finding]:
    """Check for polylines that cross one another or themselves, and for points that two of them share.

    Parameters
    ----------
    surface : SurfaceMesh
    polylines : Polylines
    held : HeldSegments
    """
    crossing = [held.start[i[_cross(held, i, j)]] for i, j in _pairs_in_faces(held)]
    owner = polylines.owner
    yield count("crossings", owner[np.concatenate(crossing)] if crossing else [], "polyline")
    yield count("shared_points", owner[_shared_points(surface, polylines)], "polyline")


def _pairs_in_faces(held: HeldSegments) -> Iterator[tuple[Ints, Ints]]:
    """All pairs of rows of the same face, in blocks."""
    n = len(held.face)
    last = np.searchsorted(held.face, held.face, side="right")
    partners = last - np.arange(n) - 1
    total = np.concatenate([[0], np.cumsum(partners)])
    begin = 0
    while begin < n:
        end = max(begin + 1, int(np.searchsorted(total, total[begin] + _PAIRS_AT_ONCE, side="right")) - 1)
        i = np.repeat(np.arange(begin, end), partners[begin:end])
        j = i + 1 + np.arange(len(i)) - (total[i] - total[begin])
        yield i, j
        begin = end


def _cross(held: HeldSegments, i: Ints, j: Ints) -> Ints:
    """Which of the pairs have no common point and cross inside their face."""
    a, b, c, d = held.start[i], held.end[i], held.start[j], held.end[j]
    apart = (a != c) & (a != d) & (b != c) & (b != d)
    p, q, r, s = (x[:, :2] for x in (held.at_start[i], held.at_end[i], held.at_start[j], held.at_end[j]))
    return np.flatnonzero(apart & _opposite(p, q, r, s) & _opposite(r, s, p, q))


def _opposite(p: Floats, q: Floats, r: Floats, s: Floats) -> Ints:
    """(m,) whether ``r`` and ``s`` (m, 2) lie on opposite sides of the line through ``p`` and ``q``."""
    x, y = (q - p).T
    left = x * (r - p)[:, 1] - y * (r - p)[:, 0]
    right = x * (s - p)[:, 1] - y * (s - p)[:, 0]
    apart: Ints = (np.minimum(left, right) < -_LEAST_TURN) & (np.maximum(left, right) > _LEAST_TURN)
    return apart


def _shared_points(surface: SurfaceMesh, polylines: Polylines) -> Ints:
    """Points at a vertex, or at a place of an edge, where there is another point too."""
    corners, carries = carriers_of(surface, polylines)
    on_edge = np.flatnonzero(carries.sum(1) < 3)
    corners, carries = corners[on_edge], carries[on_edge]
    low = np.where(carries, corners, surface.n_vertices).min(1)
    high = np.where(carries, corners, -1).max(1)
    part = (polylines.barycentric[on_edge] * (carries & (corners == high[:, None]))).sum(1)
    order = np.lexsort((part, high, low))
    same = (np.diff(low[order]) == 0) & (np.diff(high[order]) == 0) & (np.diff(part[order]) <= _LEAST_TURN)
    shared: Ints = on_edge[np.union1d(order[:-1][same], order[1:][same])]
    return shared


def hold_segments(surface: SurfaceMesh, polylines: Polylines) -> HeldSegments:
    """Find all faces that hold each segment; the last point of an open polyline begins none.

    Parameters
    ----------
    surface : SurfaceMesh
    polylines : Polylines

    Returns
    -------
    HeldSegments
    """
    corners, carries = carriers_of(surface, polylines)
    weights = np.where(carries, polylines.barycentric, 0.0)
    after = next_in_loop(polylines.offsets)
    begins = np.ones(len(polylines.points), bool)
    begins[polylines.offsets[1:][~polylines.closed & (polylines.counts > 0)] - 1] = False
    start, face = _faces_at_points(surface, corners, carries)
    start, face = start[begins[start]], face[begins[start]]
    at_start, _ = _weights_in(surface.faces[face], corners[start], weights[start])
    end = after[start]
    at_end, inside = _weights_in(surface.faces[face], corners[end], weights[end])
    lost = begins.copy()
    lost[start[inside]] = False
    row = np.flatnonzero(inside)
    row = row[np.argsort(face[row], kind="stable")]
    return HeldSegments(start[row], end[row], face[row], at_start[row], at_end[row], np.flatnonzero(lost))


def _faces_at_points(surface: SurfaceMesh, corners: Ints, carries: Bools) -> tuple[Ints, Ints]:
    """Pairs (point, face) of every point with every face that has all its carriers."""
    by_vertex = np.argsort(surface.faces.ravel(), kind="stable") // 3
    begin = offsets_of(np.bincount(surface.faces.ravel(), minlength=surface.n_vertices))
    seed = corners[np.arange(len(corners)), carries.argmax(1)]
    star = begin[seed + 1] - begin[seed]
    ragged = offsets_of(star)
    point = rows_of(ragged)
    face = by_vertex[np.arange(ragged[-1]) - ragged[point] + begin[seed][point]]
    _, inside = _weights_in(surface.faces[face], corners[point], carries[point].astype(float))
    return point[inside], face[inside]


def _weights_in(faces: Ints, corners: Ints, weights: Floats) -> tuple[Floats, Bools]:
    """Weights (R, 3) at the corners of other faces (R, 3), and whether they hold all carriers (R,)."""
    same = faces[:, :, None] == corners[:, None, :]
    moved: Floats = (same * weights[:, None, :]).sum(2)
    inside: Bools = (same.any(1) | (weights <= 0)).all(1)
    return moved, inside


def carriers_of(surface: SurfaceMesh, polylines: Polylines) -> tuple[Ints, Bools]:
    """The corners that carry each point.

    Parameters
    ----------
    surface : SurfaceMesh
    polylines : Polylines

    Returns
    -------
    corners : (N, 3) int64
        Vertices of the face of each point.
    carries : (N, 3) bool
    """
    return surface.faces[polylines.face], polylines.barycentric > _LEAST_WEIGHT
