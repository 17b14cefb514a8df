"""Opening the surface along its cuts, to the sheet that the levels are traced on."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Ints
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, previous_halfedge
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.field import DistanceField
from weavecore.offsetting.sheet import Sheet


def open_sheet(surface: SurfaceMesh, field: DistanceField) -> Sheet:
    """The surface opened along its cuts."""
    faces, twins, vertex = surface.faces, surface.twins, np.arange(surface.n_vertices)
    if surface.cuts:
        faces, vertex = part_vertices(surface)
        twins = np.where(surface.is_cut, NO_TWIN, twins)
    n_borders, n_cuts = len(surface.borders), len(surface.cuts)
    left, right = halfedges_of_cuts(surface)
    first_of_borders = np.array([loop[0] for loop in surface.borders], np.int64)
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
        side_node=np.concatenate([first_of_borders, faces.ravel()[left], faces.ravel()[right]]),
        side_is_left=np.arange(n_borders + 2 * n_cuts) < n_borders + n_cuts,
    )


def halfedges_of_cuts(surface: SurfaceMesh) -> tuple[Ints, Ints]:
    """The halfedge from the first to the second vertex of each cut, and its twin."""
    tail, head = halfedge_ends(surface.faces)
    candidates = np.flatnonzero(surface.is_cut)
    key = tail[candidates] * surface.n_vertices + head[candidates]
    order = np.argsort(key)
    wanted = np.array([loop[0] * surface.n_vertices + loop[1] for loop in surface.cuts], np.int64)
    left: Ints = candidates[order][np.searchsorted(key[order], wanted)]
    return left, surface.twins[left]


def part_vertices(surface: SurfaceMesh) -> tuple[Ints, Ints]:
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
