"""Opening the surface along its cuts, to the sheet that the levels are traced on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Ints
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge, previous_halfedge
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.field import DistanceField
from weavecore.offsetting.sheet import Sheet


def open_sheet(surface: SurfaceMesh, field: DistanceField) -> Sheet:
    """The surface opened along its cuts."""
    faces, vertex = part_vertices(surface)
    sides = sides_of_origins(surface)
    return Sheet(
        points=surface.vertices[vertex],
        faces=faces,
        twins=np.where(surface.is_cut, NO_TWIN, surface.twins),
        distance=field.distance[vertex],
        gradient=field.gradient[vertex],
        whole_faces=faces,
        face_of=np.arange(surface.n_faces),
        edge_of=np.repeat(np.arange(len(vertex))[:, None], 2, axis=1),
        share=np.zeros(len(vertex)),
        steepness=np.ones(len(vertex)),
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
    """The left side of every origin, and the right side of those inside the surface."""
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


def part_vertices(surface: SurfaceMesh) -> tuple[Ints, Ints]:
    """Faces whose corners on a cut name one node per fan of faces, and the vertex of each node."""
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
