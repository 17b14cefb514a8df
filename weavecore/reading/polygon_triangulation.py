"""Faces with any number of corners → triangles and quads.

Triangles and quads stay; what has more corners is cut into triangles ear by ear, always the
ear with the largest least angle among those that hold no other corner.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import BadIndex, Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.reading.raw import DOUBLE, RawMesh, counted

MOST_CORNERS = 256


def mesh_of_polygons(points: Floats, corners: Ints, counts: Ints, *, epsilon: float = DOUBLE) -> RawMesh:
    """The mesh of polygons of any kind.

    Parameters
    ----------
    points : (V, 3) float64
    corners : (C,) int64
        Corners of all polygons, one polygon after the other.
    counts : (P,) int64
        How many corners each has; those with less than three give no face.
    epsilon : float
        As in `RawMesh`.

    Raises
    ------
    BadIndex, Unsupported
    """
    offsets = offsets_of(counts)
    _check(corners, counts, offsets, len(points))
    parts, rows = [np.empty((0, 4), np.int64)], [np.empty(0, np.int64)]
    for n in sorted(set(counts.tolist()) - {0, 1, 2}):
        which = np.flatnonzero(counts == n)
        polygons = corners[offsets[which][:, None] + np.arange(n)]
        faces = polygons if n == 4 else np.repeat(clip_ears(points, polygons), [1, 1, 2], axis=2).reshape(-1, 4)
        parts.append(faces)
        rows.append(np.repeat(which, len(faces) // len(which)))
    order = np.argsort(np.concatenate(rows), kind="stable")
    notes = []
    if (counts > 4).any():
        notes.append(f"Split {counted(int((counts > 4).sum()), 'face')} with more than four corners into triangles.")
    if (counts < 3).any():
        notes.append(f"Dropped {counted(int((counts < 3).sum()), 'face')} with less than three corners.")
    return RawMesh(
        points, np.concatenate(parts)[order], np.concatenate(rows)[order], notes=tuple(notes), epsilon=epsilon
    )


def _check(corners: Ints, counts: Ints, offsets: Ints, n_points: int) -> None:
    outside = (corners < 0) | (corners >= n_points)
    if outside.any():
        bad = np.searchsorted(offsets, np.flatnonzero(outside), side="right") - 1
        raise BadIndex(
            f"Faces that name vertices beyond the {n_points} that there are",
            remedy="Repair the mesh: its face list does not fit its vertices.",
            ids=sorted(set(bad.tolist())),
            kind="face",
        )
    if counts.max(initial=0) > MOST_CORNERS:
        raise Unsupported(
            f"Faces with more than {MOST_CORNERS} corners",
            remedy="Split them into triangles or quads.",
            ids=np.flatnonzero(counts > MOST_CORNERS).tolist(),
            kind="face",
        )


def clip_ears(points: Floats, polygons: Ints) -> Ints:
    """Triangles (P, n-2, 3) of polygons (P, n) that have n corners each."""
    flat = _projected(points[polygons])
    left = np.tile(np.arange(polygons.shape[1]), (len(polygons), 1))
    row = np.arange(len(polygons))
    made = []
    while left.shape[1] > 3:
        n = left.shape[1]
        best = _ear_worth(flat[row[:, None], left]).argmax(1)
        made.append(left[row[:, None], (best[:, None] + [-1, 0, 1]) % n])
        left = left[np.arange(n) != best[:, None]].reshape(len(left), n - 1)
    made.append(left)
    triangles: Ints = polygons[row[:, None, None], np.stack(made, axis=1)]
    return triangles


def _projected(loops: Floats) -> Floats:
    """Loops (P, n, 2) seen against their normal (Newell), so that they run counter-clockwise."""
    centred = loops - loops.mean(1, keepdims=True)
    normal = np.cross(centred, np.roll(centred, -1, axis=1)).sum(1)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(size > 0, normal / np.where(size > 0, size, 1), [0.0, 0.0, 1.0])
    helper = np.eye(3)[np.abs(normal).argmin(1)]
    x = np.cross(helper, normal)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    axes = np.stack([x, np.cross(normal, x)], axis=2)
    flat: Floats = centred @ axes
    return flat


def _ear_worth(loops: Floats) -> Floats:
    """Least angle (P, n) of the ear at each corner; less by one turn where it is none."""
    before, after = np.roll(loops, 1, axis=1), np.roll(loops, -1, axis=1)
    ear = np.stack([before, loops, after], axis=2)
    onward, back = np.roll(ear, -1, axis=2) - ear, np.roll(ear, 1, axis=2) - ear
    angle = np.arctan2(_cross(onward, back), (onward * back).sum(3))
    holds = _holds_other(ear, loops)
    worth: Floats = angle.min(2) - 2 * np.pi * holds
    return worth


def _holds_other(ear: Floats, loops: Floats) -> Bools:
    """Whether the ear (P, n) holds another corner of its loop."""
    to = loops[:, None, :, None] - ear[:, :, None]
    side = (np.roll(ear, -1, axis=2) - ear)[:, :, None]
    inside: Bools = np.all(_cross(np.broadcast_to(side, to.shape), to) > 0, axis=3)
    holds: Bools = np.any(inside, axis=2)
    return holds


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


# ----------------------------------------------------------------------
# Quads split into triangles by their better diagonal.

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
