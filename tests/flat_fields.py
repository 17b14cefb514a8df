"""Plane surfaces whose distance from the border, and its direction, are known everywhere."""

from __future__ import annotations

import numpy as np

from planar_meshes import plate
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField


def flat_surface(loops, edge, seed=1):
    """A plate with a jittered mesh."""
    return SurfaceMesh(*plate(loops, edge, 0.25, np.random.default_rng(seed)))


def distance_at(surface, points):
    """(N,) distance of points from the border of a plane mesh, and (N, 3) the direction away from it."""
    tail, head = halfedge_ends(surface.faces)
    border = np.flatnonzero(surface.twins == NO_TWIN)
    best, nearest = np.full(len(points), np.inf), np.zeros((len(points), 3))
    for a, b in zip(surface.vertices[tail[border]], surface.vertices[head[border]]):
        part = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        foot = a + part[:, None] * (b - a)
        away = np.linalg.norm(points - foot, axis=1)
        nearest[away < best] = foot[away < best]
        best = np.minimum(best, away)
    direction = np.divide(points - nearest, best[:, None], out=np.zeros_like(nearest), where=best[:, None] > 0)
    return best, direction


def flat_field(surface):
    """The exact field at the vertices."""
    distance, direction = distance_at(surface, surface.vertices)
    on_border = np.concatenate(surface.borders)
    distance[on_border], direction[on_border] = 0.0, 0.0
    return DistanceField(distance, direction)


def without_directions(field):
    """The same distances with no direction known."""
    return DistanceField(field.distance, np.zeros_like(field.gradient))
