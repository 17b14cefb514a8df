"""Meshes as exporters leave them: each of `MESSES` spoils a clean mesh in one way that people report.

``MESSES[name]`` is `Mess`: how the mesh is spoiled, and what must be noted.  ``sweep_exports.py`` weaves them by the
hundred.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

MESSES = {}


@dataclass(frozen=True)
class Mess:
    """A way to spoil a mesh.

    ``doubts`` are codes of which one must be noted; empty where the mesh is to be mended until its borders, pieces and
    area are those of the clean one.  ``refusals`` are codes of errors that are as good.
    """

    spoil: Callable
    doubts: frozenset
    refusals: frozenset


def mess(*doubts, refusals=()):
    """Enter a function of vertices, faces and a random generator in the catalogue."""

    def enter(spoil):
        MESSES[spoil.__name__] = Mess(spoil, frozenset(doubts), frozenset(refusals))
        return spoil

    return enter


def soup_of(vertices, faces, chosen):
    """The mesh with the chosen faces on vertices of their own."""
    apart = faces.copy()
    apart[chosen] = len(vertices) + np.arange(3 * chosen.sum()).reshape(-1, 3)
    return np.concatenate([vertices, vertices[faces[chosen]].reshape(-1, 3)]), apart


def inner_edges(faces, n_vertices):
    """Faces and corners opposite to one side of every edge of two faces."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    keys = sides.min(1) * np.int64(n_vertices) + sides.max(1)
    _, first, counts = np.unique(keys, return_index=True, return_counts=True)
    return first[counts == 2]


def quartered(vertices, faces):
    """Every face in four, by its edges' midpoints."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, index = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    middle = len(vertices) + index.reshape(-1, 3)
    a, b, c = faces.T
    ab, bc, ca = middle.T
    four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([vertices, vertices[ends].mean(axis=1)]), np.concatenate([np.stack(f, axis=1) for f in four])


def size_of(vertices):
    return float(np.ptp(vertices, axis=0).max())


@mess()
def lost_welds(vertices, faces, rng):
    """Some faces, or all, on vertices of their own."""
    return soup_of(vertices, faces, rng.random(len(faces)) < rng.choice([0.1, 0.5, 1.0]))


@mess()
def last_digits(vertices, faces, rng):
    """Faces on vertices of their own whose last digits differ, as after two matrices or a file of text."""
    apart, loose = soup_of(vertices, faces, rng.random(len(faces)) < rng.choice([0.3, 1.0]))
    return apart + size_of(vertices) * 1e-8 * rng.standard_normal(apart.shape), loose


@mess()
def turned_faces(vertices, faces, rng):
    """Faces that look to both sides."""
    turned = rng.random(len(faces)) < 0.3
    return vertices, np.where(turned[:, None], faces[:, ::-1], faces)


@mess()
def repeated_faces(vertices, faces, rng):
    """Faces given twice, from another corner or turned over."""
    again = faces[rng.random(len(faces)) < 0.2]
    again = np.roll(again, 1, axis=1)
    return vertices, np.concatenate([faces, again, again[::5, ::-1]])


@mess()
def specks(vertices, faces, rng):
    """Faces without area and vertices that no face uses."""
    some = faces[rng.random(len(faces)) < 0.2]
    return np.concatenate([vertices, vertices[:3] + 1]), np.concatenate([faces, some[:, [0, 1, 1]], some[:, [2, 2, 2]]])


@mess()
def t_junctions(vertices, faces, rng):
    """Edges divided on one side only."""
    sides = inner_edges(faces, len(vertices))
    sides = rng.permutation(sides)[: max(1, len(sides) // 20)]
    at, first = np.unique(sides // 3, return_index=True)  # a face is divided once
    corner = sides[first] % 3
    a, b, c = (faces[at, (corner + k) % 3] for k in range(3))
    middle = len(vertices) + np.arange(len(at))
    kept = np.delete(faces, at, axis=0)
    added = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
    return np.concatenate([vertices, (vertices[a] + vertices[b]) / 2]), np.concatenate([kept, added])


@mess()
def other_divisions(vertices, faces, rng):
    """Two parts that meet at a seam, one of them divided twice as finely."""
    axis = int(rng.integers(3))
    across = vertices[faces].mean(axis=1)[:, axis]
    near = across < np.quantile(across, rng.uniform(0.3, 0.7))
    fine_vertices, fine = quartered(vertices, faces[near])
    return np.concatenate([vertices, fine_vertices]), np.concatenate([faces[~near], fine + len(vertices)])


@mess()
def far_origin(vertices, faces, rng):
    """Far from the origin, in double precision."""
    return vertices + size_of(vertices) * 10.0 ** rng.uniform(2, 5) * rng.standard_normal(3), faces


@mess("FAR", refusals=["TOO_FAR_FROM_ORIGIN"])
def far_in_single_precision(vertices, faces, rng):
    """So far from the origin that single precision moves vertices by a tenth of an edge or more."""
    edges = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)
    away = np.median(edges) * 2.0**23 * rng.uniform(0.2, 2.0)
    return (vertices + np.array([away, away / 3, 0.0])).astype(np.float32).astype(float), faces


@mess("SCRAPS", "SLIT")
def scraps(vertices, faces, rng):
    """Stray triangles beside the surface."""
    n, size = int(rng.integers(1, 6)), size_of(vertices)
    places = vertices[rng.integers(len(vertices), size=n)] + 0.2 * size * rng.standard_normal((n, 3))
    corners = places[:, None] + 3e-4 * size * rng.standard_normal((n, 3, 3))
    return np.concatenate([vertices, corners.reshape(-1, 3)]), np.concatenate(
        [faces, len(vertices) + np.arange(3 * n).reshape(-1, 3)]
    )


@mess("SLIT")
def missing_face(vertices, faces, rng):
    """A hole of one face, far smaller than the surface, that nobody meant."""
    on_border = np.zeros(len(vertices), bool)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    on_border[ends[counts == 1]] = True
    inner = np.flatnonzero(~on_border[faces].any(axis=1))
    if len(inner) == 0:
        return vertices, None
    area = np.linalg.norm(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]), axis=1
    )
    return vertices, np.delete(faces, inner[np.argmin(area[inner])], axis=0)


@mess("COINCIDENT")
def laid_twice(vertices, faces, rng):
    """The surface once more in the same place, divided otherwise."""
    again, fine = quartered(vertices, faces)
    return np.concatenate([vertices, again]), np.concatenate([faces, fine + len(vertices)])


@mess("THIN", "COARSE")
def thickened(vertices, faces, rng):
    """A solid of the surface's thickness, closed by walls along its borders."""
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces.ravel(), np.repeat(across, 3, axis=0))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    if (length < 1e-9 * np.linalg.norm(across, axis=1).max()).any():
        return vertices, None
    thickness = rng.uniform(0.3, 0.6) * np.median(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1))
    other = vertices + thickness * normals / length
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    _, first, counts = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    a, b = sides[first[counts == 1]].T
    n = len(vertices)
    walls = np.concatenate([np.stack([b, a, a + n], 1), np.stack([b, a + n, b + n], 1)])
    return np.concatenate([vertices, other]), np.concatenate([faces[:, ::-1], faces + n, walls[:, ::-1]])
