"""The surface glued to its mirror along the selvedges.

A shortest path on it that leaves the surface can be folded back, and is no shorter for that; so distances are those of
shortest paths within the surface.  Where a selvedge turns away from the surface, such paths bend around its corner:
glued to its mirror that is a vertex with more than a full turn of angle, as any saddle of the surface is.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.ray_seeds import FAN_ANGLE, find_sector, start_off_corner
from weavecore.offsetting.distance.rays import Rays, Records


def part_sheets(rays: Rays, surface: SurfaceMesh) -> None:
    """Unlink rays of which one runs on the surface and the next on its mirror: there is no front between the two."""
    on_mirror = rays.halfedge >= 3 * surface.n_faces
    rays.after = np.where((rays.after >= 0) & (on_mirror != on_mirror[rays.after]), -1, rays.after)


def glue_mirror(surface: SurfaceMesh) -> tuple[Ints, Ints, Ints]:
    """The faces of the surface, then those of its mirror, turned over.

    Returns
    -------
    vertex : (n,) int64
        The vertex of the surface that each vertex is or is the mirror of; those of the surface come first.
    faces : (2F, 3) int64
    twins : (6F,) int64
        None along cuts and along the borders where distances start.
    """
    n_vertices, n_halfedges = surface.n_vertices, 3 * surface.n_faces
    selvedge = np.flatnonzero(surface.is_selvedge)
    is_shared = np.zeros(n_vertices, bool)
    is_shared[halfedge_ends(surface.faces)[0][np.r_[selvedge, next_halfedge(selvedge)]]] = True
    mirrored = np.where(is_shared, np.arange(n_vertices), n_vertices + np.cumsum(~is_shared) - 1)
    vertex = np.concatenate([np.arange(n_vertices), np.flatnonzero(~is_shared)])
    faces = np.concatenate([surface.faces, mirrored[surface.faces[:, [0, 2, 1]]]])
    every = np.arange(n_halfedges)
    mirror = n_halfedges + 3 * (every // 3) + 2 - every % 3
    twins = np.full(2 * n_halfedges, NO_TWIN)
    inner = np.flatnonzero((surface.twins != NO_TWIN) & ~surface.is_cut)
    twins[inner], twins[mirror[inner]] = surface.twins[inner], mirror[surface.twins[inner]]
    twins[selvedge], twins[mirror[selvedge]] = mirror[selvedge], selvedge
    return vertex, faces, twins


# ----------------------------------------------------------------------
# Corners of selvedges that shortest paths bend around.
#
# Glued to its mirror a selvedge that turns away from the surface is a saddle with so much angle that no ray sees what
# lies behind it.  The front turns about it as about a border's corner: a fan of rays leaves it all around when it has
# been reached.  Those that run where the front has been are late, and die.

SHARP = 0.05
"""Radians above a full turn from which on fans are worth their while."""


class Saddles:
    """The corners of a surface's selvedges that the front has not reached yet."""

    def __init__(self, frames: Unfolding, surface: SurfaceMesh) -> None:
        selvedge = np.flatnonzero(surface.is_selvedge)
        vertex = surface.faces.ravel()[selvedge]
        is_sharp = frames.excess[vertex] > SHARP
        self._vertex, self._leaving = vertex[is_sharp], selvedge[is_sharp]

    def fan_out(self, frames: Unfolding, records: Records, distance: float) -> Rays:
        """Rays that leave all around the saddles which lie within a distance."""
        at = records.distance[self._vertex]
        reached = at < distance
        rays = _fans(frames, self._vertex[reached], self._leaving[reached], at[reached])
        self._vertex, self._leaving = self._vertex[~reached], self._leaving[~reached]
        return rays


def _fans(frames: Unfolding, vertex: Ints, leaving: Ints, distance: Floats) -> Rays:
    total = frames.total_angle[vertex]
    # An even number, so that no ray runs along the selvedge, where rounding would tell which sheet it is on.
    count = 2 * np.ceil(total / (2 * FAN_ANGLE)).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    angle = (np.arange(len(owner)) - offsets[owner] + 0.5) * (total / count)[owner]
    halfedge, angle = find_sector(frames, leaving[owner], angle)
    rays = start_off_corner(frames, halfedge, angle)
    rays.distance = distance[owner]
    # Counter-clockwise neighbours: the front between them runs the other way.
    rays.after = np.arange(len(owner)) - 1
    first = offsets[:-1]
    rays.after[first] = offsets[1:] - 1
    return rays
