"""Distances from borders that are known without tracing anything over a mesh."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
from weavecore.model import SurfaceMesh


def flat_distance(surface):
    """(V,) distance from the border of a plane mesh: the nearest border point can always be seen."""
    tail, head = halfedge_ends(surface.faces)
    border = np.flatnonzero(surface.twins == NO_TWIN)
    a, b = surface.vertices[tail[border]], surface.vertices[head[border]]
    best = np.full(surface.n_vertices, np.inf)
    for start, end in zip(a, b):
        along = end - start
        part = np.clip((surface.vertices - start) @ along / (along @ along), 0, 1)
        best = np.minimum(best, np.linalg.norm(surface.vertices - start - part[:, None] * along, axis=1))
    return best


def rolled(vertices, radius):
    """A plane mesh rolled onto a cylinder: what is measured along the surface stays nearly the same."""
    angle = vertices[:, 0] / radius
    return np.stack([radius * np.sin(angle), vertices[:, 1], radius * np.cos(angle)], axis=1)


def sector_sheet(radii, n):
    """Sectors of 60 degrees around a vertex, one from each rim to the next, each divided n times.

    ``radii`` are the rims' lengths.  Fewer than six rims stand up to a pyramid (a cone point), six lie flat;
    more, an even number, fold up and down by turns (a saddle).  Returns the surface and the polar
    coordinates (r, angle) of its vertices along the surface.
    """
    count = len(radii)
    turn = 2 * np.pi * np.arange(count) / count
    # Neighbouring rims r, s of height h are 60 degrees apart: r.s = (1 - h^2) cos(turn) +- h^2 = 1/2.
    sign = 1.0 if count < 6 else -1.0
    height = 0.0 if count == 6 else np.sqrt((0.5 - np.cos(turn[1])) / (sign - np.cos(turn[1])))
    flat, up = np.sqrt(1 - height**2), height * sign ** np.arange(count)
    rims = np.stack([flat * np.cos(turn), flat * np.sin(turn), up], axis=1) * np.asarray(radii, float)[:, None]
    points, polar, faces = [], [], []
    for s in range(count):
        here, there = radii[s], radii[(s + 1) % count] * np.exp(1j * np.pi / 3)
        index = {}
        for i in range(n + 1):
            for j in range(n + 1 - i):
                index[i, j] = len(points)
                points.append((i * rims[s] + j * rims[(s + 1) % count]) / n)
                at = (i * here + j * there) / n
                polar.append((abs(at), (s * np.pi / 3 + np.angle(at)) % (count * np.pi / 3)))
        for i in range(n):
            for j in range(n - i):
                faces.append([index[i, j], index[i + 1, j], index[i, j + 1]])
                if i + j < n - 1:
                    faces.append([index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]])
    _, first, same = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return SurfaceMesh(np.array(points)[first], same.ravel()[np.array(faces)]), np.array(polar)[first]


def sector_distance(radii, polar, samples=400):
    """Distance of polar points from the border of a sector sheet: straight, or around the middle."""
    total = len(radii) * np.pi / 3
    best = np.full(len(polar), np.inf)
    part = np.linspace(0, 1, samples)
    for s in range(len(radii)):
        side = radii[s] * (1 - part) + radii[(s + 1) % len(radii)] * np.exp(1j * np.pi / 3) * part
        far, angle = np.abs(side), s * np.pi / 3 + np.angle(side)
        between = np.abs(polar[:, 1, None] - angle)
        between = np.minimum(between, total - between)
        straight = np.abs(polar[:, 0, None] - far * np.exp(1j * np.minimum(between, np.pi)))
        best = np.minimum(best, straight.min(axis=1))
    return best
