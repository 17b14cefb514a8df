r"""Cutting a triangle mesh along closed curves that run across its faces.

A *mark* is a point of a curve.  Where a curve goes from one face to the next its mark splits the edge between them;
where it bends or is divided inside a face its mark splits nothing.  Curves leave *cells* of a face, each bounded by
*parts*: pieces of the face's edges, and one part for either side of each curve segment::

            c
           / \             marks x split the edges a-b... of the face; the segment x-x gives two parts, one forth (for
          x---x            the cell on its left) and one back (for the cell on its right); the parts of each cell form
         /     \           one cycle, counter-clockwise
        a-------b

Cells that share a part of an edge, and faces that are not cut, belong to the same *piece* of the mesh.

Work: linear in the faces and marks, and one sort of the marks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected, next_in_loop, offsets_of, ranks_in_rows
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.polling import poll

NONE = -1


@dataclass(frozen=True, eq=False)
class Marks:
    """Points along closed curves, curve after curve.

    Parameters
    ----------
    after, before : (M,) int64
        The next and the previous mark of the same curve.
    vertex : (M,) int64
        A number for the point: a vertex of the mesh or any number beyond them.
    halfedge : (M,) int64
        The halfedge that the mark splits, or -1.
    part : (M,) float64
        How far along that halfedge, in (0, 1).
    face : (M,) int64
        The face in which the segment from this mark to the next lies, or -1 where it runs along an edge.
    """

    after: Ints
    before: Ints
    vertex: Ints
    halfedge: Ints
    part: Floats
    face: Ints


@dataclass(frozen=True, eq=False)
class CellComplex:
    """Cells of the faces that are cut, and the pieces of the mesh that the curves leave.

    Parameters
    ----------
    part_cell : (B,) int64
        Cell of each part of a cell's boundary.
    part_after : (B,) int64
        The next part around the same cell.
    part_start, part_end : (B,) int64
        Its ends, as vertex numbers, the cell on the left.
    cell_piece : (C,) int64
        The piece of the mesh that each cell belongs to.
    face_piece : (F,) int64
        The piece of each face that is not cut, -1 of the others.
    left_piece, right_piece : (M,) int64
        The pieces beside the segment that begins at each mark, -1 for one along an edge.
    edge_piece : (3F,) int64
        The piece on the inner side of each halfedge (of its first part where it is split).
    """

    part_cell: Ints
    part_after: Ints
    part_start: Ints
    part_end: Ints
    cell_piece: Ints
    face_piece: Ints
    left_piece: Ints
    right_piece: Ints
    edge_piece: Ints


class _Perimeters:
    """The edges of the faces that are cut, in parts; face after face, halfedge after halfedge."""

    def __init__(self, faces: Ints, twins: Ints, marks: Marks) -> None:
        split = np.flatnonzero(marks.halfedge != NONE)
        here = marks.halfedge[split]
        there = twins[here]
        inner = there != NO_TWIN
        halfedge = np.concatenate([here, there[inner]])
        along = np.concatenate([marks.part[split], 1.0 - marks.part[split][inner]])
        mark = np.concatenate([split, split[inner]])
        order = np.lexsort((along, halfedge))
        halfedge, mark = halfedge[order], mark[order]
        self.faces = np.unique(np.concatenate([halfedge // 3, marks.face[marks.face != NONE]]))
        own = (3 * self.faces[:, None] + np.arange(3)).ravel()
        at = np.searchsorted(own, halfedge)
        count = np.bincount(at, minlength=len(own))
        self.offsets = offsets_of(count + 1)
        self.halfedge = np.repeat(own, count + 1)
        self.mark = np.full(self.offsets[-1], NONE, np.int64)
        self.split_part = self.offsets[at] + 1 + ranks_in_rows(count)
        self.mark[self.split_part] = mark
        self.start = np.where(self.mark == NONE, faces.ravel()[self.halfedge], marks.vertex[self.mark])
        self.after = next_in_loop(self.offsets[::3])
        self._first = np.full(3 * len(faces), NONE, np.int64)
        self._first[own] = self.offsets[:-1]
        self._last = np.full(3 * len(faces), NONE, np.int64)
        self._last[own] = self.offsets[1:] - 1
        # A mark has one part that begins at it on either side of its edge.
        self._of_mark = np.full((len(marks.vertex), 2), NONE, np.int64)
        second = ~_is_first(mark)
        self._of_mark[mark, second.astype(np.int64)] = self.split_part

    def __len__(self) -> int:
        return len(self.start)

    def first_part(self, halfedge: Ints) -> Ints:
        """The first part of each halfedge, -1 where its face is not cut."""
        return self._first[halfedge]

    def at_mark(self, mark: Ints, face: Ints) -> Ints:
        """The part in ``face`` that begins at a mark which splits one of its edges."""
        one, other = self._of_mark[mark].T
        found: Ints = np.where(self.halfedge[one] // 3 == face, one, other)
        return found

    def opposite(self, twins: Ints) -> Ints:
        """The part on the other side of each, -1 on the border or where the face there is not cut."""
        twin = twins[self.halfedge]
        rank = np.arange(len(self)) - self._first[self.halfedge]
        last = np.where(twin == NO_TWIN, NONE, self._last[twin])
        opposite: Ints = np.where(last == NONE, NONE, last - rank)
        return opposite


def _is_first(values: Ints) -> Bools:
    """Whether each value is the first of its kind."""
    first = np.zeros(len(values), bool)
    first[np.unique(values, return_index=True)[1]] = True
    return first


def cut_along(faces: Ints, twins: Ints, marks: Marks) -> CellComplex:
    """Cut a mesh along curves.

    Parameters
    ----------
    faces : (F, 3) int64
    twins : (3F,) int64
    marks : Marks
        Curves that do not cross and do not pass through vertices, except those that run along the border of the mesh.

    Returns
    -------
    CellComplex
    """
    perimeters = _Perimeters(faces, twins, marks)
    segments = np.flatnonzero(marks.face != NONE)
    start = np.concatenate([perimeters.start, marks.vertex[segments], marks.vertex[marks.after[segments]]])
    end = np.concatenate(
        [perimeters.start[perimeters.after], marks.vertex[marks.after[segments]], marks.vertex[segments]]
    )
    follower = _followers(perimeters, marks, segments)
    n_cells, cell = connected(np.arange(len(follower)), follower, len(follower))
    piece = _join_pieces(faces, twins, perimeters, cell, n_cells)
    face_piece = piece[: len(faces)].copy()
    face_piece[perimeters.faces] = NONE
    cell_piece = piece[len(faces) :]
    left = np.full(len(marks.vertex), NONE, np.int64)
    right = left.copy()
    n = len(perimeters)
    left[segments] = cell_piece[cell[n : n + len(segments)]]
    right[segments] = cell_piece[cell[n + len(segments) :]]
    edge_piece = np.repeat(face_piece, 3)
    first = perimeters.first_part(np.arange(3 * len(faces)))
    edge_piece[first != NONE] = cell_piece[cell[first[first != NONE]]]
    return CellComplex(cell, follower, start, end, cell_piece, face_piece, left, right, edge_piece)


def _followers(perimeters: _Perimeters, marks: Marks, segments: Ints) -> Ints:
    """The part that follows each part around its cell: parts of edges, then segments forth, then back."""
    poll()
    n, s = len(perimeters), len(segments)
    forth = np.full(len(marks.vertex), NONE, np.int64)
    forth[segments] = n + np.arange(s)
    back = forth + s
    around = perimeters.after.copy()
    mark = perimeters.mark[around]
    face = perimeters.halfedge // 3
    leaves = (mark != NONE) & (marks.face[mark] == face)
    around[leaves] = forth[mark[leaves]]
    enters = (mark != NONE) & ~leaves & (marks.face[marks.before[mark]] == face)
    around[enters] = back[marks.before[mark[enters]]]

    def turn(mark: Ints, onward: Ints) -> Ints:
        """Along the edge where the curve leaves the face, else on along the curve."""
        stays = marks.halfedge[mark] == NONE
        part = np.where(stays, onward, NONE)
        part[~stays] = perimeters.at_mark(mark[~stays], marks.face[segments][~stays])
        return part

    far = marks.after[segments]
    return np.concatenate([around, turn(far, forth[far]), turn(segments, back[marks.before[segments]])])


def _join_pieces(faces: Ints, twins: Ints, perimeters: _Perimeters, cell: Ints, n_cells: int) -> Ints:
    """The piece of every face and, after them, of every cell."""
    poll()
    is_cut = np.zeros(len(faces), bool)
    is_cut[perimeters.faces] = True
    h = np.arange(3 * len(faces))
    whole = (h < twins) & ~is_cut[h // 3] & ~is_cut[twins // 3]
    parts = np.flatnonzero(twins[perimeters.halfedge] != NO_TWIN)
    opposite = perimeters.opposite(twins)[parts]
    across = twins[perimeters.halfedge[parts]] // 3
    beyond = np.where(opposite == NONE, across, len(faces) + cell[opposite])
    a = np.concatenate([h[whole] // 3, len(faces) + cell[parts]])
    b = np.concatenate([twins[h[whole]] // 3, beyond])
    return connected(a, b, len(faces) + n_cells)[1]
