"""Splitting edges of a triangle mesh at given points, and the faces beside them."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, find_twins

NOT_SPLIT = -1

# The parts of a face by its corners 0, 1, 2 and the middles 3, 4, 5 of its edges from these.
_HALVES = [[0, 3, 2], [3, 1, 2]]
_CORNER_AND_HALVES = [[3, 1, 4], [0, 3, 2], [3, 4, 2]]
_CORNER_AND_OTHER_HALVES = [[3, 1, 4], [0, 3, 4], [0, 4, 2]]
_QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]
_PATTERNS = [np.array(parts) for parts in (_HALVES, _CORNER_AND_HALVES, _QUARTERS, _CORNER_AND_OTHER_HALVES)]


def split_edges(points: Floats, faces: Ints, twins: Ints, middle: Ints) -> tuple[Ints, Ints, Ints]:
    """Split faces at new vertices on their edges.

    Parameters
    ----------
    points : (n, 3) float64
        The new vertices among them.
    faces : (F, 3) int64
    twins : (3F,) int64
    middle : (3F,) int64
        The vertex on each halfedge, the same for both of an edge; -1 where it is not split.

    Returns
    -------
    faces : (F', 3) int64
        Row ``f`` is old face ``f`` or a part of it; the other parts come after all old rows.
    part_of : (F',) int64
        The old face that each face is part of.
    twins : (3F',) int64
    """
    middle = middle.reshape(-1, 3)
    count = (middle != NOT_SPLIT).sum(1)
    touched = np.flatnonzero(count)
    ring = _turn(faces[touched], middle[touched], count[touched])
    one, other = (points[ring[:, k]] - points[ring[:, m]] for k, m in ((0, 4), (2, 3)))
    is_shorter = np.linalg.norm(one, axis=1) <= np.linalg.norm(other, axis=1)
    pattern = np.where((count[touched] == 2) & is_shorter, 3, count[touched] - 1)
    pieces = [ring[pattern == n][:, parts] for n, parts in enumerate(_PATTERNS)]
    owners = [np.repeat(touched[pattern == n], len(parts)) for n, parts in enumerate(_PATTERNS)]
    piece, owner = np.concatenate([part.reshape(-1, 3) for part in pieces]), np.concatenate(owners)
    _, first = np.unique(owner, return_index=True)
    is_extra = np.ones(len(piece), bool)
    is_extra[first] = False
    place = owner.copy()
    place[is_extra] = len(faces) + np.arange(int(is_extra.sum()))
    split = np.concatenate([faces, piece[is_extra]])
    split[place] = piece
    part_of = np.concatenate([np.arange(len(faces)), owner[is_extra]])
    return split, part_of, _find_twins_again(faces, twins, split, place, touched)


def _turn(faces: Ints, middle: Ints, count: Ints) -> Ints:
    """(n, 6) corners and middles of each face, turned so that its split edges come first."""
    is_split = middle != NOT_SPLIT
    start = np.where(count == 2, (np.argmin(is_split, axis=1) + 1) % 3, np.argmax(is_split, axis=1))
    columns = (start[:, None] + np.arange(3)) % 3
    return np.concatenate([np.take_along_axis(faces, columns, 1), np.take_along_axis(middle, columns, 1)], axis=1)


def _find_twins_again(faces: Ints, twins: Ints, split: Ints, place: Ints, touched: Ints) -> Ints:
    """Twins after a split: only the parts, and the faces beside them, have new ones."""
    after = np.concatenate([twins, np.full(3 * (len(split) - len(faces)), NO_TWIN)])
    beside = twins.reshape(-1, 3)[touched].ravel()
    local = np.unique(np.concatenate([place, beside[beside != NO_TWIN] // 3]))
    found = find_twins(split[local], int(split[local].max()) + 1)
    halfedge = (3 * local[:, None] + np.arange(3)).ravel()
    known = np.repeat(np.isin(local, place), 3) | (found != NO_TWIN)
    after[halfedge[known]] = np.where(found[known] == NO_TWIN, NO_TWIN, halfedge[found[known]])
    return after
