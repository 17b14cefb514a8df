"""Mesh cut open: the surface opened along its cuts, with the distance at its nodes.

Each cut becomes two borders, so that tracing needs no special case for cuts::

          before               after               node  a vertex of the surface (on a cut one node for each side),
        ----x----           ----x----                    or a point on an edge between two of those
        =c==c==c=   cut     =c==c==c=   one side   halfedges  3F of the faces, and b more on the outer side of the
        ----x----           =c'=c'=c'   other side            border, numbered on from those: every edge has two
                            ----x----

Work: linear in the faces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge, previous_halfedge
from weavecore.model.surface import Origins, SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField


@dataclass(frozen=True, eq=False)
class CutMesh:
    """A mesh with the distance from its origins.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
    distance : (n,) float64
    gradient : (n, 3) float64
    whole_faces : (F', 3) int64
        Nodes of the faces of the surface.
    face_of : (F,) int64
        Face of the surface that each face is part of.
    edge_of : (n, 2) int64
        The two nodes of ``whole_faces`` between which each node lies; twice itself at a vertex.
    share : (n,) float64
        Where between these two it lies: 0 to 1.
    ridge_slope : (n,) float64
        At a node on the cut locus, how steeply the distance rises along it; 1 elsewhere.
    origins : Origins
        Where distances start: paths of vertices of the surface.
    side_polyline : (s,) int64
        The sides of these paths on which there is surface: which path.  One inside the surface has two.
    side_node : (s,) int64
        A node of the mesh on that side.
    side_is_left : (s,) bool
        Whether it is the left side.
    """

    points: Floats
    faces: Ints
    twins: Ints
    distance: Floats
    gradient: Floats
    whole_faces: Ints
    face_of: Ints
    edge_of: Ints
    share: Floats
    ridge_slope: Floats
    origins: Origins
    side_polyline: Ints
    side_node: Ints
    side_is_left: Bools

    @property
    def n_nodes(self) -> int:
        return len(self.points)

    @cached_property
    def border(self) -> Ints:
        """(b,) the halfedges on the inner side of the border."""
        return np.flatnonzero(self.twins == NO_TWIN)

    @cached_property
    def opposite(self) -> Ints:
        """(3F + b,) the other halfedge of the same edge."""
        opposite = np.concatenate([self.twins, self.border])
        opposite[self.border] = len(self.twins) + np.arange(len(self.border))
        return opposite

    @cached_property
    def tail(self) -> Ints:
        """(3F + b,) node at which each halfedge begins."""
        tail, head = halfedge_ends(self.faces)
        return np.concatenate([tail, head[self.border]])

    @cached_property
    def head(self) -> Ints:
        """(3F + b,) node at which each halfedge ends."""
        tail, head = halfedge_ends(self.faces)
        return np.concatenate([head, tail[self.border]])

    @cached_property
    def edges(self) -> Ints:
        """(E,) one halfedge of every edge."""
        return np.flatnonzero(self.twins < np.arange(len(self.twins)))

    def on_border(self) -> Bools:
        """(n,) whether a node lies on the border of the mesh."""
        flag = np.zeros(self.n_nodes, bool)
        flag[self.tail[self.border]] = flag[self.head[self.border]] = True
        return flag

    def edge_normals(self, halfedge: Ints) -> Floats:
        """Unit normals of the surface at edges: the mean of those of the faces beside them, by area.

        Parameters
        ----------
        halfedge : (N,) int64

        Returns
        -------
        (N, 3) float64
        """
        n = len(self.twins)
        one, other = halfedge, self.opposite[halfedge]
        one, other = np.where(one < n, one, other), np.where(other < n, other, one)
        normal = self._face_vectors(one // 3) + self._face_vectors(other // 3)
        size = np.sqrt(np.einsum("ij,ij->i", normal, normal))[:, None]
        unit: Floats = np.divide(normal, size, out=normal, where=size > 0)
        return unit

    def _face_vectors(self, face: Ints) -> Floats:
        """(N, 3) normals of faces, as long as twice their areas."""
        a, b, c = (self.points[self.faces[face, k]] for k in range(3))
        (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T
        return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)

    def locate(self, halfedge: Ints, part: Floats) -> tuple[Ints, Floats]:
        """Place points on halfedges in the faces of the surface.

        Parameters
        ----------
        halfedge : (N,) int64
        part : (N,) float64
            From 0 at the tail to 1 at the head.

        Returns
        -------
        face : (N,) int64
        barycentric : (N, 3) float64
        """
        is_outer = halfedge >= len(self.twins)
        halfedge, part = np.where(is_outer, self.opposite[halfedge], halfedge), np.where(is_outer, 1.0 - part, part)
        face = self.face_of[halfedge // 3]
        barycentric = np.zeros((len(halfedge), 3))
        row = np.arange(len(halfedge))
        barycentric[row, halfedge % 3] = 1.0 - part
        barycentric[row, (halfedge + 1) % 3] = part
        split = np.flatnonzero((self.faces[halfedge // 3] != self.whole_faces[face]).any(1))
        barycentric[split] = self._weights_in(face[split], halfedge[split], part[split])
        return face, barycentric

    def _weights_in(self, face: Ints, halfedge: Ints, part: Floats) -> Floats:
        """Barycentric coordinates in whole faces of points on halfedges of their parts."""
        corners = self.whole_faces[face]
        barycentric = np.zeros((len(face), 3))
        for node, weight in ((self.tail[halfedge], 1.0 - part), (self.head[halfedge], part)):
            share = self.share[node]
            for k, weights in ((0, weight * (1.0 - share)), (1, weight * share)):
                barycentric += np.where(corners == self.edge_of[node, k, None], weights[:, None], 0.0)
        return barycentric


def open_along_cuts(surface: SurfaceMesh, field: DistanceField) -> CutMesh:
    """Open a surface along its cuts.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        On its vertices.

    Returns
    -------
    CutMesh
    """
    faces, vertex = split_vertices_at_cuts(surface)
    sides = sides_of_origins(surface)
    return CutMesh(
        points=surface.vertices[vertex],
        faces=faces,
        twins=np.where(surface.is_cut, NO_TWIN, surface.twins),
        distance=field.distance[vertex],
        gradient=field.gradient[vertex],
        whole_faces=faces,
        face_of=np.arange(surface.n_faces),
        edge_of=np.repeat(np.arange(len(vertex))[:, None], 2, axis=1),
        share=np.zeros(len(vertex)),
        ridge_slope=np.ones(len(vertex)),
        origins=surface.origins,
        side_polyline=sides.polyline,
        side_node=faces.ravel()[sides.halfedge],
        side_is_left=sides.is_left,
    )


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of the origins on which there is surface: the left ones first, then the right ones.

    Parameters
    ----------
    polyline : (s,) int64
        Which origin.
    halfedge : (s,) int64
        The halfedge along its first edge in the face on that side.
    is_left : (s,) bool
    """

    polyline: Ints
    halfedge: Ints
    is_left: Bools


def sides_of_origins(surface: SurfaceMesh) -> Sides:
    """Find the left side of every origin, and the right side of those inside the surface.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    Sides
    """
    tail, head = halfedge_ends(surface.faces)
    candidates = np.flatnonzero(surface.is_origin)
    key = tail[candidates] * surface.n_vertices + head[candidates]
    order = np.argsort(key)
    wanted = np.array([path[0] * surface.n_vertices + path[1] for path in surface.origins.paths], np.int64)
    left = candidates[order][np.searchsorted(key[order], wanted)]
    inner = np.flatnonzero(surface.twins[left] != NO_TWIN)
    every = np.arange(len(left))
    return Sides(
        polyline=np.concatenate([every, inner]),
        halfedge=np.concatenate([left, surface.twins[left[inner]]]),
        is_left=np.arange(len(left) + len(inner)) < len(left),
    )


def split_vertices_at_cuts(surface: SurfaceMesh) -> tuple[Ints, Ints]:
    """Split the vertices on cuts into one node for each fan of faces.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    faces : (F, 3) int64
        By nodes.
    vertex : (n,) int64
        The vertex that each node lies at; the first V nodes are the vertices themselves.
    """
    corner_vertex = surface.faces.ravel()
    n = surface.n_vertices
    cut = np.flatnonzero(surface.is_cut)
    if len(cut) == 0:
        return surface.faces, np.arange(n)
    is_on_cut = np.zeros(n, bool)
    is_on_cut[corner_vertex[cut]] = is_on_cut[corner_vertex[next_halfedge(cut)]] = True
    corners = np.flatnonzero(is_on_cut[corner_vertex])
    behind = previous_halfedge(corners)
    joined = ~surface.is_cut[behind] & (surface.twins[behind] != NO_TWIN)
    here = np.flatnonzero(joined)
    there = np.searchsorted(corners, surface.twins[behind[joined]])
    count, fan = connected(here, there, len(corners))
    fan_vertex = np.empty(count, np.int64)
    fan_vertex[fan] = corner_vertex[corners]
    # The first fan of a vertex keeps its number, the others are appended.
    _, keeps = np.unique(fan_vertex, return_index=True)
    is_new = np.ones(count, bool)
    is_new[keeps] = False
    node = fan_vertex.copy()
    node[is_new] = n + np.arange(int(is_new.sum()))
    faces = corner_vertex.copy()
    faces[corners] = node[fan]
    return faces.reshape(-1, 3), np.concatenate([np.arange(n), fan_vertex[is_new]])
