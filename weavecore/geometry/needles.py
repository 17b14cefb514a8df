r"""Division of needles: triangles far longer than an edge may be, and thinner than that.

Bisection (`geometry.bisection`) halves a needle in rounds, and each diagonal that a round leaves is a long edge of the
next: n rounds make 3ⁿ triangles, where 2ⁿ suffice, and 4ⁿ of a needle with three long sides.  Here each inner edge
between two needles is divided into equal parts at once, and the points on the longest side of a needle are joined to
those on the other two in their order along it: as many triangles as there are points::

           c                          q = 2 points on the sides from a over c to b, c among them
      ─q1─────                        p = 3 points on the longest side
    a──p1──p2──p3──b                  p + q triangles, none without area

Work: O(n log n) for n triangles and points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, ranks_in_rows
from weavecore.geometry.bisection import side_lengths, unique_edges

_LEAST_LENGTH = 8.0
"""Of the longest edge that is wanted: bisection divides what is shorter, into better triangles."""

_MOST_ROUNDS = 40
"""Rounds in which needles are left out beside others that are; after as many nothing is divided."""


def divide_needles(points: Floats, triangles: Ints, longest: float) -> tuple[Floats, Ints, Ints]:
    """Divide the inner edges of triangles that are longer than eight times ``longest`` and thinner than it.

    Edges with a triangle on one side only stay, and so do those beside a triangle that is no needle, or that keeps a
    long side of its own.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
    longest : float

    Returns
    -------
    points : (N', 3) float64
        The old points, then the new ones.
    triangles : (T', 3) int64
    origin : (N',) int64
        For each point an old one in the same connected component; itself if it is old.
    """
    if side_lengths(points, triangles).max(initial=0.0) <= _LEAST_LENGTH * longest:
        return points, triangles, np.arange(len(points))
    edges, of_side = unique_edges(triangles)
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    n_parts = np.where(_divisible(points, triangles, of_side, length, longest), np.ceil(length / longest), 1)
    n_new = n_parts.astype(np.int64) - 1
    first = len(points) + np.cumsum(n_new) - n_new
    edge, rank = np.repeat(np.arange(len(edges)), n_new), ranks_in_rows(n_new) + 1
    part = (rank / (n_new[edge] + 1))[:, None]
    a, b = edges[edge].T
    every = np.concatenate([points, points[a] * (1 - part) + points[b] * part])
    touched = (n_new[of_side] > 0).any(1)
    made = _joined(triangles[touched], of_side[touched], edges, length, n_new, first)
    return every, np.concatenate([triangles[~touched], made]), np.concatenate([np.arange(len(points)), a])


def _divisible(points: Floats, triangles: Ints, of_side: Ints, length: Floats, longest: float) -> Bools:
    """(E,) inner edges of needles alone; of each needle the longest side is among them, or none is."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    sides = length[of_side]
    side = sides.argmax(1)
    is_inner = np.bincount(of_side.ravel(), minlength=len(length)) == 2
    on_border = np.where(is_inner[of_side], 0.0, sides).max(1)
    is_needle = sides.max(1) > _LEAST_LENGTH * np.maximum(longest, on_border)
    is_needle &= doubled < longest * sides.max(1)
    chosen: Bools = (length > longest) & is_inner
    chosen[of_side[~is_needle].ravel()] = False
    for _ in range(_MOST_ROUNDS):
        blocked = ~chosen[of_side[np.arange(len(side)), side]] & chosen[of_side].any(1)
        if not blocked.any():
            return chosen
        chosen[of_side[blocked].ravel()] = False
    return np.zeros(len(length), bool)


def _joined(triangles: Ints, of_side: Ints, edges: Ints, length: Floats, n_new: Ints, first: Ints) -> Ints:
    """The triangles (t, 3) between the points on the longest side of each triangle and those on the other two."""
    row = np.arange(len(triangles))
    turn = (length[of_side].argmax(1)[:, None] + np.arange(3)) % 3
    corner = triangles[row[:, None], turn]
    side = of_side[row[:, None], turn]
    a, b, c = corner.T
    size = length[side]
    # Where the foot of c lies on the longest side, of length 1.
    foot = np.clip((1 + (size[:, 2] ** 2 - size[:, 1] ** 2) / size[:, 0] ** 2) / 2, 0.0, 1.0)
    below, left, right = (_points_on(tail, side[:, k], edges, n_new, first) for tail, k in ((a, 0), (a, 2), (c, 1)))
    owner = np.concatenate([below.owner, left.owner, row, right.owner])
    point = np.concatenate([below.point, left.point, c, right.point])
    along = [below.along, left.along * foot[left.owner], foot, 1 - (1 - right.along) * (1 - foot[right.owner])]
    is_below = np.arange(len(owner)) < len(below.owner)
    order = np.lexsort([np.concatenate(along), owner])
    return _zipped(owner[order], point[order], is_below[order], a, b)


@dataclass(frozen=True, eq=False)
class _Points:
    """New points on a side of each triangle: the triangle, the point, and where it lies from 0 to 1; in this order."""

    owner: Ints
    point: Ints
    along: Floats


def _points_on(tail: Ints, side: Ints, edges: Ints, n_new: Ints, first: Ints) -> _Points:
    count = n_new[side]
    owner, rank = np.repeat(np.arange(len(side)), count), ranks_in_rows(count)
    runs_on = (edges[side, 0] == tail)[owner]
    point = first[side][owner] + np.where(runs_on, rank, count[owner] - 1 - rank)
    return _Points(owner, point, (rank + 1) / (count[owner] + 1))


def _zipped(owner: Ints, point: Ints, is_below: Bools, a: Ints, b: Ints) -> Ints:
    """Triangles (t, 3) between two rows of points, below and above, from ``a`` to ``b`` of each owner."""
    rows, ranks = [], []
    for chosen in (is_below, ~is_below):
        count = np.bincount(owner[chosen], minlength=len(a))
        start = np.cumsum(count) - count
        # Of each point the last of this row up to it; before the first, the first.
        last = np.maximum(np.cumsum(chosen) - 1, start[owner])
        rows.append((point[chosen], start, start + count - 1))
        ranks.append(last)
    (low, low_start, low_end), (high, high_start, high_end) = rows
    low_last, high_last = ranks
    k = np.flatnonzero(is_below & (low_last > low_start[owner]))
    m = np.flatnonzero(~is_below & (high_last > high_start[owner]))
    return np.concatenate(
        [
            np.c_[a, low[low_start], high[high_start]],
            np.c_[low[low_last[k] - 1], low[low_last[k]], high[high_last[k]]],
            np.c_[low[low_last[m]], high[high_last[m]], high[high_last[m] - 1]],
            np.c_[low[low_end], b, high[high_end]],
        ]
    )
