"""Meshes as plain arrays, for the tests of the reading stage."""

from __future__ import annotations

import numpy as np


def grid(n=4, m=3):
    """A flat sheet of n by m quads: vertices (V, 3), faces (F, 4)."""
    x, y = np.meshgrid(np.arange(n + 1), np.arange(m + 1))
    first = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(float)
    return vertices, np.stack([first, first + 1, first + n + 2, first + n + 1], axis=1)


def triangles(quads):
    """The quads split by their first diagonal."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def band(n=12, *, twisted=False):
    """A closed band of n quads; with a twist it is a Moebius strip."""
    turn = 2 * np.pi * np.arange(n) / n
    lean = turn / 2 if twisted else 0 * turn
    middle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * 3
    across = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=1)
    vertices = np.concatenate([middle - across, middle + across])
    here = np.arange(n)
    there = (here + 1) % n
    low, high = np.stack([here, there]), np.stack([here, there]) + n
    if twisted:
        low[1, -1], high[1, -1] = high[1, -1], low[1, -1]
    return vertices, np.stack([low[0], low[1], high[1], high[0]], axis=1)


def torus(n=24, m=12, *, outer=3.0, inner=1.0):
    """A torus of n by m quads around z, faces outwards."""
    u, v = (2 * np.pi * k / c for k, c in zip(np.meshgrid(np.arange(n), np.arange(m), indexing="ij"), (n, m)))
    reach = outer + inner * np.cos(v)
    vertices = np.stack([reach * np.cos(u), reach * np.sin(u), inner * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    at = lambda a, b: (a % n) * m + b % m  # noqa: E731
    return vertices, np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], axis=1)


def ball(rounds=3, axes=(1.0, 1.0, 1.0)):
    """An ellipsoid of triangles, faces outwards, from an octahedron halved ``rounds`` times."""
    corners = [np.array(c, float) for c in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(rounds):
        middles: dict[tuple[int, int], int] = {}

        def middle(a, b, middles=middles):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(corners)
                corners.append((corners[a] + corners[b]) / np.linalg.norm(corners[a] + corners[b]))
            return middles[key]

        halves = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            halves += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = halves
    return np.array(corners) * axes, np.array(faces)


def loose(vertices, faces):
    """The same mesh with vertices of its own for each face."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(faces.shape)


def together(*meshes):
    """Several meshes in one pair of arrays."""
    shifts = np.cumsum([0] + [len(v) for v, _ in meshes])
    return np.concatenate([v for v, _ in meshes]), np.concatenate([f + s for (_, f), s in zip(meshes, shifts)])


def moved(points, x=0.0, y=0.0, z=0.0):
    return points + np.array([x, y, z])


def volume(vertices, faces):
    """Volume inside a closed mesh, positive where the faces look outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def area(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
