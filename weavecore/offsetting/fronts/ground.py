"""`Ground`: the surface that fronts walk on, and `Curves`: closed curves drawn on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.geometry.unfolding import Unfolding
from weavecore.model.surface import SurfaceMesh


class Ground:
    """A surface laid flat face by face, about the origin, in units of its median edge.

    Attributes
    ----------
    frames : Unfolding
        Borders and cuts are walls.
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
        self.normals = surface.face_normals
        self.vertices, self.faces = vertices, surface.faces
        self.area = float((self.frames.length * self.frames.apex_y)[0::3].sum() / 2)

    def points(self, face: Ints, weights: Floats) -> Floats:
        """(n, 3) points with barycentric coordinates (n, 3) in faces."""
        points: Floats = np.einsum("nk,nkd->nd", weights, self.vertices[self.faces[face]])
        return points

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


@dataclass(frozen=True, eq=False)
class Curves:
    """Closed curves on the ground: segments, each in one face, curve after curve.

    Parameters
    ----------
    offsets : (C+1,) int64
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
        return next_in_loop(self.offsets)

    @cached_property
    def lengths(self) -> Floats:
        """(m,) length of each segment."""
        lengths: Floats = np.linalg.norm(self.points[self.after] - self.points, axis=1)
        return lengths

    def take(self, chosen: Bools) -> Curves:
        """Some of the curves."""
        kept = chosen[self.owner]
        counts = np.diff(self.offsets)[chosen]
        return Curves(
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            self.face[kept],
            self.start[kept],
            self.end[kept],
            self.is_vertex[kept],
            self.is_corner[kept],
            self.points[kept],
        )
