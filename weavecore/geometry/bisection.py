r"""Bisection of the edges of a triangle mesh, and the faces beside them.

A face with one, two or three split edges becomes two, three or four faces::

        c             c               c              Of the two ways to divide the quad that two split
       / \           / \             / \             edges leave, the one with the shorter diagonal is
      /   \         /   m           m---m            taken.
     /     \       / \ . \         / \ / \
    a---m---b     a---m---b       a---m---b

`bisect_long_edges` (after Rivara 1984) and `bisect_edges` work on triangles alone;  `split_edges` also updates twins,
and keeps the numbers of old faces.  Work: linear in the triangles, for each round.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, order_by
from weavecore.geometry.halfedges import NO_TWIN, find_twins
from weavecore.polling import poll

_MAX_ROUNDS = 40  # each halves the longest edges: a ratio of 2⁴⁰ between lengths


def bisect_long_edges(
    points: Floats, triangles: Ints, longest: float, *, is_loose: Optional[Bools] = None
) -> tuple[Floats, Ints, Ints]:
    """Bisect inner edges until none is too long; edges of one triangle stay.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
    longest : float
        Raised to the longest edge that stays: others cannot become shorter than half of that.
    is_loose : (N,) bool, optional
        Points between which an edge that stays does not count.

    Returns
    -------
    points : (N', 3) float64
        The old points, then the new ones.
    triangles : (T', 3) int64
    origin : (N',) int64
        For each point an old one in the same connected component; itself if it is old.
    """
    origin = np.arange(len(points))
    flag = side_lengths(points, triangles) > longest
    longest = max(longest, _longest_border(points, triangles, flag, is_loose))
    done = []
    for _ in range(_MAX_ROUNDS):
        flag &= side_lengths(points, triangles) > longest
        # Long edges make long ones only in their own triangles.
        rests = ~flag.any(1)
        done.append(triangles[rests])
        triangles, flag = triangles[~rests], flag[~rests]
        n = len(points)
        points, triangles, ends = _bisect_sides(points, triangles, flag)
        origin = np.concatenate([origin, origin[ends]])
        flag = np.ones(triangles.shape, bool)
        if len(points) == n:
            break
    return points, np.concatenate([*done, triangles]), origin


def expected_bisections(points: Floats, triangles: Ints, longest: float, *, is_loose: Optional[Bools] = None) -> float:
    """About how many triangles `bisect_long_edges` makes: a round makes 4, 3 or 2 of one with 3, 2 or 1 long sides.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
    longest, is_loose :
        As of `bisect_long_edges`.
    """
    sides = side_lengths(points, triangles)
    longest = max(longest, _longest_border(points, triangles, sides > longest, is_loose))
    rounds = np.sort(np.ceil(np.log2(np.maximum(sides / longest, 1.0))), axis=1)
    return float((2.0 ** rounds[:, 2] * 1.5 ** rounds[:, 1] * (4 / 3) ** rounds[:, 0]).sum())


def side_lengths(points: Floats, triangles: Ints) -> Floats:
    """Lengths of the sides of triangles, each from a corner to the next.

    Parameters
    ----------
    points : (N, k) float64
    triangles : (T, 3) int64

    Returns
    -------
    (T, 3) float64
    """
    poll()
    square = np.zeros(triangles.shape)
    for column in np.ascontiguousarray(points.T):
        corner = column[triangles]
        square += (corner[:, [1, 2, 0]] - corner) ** 2
    lengths: Floats = np.sqrt(square)
    return lengths


def _longest_border(points: Floats, triangles: Ints, flag: Bools, is_loose: Optional[Bools]) -> float:
    """The longest edge of one triangle among those with flagged sides, but for those between loose points."""
    side = np.flatnonzero(flag)
    single, count = np.unique(_keys(triangles).ravel()[side], return_counts=True)
    n = np.int64(triangles.max(initial=0) + 1)
    ends = single[count == 1]
    a, b = ends // n, ends % n
    length = np.linalg.norm(points[a] - points[b], axis=1)
    return float((length if is_loose is None else length[~(is_loose[a] & is_loose[b])]).max(initial=0.0))


def _keys(triangles: Ints) -> Ints:
    """(T, 3) a number for the edge of each side: equal for the two sides of an edge."""
    poll()
    head = triangles[:, [1, 2, 0]]
    n = np.int64(triangles.max(initial=0) + 1)
    keys: Ints = np.minimum(triangles, head) * n + np.maximum(triangles, head)
    return keys


def unique_edges(triangles: Ints) -> tuple[Ints, Ints]:
    """Edges of triangles, each once.

    Parameters
    ----------
    triangles : (T, 3) int64

    Returns
    -------
    edges : (E, 2) int64
        The lesser point first, sorted.
    of_side : (T, 3) int64
        Edge of each side of each triangle.
    """
    poll()
    n = int(triangles.max(initial=-1)) + 1
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    lesser, greater = np.minimum(tail, head), np.maximum(tail, head)
    order = order_by(greater, n)
    poll()
    order = order[order_by(lesser[order], n)]
    poll()
    lesser, greater = lesser[order], greater[order]
    is_new = np.ones(len(order), bool)
    is_new[1:] = (lesser[1:] != lesser[:-1]) | (greater[1:] != greater[:-1])
    of_side = np.empty(len(order), np.int64)
    of_side[order] = np.cumsum(is_new) - 1
    return np.stack([lesser[is_new], greater[is_new]], axis=1), of_side.reshape(-1, 3)


def naked_edges(triangles: Ints) -> Ints:
    """Edges with one triangle only.

    Parameters
    ----------
    triangles : (T, 3) int64

    Returns
    -------
    (e, 2) int64
        Those of the `unique_edges`.
    """
    edges, of_side = unique_edges(triangles)
    naked: Ints = edges[np.bincount(of_side.ravel(), minlength=len(edges)) == 1]
    return naked


def bisect_edges(points: Floats, triangles: Ints, chosen: Bools) -> tuple[Floats, Ints, Ints]:
    """Bisect chosen edges; edges of one triangle stay.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
    chosen : (E,) bool
        Of the `unique_edges`.

    Returns
    -------
    points, triangles, origin
        As of `bisect_long_edges`.
    """
    points, triangles, ends = _bisect_sides(points, triangles, chosen[unique_edges(triangles)[1]])
    return points, triangles, np.concatenate([np.arange(len(points) - len(ends)), ends])


def _bisect_sides(points: Floats, triangles: Ints, flag: Bools) -> tuple[Floats, Ints, Ints]:
    """Split the edges with flagged sides (T, 3), both sides or none; with each new point one end of its edge."""
    side = np.flatnonzero(flag)
    edges, of_side, count = np.unique(_keys(triangles).ravel()[side], return_inverse=True, return_counts=True)
    inner = count > 1
    number = np.where(inner, len(points) + np.cumsum(inner) - 1, -1)
    middle = np.full(triangles.shape, -1, np.int64)
    middle.ravel()[side] = number[of_side.ravel()]
    n = np.int64(triangles.max(initial=0) + 1)
    a, b = edges[inner] // n, edges[inner] % n
    touched = (middle >= 0).any(1)
    points = np.concatenate([points, (points[a] + points[b]) / 2])
    return points, np.concatenate([triangles[~touched], _split(points, triangles[touched], middle[touched])]), a


def _split(points: Floats, triangles: Ints, middle: Ints) -> Ints:
    """Triangles with a new point on some of their sides (-1 on the others), each cut in up to four."""
    count = (middle >= 0).sum(1)
    out: list[Ints] = [np.zeros((0, 3), np.int64)]
    # Turned so that the split side, or the one whole side, is the first.
    one = np.flatnonzero(count == 1)
    if len(one):
        (a, b, c), (ab, _, _) = _turned(triangles[one], middle[one], np.argmax(middle[one] >= 0, axis=1))
        out += [np.c_[a, ab, c], np.c_[ab, b, c]]
    two = np.flatnonzero(count == 2)
    if len(two):
        (a, b, c), (_, bc, ca) = _turned(triangles[two], middle[two], np.argmax(middle[two] < 0, axis=1))
        short = np.linalg.norm(points[a] - points[bc], axis=1) <= np.linalg.norm(points[b] - points[ca], axis=1)
        out += [np.c_[a, b, np.where(short, bc, ca)], np.c_[np.where(short, a, b), bc, ca], np.c_[ca, bc, c]]
    three = np.flatnonzero(count == 3)
    if len(three):
        (a, b, c), (ab, bc, ca) = triangles[three].T, middle[three].T
        out += [np.c_[a, ab, ca], np.c_[ab, b, bc], np.c_[ca, bc, c], np.c_[ab, bc, ca]]
    return np.concatenate(out)


def _turned(triangles: Ints, middle: Ints, first: Ints) -> tuple[tuple[Ints, ...], tuple[Ints, ...]]:
    """Corners and sides beginning with the given side of each triangle."""
    row = np.arange(len(triangles))
    turns = [(first + k) % 3 for k in range(3)]
    return tuple(triangles[row, k] for k in turns), tuple(middle[row, k] for k in turns)


NOT_SPLIT = -1

# Parts of a face by its corners 0, 1, 2 and the points 3, 4, 5 on the edges that start at these.
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
