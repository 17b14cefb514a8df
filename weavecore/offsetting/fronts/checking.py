"""What must hold of fronts that were offset well; a surface on which it does not is refused.

Behind sharp features steps part, and what lies between them is not offset (see docs/fronts.md).  That can leave
fronts that cross or a part of the surface without any.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Ints, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.latitudes import Latitudes
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.judging import measure_nearness
from weavecore.offsetting.fronts.meeting import curves_meet, meet_themselves
from weavecore.offsetting.fronts.rays import Rays
from weavecore.offsetting.opening import part_vertices
from weavecore.tolerances import LEAST_HEM

NEAREST = 0.75
"""Spacings between parent and child at least; a chord over a fan of rays or a saddle is less than the spacing."""

DEEPEST, FARTHEST = 1.05, 1.4
"""Spacings that a pocket may be deep, and another band, where a child may have come a little too far."""


def refuse_crossings(ground: Ground, children: Curves, parents: Curves | None) -> None:
    """Raise `Degenerate` where children cross each other or a parent."""
    crossing = [meet_themselves(ground, children)]
    if parents is not None:
        crossing.append(curves_meet(ground, children, parents))
    at = np.concatenate([meetings.first for meetings in crossing])
    if len(at):
        raise _too_sharp(children.face[at])


def refuse_near(ground: Ground, rays: Rays, children: Curves) -> None:
    """Raise `Degenerate` where a vertex of a child is much nearer to the parents than the spacing."""
    vertex = np.flatnonzero(children.is_vertex)
    near = measure_nearness(ground, rays, children, vertex) < NEAREST
    if near.any():
        raise _too_sharp(children.face[vertex[near]])


def refuse_loose_ends(ground: Ground, children: Curves) -> None:
    """Raise `Degenerate` where an open child does not end on a selvedge."""
    at = np.concatenate(children.ends)
    loose = ground.rims(children.face[at], children.start[at])[0] == NO_TWIN
    if loose.any():
        raise _too_sharp(children.face[at[loose]])


def refuse_broken(latitudes: Latitudes) -> None:
    """Raise `Degenerate` where the bands do not make up the surface, a child has no parent or a part no ring."""
    surface, bands = latitudes.surface, latitudes.bands
    orphans = np.setdiff1d(np.flatnonzero(latitudes.generation > 0), latitudes.parents[:, 1])
    steps = latitudes.generation[latitudes.parents[:, 1]] - latitudes.generation[latitudes.parents[:, 0]]
    band = rows_of(bands.offsets)
    top = np.zeros(len(bands))
    np.maximum.at(top, band[bands.is_parent], latitudes.distance[bands.polyline[bands.is_parent]])
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    is_cut = np.bincount(band, ~latitudes.polylines.closed[bands.polyline], minlength=len(bands)) > 0
    deepest = np.where(is_cut, 1.0 + LEAST_HEM, DEEPEST)  # A child so near to a selvedge may be left out.
    too_deep = bands.depth > top + np.where(has_child, FARTHEST, deepest) * latitudes.spacing
    # Cut along its origins and all fronts the surface has one more for each open front.
    _, nodes = part_vertices(surface)
    parted = len(nodes) - surface.n_edges - int(surface.is_cut.sum()) // 2 + surface.n_faces
    n_open = int((~latitudes.polylines.closed[len(surface.origins) :]).sum())
    is_whole = int(bands.euler.sum()) == parted + n_open
    if len(orphans) or (steps != 1).any() or too_deep.any() or not is_whole:
        lines = np.concatenate([orphans, bands.polyline[too_deep[band]]])
        raise _too_sharp(latitudes.polylines.face[latitudes.polylines.offsets[lines]])


def _too_sharp(faces: Ints) -> Degenerate:
    return Degenerate(
        "Behind sharp features of the surface the polylines cannot be offset step by step",
        remedy='Take the method "levels", which passes sharp features, or another spacing.',
        ids=np.unique(faces).tolist(),
        kind="face",
    )
