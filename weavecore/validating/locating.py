"""Where polylines run on a mesh: the vertices that carry a point, the faces that hold a segment.

The *carriers* of a point are the corners of its face with a weight: three inside a face,
two on an edge, one at a vertex.  A segment is *held* by a face that has the carriers of both
its ends; one along an edge is held by the faces on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

LEAST_WEIGHT = 1e-9
"""A corner with less weight than this does not carry a point."""


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


def carriers_of(surface: SurfaceMesh, polylines: Polylines) -> tuple[Ints, Bools]:
    """Corners (N, 3) of the face of each point, and which of them carry it (N, 3)."""
    return surface.faces[polylines.face], polylines.barycentric > LEAST_WEIGHT


def hold_segments(surface: SurfaceMesh, polylines: Polylines) -> HeldSegments:
    """Find all the faces that hold each segment; the last point of an open polyline begins none."""
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
    """Weights (R, 3) at the corners of other faces, and whether none is left out (R,)."""
    same = faces[:, :, None] == corners[:, None, :]
    moved: Floats = (same * weights[:, None, :]).sum(2)
    inside: Bools = (same.any(1) | (weights <= 0)).all(1)
    return moved, inside
