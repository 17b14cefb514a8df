"""Straight walks over a mesh, with every face that they pass: straightest geodesics as curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.geometry.unfolding import Unfolding, barycentric_at, leave_face

_MOST_FACES = 100_000
_INSIDE_FACE = 1e-7
"""A walk ends no nearer to the side of its last face than this, in barycentric coordinates."""

_Row = tuple[Ints, Ints, Floats, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Walks:
    """Straight walks, cut where they go from face to face: one row a segment, walk after walk.

    Parameters
    ----------
    offsets : (n+1,) int64
        Segments of each walk, in order.
    face : (m,) int64
    start, end : (m, 3) float64
        Barycentric coordinates of both ends of each segment in its face.
    begin, finish : (m,) float64
        How far the walk had come at both ends.
    far : (n,) float64
        How far each walk came.
    wall : (n,) int64
        The halfedge of the wall that was in the way, -1 where none was.
    wall_ux, wall_uy : (n,) float64
        Direction in which the walk came to that wall, in the frame of the halfedge.
    """

    offsets: Ints
    face: Ints
    start: Floats
    end: Floats
    begin: Floats
    finish: Floats
    far: Floats
    wall: Ints
    wall_ux: Floats
    wall_uy: Floats

    def __len__(self) -> int:
        return len(self.far)

    @property
    def is_blocked(self) -> Bools:
        """(n,) whether a wall was in the way."""
        return np.asarray(self.wall != NO_TWIN)

    def take(self, chosen: Bools) -> Walks:
        """Some of the walks."""
        counts = np.diff(self.offsets)
        rows = np.repeat(chosen, counts)
        return Walks(
            offsets_of(counts[chosen]),
            self.face[rows],
            self.start[rows],
            self.end[rows],
            self.begin[rows],
            self.finish[rows],
            self.far[chosen],
            self.wall[chosen],
            self.wall_ux[chosen],
            self.wall_uy[chosen],
        )


def in_face_order(weights: Floats, halfedge: Ints) -> Floats:
    """Weights (n, 3) of tail, head and apex of halfedges, as barycentric coordinates in their faces."""
    columns = (np.arange(3) - (halfedge % 3)[:, None]) % 3
    return np.take_along_axis(weights, columns, 1)


def on_halfedge(halfedge: Ints, part: Floats) -> Floats:
    """Barycentric coordinates (n, 3), in their faces, of points on halfedges."""
    return in_face_order(np.stack([1.0 - part, part, np.zeros_like(part)], axis=1), halfedge)


def walk_far(frames: Unfolding, halfedge: Ints, px: Floats, py: Floats, ux: Floats, uy: Floats, far: Floats) -> Walks:
    """Walk straight over the mesh and keep the way.

    Parameters
    ----------
    halfedge : (n,) int64
    px, py : (n,) float64
        Place in the frame of the halfedge, in its face or on the halfedge.
    ux, uy : (n,) float64
        Unit direction in that frame, into the face.
    far : (n,) float64
        How far to walk.

    Notes
    -----
    Polthier and Schmies 1998, *Straightest geodesics on polyhedral surfaces*.
    """
    at, x, y, dx, dy = halfedge.copy(), px.copy(), py.copy(), ux.copy(), uy.copy()
    gone, wall = np.zeros(len(at)), np.full(len(at), NO_TWIN)
    wall_ux, wall_uy = np.zeros(len(at)), np.zeros(len(at))
    active = np.arange(len(at))
    rows: list[_Row] = []
    for _ in range(_MOST_FACES):
        if len(active) == 0 and rows:
            break
        h, begin = at[active], gone[active]
        edge, reach, along, ex, ey = leave_face(frames, h, x[active], y[active], dx[active], dy[active])
        start = in_face_order(barycentric_at(frames, h, x[active], y[active]), h)
        ends = reach >= far[active] - begin
        step = np.where(ends, far[active] - begin, reach)
        inside = barycentric_at(frames, h, x[active] + step * dx[active], y[active] + step * dy[active])
        end = np.where(
            ends[:, None], _kept_inside(in_face_order(inside, h)), on_halfedge(edge, along / frames.length[edge])
        )
        gone[active] += step
        rows.append((active, h // 3, start, end, begin, gone[active]))
        stuck = ~ends & (frames.twin[edge] == NO_TWIN)
        at_wall = active[stuck]
        wall[at_wall], wall_ux[at_wall], wall_uy[at_wall] = edge[stuck], ex[stuck], ey[stuck]
        twin, tx, ex, ey = frames.across(edge, along, ex, ey)
        onward = ~ends & (twin != NO_TWIN)
        active = active[onward]
        at[active], x[active], y[active] = twin[onward], tx[onward], 0.0
        dx[active], dy[active] = ex[onward], ey[onward]
    offsets, face, start, end, begin, finish = _gather(rows, len(gone))
    return Walks(offsets, face, start, end, begin, finish, gone, wall, wall_ux, wall_uy)


def _gather(rows: list[_Row], n_walks: int) -> tuple[Ints, Ints, Floats, Floats, Floats, Floats]:
    """Put the segments of each walk one behind the other."""
    walk, face = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    start, end, begin, finish = (np.concatenate([row[k] for row in rows]) for k in (2, 3, 4, 5))
    order = np.argsort(walk, kind="stable")
    offsets = offsets_of(np.bincount(walk, minlength=n_walks))
    return offsets, face[order], start[order], end[order], begin[order], finish[order]


def _kept_inside(weights: Floats) -> Floats:
    """Barycentric coordinates moved off the sides of the face by a trifle."""
    kept = np.maximum(weights, _INSIDE_FACE)
    inside: Floats = kept / kept.sum(1, keepdims=True)
    return inside


def place_along(walks: Walks, far: Floats) -> tuple[Ints, Floats]:
    """Face (n,) and barycentric coordinates (n, 3) of the places at which walks had come so far."""
    row = np.arange(len(walks.face))
    owner = np.repeat(np.arange(len(walks)), np.diff(walks.offsets))
    passed = np.bincount(owner[walks.finish < far[owner]], minlength=len(walks))
    row = np.minimum(walks.offsets[:-1] + passed, walks.offsets[1:] - 1)
    length = walks.finish[row] - walks.begin[row]
    part = np.divide(far - walks.begin[row], length, out=np.zeros(len(row)), where=length > 0)
    part = np.clip(part, 0.0, 1.0)[:, None]
    return walks.face[row], _kept_inside(walks.start[row] * (1 - part) + walks.end[row] * part)
