"""Ragged polygons: face ``f`` has the corners ``corners[offsets[f]:offsets[f + 1]]``."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, next_in_loop


def fan_triangles(offsets: Ints, corners: Ints) -> tuple[Ints, Ints]:
    """Each face as a fan of triangles (T, 3) about its first corner, and the face (T,) of each."""
    parts, face = _fans(offsets, corners, np.diff(offsets) - 2)
    return parts[:, :3], face


def fan_quads(offsets: Ints, corners: Ints) -> tuple[Ints, Ints]:
    """Quads (Q, 4) as they are, larger faces as fans, triangles with their last corner twice; and the face of each."""
    sides = np.diff(offsets)
    return _fans(offsets, corners, np.where(sides == 4, 1, sides - 2))


def nodes_on_border(offsets: Ints, corners: Ints, n_nodes: int) -> Bools:
    """(N,) whether a node is the end of an edge with a single face."""
    a, b = corners, corners[next_in_loop(offsets)]
    key, count = np.unique(np.minimum(a, b) * n_nodes + np.maximum(a, b), return_counts=True)
    naked = key[count == 1]
    on_border = np.zeros(n_nodes, bool)
    on_border[np.concatenate([naked // n_nodes, naked % n_nodes])] = True
    return on_border


def _fans(offsets: Ints, corners: Ints, n_parts: Ints) -> tuple[Ints, Ints]:
    """Cut each face into that many triangles about its first corner; where that falls one short, into a quad."""
    n_parts = np.maximum(n_parts, 0)
    face = np.repeat(np.arange(len(n_parts)), n_parts)
    step = np.arange(len(face)) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    start, end = offsets[:-1][face], offsets[1:][face]
    is_quad = end - start - n_parts[face] == 3
    second = start + step + 1
    return corners[np.stack([start, second, second + 1, second + 1 + is_quad], axis=1)], face
