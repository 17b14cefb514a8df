"""`validate`: check the result of a stage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice
from weavecore.model.strands import Strands
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.check_latitudes import check_latitudes
from weavecore.validating.check_lattices import check_lattice, check_strands
from weavecore.validating.report import Finding, Report, count

Checkable = Union[SurfaceMesh, Latitudes, Lattice, Strands]


def validate(value: Checkable, *, lattice: Optional[Lattice] = None) -> Report:
    """Check the invariants of a stage's result.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice or Strands
        Only the value itself is checked, not those it was made from.
    lattice : Lattice, optional
        The lattice whose edges the strands partition; needed with strands only.

    Returns
    -------
    Report
        One finding for each invariant; ``report.raise_if_broken()`` raises `Broken`.

    Raises
    ------
    Unsupported
        For a value that no stage returns, and for strands without their lattice.
    """
    if isinstance(value, SurfaceMesh):
        return Report.of(_check_surface(value))
    if isinstance(value, Latitudes):
        return Report.of(check_latitudes(value))
    if isinstance(value, Lattice):
        return Report.of(check_lattice(value))
    if isinstance(value, Strands) and lattice is not None:
        return Report.of(check_strands(value, lattice))
    raise Unsupported(
        f"A {type(value).__name__} alone cannot be checked",
        remedy="Pass a surface, latitudes, a lattice, or strands together with their lattice.",
    )


def _check_surface(surface: SurfaceMesh) -> Iterator[Finding]:
    """No face is without area and no vertex without a face; cuts and origins run along edges and do not meet."""
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
