"""Faces laid flat: the frames in which straight lines run over a mesh.

The *frame* of halfedge ``h`` is the plane of its face: origin at the halfedge's tail, x along
it, y into the face.  A line that leaves the face by another edge goes on straight in the frame
of that edge's twin: the straightest geodesic of Polthier and Schmies (1998).

A *wall* is a halfedge that no line crosses: the border, and the cuts of a closed surface.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
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
