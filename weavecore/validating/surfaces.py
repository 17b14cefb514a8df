"""What must hold of a `SurfaceMesh` beyond what it checks when it is made."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.report import Finding, count


def check_surface(surface: SurfaceMesh) -> Iterator[Finding]:
    """Faces without area, vertices without faces, cuts that leave the edges, cuts and origins that meet."""
    flat = np.flatnonzero(~surface.face_normals.any(1))
    yield count("faces_without_area", flat, "face")
    used = np.bincount(surface.faces.ravel(), minlength=surface.n_vertices) > 0
    yield count("vertices_unused", np.flatnonzero(~used), "vertex")
    yield from _check_cuts(surface)
    yield from _check_origins(surface)


def _check_cuts(surface: SurfaceMesh) -> Iterator[Finding]:
    """Cuts run along edges, and none passes a vertex where a cut or a border passes already."""
    n = surface.n_vertices
    tail, head = halfedge_ends(surface.faces)
    edges = np.concatenate([tail * n + head, head * n + tail])
    off = [k for k, loop in enumerate(surface.cuts) if not np.isin(loop * n + np.roll(loop, -1), edges).all()]
    yield count("cuts_off_edges", off, "cut")
    passes = np.concatenate([np.zeros(0, np.int64), *surface.cuts, *surface.borders])
    vertex, times = np.unique(passes, return_counts=True)
    yield count("cuts_that_meet", vertex[times > 1], "vertex")


def _check_origins(surface: SurfaceMesh) -> Iterator[Finding]:
    """Origins do not meet, and each runs wholly along one border, with the surface on its left, or wholly inside."""
    origins, n = surface.origins, surface.n_vertices
    tail, head = halfedge_ends(surface.faces)
    a, b = origins.edges()
    forth, back = np.isin(a * n + b, tail * n + head), np.isin(b * n + a, tail * n + head)
    counts = np.array([len(path) for path in origins.paths], np.int64)
    path = np.repeat(np.arange(len(origins)), counts - ~origins.closed)
    on_border = np.zeros(n, bool)
    on_border[np.concatenate([np.zeros(0, np.int64), *surface.borders])] = True
    # The ends of an open one may touch a border.
    ends = np.concatenate(
        [np.zeros(0, np.int64), *(p[[0, -1]] for p, c in zip(origins.paths, origins.closed) if not c)]
    )
    on_border[ends] = False
    along = np.setdiff1d(np.arange(len(origins)), path[~forth | back])
    inside = np.setdiff1d(np.arange(len(origins)), path[~(forth & back) | on_border[a] | on_border[b]])
    yield count("origins_astray", np.setdiff1d(np.arange(len(origins)), np.union1d(along, inside)), "origin")
    vertex, times = np.unique(origins.vertices(), return_counts=True)
    yield count("origins_that_meet", vertex[times > 1], "vertex")
