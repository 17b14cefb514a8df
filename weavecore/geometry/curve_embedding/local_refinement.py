"""Local refinement: bisection of the faces along a curve, where a mesh is too coarse for its bends.

The longest edge of a face is bisected first (Rivara 1984), and with it the longest edge of every face that it
touches, so that no angle becomes much smaller.  Work: linear in the faces of the mesh for each round, and a round
halves edges.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, ranges
from weavecore.geometry.bisection import NOT_SPLIT, split_edges
from weavecore.geometry.closest import nearest_on_triangles
from weavecore.geometry.halfedges import NO_TWIN, find_twins, halfedge_ends

_MAX_FACES = 2_000_000
"""More faces than this are refused: a curve is embedded in seconds, not minutes."""


def refine_along(
    vertices: Floats, faces: Ints, points: Floats, face: Ints, longest: Floats, fixed: Ints
) -> tuple[Floats, Ints, Ints, Ints]:
    """Bisect the edges of the faces that points lie on until they are short enough.

    A border is bisected with the others, and so keeps its shape.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    points : (n, 3) float64
    face : (n,) int64
        The face that each point lies on.
    longest : (n,) float64
        Longest edge that this face may have.
    fixed : (m, 2) int64
        Edges that may not be bisected.

    Returns
    -------
    vertices : (V', 3) float64
        The old ones first.
    faces : (F', 3) int64
        Row ``f`` is face ``f`` or a part of it.
    twins : (3F',) int64
    face : (n,) int64
        The face that each point lies on now.

    Raises
    ------
    TooMuchWork
        If there would be more than `_MAX_FACES` faces.
    """
    twins = find_twins(faces, len(vertices))
    while True:
        is_fixed = flags_of_edges(faces, fixed)
        length = np.linalg.norm(vertices[faces[:, [1, 2, 0]]] - vertices[faces], axis=2)
        length[is_fixed.reshape(-1, 3)] = 0
        limit = np.full(len(faces), np.inf)
        np.minimum.at(limit, face, longest)
        marked = np.zeros(length.shape, bool)
        too_long = np.flatnonzero(length.max(1) > limit)
        if len(too_long) == 0:
            return vertices, faces, twins, face
        _check_count(len(faces))
        marked[too_long, np.argmax(length[too_long], axis=1)] = True
        vertices, middle = _middles(vertices, faces, twins, _with_longest(length, twins, marked.ravel()))
        faces, part_of, twins = split_edges(vertices, faces, twins, middle)
        face = _found_again(vertices, faces, part_of, points, face)


def flags_of_edges(faces: Ints, edges: Ints) -> Bools:
    """Whether halfedges lie on given edges, in either direction.

    Parameters
    ----------
    faces : (F, 3) int64
    edges : (m, 2) int64
        Pairs of vertices.

    Returns
    -------
    (3F,) bool
    """
    tail, head = halfedge_ends(faces)
    n = np.int64(max(faces.max(), edges.max(initial=0)) + 1)
    flags: Bools = np.isin(
        np.minimum(tail, head) * n + np.maximum(tail, head), edges.min(1, initial=n) * n + edges.max(1, initial=0)
    )
    return flags


def _with_longest(length: Floats, twins: Ints, marked: Bools) -> Bools:
    """Marked halfedges with their twins, and the longest edge of every face that has one."""
    longest = 3 * np.arange(len(length)) + np.argmax(length, axis=1)
    new = np.flatnonzero(marked)
    while len(new):
        across = twins[new]
        across = across[across != NO_TWIN]
        marked[across] = True
        touched = longest[np.concatenate([new, across]) // 3]
        new = np.unique(touched[~marked[touched]])
        marked[new] = True
    return marked


def _middles(vertices: Floats, faces: Ints, twins: Ints, marked: Bools) -> tuple[Floats, Ints]:
    """The vertices with a new one on each marked edge, and its number for each halfedge, -1 where there is none."""
    tail, head = halfedge_ends(faces)
    leads = np.flatnonzero(marked & ((twins == NO_TWIN) | (np.arange(len(twins)) < twins)))
    middle = np.full(len(twins), NOT_SPLIT)
    middle[leads] = len(vertices) + np.arange(len(leads))
    paired = leads[twins[leads] != NO_TWIN]
    middle[twins[paired]] = middle[paired]
    return np.concatenate([vertices, (vertices[tail[leads]] + vertices[head[leads]]) / 2]), middle


def _found_again(vertices: Floats, faces: Ints, part_of: Ints, points: Floats, face: Ints) -> Ints:
    """The part of its old face on which each point lies."""
    order = np.argsort(part_of, kind="stable")
    first = np.searchsorted(part_of[order], face)
    count = np.searchsorted(part_of[order], face, side="right") - first
    row = np.repeat(np.arange(len(face)), count)
    part = order[ranges(first, count)]
    gap = np.linalg.norm(nearest_on_triangles(points[row], vertices[faces[part]]) - points[row], axis=1)
    by_gap = np.lexsort((part, gap, row))
    found: Ints = part[by_gap][offsets_of(count)[:-1]]
    return found


def _check_count(n_faces: int) -> None:
    if n_faces > _MAX_FACES:
        raise TooMuchWork(
            f"Refining the mesh along the curve would make more than {_MAX_FACES:,} faces",
            remedy="Give a smoother or a shorter curve.",
        )
