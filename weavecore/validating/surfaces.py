"""What must hold of a `SurfaceMesh` beyond what it checks when it is made."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.report import Finding, count


def check_surface(surface: SurfaceMesh) -> Iterator[Finding]:
    """Faces without area, vertices without faces, and cuts or origins that leave the edges or meet."""
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
    """Origins run along edges and do not meet, each wholly along one border, which has them on its left, or inside."""
    origins, n = surface.origins, surface.n_vertices
    tail, head = halfedge_ends(surface.faces)
    forth, back = tail * n + head, head * n + tail
    on_border = np.zeros(n, bool)
    on_border[np.concatenate([np.zeros(0, np.int64), *surface.borders])] = True
    off, astray = [], []
    for k, (path, closed) in enumerate(zip(origins.paths, origins.closed.tolist())):
        steps = path * n + np.roll(path, -1) if closed else path[:-1] * n + path[1:]
        if not (np.isin(steps, forth) | np.isin(steps, back)).all():
            off.append(k)
        along = (np.isin(steps, forth) & ~np.isin(steps, back)).all()
        inner = path if closed else path[1:-1]
        inside = not on_border[inner].any() and (np.isin(steps, forth) & np.isin(steps, back)).all()
        if not (along or inside):
            astray.append(k)
    yield count("origins_off_edges", off, "origin")
    yield count("origins_astray", astray, "origin")
    vertex, times = np.unique(origins.vertices(), return_counts=True)
    yield count("origins_that_meet", vertex[times > 1], "vertex")
