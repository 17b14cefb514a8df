"""Zipping: the triangles between the two rings of a plain band (step one of Yan et al. 2016, §5).

A zip walks once around both rings and advances on one of them at each step.  The node of
the child that closes the triangle over a parent's edge is the one nearest to the middle
of that edge; for two straight rows that is the Delaunay triangulation.  Swaps of single
diagonals then mend what curvature makes of it.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

_MOST_ROUNDS = 64
_GAIN = 1e-9


def match_rings(feet: Floats, n_parent: int) -> Optional[Ints]:
    """For each edge of the parent the node of the child over it, unrolled: (n,) rising.

    Parameters
    ----------
    feet : (m,) float64
        Index on the parent of the foot of each node of the child, not yet unrolled.
    n_parent : int

    Returns
    -------
    (n,) int64 or None
        Child ``k % m`` lies over edge ``i``, which runs from node ``i`` to ``i + 1``.  None
        where the feet do not run around the parent once.
    """
    m = len(feet)
    step = np.diff(np.append(feet, feet[0]))
    step -= n_parent * np.rint(step / n_parent)
    if abs(step.sum() - n_parent) > 0.5:
        return None
    rising = feet[0] + np.concatenate([[0.0], np.cumsum(step)[:-1]])
    if np.max(np.maximum.accumulate(rising) - rising) > 1.5:
        return None
    rising = np.maximum.accumulate(rising)
    turns = np.arange(-2, 3)
    unrolled = (rising[None, :] + turns[:, None] * n_parent).ravel()
    numbers = (np.arange(m)[None, :] + turns[:, None] * m).ravel()
    middle = np.arange(n_parent) + np.ceil(rising[0]) + 0.5
    after = np.searchsorted(unrolled, middle)
    before = after - 1
    nearer = np.where(middle - unrolled[before] < unrolled[after] - middle, before, after)
    first = int(np.ceil(rising[0])) % n_parent
    laps = int(np.ceil(rising[0])) // n_parent
    over = numbers[nearer] - laps * m
    return np.concatenate([over[n_parent - first :] - m, over[: n_parent - first]])


def zip_rings(over: Ints, n_child: int) -> tuple[Ints, Ints, Bools]:
    """The walk: nodes of parent and child before each of the n + m steps, and which steps are the parent's.

    Indices are unrolled; the walk begins at parent 0.
    """
    n = len(over)
    before = np.concatenate([[over[-1] - n_child], over[:-1]])
    steps = over - before  # steps of the child while the walk stands at parent i
    is_parent = np.zeros(n + int(steps.sum()), bool)
    is_parent[np.cumsum(steps + 1) - 1] = True
    i = np.concatenate([[0], np.cumsum(is_parent)[:-1]])
    j = before[0] + np.concatenate([[0], np.cumsum(~is_parent)[:-1]])
    return i, j, is_parent


def swap_diagonals(parent: Floats, child: Floats, i: Ints, j: Ints, is_parent: Bools) -> tuple[Ints, Ints, Bools]:
    """Exchange neighbouring steps wherever the link between them becomes shorter."""
    n, m, size = len(parent), len(child), len(is_parent)
    i, j, is_parent = i.copy(), j.copy(), is_parent.copy()
    quiet = 0
    for turn in range(_MOST_ROUNDS):
        at = np.arange(turn % 2, size - 1, 2)
        at = at[is_parent[at] != is_parent[at + 1]]
        # The link before step at + 1 is the one that the two steps share.
        old_i, old_j = i[at + 1], j[at + 1]
        new_i = np.where(is_parent[at], old_i - 1, old_i + 1)
        new_j = np.where(is_parent[at], old_j + 1, old_j - 1)
        old = np.linalg.norm(parent[old_i % n] - child[old_j % m], axis=1)
        new = np.linalg.norm(parent[new_i % n] - child[new_j % m], axis=1)
        better = new < old * (1 - _GAIN)
        at = at[better]
        i[at + 1], j[at + 1] = new_i[better], new_j[better]
        is_parent[at], is_parent[at + 1] = is_parent[at + 1], is_parent[at].copy()
        quiet = 0 if len(at) else quiet + 1
        if quiet == 2:
            break
    return i, j, is_parent
