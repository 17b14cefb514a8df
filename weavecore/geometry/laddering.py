"""Triangles in a polygon of which one straight side has many points.

A fan about the middle would join each of them to one far point.  Here rows of points are laid over that side, each
with half as many as the one below, so that no triangle is much longer than it must be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

LEAST_CROWD = 12
"""A side with so many points between its ends is worth a ladder."""

_STRAIGHT = 1e-6  # sine of the turn from which on a polygon has a corner
_LEAST_ROW = 2


@dataclass(frozen=True, eq=False)
class Ladder:
    """Triangles of a polygon's corners, in its order, and of points numbered on from these.

    Parameters
    ----------
    points : (k, 3) float64
    triangles : (t, 3) int64
        Running the same way around as the polygon.
    """

    points: Floats
    triangles: Ints


def lay_ladder(polygon: Floats) -> Optional[Ladder]:
    """The ladder of a polygon (n, 3); None where no side is so crowded, or the others do not lie over it.

    Parameters
    ----------
    polygon : (n, 3) float64
        A piece of a plane, nearly convex.
    """
    base = _crowded_side(polygon)
    if base is None:
        return None
    first, count = base
    n = len(polygon)
    low = (first + np.arange(count)) % n
    top = (first + np.r_[0, np.arange(n - 1, count - 2, -1)]) % n
    along = polygon[low[-1]] - polygon[low[0]]
    place = (polygon - polygon[low[0]]) @ along / (along @ along)
    if len(top) < 3 or (np.diff(place[low]) <= 0).any() or (np.diff(place[top]) <= 0).any():
        return None
    over = np.stack([np.interp(place[low], place[top], polygon[top][:, k]) for k in range(3)], axis=1)
    rows, points = [low], [np.zeros((0, 3))]
    n_rows = int(np.log2((count - 2) / _LEAST_ROW))
    number = n
    for k in range(1, n_rows + 1):
        inner = np.arange(2**k, count - 1, 2**k)
        part = (2.0**k - 1.0) / 2.0**n_rows
        points.append(polygon[low[inner]] * (1.0 - part) + over[inner] * part)
        rows.append(np.concatenate([low[:1], number + np.arange(len(inner)), low[-1:]]))
        place = np.concatenate([place, place[low[inner]]])
        number += len(inner)
    rows.append(top)
    strips = [_between(one, other, place) for one, other in zip(rows, rows[1:])]
    return Ladder(np.concatenate(points), np.concatenate(strips))


def _crowded_side(polygon: Floats) -> Optional[tuple[int, int]]:
    """First point of the straight side with the most points, and their number, its ends among them."""
    ahead = np.roll(polygon, -1, axis=0) - polygon
    size = np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), np.finfo(float).tiny)
    ahead = ahead / size
    turn = np.linalg.norm(np.cross(np.roll(ahead, 1, axis=0), ahead), axis=1)
    corners = np.flatnonzero((turn > _STRAIGHT) | ((np.roll(ahead, 1, axis=0) * ahead).sum(1) < 0))
    if len(corners) < 3:
        return None
    counts = np.diff(np.append(corners, corners[0] + len(polygon))) + 1
    best = int(np.argmax(counts))
    return (int(corners[best]), int(counts[best])) if counts[best] - 2 >= LEAST_CROWD else None


def _between(low: Ints, top: Ints, place: Floats) -> Ints:
    """Triangles between two rows that begin and end together, places rising along both."""
    chain = np.concatenate([low[1:], top[1:-1]])
    is_low = np.arange(len(chain)) < len(low) - 1
    key = place[chain]
    # The first of either row go first: before them the other one lies in line with the end that both share.
    key[0] = key[len(low) - 1] = -np.inf
    order = np.lexsort((~is_low, key))
    is_low = is_low[order]
    i, j = np.cumsum(is_low), np.cumsum(~is_low)
    # Each step is along one row, and makes a triangle with where the other one is.
    triangles = np.where(
        is_low[:, None],
        np.stack([low[i - is_low], low[i], top[j]], axis=1),
        np.stack([low[i], top[j], top[j - ~is_low]], axis=1),
    )
    a, b, c = triangles.T
    kept: Ints = triangles[(a != b) & (b != c) & (c != a)]
    return kept
