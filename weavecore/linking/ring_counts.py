"""How many edges each polyline is divided into: few changes from ring to ring, and those far from the borders.

Where a ring has k edges more or less than its parent, k rods end on each side of the band, each pair at a dislocation:
a node with one edge too few beside one with one too many.  Counts that follow the lengths closely change in
nearly every band, up and down again, and rods that start at a border end after two or three joints.  So the counts n
of all polylines that follow one another by plain bands are chosen together, such that

    Σ  a · n° (log n/n°)²   +   Σ  b |n_child - n_parent|  +  c [n_child ≠ n_parent]
   rings                       bands

is least, where n° is the count that gives the edge length asked for; n stays within a factor of n°, and b is larger
in the bands next to a border.  A polyline of a band in which rings split or merge has a term ``b |n - n°|``, for there
the counts of all sides must go together.  Polylines and plain bands make trees, so the least sum is found by dynamic
programming from the last generation to the first (Bellman 1957): O(K²) a band for K counts to choose from.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

EVENNESS = 0.5
"""Weight a of uneven edges: at 20 % off the edge length 50 edges count as much as one rod that ends."""

_BORDER_BANDS = 3
"""Generations beside a border: a rod from the border that ends in them has fewer than four joints."""

_BESIDE_BORDER = 4.0
"""Weight b in these bands: each rod that ends there counts this many times."""

_DIGITS = 6
"""Sums are compared to so many digits: on symmetric surfaces rounding errors must not decide between equal ones."""

_MOST_CHOICES = 256
"""Counts to choose from for one tree of polylines; where there are more whole numbers some are left out."""


def choose_counts(
    ideal: Floats, generation: Ints, pairs: Ints, branches: Bools, *, step: int, odd: int, slack: float, jump: float
) -> Ints:
    """Number of edges of each polyline of one tree.

    Parameters
    ----------
    ideal : (n,) float64
        Length of each polyline in edges, parents before their children.
    generation : (n,) int64
    pairs : (n - 1, 2) int64
        Parent and child of every plain band between them.
    branches : (n,) bool
        Polylines of bands in which rings split or merge.
    step, odd : int
        Counts are multiples of ``step`` plus ``odd``.
    slack : float
        Factor by which a count may be off the ideal one.
    jump : float
        Weight c of a band in which the count changes, in rods that end.

    Returns
    -------
    (n,) int64
    """
    choices = _choices(ideal, step, odd, slack)
    off = np.log(choices[None, :] / ideal[:, None])
    cost = EVENNESS * ideal[:, None] * off**2
    weight = np.where(generation <= _BORDER_BANDS, _BESIDE_BORDER, 1.0)
    cost += (branches * weight)[:, None] * np.abs(choices[None, :] - ideal[:, None])
    near = np.maximum(np.log(slack), np.abs(off).min(axis=1) + 1e-9)
    cost[np.abs(off) > near[:, None]] = np.inf
    change = np.abs(choices[:, None] - choices[None, :]).astype(np.float64)
    best = np.zeros((len(ideal), len(choices)), np.int64)
    for parent, child in pairs[np.argsort(-pairs[:, 1], kind="stable")].tolist():
        total = np.round(weight[child] * change + jump * (change > 0) + cost[child][None, :], _DIGITS)
        best[child] = total.argmin(axis=1)
        cost[parent] += total.min(axis=1)
    chosen = np.empty(len(ideal), np.int64)
    roots = np.setdiff1d(np.arange(len(ideal)), pairs[:, 1])
    chosen[roots] = np.round(cost[roots], _DIGITS).argmin(axis=1)
    for parent, child in pairs[np.argsort(pairs[:, 1], kind="stable")].tolist():
        chosen[child] = best[child, chosen[parent]]
    counts: Ints = choices[chosen]
    return counts


def _choices(ideal: Floats, step: int, odd: int, slack: float) -> Ints:
    least = max(int(np.floor((ideal.min() / slack - odd) / step)), 0)
    most = int(np.ceil((ideal.max() * slack - odd) / step))
    whole = np.arange(least, most + 1)
    if len(whole) > _MOST_CHOICES:
        whole = np.unique(np.rint(np.geomspace(max(least, 1), most, _MOST_CHOICES)).astype(np.int64))
    choices: Ints = whole * step + odd
    return choices[choices > 0]
