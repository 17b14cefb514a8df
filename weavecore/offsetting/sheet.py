"""`Sheet`: the surface as the levels are traced on it, with the distance at its nodes.

A sheet is opened along the cuts: each is two borders, so that whoever traces never needs to
ask about cuts.  A *node* of the sheet is a vertex of the surface (one on a cut is a
node per side) or lies on an edge between two of those.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, previous_halfedge
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.field import DistanceField


@dataclass(frozen=True, eq=False)
class Sheet:
    """A mesh with a distance that is 0 on all of its border.

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
    steepness : (n,) float64
        How steeply the distance rises along the ridge at a node that was put on one; 1 elsewhere.
    origins : tuple of int arrays
        Vertex loops of the surface where distances start: its borders, then its cuts.
    side_polyline, side_node, side_is_left : (s,)
        The sides of these loops on which there is surface: which loop, one node
        of the sheet on that side, and whether it is the left side.  A cut has two.
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
    steepness: Floats
    origins: tuple[Ints, ...]
    side_polyline: Ints
    side_node: Ints
    side_is_left: Bools

    @property
    def n_origins(self) -> int:
        return len(self.origins)

    @property
    def n_nodes(self) -> int:
        return len(self.points)

    def on_border(self) -> Bools:
        """(n,) whether a node lies on the border of the sheet."""
        flag = np.zeros(self.n_nodes, bool)
        tail, head = halfedge_ends(self.faces)
        border = self.twins == NO_TWIN
        flag[tail[border]] = flag[head[border]] = True
        return flag

    def locate(self, halfedge: Ints, part: Floats) -> tuple[Ints, Floats]:
        """Face of the surface and barycentric coordinates in it (N, 3) of points on halfedges."""
        tail, head = halfedge_ends(self.faces)
        face = self.face_of[halfedge // 3]
        corners = self.whole_faces[face]
        barycentric = np.zeros((len(halfedge), 3))
        for node, weight in ((tail[halfedge], 1.0 - part), (head[halfedge], part)):
            a, b = self.edge_of[node].T
            share = self.share[node]
            barycentric += np.where(corners == a[:, None], (weight * (1.0 - share))[:, None], 0.0)
            barycentric += np.where(corners == b[:, None], (weight * share)[:, None], 0.0)
        return face, barycentric


def open_sheet(surface: SurfaceMesh, field: DistanceField) -> Sheet:
    """The surface opened along its cuts."""
    faces, twins, vertex = surface.faces, surface.twins, np.arange(surface.n_vertices)
    if surface.cuts:
        faces, vertex = _part_vertices(surface)
        twins = np.where(surface.is_cut, NO_TWIN, twins)
    n_borders, n_cuts = len(surface.borders), len(surface.cuts)
    left, right = _halfedges_of_cuts(surface)
    return Sheet(
        points=surface.vertices[vertex] if surface.cuts else surface.vertices,
        faces=faces,
        twins=twins,
        distance=field.distance[vertex],
        gradient=field.gradient[vertex],
        whole_faces=faces,
        face_of=np.arange(surface.n_faces),
        edge_of=np.repeat(np.arange(len(vertex))[:, None], 2, axis=1),
        share=np.zeros(len(vertex)),
        steepness=np.ones(len(vertex)),
        origins=surface.borders + surface.cuts,
        side_polyline=np.concatenate([np.arange(n_borders + n_cuts), n_borders + np.arange(n_cuts)]),
        side_node=np.concatenate([[b[0] for b in surface.borders], faces.ravel()[left], faces.ravel()[right]]).astype(
            np.int64
        ),
        side_is_left=np.arange(n_borders + 2 * n_cuts) < n_borders + n_cuts,
    )


def _halfedges_of_cuts(surface: SurfaceMesh) -> tuple[Ints, Ints]:
    """The halfedge from the first to the second vertex of each cut, and its twin."""
    tail, head = halfedge_ends(surface.faces)
    candidates = np.flatnonzero(surface.is_cut)
    key = tail[candidates] * surface.n_vertices + head[candidates]
    order = np.argsort(key)
    wanted = np.array([loop[0] * surface.n_vertices + loop[1] for loop in surface.cuts], np.int64)
    left: Ints = candidates[order][np.searchsorted(key[order], wanted)]
    return left, surface.twins[left]


def _part_vertices(surface: SurfaceMesh) -> tuple[Ints, Ints]:
    """Faces whose corners on a cut name one node per fan of faces, and the vertex of each node."""
    corner_vertex = surface.faces.ravel()
    n = surface.n_vertices
    is_on_cut = np.zeros(n, bool)
    is_on_cut[np.concatenate(surface.cuts)] = True
    corners = np.flatnonzero(is_on_cut[corner_vertex])
    behind = previous_halfedge(corners)
    joined = ~surface.is_cut[behind] & (surface.twins[behind] != NO_TWIN)
    here = np.flatnonzero(joined)
    there = np.searchsorted(corners, surface.twins[behind[joined]])
    links = coo_matrix((np.ones(len(here), np.int8), (here, there)), shape=(len(corners), len(corners)))
    count, fan = connected_components(links, directed=False)
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
