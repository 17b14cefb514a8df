r"""Where curves cross: the four-angle test (Yan et al. 2016, §4.3), and exact sides where it is in doubt.

Seen on a reference plane, the segments ab and cd cross where they are the diagonals of a convex quadrilateral a c b d.
The four angles of the quadrilateral then sum up to 2π; four points in any other position give less::

           c
          / \
        a --+-- b        angle at a + at c + at b + at d = 2π
          \ /
           d

The reference plane is that of the common face: only segments in one face are compared, so two sheets of a surface that
lie close to each other in space are not taken for one.  The sum tends to 2π as well where segments just touch, or miss
each other by a hair; there the sides on which the ends lie decide, in exact arithmetic where rounding could turn them.

The time is linear in the segments and in the pairs of segments that share a face.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.offset_vertices import FrontRays
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves

DOUBT = 1e-6
"""Radians below 2π down to which the sum of the angles leaves a crossing possible; far above its rounding error."""

_PAIRS_AT_ONCE = 1_000_000
"""Pairs of segments compared in one block, which bounds the memory: some hundred bytes a pair."""


@dataclass(frozen=True, eq=False)
class Intersections:
    """Pairs of segments that cross.

    Parameters
    ----------
    first, second : (k,) int64
        Both segments.
    on_first, on_second : (k,) float64
        Where on each, in 0 to 1.
    turns_left : (k,) bool
        Whether the second segment runs to the left of the first.
    """

    first: Ints
    second: Ints
    on_first: Floats
    on_second: Floats
    turns_left: Bools

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def concatenate(cls, parts: list[Intersections]) -> Intersections:
        """All pairs of several values."""
        names = ("first", "second", "on_first", "on_second", "turns_left")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def find_intersections(domain: Domain, curves: SurfaceCurves) -> Intersections:
    """Self-intersections (§4.3) and mutual intersections (§4.4) of curves.

    Parameters
    ----------
    domain : Domain
    curves : SurfaceCurves

    Returns
    -------
    Intersections
        Each crossing once, but not the common ends of segments that follow each other.
    """
    segments = _FaceSegments(domain, curves.face, curves.start, curves.end)
    parts = []
    for i, j in _pair_up(segments.face, segments.face):
        apart = (i < j) & (curves.after[i] != j) & (curves.after[j] != i)
        parts.append(_intersect(segments, i[apart], segments, j[apart]))
    return Intersections.concatenate(parts)


def find_intersections_with(domain: Domain, curves: SurfaceCurves, others: SurfaceCurves) -> Intersections:
    """Where curves cross other curves.

    Parameters
    ----------
    domain : Domain
    curves, others : SurfaceCurves

    Returns
    -------
    Intersections
        First segments of the curves, second ones of the others.
    """
    ours = _FaceSegments(domain, curves.face, curves.start, curves.end)
    theirs = _FaceSegments(domain, others.face, others.start, others.end)
    return Intersections.concatenate([_intersect(ours, i, theirs, j) for i, j in _pair_up(ours.face, theirs.face)])


def find_ray_intersections(domain: Domain, rays: FrontRays, curves: SurfaceCurves) -> Intersections:
    """Where rays cross curves.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
    curves : SurfaceCurves

    Returns
    -------
    Intersections
        First segments of the rays' walks, second ones of the curves.
    """
    walks = rays.walks
    ours = _FaceSegments(domain, walks.face, walks.start, walks.end)
    theirs = _FaceSegments(domain, curves.face, curves.start, curves.end)
    return Intersections.concatenate([_intersect(ours, i, theirs, j) for i, j in _pair_up(ours.face, theirs.face)])


class _FaceSegments:
    """Segments in faces: in barycentric coordinates, and in the planes of the faces.

    Parameters
    ----------
    domain : Domain
    face : (m,) int64
    start, end : (m, 3) float64
        Barycentric coordinates of both ends.
    """

    def __init__(self, domain: Domain, face: Ints, start: Floats, end: Floats) -> None:
        # Sides are taken in barycentric coordinates, in which what lies on an edge lies on an axis, exactly.
        self.face, self.start, self.end = face, start[:, 1:], end[:, 1:]
        self.low = np.minimum(self.start, self.end)
        self.high = np.maximum(self.start, self.end)
        self.plane_start, self.plane_end = domain.plane_points(face, start), domain.plane_points(face, end)

    def overlap(self, i: Ints, other: _FaceSegments, j: Ints) -> Bools:
        """Whether the boxes (k,) around segments overlap."""
        apart = (self.low[i] > other.high[j]) | (other.low[j] > self.high[i])
        return np.asarray(~apart.any(axis=1))


def _pair_up(faces: Ints, other_faces: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of elements of both that lie in one face, in blocks; at least one block."""
    order = np.argsort(other_faces, kind="stable")
    ordered = other_faces[order]
    first = np.searchsorted(ordered, faces, side="left")
    count = np.searchsorted(ordered, faces, side="right") - first
    total = np.concatenate([[0], np.cumsum(count)])
    begin = 0
    while True:
        end = int(np.searchsorted(total, total[begin] + _PAIRS_AT_ONCE, side="right")) - 1
        end = min(max(end, begin + 1), len(faces))
        i = np.repeat(np.arange(begin, end), count[begin:end])
        j = order[np.arange(len(i)) - (total[i] - total[begin]) + first[i]]
        yield i, j
        begin = end
        if begin >= len(faces):
            return


def _intersect(one: _FaceSegments, i: Ints, other: _FaceSegments, j: Ints) -> Intersections:
    """The pairs (k,) of segments that cross."""
    near = one.overlap(i, other, j)
    i, j = i[near], j[near]
    crosses = _cross(one, i, other, j)
    i, j = i[crosses], j[crosses]
    a, b, c, d = one.start[i], one.end[i], other.start[j], other.end[j]
    on_first, on_second = locate_crossings(a, b, c, d)
    u, v = b - a, d - c
    return Intersections(i, j, on_first, on_second, u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0)


def _cross(one: _FaceSegments, i: Ints, other: _FaceSegments, j: Ints) -> Bools:
    """The four-angle test (§4.3) in the plane of the face, then sides by barycentric coordinates where it is full."""
    angles = sum_of_four_angles(one.plane_start[i], one.plane_end[i], other.plane_start[j], other.plane_end[j])
    crosses = angles > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(one.start[i[n]], one.end[i[n]], other.start[j[n]], other.end[j[n]])
    return crosses


# ----------------------------------------------------------------------
# The four-angle test of §4.3 on a plane.


def segments_cross(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Which of the segments ab and cd cross: the four-angle test first, then the sides.

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments on the reference plane.

    Returns
    -------
    (n,) bool
        A point on a line counts as left of it.
    """
    crosses = sum_of_four_angles(a, b, c, d) > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(a[n], b[n], c[n], d[n])
    return crosses


def sum_of_four_angles(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Sum of the angles at the corners of the quadrilaterals a c b d (Yan et al. 2016, §4.3, Figure 6).

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments ab and cd on the reference plane.

    Returns
    -------
    (n,) float64
        Radians, each angle taken between 0 and π; 2π where the segments cross.
    """
    total = np.zeros(len(a))
    for before, at, after in ((d, a, c), (a, c, b), (c, b, d), (b, d, a)):
        u, v = before - at, after - at
        total += np.abs(np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(1)))
    return total


def ends_on_opposite_sides(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Whether each of two segments has its ends on both sides of the other's line.

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments ab and cd.

    Returns
    -------
    (n,) bool
    """
    return np.asarray((find_sides(a, b, c) != find_sides(a, b, d)) & (find_sides(c, d, a) != find_sides(c, d, b)))


def find_sides(a: Floats, b: Floats, points: Floats) -> Ints:
    """On which sides of lines points lie, exactly: the sign is that of the coordinates as they are stored.

    Parameters
    ----------
    a, b : (n, 2) float64
        The lines run from a to b.
    points : (n, 2) float64

    Returns
    -------
    (n,) int64
        1 left, -1 right; a point on the line counts as left.
    """
    sides, is_sure = _find_sides_in(np.float64, a, b, points)
    rest = np.flatnonzero(~is_sure)
    # Where the machine has longer numbers these decide nearly all of the rest.
    sides[rest], is_sure = _find_sides_in(np.longdouble, a[rest], b[rest], points[rest])
    for k in rest[~is_sure].tolist():
        (ax, ay), (bx, by), (px, py) = (tuple(map(Fraction, q[k].tolist())) for q in (a, b, points))
        sides[k] = 1 if (bx - ax) * (py - ay) >= (by - ay) * (px - ax) else -1
    return sides


def _find_sides_in(kind: type, a: Floats, b: Floats, points: Floats) -> tuple[Ints, Bools]:
    """The sides by numbers of a kind, and where rounding cannot have turned them."""
    a, b, points = a.astype(kind), b.astype(kind), points.astype(kind)
    u, v = b - a, points - a
    one, other = u[:, 0] * v[:, 1], u[:, 1] * v[:, 0]
    # The differences are rounded as well: their errors are of the size of the coordinates.
    size = np.maximum(np.abs(a), np.maximum(np.abs(b), np.abs(points))).max(axis=1, initial=0)
    spread = np.abs(u).max(axis=1, initial=0) + np.abs(v).max(axis=1, initial=0)
    bound = 8 * np.finfo(kind).eps * (np.abs(one) + np.abs(other) + size * spread)
    in_line = ((u == 0) & (v == 0)).any(axis=1)  # with an axis, exactly
    return np.where(one >= other, 1, -1), np.asarray(in_line | (np.abs(one - other) > bound))


def locate_crossings(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Where segments that cross do so.

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments ab and cd.

    Returns
    -------
    on_first, on_second : (n,) float64
        Parts of ab and of cd, in 0 to 1.
    """
    u, v, w = b - a, d - c, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area = np.where(area == 0, np.finfo(float).tiny, area)
    on_first = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / area
    on_second = (w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / area
    return np.clip(on_first, 0.0, 1.0), np.clip(on_second, 0.0, 1.0)
