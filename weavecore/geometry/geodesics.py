"""Faces laid flat: the frames in which straight lines run over a mesh.

The *frame* of halfedge ``h`` is the plane of its face: origin at the halfedge's tail, x along
it, y into the face.  A line that leaves the face by another edge goes on straight in the frame
of that edge's twin: the straightest geodesic of Polthier and Schmies (1998).

A *wall* is a halfedge that no line crosses: the border, and the cuts of a closed surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge, previous_halfedge

_INSIDE_EDGE = 1e-9  # lines cross an edge no nearer to its ends than this part of it
_MOST_FACES_WALKED = 200


class Unfolding:
    """The frames of all halfedges of a mesh, as arrays (3F,) in halfedge order.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
        -1 at walls.

    Attributes
    ----------
    length : length of each halfedge
    apex, apex_x, apex_y : the opposite corner: its vertex, and its place in the frame
    next_x, next_y, previous_x, previous_y : unit directions of the face's other halfedges in the frame
    angle : angle of the face at the halfedge's tail
    total_angle : (V,) sum of the angles at each vertex
    on_wall : (V,) whether a vertex lies on a wall
    excess : (V,) angle above a full turn at inner vertices, 0 on walls
    mean_length : (V,) mean length of the edges at each vertex
    roughness : float, how far nine in ten inner vertices are from flat at most: their angle off a full turn
    """

    def __init__(self, vertices: Floats, faces: Ints, twins: Ints) -> None:
        n = len(vertices)
        self.vertices, self.faces, self.twin = vertices, faces, twins
        self.tail, self.head = halfedge_ends(faces)
        self.apex = faces[:, [2, 0, 1]].ravel()
        every = np.arange(3 * len(faces))
        self.next, self.previous = next_halfedge(every), previous_halfedge(every)
        edge = vertices[self.head] - vertices[self.tail]
        self.length = np.maximum(np.sqrt(np.einsum("ij,ij->i", edge, edge)), np.finfo(float).tiny)
        self._lay_flat(edge)
        self.angle = np.arctan2(self.apex_y, self.apex_x)
        self.total_angle = np.bincount(self.tail, self.angle, n)
        self.on_wall = np.zeros(n, bool)
        wall = twins == NO_TWIN
        self.on_wall[self.tail[wall]] = self.on_wall[self.head[wall]] = True
        self.excess = np.where(self.on_wall, 0.0, self.total_angle - 2 * np.pi)
        self.roughness = float(np.quantile(np.abs(self.excess[~self.on_wall]), 0.9)) if not self.on_wall.all() else 0.0
        total = np.bincount(self.tail, self.length, n) + np.bincount(self.head, self.length, n)
        count = np.bincount(self.tail, minlength=n) + np.bincount(self.head, minlength=n)
        self.mean_length = total / np.maximum(count, 1)

    def _lay_flat(self, edge: Floats) -> None:
        by_face = self.length.reshape(-1, 3)
        after, before = by_face[:, [1, 2, 0]].ravel(), by_face[:, [2, 0, 1]].ravel()
        cross = np.cross(edge[0::3], edge[1::3])
        double_area = np.sqrt(np.einsum("ij,ij->i", cross, cross))
        self.apex_x = (self.length**2 + before**2 - after**2) / (2 * self.length)
        self.apex_y = np.repeat(double_area, 3) / self.length
        self.next_x, self.next_y = (self.apex_x - self.length) / after, self.apex_y / after
        self.previous_x, self.previous_y = -self.apex_x / before, -self.apex_y / before
        self._normal = cross / np.maximum(double_area, np.finfo(float).tiny)[:, None]

    def points(self, halfedge: Ints, along: Floats) -> Floats:
        """Points (n, 3) at a length along halfedges."""
        tail = self.vertices[self.tail[halfedge]]
        part = (along / self.length[halfedge])[:, None]
        points: Floats = tail + part * (self.vertices[self.head[halfedge]] - tail)
        return points

    def directions(self, halfedge: Ints, x: Floats, y: Floats) -> Floats:
        """Vectors (n, 3) of frame directions."""
        edge = self.vertices[self.head[halfedge]] - self.vertices[self.tail[halfedge]]
        axis = edge / self.length[halfedge][:, None]
        ax, ay, az = axis.T
        nx, ny, nz = self._normal[halfedge // 3].T
        up = np.stack([ny * az - nz * ay, nz * ax - nx * az, nx * ay - ny * ax], axis=1)
        vectors: Floats = x[:, None] * axis + y[:, None] * up
        return vectors

    def across(self, halfedge: Ints, along: Floats, x: Floats, y: Floats) -> tuple[Ints, Floats, Floats, Floats]:
        """The same point and direction on an edge in the frame of its twin (-1 at walls)."""
        return self.twin[halfedge], self.length[halfedge] - along, -x, -y


def leave_face(
    frames: Unfolding, halfedge: Ints, px: Floats, py: Floats, ux: Floats, uy: Floats
) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """Where a line from inside a face leaves it: halfedge of the face, length, place on it, direction in its frame."""
    length, apex_x, apex_y = frames.length[halfedge], frames.apex_x[halfedge], frames.apex_y[halfedge]
    nx, ny = frames.next_x[halfedge], frames.next_y[halfedge]
    qx, qy = frames.previous_x[halfedge], frames.previous_y[halfedge]
    to_next, to_previous = ux * ny - uy * nx, ux * qy - uy * qx
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(uy < 0, -py / uy, np.inf)
        far_next = np.where(to_next > 0, ((length - px) * ny + py * nx) / to_next, np.inf)
        far_previous = np.where(to_previous > 0, (py * qx - px * qy) / to_previous, np.inf)
    by_next = far_next < far
    far = np.where(by_next, far_next, far)
    by_previous = far_previous < far
    far = np.maximum(np.where(by_previous, far_previous, far), 0)
    by_next &= ~by_previous
    edge = np.where(by_previous, frames.previous[halfedge], np.where(by_next, frames.next[halfedge], halfedge))
    cx = np.where(by_previous, qx, np.where(by_next, nx, 1.0))
    cy = np.where(by_previous, qy, np.where(by_next, ny, 0.0))
    ox = np.where(by_previous, apex_x, np.where(by_next, length, 0.0))
    along = (px + far * ux - ox) * cx + (py + far * uy - np.where(by_previous, apex_y, 0.0)) * cy
    size = frames.length[edge]
    along = np.clip(along, _INSIDE_EDGE * size, (1 - _INSIDE_EDGE) * size)
    return edge, far, along, ux * cx + uy * cy, uy * cx - ux * cy


def walk_straight(
    frames: Unfolding, halfedge: Ints, px: Floats, ux: Floats, uy: Floats, far: Floats
) -> tuple[Ints, Floats, Floats, Floats, Floats, Bools]:
    """Walk straight over the mesh from points on edges.

    Parameters
    ----------
    halfedge : (n,) int64
    px : (n,) float64
        Place along the halfedge.
    ux, uy : (n,) float64
        Unit direction in its frame; with ``uy < 0`` the walk goes into the face of the twin.
    far : (n,) float64
        How far to walk.

    Returns
    -------
    halfedge, px, py, ux, uy : (n,)
        Frame, place and direction of the end.
    arrived : (n,) bool
        False where a wall was in the way.
    """
    at, x, y, dx, dy = halfedge.copy(), px.copy(), np.zeros(len(px)), ux.copy(), uy.copy()
    back = np.flatnonzero(uy < 0)
    twin, x[back], dx[back], dy[back] = frames.across(at[back], x[back], dx[back], dy[back])
    arrived = np.ones(len(at), bool)
    arrived[back] = twin != NO_TWIN
    at[back] = np.maximum(twin, 0)
    left = far.copy()
    active = np.flatnonzero(arrived)
    for _ in range(_MOST_FACES_WALKED):
        if len(active) == 0:
            break
        edge, reach, along, ex, ey = leave_face(frames, at[active], x[active], y[active], dx[active], dy[active])
        ends = reach >= left[active]
        stop, m = active[ends], left[active][ends]
        x[stop] += m * dx[stop]
        y[stop] += m * dy[stop]
        twin, tx, ex, ey = frames.across(edge, along, ex, ey)
        arrived[active[~ends & (twin == NO_TWIN)]] = False
        onward = ~ends & (twin != NO_TWIN)
        left[active] -= reach
        active = active[onward]
        at[active], x[active], y[active] = twin[onward], tx[onward], 0.0
        dx[active], dy[active] = ex[onward], ey[onward]
    arrived[active] = False
    return at, x, y, dx, dy, arrived


def back_to_edge(
    frames: Unfolding, halfedge: Ints, px: Floats, py: Floats, ux: Floats, uy: Floats
) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """Move a line that passes a point inside a face back to the edge by which it entered.

    Returns
    -------
    halfedge, along, ux, uy : (n,)
        Entry edge of the same face, place on it, direction in its frame.
    back : (n,) float64
        How far the line was moved back.
    """
    edge, far, along, ex, ey = leave_face(frames, halfedge, px, py, -ux, -uy)
    return edge, along, -ex, -ey, far


def barycentric_at(frames: Unfolding, halfedge: Ints, px: Floats, py: Floats) -> Floats:
    """Weights (n, 3) of tail, head and apex at a place in the frame."""
    apex = py / np.maximum(frames.apex_y[halfedge], np.finfo(float).tiny)
    head = (px - apex * frames.apex_x[halfedge]) / frames.length[halfedge]
    return np.stack([1 - head - apex, head, apex], axis=1)


# ----------------------------------------------------------------------
# Straight walks over a mesh, with every face that they pass: straightest geodesics as curves.

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
