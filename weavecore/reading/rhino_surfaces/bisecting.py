"""Triangles on the grids of a SubD, halved one by one where they are too long or leave the surface.

An edge is halved at the vertex of the grid that lies in its middle, so that the new vertex is on the surface too.
Triangles are halved at their longest edges, which keeps their angles from getting small (Rivara 1984).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

_MOST_ROUNDS = 40
_MOST_PASSES = 50
_ALIKE = 1.0 - 1e-9
_NEARLY_LONGEST = 0.8


@dataclass(frozen=True, eq=False)
class _Sides:
    """The sides (F, 3) of triangles: which edge each is, its length, its middle in the grid or -1, its rise."""

    edge: Ints
    length: Floats
    middle: Ints
    rise: Floats


def bisected(points: Floats, grid: Ints, owner: Ints, places: Ints, edge: float, chord: float) -> tuple[Ints, float]:
    """Triangles halved until none is too long or too far from the surface, as far as the grid goes.

    Parameters
    ----------
    points : (V, 3)
    grid : (Q, m + 1, m + 1)
        Vertices by quad and place.
    owner : (F,), places : (F, 3, 2)
        The quad in which each triangle lies, and the places of its corners.
    edge, chord : float
        Longest edge and greatest chord error that are wanted.

    Returns
    -------
    faces (T, 3), rise
        Vertices of the triangles, and how far the surface still rises over an edge.
    """
    for _ in range(_MOST_ROUNDS):
        sides = _measured(points, grid, owner, places)
        marked = _with_longest(sides, (sides.middle >= 0) & ((sides.length > edge) | (sides.rise > chord)))
        chosen = _chosen(sides, marked)
        if not chosen.any():
            break
        owner, places = _halved(owner, places, chosen)
    faces: Ints = grid[owner[:, None], places[..., 0], places[..., 1]]
    return faces, float(sides.rise.max())


def _measured(points: Floats, grid: Ints, owner: Ints, places: Ints) -> _Sides:
    faces = grid[owner[:, None], places[..., 0], places[..., 1]]
    onward = np.roll(faces, -1, axis=1)
    key = np.minimum(faces, onward) * np.int64(len(points)) + np.maximum(faces, onward)
    edge = np.unique(key, return_inverse=True)[1].reshape(-1, 3)
    total = places + np.roll(places, -1, axis=1)
    is_in_grid = (total % 2 == 0).all(2)
    half = total // 2
    middle = np.where(is_in_grid, grid[owner[:, None], half[..., 0], half[..., 1]], -1)
    along = points[onward] - points[faces]
    length = np.linalg.norm(along, axis=2)
    off = points[middle] - points[faces]
    part = np.einsum("fkx,fkx->fk", off, along) / np.maximum(length, 1e-300) ** 2
    rise = np.linalg.norm(off - part[..., None] * along, axis=2)
    return _Sides(edge, length, middle, np.where(is_in_grid, rise, 0.0))


def _with_longest(sides: _Sides, marked: Bools) -> Bools:
    """Edges marked, with the longest that can be halved of every triangle that has a marked one; by side (F, 3)."""
    # Halving a short side makes a needle: better to leave the triangle as it is.
    can = (sides.middle >= 0) & (sides.length >= _NEARLY_LONGEST * sides.length.max(1, keepdims=True))
    length = np.where(can, sides.length, 0.0)
    longest = can & (length >= _ALIKE * length.max(1, keepdims=True))
    is_marked = np.zeros(int(sides.edge.max()) + 1, bool)
    is_marked[sides.edge[marked]] = True
    for _ in range(_MOST_PASSES):
        count = is_marked.sum()
        touched = is_marked[sides.edge].any(1)
        lacks = touched & ~(longest & is_marked[sides.edge]).any(1)
        first = np.argmax(longest[lacks], axis=1)
        is_marked[sides.edge[lacks][np.arange(len(first)), first][longest[lacks].any(1)]] = True
        if is_marked.sum() == count:
            break
    marked_again: Bools = is_marked[sides.edge] & can
    return marked_again


def _chosen(sides: _Sides, marked: Bools) -> Bools:
    """At most one side (F, 3) of each triangle: its longest marked one, if it is so for both of its triangles."""
    # Ties fall to the edge with the least number, in both triangles alike.
    rank = np.lexsort((sides.edge.ravel(), -sides.length.ravel()))
    order = np.empty(len(rank), np.int64)
    order[rank] = np.arange(len(rank))
    best = np.full(int(sides.edge.max()) + 1, len(rank))
    np.minimum.at(best, sides.edge.ravel(), order)
    place = np.where(marked, best[sides.edge], len(rank))
    first = marked & (place == place.min(1, keepdims=True))
    n_faces = np.bincount(sides.edge.ravel())
    ready = np.bincount(sides.edge.ravel(), first.ravel(), len(n_faces)) == n_faces
    chosen: Bools = first & ready[sides.edge]
    return chosen


def _halved(owner: Ints, places: Ints, chosen: Bools) -> tuple[Ints, Ints]:
    face, k = np.nonzero(chosen)
    a, b, c = (places[face, (k + i) % 3] for i in range(3))
    middle = (a + b) // 2
    places = places.copy()
    places[face] = np.stack([a, middle, c], axis=1)
    return np.concatenate([owner, owner[face]]), np.concatenate([places, np.stack([middle, b, c], axis=1)])
