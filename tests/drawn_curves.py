"""Curves drawn on a plate."""

from __future__ import annotations

import numpy as np

from flat_fields import flat_surface
from planar_meshes import rectangle
from weavecore.geometry.arrays import offsets_of
from weavecore.offsetting.propagation.chords import embed_chords
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves, next_along


def square_domain(size=10.0, edge=0.4):
    return Domain(flat_surface([rectangle(size, size)], edge))


def draw(domain, *loops):
    """Curves through the points (n, 2) of loops, in the unit and about the centroid of the domain."""
    return _draw(domain, loops, is_closed=True)


def draw_open(domain, *paths):
    """The same, from the first to the last point of paths."""
    return _draw(domain, paths, is_closed=False)


def _draw(domain, paths, *, is_closed):
    points = np.concatenate([np.c_[path, np.zeros(len(path))] for path in paths])
    face, weights = place(domain, points)
    offsets, closed = offsets_of([len(path) for path in paths]), np.full(len(paths), is_closed)
    after = next_along(offsets, closed)
    chord, face, start, end = embed_chords(domain, face, weights, face[after], weights[after])
    is_vertex = np.r_[True, chord[1:] != chord[:-1]]
    owner = np.repeat(np.arange(len(paths)), np.diff(offsets))[chord]
    counts = offsets_of(np.bincount(owner, minlength=len(paths)))
    return SurfaceCurves(counts, closed, face, start, end, is_vertex, is_vertex & False, domain.points(face, start))


def place(domain, points):
    """Face and barycentric coordinates of points of a plane mesh."""
    corners = domain.vertices[domain.faces][:, :, :2]
    face = np.empty(len(points), np.int64)
    weights = np.empty((len(points), 3))
    for k, point in enumerate(points[:, :2]):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        area = _cross(b - a, c - a)
        w = np.stack([_cross(c - b, point - b), _cross(a - c, point - c), _cross(b - a, point - a)], 1) / area[:, None]
        face[k] = w.min(1).argmax()
        weights[k] = w[face[k]]
    return face, weights


def _cross(u, v):
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def signed_areas(curves):
    """(C,) area of each curve in the plane, positive where it runs counter-clockwise."""
    p, q = curves.points, curves.points[curves.after]
    return np.bincount(curves.owner, (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / 2, len(curves))
