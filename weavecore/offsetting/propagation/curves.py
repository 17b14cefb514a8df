"""`Ground`: the surface that fronts walk on, and `Curves`: closed and open curves drawn on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, order_cycles, rows_of
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.ray_seeds import Corners


class Ground:
    """A surface laid flat face by face, about the origin, in units of its median edge.

    Attributes
    ----------
    frames : Unfolding
        Borders and cuts are walls.
    is_selvedge : (3F,) bool
        Walls from which no distance starts.
    normals : (F, 3) float64
    scale : float
        The unit in units of the model.
    area : float
    """

    def __init__(self, surface: SurfaceMesh) -> None:
        self.scale = float(np.median(surface.edge_lengths)) or 1.0
        vertices = (surface.vertices - surface.vertices.mean(axis=0)) / self.scale
        self.twins: Ints = np.where(surface.is_cut, NO_TWIN, surface.twins)
        self.frames = Unfolding(vertices, surface.faces, self.twins)
        self.is_selvedge: Bools = surface.is_selvedge
        self.has_selvedges = bool(self.is_selvedge.any())
        self.normals = surface.face_normals
        self.vertices, self.faces = vertices, surface.faces
        self.area = float((self.frames.length * self.frames.apex_y)[0::3].sum() / 2)

    @cached_property
    def walls(self) -> Walls:
        """How the walls hang together."""
        return Walls(self.frames)

    def points(self, face: Ints, weights: Floats) -> Floats:
        """(n, 3) points with barycentric coordinates (n, 3) in faces."""
        points: Floats = np.einsum("nk,nkd->nd", weights, self.vertices[self.faces[face]])
        return points

    def rims(self, face: Ints, weights: Floats) -> tuple[Ints, Floats]:
        """The halfedges of selvedges on which places lie, -1 where they lie on none, and how far along them."""
        apex = weights.argmin(1)
        row, halfedge = np.arange(len(face)), 3 * face + (apex + 1) % 3
        is_there = (weights[row, apex] == 0.0) & self.is_selvedge[halfedge]
        place = weights[row, (apex + 2) % 3] * self.frames.length[halfedge]
        return np.where(is_there, halfedge, NO_TWIN), place

    def flat(self, face: Ints, weights: Floats) -> Floats:
        """(n, 2) the same in the frames of the first halfedges of the faces."""
        h = 3 * face
        x = weights[:, 1] * self.frames.length[h] + weights[:, 2] * self.frames.apex_x[h]
        return np.stack([x, weights[:, 2] * self.frames.apex_y[h]], axis=1)

    def aimed(self, face: Ints, vectors: Floats) -> tuple[Floats, Floats]:
        """Unit directions in those frames that vectors (n, 3) in the faces' planes have."""
        corners = self.vertices[self.faces[face]]
        along = corners[:, 1] - corners[:, 0]
        along = along / self.frames.length[3 * face][:, None]
        x = np.einsum("ij,ij->i", vectors, along)
        y = np.einsum("ij,ij->i", vectors, np.cross(self.normals[face], along))
        size = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
        return x / size, y / size


class Walls:
    """What comes before and after along each wall, and how much surface there is between; arrays (3F,).

    Attributes
    ----------
    offsets, halfedges : (W+1,), (n,) int64
        The halfedges of each wall, in order, with the surface on their left.
    after, before : int64
        The halfedge of a wall that begins where this one ends, and the one that ends where it begins.
    angle : float64
        Of the surface between this one and the one before.
    """

    def __init__(self, frames: Unfolding) -> None:
        wall = np.flatnonzero(frames.twin == NO_TWIN)
        corners = Corners(frames, wall)
        self.before: Ints = np.full(len(frames.twin), NO_TWIN)
        self.before[wall] = wall[corners.before]
        self.after: Ints = np.full(len(frames.twin), NO_TWIN)
        self.after[self.before[wall]] = wall
        self.angle: Floats = np.zeros(len(frames.twin))
        self.angle[wall] = corners.total
        number = np.full(len(frames.twin), NO_TWIN)
        number[wall] = np.arange(len(wall))
        order, self.offsets = order_cycles(number[self.after[wall]])
        self.halfedges: Ints = wall[order]
        length = frames.length[self.halfedges]
        self._station = np.zeros(len(frames.twin))
        self._station[self.halfedges] = np.cumsum(length) - length
        self._loop = np.full(len(frames.twin), NO_TWIN)
        self._loop[self.halfedges] = rows_of(self.offsets)
        self._around = np.bincount(rows_of(self.offsets), length, minlength=len(self.offsets) - 1)

    def measure_along(self, start: Ints, start_place: Floats, end: Ints, end_place: Floats) -> Floats:
        """How far it is along walls, the surface on the left, between places on them; infinite between two walls."""
        way = self._station[end] + end_place - self._station[start] - start_place
        is_one = self._loop[start] == self._loop[end]
        return np.asarray(np.where(is_one, way % self._around[self._loop[start]], np.inf))


def next_along(offsets: Ints, closed: Bools) -> Ints:
    """For each value of a ragged array the index of the next one of its row; the last of an open row stays."""
    after = next_in_loop(offsets)
    last = offsets[1:][~closed & (np.diff(offsets) > 0)] - 1
    after[last] = last
    return after


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves on the ground: segments, each in one face, curve after curve.

    The last segment of an open curve is a point, its end, and comes after itself.

    Parameters
    ----------
    offsets : (C+1,) int64
    closed : (C,) bool
    face : (m,) int64
    start, end : (m, 3) float64
        Barycentric coordinates of both ends of each segment in its face.
    is_vertex : (m,) bool
        Whether a segment begins at a vertex of the polyline: where it was put by an offset or by a
        reconnection, not where it only goes from one face to the next.
    is_corner : (m,) bool
        Whether that vertex comes from a reconnection.
    points : (m, 3) float64
        Where each segment begins.
    """

    offsets: Ints
    closed: Bools
    face: Ints
    start: Floats
    end: Floats
    is_vertex: Bools
    is_corner: Bools
    points: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def owner(self) -> Ints:
        """(m,) the curve of each segment."""
        return rows_of(self.offsets)

    @cached_property
    def after(self) -> Ints:
        """(m,) the next segment of the same curve."""
        return next_along(self.offsets, self.closed)

    @cached_property
    def lengths(self) -> Floats:
        """(m,) length of each segment."""
        lengths: Floats = np.linalg.norm(self.points[self.after] - self.points, axis=1)
        return lengths

    def locate(self, station: Floats, owner: Ints) -> tuple[Ints, Floats]:
        """Segments (n,) of curves, and where on them in 0 to 1, at arc lengths counted along all curves."""
        total = np.concatenate([[0.0], np.cumsum(self.lengths)])
        segment = np.searchsorted(total, station, side="right") - 1
        segment = np.clip(segment, self.offsets[owner], self.offsets[owner + 1] - 1)
        length = self.lengths[segment]
        part = np.divide(station - total[segment], length, out=np.zeros(len(segment)), where=length > 0)
        return segment, np.clip(part, 0.0, 1.0)

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """First and last segments (c,) of the open curves."""
        return self.offsets[:-1][~self.closed], self.offsets[1:][~self.closed] - 1

    def take(self, chosen: Bools) -> Curves:
        """Some of the curves."""
        kept = chosen[self.owner]
        counts = np.diff(self.offsets)[chosen]
        return Curves(
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            self.closed[chosen],
            self.face[kept],
            self.start[kept],
            self.end[kept],
            self.is_vertex[kept],
            self.is_corner[kept],
            self.points[kept],
        )
