"""Faces with any number of corners split into triangles.

Triangles and quads stay as they are.  A face with more corners is cut by ear clipping (Meisters 1975): project it
along its Newell normal, cut off the ear with the largest least angle among those that contain no other corner, and
repeat. O(n³) for a face of n corners, all faces with n corners at once.  Quads are split by the diagonal that leaves
the larger least angle.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import BadIndex, Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.model import Note
from weavecore.reading.raw import DOUBLE, RawMesh, counted

MOST_CORNERS = 256
"""Corners of a face.  Ear clipping is cubic: 256 corners take about a second, and real files seldom have more than
20."""


_TIE = 1e-9
"""Radians.  Least angles that differ by less are equal, so that a rectangle is split alike however it is rotated."""


def mesh_of_polygons(vertices: Floats, corners: Ints, counts: Ints, *, epsilon: float = DOUBLE) -> RawMesh:
    """The mesh of polygons with any number of corners.

    Parameters
    ----------
    vertices : (V, 3) float64
    corners : (C,) int64
        Vertices at the corners of all polygons, one polygon after the other.
    counts : (P,) int64
        Number of corners of each; those with less than three give no face.
    epsilon : float
        As in `RawMesh`.

    Returns
    -------
    RawMesh
        Its ``face_ids`` are the rows of the polygons.

    Raises
    ------
    BadIndex, Unsupported
    """
    offsets = offsets_of(counts)
    _check(corners, counts, offsets, len(vertices))
    parts, rows = [np.empty((0, 4), np.int64)], [np.empty(0, np.int64)]
    for n in sorted(set(counts.tolist()) - {0, 1, 2}):
        which = np.flatnonzero(counts == n)
        polygons = corners[offsets[which][:, None] + np.arange(n)]
        faces = polygons if n == 4 else _clip_ears(vertices, polygons)[..., [0, 1, 2, 2]].reshape(-1, 4)
        parts.append(faces)
        rows.append(np.repeat(which, len(faces) // len(which)))
    order = np.argsort(np.concatenate(rows), kind="stable")
    notes = []
    if (counts > 4).any():
        n_large = int((counts > 4).sum())
        text = f"Split {counted(n_large, 'face')} with more than four corners into triangles."
        notes.append(Note("TRIANGULATED", text, {"count": n_large}))
    if (counts < 3).any():
        n_small = int((counts < 3).sum())
        text = f"Dropped {counted(n_small, 'face')} with less than three corners."
        notes.append(Note("DROPPED", text, {"count": n_small}))
    return RawMesh(
        vertices, np.concatenate(parts)[order], np.concatenate(rows)[order], notes=tuple(notes), epsilon=epsilon
    )


def _check(corners: Ints, counts: Ints, offsets: Ints, n_vertices: int) -> None:
    outside = (corners < 0) | (corners >= n_vertices)
    if outside.any():
        bad = np.searchsorted(offsets, np.flatnonzero(outside), side="right") - 1
        raise BadIndex(
            f"Faces refer to vertices beyond the {n_vertices} of the mesh",
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


def _clip_ears(vertices: Floats, polygons: Ints) -> Ints:
    """Triangles (P, n - 2, 3) of polygons (P, n) that have n corners each."""
    if polygons.shape[1] == 3:
        return polygons[:, None]
    flat = _projected(vertices[polygons])
    left = np.tile(np.arange(polygons.shape[1]), (len(polygons), 1))
    row = np.arange(len(polygons))
    made = []
    while left.shape[1] > 3:
        n = left.shape[1]
        best = _ear_quality(flat[row[:, None], left]).argmax(1)
        made.append(left[row[:, None], (best[:, None] + [-1, 0, 1]) % n])
        left = left[np.arange(n) != best[:, None]].reshape(len(left), n - 1)
    made.append(left)
    triangles: Ints = polygons[row[:, None, None], np.stack(made, axis=1)]
    return triangles


def _projected(loops: Floats) -> Floats:
    """Loops (P, n, 2) projected along their Newell normals, so that they run counter-clockwise."""
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


def _ear_quality(loops: Floats) -> Floats:
    """Least angle (P, n) of the ear at each corner; less by 2π where the corner has no ear."""
    before, after = np.roll(loops, 1, axis=1), np.roll(loops, -1, axis=1)
    ear = np.stack([before, loops, after], axis=2)
    onward, back = np.roll(ear, -1, axis=2) - ear, np.roll(ear, 1, axis=2) - ear
    angle = np.arctan2(_cross(onward, back), (onward * back).sum(3))
    contains = _contains_corner(ear, loops)
    quality: Floats = angle.min(2) - 2 * np.pi * contains
    return quality


def _contains_corner(ear: Floats, loops: Floats) -> Bools:
    """Whether the ear at each corner (P, n) contains another corner of its loop."""
    to = loops[:, None, :, None] - ear[:, :, None]
    side = (np.roll(ear, -1, axis=2) - ear)[:, :, None]
    inside: Bools = np.all(_cross(np.broadcast_to(side, to.shape), to) > 0, axis=3)
    contains: Bools = np.any(inside, axis=2)
    return contains


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def split_faces(vertices: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """Split the quads among faces into triangles.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) or (F, 4) int64
        A quad that repeats a corner, or has -1 for its fourth, is a triangle.

    Returns
    -------
    triangles : (T, 3) int64
        In the order of the faces.
    row : (T,) int64
        The row of the face of each.
    """
    if faces.shape[1] == 3:
        return faces, np.arange(len(faces))
    quads, is_quad = _without_repeats(faces)
    split = split_quads(vertices, quads[is_quad])
    n_triangles = 1 + is_quad
    triangles = np.repeat(quads[:, :3], n_triangles, axis=0)
    row = np.repeat(np.arange(len(faces)), n_triangles)
    triangles[is_quad[row]] = split.reshape(-1, 3)
    return triangles, row


def split_quads(vertices: Floats, quads: Ints) -> Ints:
    """Split each quad by the diagonal with the larger least angle.

    The diagonal from the first corner is taken if both are alike.  One that folds the quad, so that its two
    triangles face opposite sides, is taken only if both do.

    Parameters
    ----------
    vertices : (V, 3) float64
    quads : (Q, 4) int64

    Returns
    -------
    (Q, 2, 3) int64
    """
    first, second = quads[:, [[0, 1, 2], [0, 2, 3]]], quads[:, [[0, 1, 3], [1, 2, 3]]]
    second_is_better = _pair_quality(vertices[second]) > _pair_quality(vertices[first]) + _TIE
    return np.where(second_is_better[:, None, None], second, first)


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


def _pair_quality(pairs: Floats) -> Floats:
    """Least angle (Q,) of two triangles (Q, 2, 3, 3); less by π where they are folded."""
    onward = np.roll(pairs, -1, axis=2) - pairs
    back = np.roll(pairs, 1, axis=2) - pairs
    normal = np.cross(onward, back)
    angle = np.arctan2(np.linalg.norm(normal, axis=3), (onward * back).sum(3))
    folded = (normal[:, 0, 0] * normal[:, 1, 0]).sum(1) < 0
    least: Floats = angle.min((1, 2)) - np.pi * folded
    return least
