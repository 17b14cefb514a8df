"""The surface that fronts propagate on: its faces in the plane, and its boundary halfedges in order.

A *boundary halfedge* is one that no straight line crosses: on a border, or on either side of a cut.  It runs with
the surface on its left.  Distances start at the *sources*; a *free border* is a border from which none starts::

         ------>  halfedge h  ----->  after[h]
    before[h]    ^          ^
          angle[h]          angle[after[h]]       the surface lies above the line, inside the angles

Lengths are in units of the median edge and coordinates are relative to the centroid, so that tolerances hold in any
unit of the model and far from its origin.  Everything here costs O(F) once.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, order_cycles, rows_of
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.ray_seeds import Corners


class Domain:
    """A surface unfolded face by face.

    Places on it are a face (n,) and barycentric coordinates (n, 3) in that face.

    Parameters
    ----------
    surface : SurfaceMesh

    Attributes
    ----------
    frames : Unfolding
        The frames of all halfedges; no line crosses borders and cuts.
    twins : (3F,) int64
        -1 at boundary halfedges.
    vertices : (V, 3) float64
        About their centroid, in units of the median edge.
    faces : (F, 3) int64
    normals : (F, 3) float64
        Unit normals of the faces.
    is_free_border : (3F,) bool
        Boundary halfedges from which no distance starts.
    has_free_borders : bool
    scale : float
        Length of the median edge in units of the model.
    area : float
        In square median edges.
    """

    def __init__(self, surface: SurfaceMesh) -> None:
        self.scale = float(np.median(surface.edge_lengths)) or 1.0
        vertices = (surface.vertices - surface.vertices.mean(axis=0)) / self.scale
        self.twins: Ints = np.where(surface.is_cut, NO_TWIN, surface.twins)
        self.frames = Unfolding(vertices, surface.faces, self.twins)
        self.is_free_border: Bools = surface.is_free_border
        self.has_free_borders = bool(self.is_free_border.any())
        self.normals = surface.face_normals
        self.vertices, self.faces = vertices, surface.faces
        self.area = float((self.frames.length * self.frames.apex_y)[0::3].sum() / 2)

    @cached_property
    def boundary(self) -> BoundaryHalfedges:
        """The boundary halfedges in order."""
        return BoundaryHalfedges(self.frames)

    def points(self, face: Ints, weights: Floats) -> Floats:
        """Coordinates (n, 3) of places; of differences of barycentric coordinates, vectors."""
        points: Floats = np.einsum("nk,nkd->nd", weights, self.vertices[self.faces[face]])
        return points

    def plane_points(self, face: Ints, weights: Floats) -> Floats:
        """Coordinates (n, 2) of places in the frames of the first halfedges of their faces."""
        h = 3 * face
        x = weights[:, 1] * self.frames.length[h] + weights[:, 2] * self.frames.apex_x[h]
        return np.stack([x, weights[:, 2] * self.frames.apex_y[h]], axis=1)

    def plane_directions(self, face: Ints, vectors: Floats) -> tuple[Floats, Floats]:
        """Unit directions (n,), (n,) in those frames of vectors (n, 3) projected onto the planes of the faces."""
        corners = self.vertices[self.faces[face]]
        along = corners[:, 1] - corners[:, 0]
        along = along / self.frames.length[3 * face][:, None]
        x = np.einsum("ij,ij->i", vectors, along)
        y = np.einsum("ij,ij->i", vectors, np.cross(self.normals[face], along))
        size = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
        return x / size, y / size

    def find_free_borders(self, face: Ints, weights: Floats) -> tuple[Ints, Floats]:
        """Halfedges (n,) of free borders on which places lie, -1 where on none, and the lengths (n,) along them."""
        apex = weights.argmin(1)
        row, halfedge = np.arange(len(face)), 3 * face + (apex + 1) % 3
        is_there = (weights[row, apex] == 0.0) & self.is_free_border[halfedge]
        place = weights[row, (apex + 2) % 3] * self.frames.length[halfedge]
        return np.where(is_there, halfedge, NO_TWIN), place


class BoundaryHalfedges:
    """The order of the boundary halfedges, and the angle of the surface between them.

    Parameters
    ----------
    frames : Unfolding

    Attributes
    ----------
    offsets, halfedges : (L+1,), (n,) int64
        The halfedges of each boundary loop, in order, with the surface on their left.
    after, before : (3F,) int64
        The boundary halfedge that begins where this one ends, and the one that ends where it begins; -1 inside.
    angle : (3F,) float64
        Angle of the surface between this one and the one before, in radians.
    """

    def __init__(self, frames: Unfolding) -> None:
        boundary = np.flatnonzero(frames.twin == NO_TWIN)
        corners = Corners(frames, boundary)
        self.before: Ints = np.full(len(frames.twin), NO_TWIN)
        self.before[boundary] = boundary[corners.before]
        self.after: Ints = np.full(len(frames.twin), NO_TWIN)
        self.after[self.before[boundary]] = boundary
        self.angle: Floats = np.zeros(len(frames.twin))
        self.angle[boundary] = corners.total
        number = np.full(len(frames.twin), NO_TWIN)
        number[boundary] = np.arange(len(boundary))
        order, self.offsets = order_cycles(number[self.after[boundary]])
        self.halfedges: Ints = boundary[order]
        length = frames.length[self.halfedges]
        self._station = np.zeros(len(frames.twin))
        self._station[self.halfedges] = np.cumsum(length) - length
        self._loop = np.full(len(frames.twin), NO_TWIN)
        self._loop[self.halfedges] = rows_of(self.offsets)
        self._around = np.bincount(rows_of(self.offsets), length, minlength=len(self.offsets) - 1)

    def measure_along(self, start: Ints, start_place: Floats, end: Ints, end_place: Floats) -> Floats:
        """Length along boundary loops between places on them.

        Parameters
        ----------
        start, end : (n,) int64
            Boundary halfedges.
        start_place, end_place : (n,) float64
            Length along each from its tail.

        Returns
        -------
        (n,) float64
            From start to end with the surface on the left; infinite between two loops.
        """
        way = self._station[end] + end_place - self._station[start] - start_place
        is_one = self._loop[start] == self._loop[end]
        return np.asarray(np.where(is_one, way % self._around[self._loop[start]], np.inf))
