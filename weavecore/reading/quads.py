"""Quads split into triangles by their better diagonal."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

_TIE = 1e-9
"""Radians: least angles that differ by less are equal, so that a rectangle that was turned is split alike."""


def split_faces(points: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """Triangles (T, 3) in the order of the faces, and the row (T,) of the face of each.

    A quad that repeats a corner, or has -1 for its fourth, is a triangle.
    """
    if faces.shape[1] == 3:
        return faces, np.arange(len(faces))
    quads, is_quad = _without_repeats(faces)
    split = split_quads(points, quads[is_quad])
    n_triangles = 1 + is_quad
    triangles = np.repeat(quads[:, :3], n_triangles, axis=0)
    row = np.repeat(np.arange(len(faces)), n_triangles)
    triangles[is_quad[row]] = split.reshape(-1, 3)
    return triangles, row


def split_quads(points: Floats, quads: Ints) -> Ints:
    """Two triangles (Q, 2, 3) for each quad (Q, 4), by the diagonal with the larger least angle.

    The diagonal from the first corner is taken where both are alike.  One that would fold the
    quad (its two triangles looking to opposite sides) is taken only if both do.
    """
    first, second = quads[:, [[0, 1, 2], [0, 2, 3]]], quads[:, [[0, 1, 3], [1, 2, 3]]]
    better = _worth(points[second]) > _worth(points[first]) + _TIE
    return np.where(better[:, None, None], second, first)


def _without_repeats(faces: Ints) -> tuple[Ints, Bools]:
    """Quads with what repeats moved to the last column, and which of them have four corners."""
    quads = faces.copy()
    quads[:, 3] = np.where(quads[:, 3] == -1, quads[:, 2], quads[:, 3])
    is_quad = np.ones(len(quads), bool)
    for k, keep in enumerate(([1, 2, 3, 0], [0, 2, 3, 1], [0, 1, 3, 2], [0, 1, 2, 3])):
        repeats = is_quad & (quads[:, k] == quads[:, (k + 1) % 4])
        quads[repeats] = quads[repeats][:, keep]
        is_quad &= ~repeats
    return quads, is_quad


def _worth(pairs: Floats) -> Floats:
    """Least angle (Q,) of two triangles (Q, 2, 3, 3); less half a turn where they are folded."""
    onward = np.roll(pairs, -1, axis=2) - pairs
    back = np.roll(pairs, 1, axis=2) - pairs
    normal = np.cross(onward, back)
    angle = np.arctan2(np.linalg.norm(normal, axis=3), (onward * back).sum(3))
    folded = (normal[:, 0, 0] * normal[:, 1, 0]).sum(1) < 0
    least: Floats = angle.min((1, 2)) - np.pi * folded
    return least
