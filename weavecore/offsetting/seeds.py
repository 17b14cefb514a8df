"""Where rays start: strips beside the borders' edges, and fans at their turns.

The borders run with the surface on their left, so the offset direction is n x t (Yan et al.
2016, §4.1).  Where a border turns away from the surface the front opens: a fan of rays fills the
wedge between the strips of the two edges.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.geometry.unfolding import Unfolding
from weavecore.offsetting.rays import Rays

RAY_SPACING = 0.35  # of the mean edge length nearby
LEAST_WEDGE = 0.02  # radians; a smaller one is left to the strips beside it
FAN_ANGLE = 0.25  # radians between the rays of a fan
_MOST_SECTORS = 10_000


def seed_rays(frames: Unfolding) -> Rays:
    """Rays from all walls, linked to their neighbours along them."""
    wall = np.flatnonzero(frames.twin == NO_TWIN)
    strips, first, last = _strips(frames, wall)
    n_vertices = len(frames.vertices)
    starts, ends = np.full(n_vertices, -1), np.full(n_vertices, -1)
    starts[frames.tail[wall]], ends[frames.head[wall]] = first, last
    turn = _turn_vertices(frames, wall)
    before = ends[turn.vertex]
    after = starts[turn.vertex]
    strips.after[last] = _next_strip(frames, wall, starts)
    if len(turn.vertex) == 0:
        return strips
    count = np.ceil(turn.wedge / FAN_ANGLE).astype(np.int64)
    fans = _fans(frames, turn, count)
    head, tail = len(strips) + offsets_of(count)[:-1], offsets_of(count)[1:] - 1
    fans.after = np.arange(len(fans)) + len(strips) + 1
    fans.after[tail] = after
    strips.after[before] = head
    return strips.joined(fans)


class _Turns:
    """Corners of a wall that open the front: vertex, first outgoing halfedge there, total angle."""

    def __init__(self, vertex: Ints, halfedge: Ints, total: Floats) -> None:
        self.vertex, self.halfedge, self.total = vertex, halfedge, total
        self.wedge = total - np.pi


def _strips(frames: Unfolding, wall: Ints) -> tuple[Rays, Ints, Ints]:
    length = frames.length[wall]
    nearby = np.minimum(frames.mean_length[frames.tail[wall]], frames.mean_length[frames.head[wall]])
    count = np.maximum(1, np.ceil(length / (RAY_SPACING * nearby) * 0.999)).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    halfedge, width = wall[owner], (length / count)[owner]
    n = len(halfedge)
    px = (np.arange(n) - offsets[:-1][owner] + 0.5) * width
    rays = Rays.starting(halfedge, px, np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n), width * 0.50005)
    rays.after = np.arange(1, n + 1)
    return rays, offsets[:-1], offsets[1:] - 1


def _next_strip(frames: Unfolding, wall: Ints, starts: Ints) -> Ints:
    following: Ints = starts[frames.head[wall]]
    return following


def _turn_vertices(frames: Unfolding, wall: Ints) -> _Turns:
    """Sectors of faces between two walls that are wider than a half turn."""
    total = np.zeros(len(wall))
    at, open_ = wall.copy(), np.arange(len(wall))
    for _ in range(_MOST_SECTORS):
        if len(open_) == 0:
            break
        total[open_] += frames.angle[at]
        at = frames.twin[frames.previous[at]]
        open_, at = open_[at != NO_TWIN], at[at != NO_TWIN]
    wide = total > np.pi + LEAST_WEDGE
    return _Turns(frames.tail[wall[wide]], wall[wide], total[wide])


def _fans(frames: Unfolding, turn: _Turns, count: Ints) -> Rays:
    """Rays from the turns, from the strip before to the strip after: clockwise seen from outside."""
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    place = (np.arange(len(owner)) - offsets[:-1][owner] + 0.5) / count[owner]
    angle = turn.total[owner] - np.pi / 2 - turn.wedge[owner] * place
    halfedge, angle = find_sector(frames, turn.halfedge[owner], angle)
    n = len(halfedge)
    start = 1e-9 * frames.length[halfedge]
    wide = np.full(n, np.inf)
    return Rays.starting(halfedge, start, np.cos(angle), np.sin(angle), np.zeros(n), wide, wide.copy())


def find_sector(frames: Unfolding, halfedge: Ints, angle: Floats) -> tuple[Ints, Floats]:
    """The outgoing halfedge whose face holds a direction, and the angle that is left in it.

    ``angle`` counts counter-clockwise from the given outgoing halfedges.
    """
    at, left = halfedge.copy(), angle.copy()
    active = np.arange(len(at))
    for _ in range(_MOST_SECTORS):
        active = active[left[active] >= frames.angle[at[active]]]
        if len(active) == 0:
            break
        onward = frames.twin[frames.previous[at[active]]]
        active, onward = active[onward != NO_TWIN], onward[onward != NO_TWIN]
        left[active] -= frames.angle[at[active]]
        at[active] = onward
    return at, np.minimum(left, frames.angle[at] * (1 - 1e-9))
