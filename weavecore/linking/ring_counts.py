"""How many edges each polyline is divided into: few changes from ring to ring, and those far from the borders.

Where a ring has k edges more or less than its parent, k rods end on each side of the band, each pair at a dislocation:
a node with one edge too few beside one with one too many.  Counts that follow the lengths closely change in
nearly every band, up and down again, and rods that start at a border end after two or three joints.  So the counts n
of all polylines that follow one another by plain bands are chosen together, such that

    Σ  a · n° (log n/n°)²   +   Σ  b |n_child - n_parent|  +  c [n_child ≠ n_parent]
   rings                       bands

is least, where n° is the count that gives the edge length asked for; n stays within a factor of n°, and b is larger
in the bands next to a border.

A band in which rings split or merge has a term of the same kind, ``b |Σ n_parent - 2 k - Σ n_child|``: what a ring has
more than the rings that it splits into must lie where it faces itself across the neck, k edges on each side.  Here 2 k
is a part of the ring's count, by how much of its length lies too far from any child (`node_counts`).

Polylines and bands make trees, so the least sum is found by messages from the leaves to a root (Bellman 1957; min-sum
on a factor tree, Kschischang, Frey and Loeliger 2001): O(K²) a band for K counts to choose from, and for a band of
several sides as much for each sum of two (min-plus convolution).  A band that would close a cycle, around a handle, is
left out; its polylines have terms ``b |n - n°|`` instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.elementary import logarithms

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


@dataclass(frozen=True, eq=False)
class Balance:
    """A band whose parents' counts should be those of its children.

    Parameters
    ----------
    polyline : (k,) int64
        Its sides, two or more.
    sign : (k,) int64
        1 and -1 on the two sides of the balance.
    across : (k,) float64
        Part of the length of each from which rods go across a neck, to a parent.
    """

    polyline: Ints
    sign: Ints
    across: Floats


def choose_counts(
    ideal: Floats,
    generation: Ints,
    bands: list[Balance],
    branches: Bools,
    *,
    step: int,
    remainder: int,
    slack: float,
    jump: float,
) -> Ints:
    """Choose the number of edges of each polyline of one tree.

    Parameters
    ----------
    ideal : (n,) float64
        Count n° of each polyline: its length in edges.
    generation : (n,) int64
    bands : list of Balance
        No two polylines are joined by them in two ways.
    branches : (n,) bool
        Polylines of other bands in which rings split or merge.
    step, remainder : int
        Counts are multiples of ``step`` plus ``remainder``.
    slack : float
        Factor by which a count may be off the ideal one.
    jump : float
        Cost c of a band in which the count changes, in rods that end.

    Returns
    -------
    (n,) int64
    """
    choices = _choices(ideal, step, remainder, slack)
    off = logarithms(choices[None, :] / ideal[:, None])
    cost = EVENNESS * ideal[:, None] * off**2
    weight = np.where(generation <= _BORDER_BANDS, _BESIDE_BORDER, 1.0)
    cost += (branches * weight)[:, None] * np.abs(choices[None, :] - ideal[:, None])
    near = np.maximum(logarithms(slack), np.abs(off).min(axis=1) + 1e-9)
    cost[np.abs(off) > near[:, None]] = np.inf
    order, toward = _towards_root(len(ideal), bands)
    messages = []
    for band, root in zip(order, toward):
        inward = band.polyline.tolist().index(root)
        sides = [_Side(choices, band, k, cost[band.polyline[k]]) for k in range(len(band.polyline))]
        message = _Message(
            sides[inward], sides[:inward] + sides[inward + 1 :], float(weight[band.polyline].min()), jump
        )
        cost[root] += message.cost
        messages.append(message)
    inner = {p for band, root in zip(order, toward) for p in band.polyline.tolist() if p != root}
    chosen = {p: int(np.round(cost[p], _DIGITS).argmin()) for p in range(len(ideal)) if p not in inner}
    for band, root, message in zip(order[::-1], toward[::-1], messages[::-1]):
        others = [p for p in band.polyline.tolist() if p != root]
        chosen.update(zip(others, message.choices_for(chosen[root])))
    counts: Ints = choices[[chosen[p] for p in range(len(ideal))]]
    return counts


def _towards_root(n: int, bands: list[Balance]) -> tuple[list[Balance], list[int]]:
    """The bands from the leaves inwards, each with its polyline on the way to the root: the first of its tree."""
    at: list[list[int]] = [[] for _ in range(n)]
    for k, band in enumerate(bands):
        for p in band.polyline.tolist():
            at[p].append(k)
    order: list[Balance] = []
    toward: list[int] = []
    seen, known = np.zeros(n, bool), np.zeros(len(bands), bool)
    for root in range(n):
        ahead = [] if seen[root] else [root]
        while ahead:
            p = ahead.pop()
            seen[p] = True
            for k in at[p]:
                if not known[k]:
                    known[k] = True
                    order.append(bands[k])
                    toward.append(p)
                    ahead += [q for q in bands[k].polyline.tolist() if q != p]
    return order[::-1], toward[::-1]


class _Side:
    """What a polyline gives to the balance of a band for each of its counts, and at what cost."""

    def __init__(self, choices: Ints, band: Balance, k: int, cost: Floats) -> None:
        across = 2 * np.rint(choices * band.across[k] / 2.0).astype(np.int64)
        self.given = int(band.sign[k]) * (choices - across)
        self.cost = cost

    def by_sum(self) -> tuple[int, Floats, Ints]:
        """The least of what may be given, and for each whole number from there on the least cost and its choice."""
        least = int(self.given.min())
        order = np.lexsort([self.cost, self.given])
        given, first = np.unique(self.given[order], return_index=True)
        cost, choice = np.full(int(given[-1]) - least + 1, np.inf), np.zeros(int(given[-1]) - least + 1, np.int64)
        cost[given - least], choice[given - least] = self.cost[order[first]], order[first]
        return least, cost, choice


class _Message:
    """The least cost of a band and all beyond it for each count of the polyline on the way to the root."""

    def __init__(self, inward: _Side, others: list[_Side], weight: float, jump: float) -> None:
        self._tables = [side.by_sum() for side in others]
        self._sums = [self._tables[0][:2]]
        for least, cost, _ in self._tables[1:]:
            self._sums.append((self._sums[-1][0] + least, _min_plus(self._sums[-1][1], cost)))
        least, total = self._sums[-1]
        off = np.abs(inward.given[:, None] + least + np.arange(len(total)))
        whole = np.round(weight * off + jump * (off > 0) + total, _DIGITS)
        self._best = whole.argmin(axis=1)
        self.cost = whole.min(axis=1)

    def choices_for(self, choice: int) -> list[int]:
        """The choices of the other polylines that go with one of the polyline on the way to the root."""
        at = int(self._best[choice])
        found = []
        for (_, before), (_, cost, choices) in zip(self._sums[-2::-1], self._tables[:0:-1]):
            k = np.arange(max(0, at - len(before) + 1), min(at, len(cost) - 1) + 1)
            k_best = int(k[np.round(cost[k] + before[at - k], _DIGITS).argmin()])
            found.append(int(choices[k_best]))
            at -= k_best
        return [int(self._tables[0][2][at]), *found[::-1]]


def _min_plus(one: Floats, other: Floats) -> Floats:
    """(a + b - 1,) the least sum of one entry of each whose places add up to each place."""
    least = np.full(len(one) + len(other) - 1, np.inf)
    for k in np.flatnonzero(np.isfinite(one)).tolist():
        part = least[k : k + len(other)]
        np.minimum(part, one[k] + other, out=part)
    return least


def _choices(ideal: Floats, step: int, remainder: int, slack: float) -> Ints:
    """The counts to choose from (K,), rising."""
    least = max(int(np.floor((ideal.min() / slack - remainder) / step)), 0)
    most = int(np.ceil((ideal.max() * slack - remainder) / step))
    whole = np.arange(least, most + 1)
    if len(whole) > _MOST_CHOICES:
        whole = np.unique(np.rint(np.geomspace(max(least, 1), most, _MOST_CHOICES)).astype(np.int64))
    choices: Ints = whole * step + remainder
    return choices[choices > 0]
