"""The register of tough surfaces, and what several of them are made with."""

from __future__ import annotations

import numpy as np

TOUGH = {}


def tough(make):
    """Enter a function of a random generator in the catalogue; its seed is drawn apart from those of others."""
    name = make.__name__

    def from_seed(seed=0):
        return make(np.random.default_rng([seed, *name.encode()]))

    from_seed.__name__, from_seed.__doc__ = name, make.__doc__
    TOUGH[name] = from_seed
    return from_seed


def grid(u, v, wrap_u=False, wrap_v=False):
    """Faces of a grid of u by v vertices (row-major in u), two triangles a cell, joined up where wrapped."""
    i, j = np.meshgrid(np.arange(u if wrap_u else u - 1), np.arange(v if wrap_v else v - 1), indexing="ij")
    i, j = i.ravel(), j.ravel()
    a, b = i * v + j, (i + 1) % u * v + j
    c, d = (i + 1) % u * v + (j + 1) % v, i * v + (j + 1) % v
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def sheet(x, y, z):
    """A grid of points as a mesh."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3).astype(float), grid(
        *np.broadcast(x, y, z).shape
    )


def joined(*meshes):
    """Several meshes as one, not connected."""
    shift = np.cumsum([0] + [len(v) for v, _ in meshes[:-1]])
    return np.concatenate([v for v, _ in meshes]), np.concatenate([f + s for (_, f), s in zip(meshes, shift)])


def curved(mesh, rng, height=0.3):
    """A flat mesh lifted to a smooth height."""
    vertices, faces = mesh
    size = np.ptp(vertices, axis=0).max()
    x, y = vertices[:, 0] / size, vertices[:, 1] / size
    a, b, c, d = rng.uniform(-3, 3, 4)
    lifted = vertices.copy()
    lifted[:, 2] = height * size * (np.sin(a * x + b) * np.cos(c * y + d) + 0.5 * x * y)
    return lifted, faces


def largest_piece(vertices, faces):
    """The connected piece with the most faces."""
    from weavecore.geometry.halfedges import components, find_twins

    _, label = components(find_twins(faces, len(vertices)))
    faces = faces[label == np.argmax(np.bincount(label))]
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(-1, 3)
