"""Splitting the long edges of a triangle mesh in the middle."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

_MOST_ROUNDS = 40


def bisect_long_edges(points: Floats, triangles: Ints, longest: float) -> tuple[Floats, Ints, Ints]:
    """Split inner edges until none is longer than ``longest``; edges of one triangle stay.

    Parameters
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int64
    longest : float
        Not less than the longest edge that stays is taken: others cannot be shorter than half of that.

    Returns
    -------
    points : (N', 3) float64
        The given points, then the new ones.
    triangles : (T', 3) int64
    origin : (N',) int64
        For each point one of the given ones in the same connected piece; itself if it was given.
    """
    origin = np.arange(len(points))
    edges, of_side = unique_edges(triangles)
    stays = np.bincount(of_side.ravel()) == 1
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    longest = max(longest, float(length[stays].max(initial=0.0)))
    for _ in range(_MOST_ROUNDS):
        edges = unique_edges(triangles)[0]
        is_long = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1) > longest
        n = len(points)
        points, triangles, step = bisect_edges(points, triangles, is_long)
        origin = origin[step]
        if len(points) == n:
            break
    return points, triangles, origin


def unique_edges(triangles: Ints) -> tuple[Ints, Ints]:
    """Edges (E, 2), the lesser point first, sorted; and the edge (T, 3) of each side of each triangle."""
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    n = np.int64(triangles.max(initial=0) + 1)
    key, of_side = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head), return_inverse=True)
    return np.c_[key // n, key % n], of_side.reshape(-1, 3)


def bisect_edges(points: Floats, triangles: Ints, chosen: Bools) -> tuple[Floats, Ints, Ints]:
    """Split the chosen ones (E,) of the `unique_edges` in the middle; edges of one triangle stay.

    Returns what `bisect_long_edges` does.
    """
    edges, of_side = unique_edges(triangles)
    chosen = chosen & (np.bincount(of_side.ravel(), minlength=len(edges)) > 1)
    n = len(points)
    new = np.full(len(edges), -1, np.int64)
    new[chosen] = n + np.arange(int(chosen.sum()))
    a, b = edges[chosen].T
    points = np.concatenate([points, (points[a] + points[b]) / 2])
    return points, _split(points, triangles, new[of_side]), np.concatenate([np.arange(n), a])


def _split(points: Floats, triangles: Ints, middle: Ints) -> Ints:
    """Triangles with a new point on some sides (-1 on the others), each cut in up to four."""
    count = (middle >= 0).sum(1)
    out = [triangles[count == 0]]
    # Turned so that the split side, or the one whole side, is the first.
    one = np.flatnonzero(count == 1)
    if len(one):
        (a, b, c), (ab, _, _) = _turned(triangles[one], middle[one], np.argmax(middle[one] >= 0, axis=1))
        out += [np.c_[a, ab, c], np.c_[ab, b, c]]
    two = np.flatnonzero(count == 2)
    if len(two):
        (a, b, c), (_, bc, ca) = _turned(triangles[two], middle[two], np.argmax(middle[two] < 0, axis=1))
        short = np.linalg.norm(points[a] - points[bc], axis=1) <= np.linalg.norm(points[b] - points[ca], axis=1)
        first = np.where(short[:, None], np.c_[a, b, bc], np.c_[a, b, ca])
        second = np.where(short[:, None], np.c_[a, bc, ca], np.c_[b, bc, ca])
        out += [first, second, np.c_[ca, bc, c]]
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
