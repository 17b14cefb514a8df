"""Distances at free borders: the reflected double of the surface, and pseudo-sources at the corners of its border.

No distance starts at a *free border*, so shortest paths run along it and bend around it.  The surface is glued to its
mirror image along the free borders.  A path on this double that leaves the surface can be reflected back and is as
long; so distances on the double are those of shortest paths within the surface.

Where a free border turns away from the surface (an interior angle Θ > π), the double has a vertex of total angle
2 Θ > 2 π: a saddle, about which shortest paths bend.  It has so much angle that no ray sees what lies behind it, so it
becomes a *pseudo-source* (Mitchell, Mount and Papadimitriou 1987): a fan of rays leaves it all around when the front
reaches it.  Rays that run where the front has been come late, and stop.

Work: linear in the faces.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, ranks_in_rows, rows_of
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.ray_seeds import FAN_ANGLE, find_sector, rays_off_corner
from weavecore.offsetting.distance.rays import NO_RAY, GeodesicRays, TentativeDistances

MIN_PSEUDO_SOURCE_EXCESS = 0.05
"""Radians above a full turn from which a fan is started; less is left to the blockers of passing rays."""


def reflected_double(surface: SurfaceMesh) -> tuple[Ints, Ints, Ints]:
    """Faces of the surface, then those of its mirror image, turned over.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    vertex : (n,) int64
        The vertex of the surface that each vertex is or is the image of; those of the surface come first.
    faces : (2F, 3) int64
    twins : (6F,) int64
        -1 along cuts and along the borders where distances start.
    """
    n_vertices, n_halfedges = surface.n_vertices, 3 * surface.n_faces
    free = np.flatnonzero(surface.is_free_border)
    is_shared = np.zeros(n_vertices, bool)
    is_shared[halfedge_ends(surface.faces)[0][np.r_[free, next_halfedge(free)]]] = True
    image = np.where(is_shared, np.arange(n_vertices), n_vertices + np.cumsum(~is_shared) - 1)
    vertex = np.concatenate([np.arange(n_vertices), np.flatnonzero(~is_shared)])
    faces = np.concatenate([surface.faces, image[surface.faces[:, [0, 2, 1]]]])
    every = np.arange(n_halfedges)
    mirrored = n_halfedges + 3 * (every // 3) + 2 - every % 3
    twins = np.full(2 * n_halfedges, NO_TWIN)
    inner = np.flatnonzero((surface.twins != NO_TWIN) & ~surface.is_cut)
    twins[inner], twins[mirrored[inner]] = surface.twins[inner], mirrored[surface.twins[inner]]
    twins[free], twins[mirrored[free]] = mirrored[free], free
    return vertex, faces, twins


def unlink_across_free_borders(rays: GeodesicRays, surface: SurfaceMesh) -> None:
    """Unlink, in place, neighbours of which one runs on the surface and one on its image: no front joins them.

    Parameters
    ----------
    rays : GeodesicRays
    surface : SurfaceMesh
    """
    after = rays.links.after
    on_image = rays.state.halfedge >= 3 * surface.n_faces
    rays.links.after = np.where((after >= 0) & (on_image != on_image[after]), NO_RAY, after)


class PseudoSources:
    """Corners of free borders that the front has not reached yet.

    Parameters
    ----------
    frames : Unfolding
        Of the reflected double.
    surface : SurfaceMesh
    """

    def __init__(self, frames: Unfolding, surface: SurfaceMesh) -> None:
        free = np.flatnonzero(surface.is_free_border)
        vertex = surface.faces.ravel()[free]
        is_sharp = frames.excess[vertex] > MIN_PSEUDO_SOURCE_EXCESS
        self._vertex, self._leaving = vertex[is_sharp], free[is_sharp]

    def rays_from_reached(self, frames: Unfolding, tentative: TentativeDistances, distance: float) -> GeodesicRays:
        """Fans of rays all around the corners that lie within a distance, each corner once.

        Parameters
        ----------
        frames : Unfolding
        tentative : TentativeDistances
        distance : float

        Returns
        -------
        GeodesicRays
        """
        at = tentative.distance[self._vertex]
        reached = at < distance
        rays = _full_fans(frames, self._vertex[reached], self._leaving[reached], at[reached])
        self._vertex, self._leaving = self._vertex[~reached], self._leaving[~reached]
        return rays


def _full_fans(frames: Unfolding, vertex: Ints, leaving: Ints, distance: Floats) -> GeodesicRays:
    total = frames.total_angle[vertex]
    # An even number, so that no ray runs along the free border, where rounding would decide on which side it is.
    count = 2 * np.ceil(total / (2 * FAN_ANGLE)).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    angle = (ranks_in_rows(count) + 0.5) * (total / count)[owner]
    rays = rays_off_corner(frames, *find_sector(frames, leaving[owner], angle))
    rays.state.distance = distance[owner]
    # Counter-clockwise neighbours: the front between them runs the other way.
    rays.links.after = np.arange(len(owner)) - 1
    rays.links.after[offsets[:-1]] = offsets[1:] - 1
    return rays
