r"""Straightest geodesics: the frames of halfedges, and straight walks over a mesh.

The *frame* of halfedge ``h`` is the plane of its face: origin at the halfedge's tail, x along it, y into the face.  A
line that leaves the face by another edge goes on straight in the frame of that edge's twin (Polthier and Schmies
1998, *Straightest geodesics on polyhedral surfaces*)::

                  apex (apex_x, apex_y)
                    *                          next       head -> apex, unit direction `next_direction`
      previous    /   \    next               previous   apex -> tail, unit direction `previous_direction`
                /       \                     angle      of the face at the tail
      tail     *---------* head   x ->
              (0, 0)   (length, 0)

No line crosses a *boundary halfedge*: the border, and the cuts of a closed surface.

Work: linear in the halfedges, and in the faces that walks cross.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, cross, offsets_of, order_rows_by
from weavecore.geometry.elementary import arctangents
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge, previous_halfedge
from weavecore.polling import poll

_INSIDE_EDGE = 1e-9  # lines cross an edge no nearer to its ends than this part of it
_MAX_FACES_NEARBY = 200  # crossed by a walk of an edge or two: more only where faces are needles
_MAX_FACES = 100_000  # crossed by a walk of any length, against walks that never end

_INSIDE_FACE = 1e-7
"""A walk ends no nearer to the side of its last face than this, in barycentric coordinates."""


class Unfolding:
    """The frames of all halfedges of a mesh, as arrays (3F,) in halfedge order.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
        -1 at boundary halfedges.

    Attributes
    ----------
    length : length of each halfedge
    apex, apex_x, apex_y : the opposite corner: its vertex, and its place in the frame
    angle : angle of the face at the halfedge's tail
    total_angle : (V,) sum of the angles at each vertex
    on_boundary : (V,) whether a vertex lies on a boundary halfedge
    excess : (V,) angle above a full turn at inner vertices, 0 on the boundary
    mean_length : (V,) mean length of the edges at each vertex
    roughness : float, how far nine in ten inner vertices are from flat at most: their angle off a full turn
    """

    def __init__(self, vertices: Floats, faces: Ints, twins: Ints) -> None:
        n = len(vertices)
        self.vertices, self.faces, self.twin = vertices, faces, twins
        self.tail, self.head = halfedge_ends(faces)
        self.apex = faces[:, [2, 0, 1]].ravel()
        self._lay_flat()
        self.total_angle = np.bincount(self.tail, self.angle, n)
        self.on_boundary = np.zeros(n, bool)
        boundary = np.flatnonzero(twins == NO_TWIN)
        self.on_boundary[self.tail[boundary]] = self.on_boundary[self.head[boundary]] = True
        self.excess = np.where(self.on_boundary, 0.0, self.total_angle - 2 * np.pi)
        self.roughness = (
            float(np.quantile(np.abs(self.excess[~self.on_boundary]), 0.9)) if not self.on_boundary.all() else 0.0
        )
        poll()
        total = np.bincount(self.tail, self.length, n) + np.bincount(self.head, self.length, n)
        count = np.bincount(self.tail, minlength=n) + np.bincount(self.head, minlength=n)
        self.mean_length = total / np.maximum(count, 1)

    def _lay_flat(self) -> None:
        """Lengths, apexes and angles, and the normals of the faces."""
        n_faces = len(self.faces)
        arrays = [np.empty((n_faces, 3)) for _ in range(5)]
        for k in blocks(n_faces):
            for array, values in zip(arrays, _laid_flat(self.vertices[self.faces[k]])):
                array[k] = values
        self._normal, *by_face = arrays
        self.length, self.apex_x, self.apex_y, self.angle = (array.ravel() for array in by_face)

    @cached_property
    def outgoing(self) -> tuple[Ints, Ints]:
        """The halfedges that leave each vertex, in rising order, and the offsets (V + 1,) of the vertices."""
        return order_rows_by(self.tail, len(self.vertices))

    def next_direction(self, halfedge: Ints) -> tuple[Floats, Floats]:
        """Unit directions of the following halfedges of the faces, in the frames of halfedges.

        Parameters
        ----------
        halfedge : (n,) int64

        Returns
        -------
        x, y : (n,) float64
        """
        size = self.length[next_halfedge(halfedge)]
        return (self.apex_x[halfedge] - self.length[halfedge]) / size, self.apex_y[halfedge] / size

    def previous_direction(self, halfedge: Ints) -> tuple[Floats, Floats]:
        """The same of the preceding halfedges."""
        size = self.length[previous_halfedge(halfedge)]
        return -self.apex_x[halfedge] / size, -self.apex_y[halfedge] / size

    def points(self, halfedge: Ints, along: Floats) -> Floats:
        """Points along halfedges.

        Parameters
        ----------
        halfedge : (n,) int64
        along : (n,) float64
            Length from the tail.

        Returns
        -------
        (n, 3) float64
        """
        tail = self.vertices[self.tail[halfedge]]
        part = (along / self.length[halfedge])[:, None]
        points: Floats = tail + part * (self.vertices[self.head[halfedge]] - tail)
        return points

    def directions(self, halfedge: Ints, x: Floats, y: Floats) -> Floats:
        """Directions of frames, in space.

        Parameters
        ----------
        halfedge : (n,) int64
        x, y : (n,) float64

        Returns
        -------
        (n, 3) float64
        """
        edge = self.vertices[self.head[halfedge]] - self.vertices[self.tail[halfedge]]
        axis = edge / self.length[halfedge][:, None]
        ax, ay, az = axis.T
        nx, ny, nz = self._normal[halfedge // 3].T
        up = np.stack([ny * az - nz * ay, nz * ax - nx * az, nx * ay - ny * ax], axis=1)
        vectors: Floats = x[:, None] * axis + y[:, None] * up
        return vectors

    def across(self, halfedge: Ints, along: Floats, x: Floats, y: Floats) -> tuple[Ints, Floats, Floats, Floats]:
        """The same point and direction on an edge in the frame of its twin.

        Parameters
        ----------
        halfedge : (n,) int64
        along : (n,) float64
            Place on it.
        x, y : (n,) float64
            Direction in its frame.

        Returns
        -------
        twin : (n,) int64
            -1 at boundary halfedges.
        along, x, y : (n,) float64
        """
        return self.twin[halfedge], self.length[halfedge] - along, -x, -y


def _leave_face(
    frames: Unfolding, halfedge: Ints, px: Floats, py: Floats, ux: Floats, uy: Floats
) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """Find where lines from inside faces leave them.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
        Whose frame the rest is in.
    px, py, ux, uy : (n,) float64
        A point in the face, and a unit direction.

    Returns
    -------
    edge : (n,) int64
        Halfedge of the face that is left.
    far : (n,) float64
        Length of the way to it.
    along : (n,) float64
        Place on it, from its tail.
    ux, uy : (n,) float64
        The direction in its frame.
    """
    length, apex_x, apex_y = frames.length[halfedge], frames.apex_x[halfedge], frames.apex_y[halfedge]
    (nx, ny), (qx, qy) = frames.next_direction(halfedge), frames.previous_direction(halfedge)
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
    edge = np.where(by_next, next_halfedge(halfedge), halfedge)
    edge = np.where(by_previous, previous_halfedge(halfedge), edge)
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
    """Walk straight over a few faces from points on edges.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
    px : (n,) float64
        Place along the halfedge.
    ux, uy : (n,) float64
        Unit direction in its frame; with ``uy < 0`` the walk goes into the face of the twin.
    far : (n,) float64
        How far to walk.

    Returns
    -------
    halfedge : (n,) int64
        Whose frame the end is in.
    px, py, ux, uy : (n,) float64
        Place and direction of the end.
    arrived : (n,) bool
        False where a boundary halfedge was in the way.
    """
    at, x, y, dx, dy = halfedge.copy(), px.copy(), np.zeros(len(px)), ux.copy(), uy.copy()
    back = np.flatnonzero(uy < 0)
    twin, x[back], dx[back], dy[back] = frames.across(at[back], x[back], dx[back], dy[back])
    arrived = np.ones(len(at), bool)
    arrived[back] = twin != NO_TWIN
    at[back] = np.maximum(twin, 0)
    left = far.copy()
    active = np.flatnonzero(arrived)
    for _ in range(_MAX_FACES_NEARBY):
        if len(active) == 0:
            break
        edge, reach, along, ex, ey = _leave_face(frames, at[active], x[active], y[active], dx[active], dy[active])
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

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
    px, py, ux, uy : (n,) float64
        Point and unit direction in the frame of the halfedge.

    Returns
    -------
    halfedge : (n,) int64
        Entry edge of the same face.
    along, ux, uy : (n,) float64
        Place on it, and the direction in its frame.
    back : (n,) float64
        How far the line was moved back.
    """
    edge, far, along, ex, ey = _leave_face(frames, halfedge, px, py, -ux, -uy)
    return edge, along, -ex, -ey, far


def barycentric_at(frames: Unfolding, halfedge: Ints, px: Floats, py: Floats) -> Floats:
    """Barycentric coordinates of places in frames.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
    px, py : (n,) float64

    Returns
    -------
    (n, 3) float64
        Weights of tail, head and apex.
    """
    apex = py / np.maximum(frames.apex_y[halfedge], np.finfo(float).tiny)
    head = (px - apex * frames.apex_x[halfedge]) / frames.length[halfedge]
    return np.stack([1 - head - apex, head, apex], axis=1)


def _laid_flat(corners: Floats) -> tuple[Floats, ...]:
    """Normals of faces (n, 3), then (n, 3) each for the halfedges: length, apex and angle of the frame.

    Parameters
    ----------
    corners : (n, 3, 3) float64
    """
    edge = corners[:, [1, 2, 0]] - corners
    length = np.maximum(np.sqrt(np.einsum("fij,fij->fi", edge, edge)), np.finfo(float).tiny)
    after, before = length[:, [1, 2, 0]], length[:, [2, 0, 1]]
    normal = cross(edge[:, 0], edge[:, 1])
    double_area = np.sqrt(np.einsum("ij,ij->i", normal, normal))
    normal /= np.maximum(double_area, np.finfo(float).tiny)[:, None]
    apex_x = (length**2 + before**2 - after**2) / (2 * length)
    apex_y = double_area[:, None] / length
    return normal, length, apex_x, apex_y, arctangents(apex_y, apex_x)


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
    stopped_at : (n,) int64
        The boundary halfedge that was in the way, -1 where none was.
    stop_ux, stop_uy : (n,) float64
        Direction in which the walk came to it, in its frame.
    """

    offsets: Ints
    face: Ints
    start: Floats
    end: Floats
    begin: Floats
    finish: Floats
    far: Floats
    stopped_at: Ints
    stop_ux: Floats
    stop_uy: Floats

    def __len__(self) -> int:
        return len(self.far)

    @property
    def is_blocked(self) -> Bools:
        """(n,) whether a boundary halfedge was in the way."""
        return np.asarray(self.stopped_at != NO_TWIN)

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
            self.stopped_at[chosen],
            self.stop_ux[chosen],
            self.stop_uy[chosen],
        )


def _in_face_order(weights: Floats, halfedge: Ints) -> Floats:
    """Reorder weights of tail, head and apex to the corners of the face.

    Parameters
    ----------
    weights : (n, 3) float64
    halfedge : (n,) int64

    Returns
    -------
    (n, 3) float64
        Barycentric coordinates.
    """
    columns = (np.arange(3) - (halfedge % 3)[:, None]) % 3
    return np.take_along_axis(weights, columns, 1)


def on_halfedge(halfedge: Ints, part: Floats) -> Floats:
    """Barycentric coordinates, in their faces, of points on halfedges.

    Parameters
    ----------
    halfedge : (n,) int64
    part : (n,) float64
        From 0 at the tail to 1 at the head.

    Returns
    -------
    (n, 3) float64
    """
    return _in_face_order(np.stack([1.0 - part, part, np.zeros_like(part)], axis=1), halfedge)


def walk_far(frames: Unfolding, halfedge: Ints, px: Floats, py: Floats, ux: Floats, uy: Floats, far: Floats) -> Walks:
    """Walk straight over the mesh and record every face on the way.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
    px, py : (n,) float64
        Place in the frame of the halfedge, in its face or on the halfedge.
    ux, uy : (n,) float64
        Unit direction in that frame, into the face.
    far : (n,) float64
        How far to walk.

    Returns
    -------
    Walks
    """
    at, x, y, dx, dy = halfedge.copy(), px.copy(), py.copy(), ux.copy(), uy.copy()
    gone, stopped_at = np.zeros(len(at)), np.full(len(at), NO_TWIN)
    stop_ux, stop_uy = np.zeros(len(at)), np.zeros(len(at))
    active = np.arange(len(at))
    rows: list[_Row] = []
    for _ in range(_MAX_FACES):
        if len(active) == 0 and rows:
            break
        h, begin = at[active], gone[active]
        edge, reach, along, ex, ey = _leave_face(frames, h, x[active], y[active], dx[active], dy[active])
        start = _in_face_order(barycentric_at(frames, h, x[active], y[active]), h)
        ends = reach >= far[active] - begin
        step = np.where(ends, far[active] - begin, reach)
        inside = barycentric_at(frames, h, x[active] + step * dx[active], y[active] + step * dy[active])
        end = np.where(
            ends[:, None], _kept_inside(_in_face_order(inside, h)), on_halfedge(edge, along / frames.length[edge])
        )
        gone[active] += step
        rows.append((active, h // 3, start, end, begin, gone[active]))
        stuck = ~ends & (frames.twin[edge] == NO_TWIN)
        blocked = active[stuck]
        stopped_at[blocked], stop_ux[blocked], stop_uy[blocked] = edge[stuck], ex[stuck], ey[stuck]
        twin, tx, ex, ey = frames.across(edge, along, ex, ey)
        onward = ~ends & (twin != NO_TWIN)
        active = active[onward]
        at[active], x[active], y[active] = twin[onward], tx[onward], 0.0
        dx[active], dy[active] = ex[onward], ey[onward]
    offsets, face, start, end, begin, finish = _gather(rows, len(gone))
    return Walks(offsets, face, start, end, begin, finish, gone, stopped_at, stop_ux, stop_uy)


def _gather(rows: list[_Row], n_walks: int) -> tuple[Ints, Ints, Floats, Floats, Floats, Floats]:
    """Put the segments of each walk one behind the other."""
    walk, face = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    start, end, begin, finish = (np.concatenate([row[k] for row in rows]) for k in (2, 3, 4, 5))
    order = np.argsort(walk, kind="stable")
    offsets = offsets_of(np.bincount(walk, minlength=n_walks))
    return offsets, face[order], start[order], end[order], begin[order], finish[order]


def _kept_inside(weights: Floats) -> Floats:
    """Barycentric coordinates moved off the sides of the face by `_INSIDE_FACE`."""
    kept = np.maximum(weights, _INSIDE_FACE)
    inside: Floats = kept / kept.sum(1, keepdims=True)
    return inside


def place_along(walks: Walks, far: Floats) -> tuple[Ints, Floats]:
    """Places at which walks had come so far.

    Parameters
    ----------
    walks : Walks
    far : (n,) float64
        A length along each walk.

    Returns
    -------
    face : (n,) int64
    barycentric : (n, 3) float64
    """
    row = np.arange(len(walks.face))
    owner = np.repeat(np.arange(len(walks)), np.diff(walks.offsets))
    passed = np.bincount(owner[walks.finish < far[owner]], minlength=len(walks))
    row = np.minimum(walks.offsets[:-1] + passed, walks.offsets[1:] - 1)
    length = walks.finish[row] - walks.begin[row]
    part = np.divide(far - walks.begin[row], length, out=np.zeros(len(row)), where=length > 0)
    part = np.clip(part, 0.0, 1.0)[:, None]
    return walks.face[row], _kept_inside(walks.start[row] * (1 - part) + walks.end[row] * part)
