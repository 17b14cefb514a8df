"""The surface's mesh opened along its cuts, so that a cut is two borders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, next_halfedge
from weavecore.model.surface import SurfaceMesh


@dataclass(frozen=True, eq=False)
class OpenMesh:
    """Vertices (V, 3), faces (F, 3) and twins (3F,): faces are those of the surface, vertices on a cut appear twice."""

    vertices: Floats
    faces: Ints
    twins: Ints


def open_mesh(surface: SurfaceMesh) -> OpenMesh:
    """The mesh itself where there is no cut."""
    if not surface.is_cut.any():
        return OpenMesh(surface.vertices, surface.faces, surface.twins)
    twins = np.where(surface.is_cut, NO_TWIN, surface.twins)
    inner = np.flatnonzero(twins != NO_TWIN)
    n = len(twins)
    links = coo_matrix((np.ones(len(inner), np.int8), (inner, next_halfedge(twins[inner]))), shape=(n, n))
    count, fan = connected_components(links, directed=False)
    vertices = np.empty((count, 3))
    vertices[fan] = surface.vertices[surface.faces.ravel()]
    return OpenMesh(vertices, fan.astype(np.int64).reshape(-1, 3), twins)
