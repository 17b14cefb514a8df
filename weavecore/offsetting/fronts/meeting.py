"""Where curves meet: candidates are the segments in a common face, never all pairs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.fronts.criterion import (
    DOUBT,
    ends_on_opposite_sides,
    places_of_crossing,
    sum_of_four_angles,
)
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.rays import Rays

_PAIRS_AT_ONCE = 1_000_000


@dataclass(frozen=True, eq=False)
class Meetings:
    """Pairs of segments that cross.

    Parameters
    ----------
    first, second : (k,) int64
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
    def of(cls, parts: list[Meetings]) -> Meetings:
        """One value of several."""
        names = ("first", "second", "on_first", "on_second", "turns_left")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class _Segments:
    """Segments in faces with their places in the plane of the face."""

    def __init__(self, ground: Ground, face: Ints, start: Floats, end: Floats) -> None:
        # Signs are taken of barycentric coordinates: these say exactly what lies on an edge.
        self.face, self.start, self.end = face, start[:, 1:], end[:, 1:]
        self.low = np.minimum(self.start, self.end)
        self.high = np.maximum(self.start, self.end)
        self.flat_start, self.flat_end = ground.flat(face, start), ground.flat(face, end)

    def overlap(self, i: Ints, other: _Segments, j: Ints) -> Bools:
        """Whether the boxes around segments overlap."""
        apart = (self.low[i] > other.high[j]) | (other.low[j] > self.high[i])
        return np.asarray(~apart.any(axis=1))


def meet_themselves(ground: Ground, curves: Curves) -> Meetings:
    """All self-intersections and mutual intersections of curves; each once."""
    segments = _Segments(ground, curves.face, curves.start, curves.end)
    parts = []
    for i, j in _candidates(segments.face, segments.face):
        apart = (i < j) & (curves.after[i] != j) & (curves.after[j] != i)
        parts.append(_meet(segments, i[apart], segments, j[apart]))
    return Meetings.of(parts)


def curves_meet(ground: Ground, curves: Curves, others: Curves) -> Meetings:
    """Where curves cross others."""
    ours = _Segments(ground, curves.face, curves.start, curves.end)
    theirs = _Segments(ground, others.face, others.start, others.end)
    return Meetings.of([_meet(ours, i, theirs, j) for i, j in _candidates(ours.face, theirs.face)])


def rays_meet(ground: Ground, rays: Rays, curves: Curves) -> Meetings:
    """Where rays, named by their segments, cross curves."""
    walks = rays.walks
    ours = _Segments(ground, walks.face, walks.start, walks.end)
    theirs = _Segments(ground, curves.face, curves.start, curves.end)
    return Meetings.of([_meet(ours, i, theirs, j) for i, j in _candidates(ours.face, theirs.face)])


def _meet(one: _Segments, i: Ints, other: _Segments, j: Ints) -> Meetings:
    near = one.overlap(i, other, j)
    i, j = i[near], j[near]
    crosses = _cross(one, i, other, j)
    i, j = i[crosses], j[crosses]
    a, b, c, d = one.start[i], one.end[i], other.start[j], other.end[j]
    on_first, on_second = places_of_crossing(a, b, c, d)
    u, v = b - a, d - c
    return Meetings(i, j, on_first, on_second, u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0)


def _cross(one: _Segments, i: Ints, other: _Segments, j: Ints) -> Bools:
    """The sum of four angles in the plane of the face, then sides by barycentric coordinates where it is full."""
    angles = sum_of_four_angles(one.flat_start[i], one.flat_end[i], other.flat_start[j], other.flat_end[j])
    crosses = angles > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(one.start[i[n]], one.end[i[n]], other.start[j[n]], other.end[j[n]])
    return crosses


def _candidates(faces: Ints, other_faces: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of an element of each that lie in one face, in blocks; at least one block."""
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
