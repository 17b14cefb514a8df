"""A sensible spacing where none is asked for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from weavecore.geometry.arrays import Floats
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.geometry.refinement import refine_faces
from weavecore.model import SurfaceMesh
from weavecore.offsetting.wavefront import measure_distance

N_GENERATIONS = 15
"""How many generations the deepest part of a surface gets: enough to read its shape, few enough to build."""

FEWEST_GENERATIONS = 5
"""A mesh too coarse for that gets a wider spacing, but never so wide that fewer than these fit."""

EDGES_PER_SPACING = 3.0
"""A spacing of fewer mean edges than this would show the facets of the mesh rather than its shape."""

MOST_BEND = 1.5
"""Radians that the surface may turn over one spacing, on the mean: more, and the rings would cut through its tubes."""

_FEW_FACES = 2000  # such a mesh may be coarser than the surface is deep
_FEWEST_EDGES = 12  # across a square of the surface's area

_FRIENDLY = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


def suggest_spacing(surface: SurfaceMesh) -> float:
    """A spacing that fills the surface with some fifteen generations, as a round number.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    float
        In the model's unit.
    """
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    mean_edge = math.sqrt(areas.mean() * 4 / math.sqrt(3))
    if surface.n_faces < _FEW_FACES:
        depth = _depth_of_few_faces(surface, longest=math.sqrt(areas.sum()) / _FEWEST_EDGES)
    else:
        depth = _depth_along_edges(surface)
    if depth == 0:  # All vertices lie on borders still: as deep as the circle in the widest face.
        depth = 2 * float((areas / surface.edge_lengths.reshape(-1, 3).sum(1)).max())
    wanted = min(depth / N_GENERATIONS, MOST_BEND * _mean_radius(surface, float(areas.sum())))
    return round_friendly(max(wanted, min(EDGES_PER_SPACING * mean_edge, depth / FEWEST_GENERATIONS)))


def _mean_radius(surface: SurfaceMesh, area: float) -> float:
    """One over the mean of the curvature over the surface: the turn at each edge, times its length, over the area."""
    halfedge = np.flatnonzero(surface.twins > np.arange(len(surface.twins)))
    one, other = surface.face_normals[halfedge // 3], surface.face_normals[surface.twins[halfedge] // 3]
    turn = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(1))
    bend = float((turn * surface.edge_lengths[halfedge]).sum())
    return area / bend if bend > 0 else math.inf


def round_friendly(length: float) -> float:
    """The number nearest in proportion among 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 and their decimal multiples."""
    exponent = math.floor(math.log10(length))
    mantissa = length / 10.0**exponent
    nearest = _FRIENDLY[np.argmin(np.abs(np.log(_FRIENDLY / mantissa)))]
    return float(f"{nearest:g}e{exponent}")


def _depth_along_edges(surface: SurfaceMesh) -> float:
    """Distance of the farthest vertex from the borders and cuts, along edges: some percent too long, and cheap."""
    tail, head = halfedge_ends(surface.faces)
    n = surface.n_vertices
    graph = coo_matrix((surface.edge_lengths, (tail, head)), shape=(n, n)).tocsr()
    # Where two halfedges share an edge the sum of both would be stored; each runs its own way, so none do.
    sources = surface.origins.vertices()
    distance: Floats = dijkstra(graph, directed=False, indices=sources, min_only=True)
    return float(distance[np.isfinite(distance)].max())


def _depth_of_few_faces(surface: SurfaceMesh, *, longest: float) -> float:
    """The same where edges may be as long as the surface is deep, or no vertex lies off the borders."""
    fine = refine_faces(
        surface.vertices, surface.faces, longest=longest, protected=surface.is_cut, yielding=surface.is_selvedge
    )
    distance = measure_distance(replace(surface, vertices=fine.vertices, faces=fine.faces)).distance
    return float(distance[np.isfinite(distance)].max())
