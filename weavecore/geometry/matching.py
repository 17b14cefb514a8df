"""Pairing things that like each other best."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, ranks_in_rows

ALONE = -1
_MOST_PAIRS = 20_000
"""Above so many pairs that are allowed the best matching is not looked for: the time it takes has no bound."""


def match_greedily(one: Ints, other: Ints, cost: Floats, n: int) -> Ints:
    """Partner (n,) of each of ``n`` things, -1 where it has none: the cheapest of the given pairs first.

    Parameters
    ----------
    one, other : (k,) int64
        The pairs that are allowed.
    cost : (k,) float64
        Where two cost the same, the pair with the lesser numbers goes first.
    n : int
    """
    partner = np.full(n, ALONE, np.int64)
    order = np.lexsort((other, one, cost))
    one, other = one[order], other[order]
    # Pairs that are the cheapest for both are settled together; so a few rounds do.
    while len(one):
        rank = np.arange(len(one))
        best = np.full(n, len(one))
        np.minimum.at(best, one, rank)
        np.minimum.at(best, other, rank)
        both = (best[one] == rank) & (best[other] == rank)
        partner[one[both]], partner[other[both]] = other[both], one[both]
        free = (partner[one] == ALONE) & (partner[other] == ALONE)
        one, other = one[free], other[free]
    return partner


def match_best(one: Ints, other: Ints, cost: Floats, n: int) -> Ints:
    """Partner (n,) of each of ``n`` things, -1 where it has none: as few as can be left alone, then the least sum.

    Arguments are those of `match_greedily`, which is what is done where there are very many pairs.
    """
    if len(one) == 0 or len(one) > _MOST_PAIRS:
        return match_greedily(one, other, cost, n)
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_matrix

    pair = np.arange(len(one))
    which = np.r_[one, other], np.r_[pair, pair]
    shares = coo_matrix((np.ones(2 * len(one)), which), shape=(n, len(one))).tocsr()
    # A pair more is worth more than any that it makes dearer.
    reward = 2.0 * (1.0 + cost.max()) + cost.max() * np.sqrt(n)
    found = milp(
        cost - reward,
        constraints=LinearConstraint(shares, ub=1.0),
        integrality=np.ones(len(one), np.int64),
        bounds=Bounds(0, 1),
        options={"presolve": False},  # With it HiGHS prints a line now and then that nothing else can silence.
    )
    if found.x is None:
        return match_greedily(one, other, cost, n)
    taken = found.x > 0.5
    partner = np.full(n, ALONE, np.int64)
    partner[one[taken]], partner[other[taken]] = other[taken], one[taken]
    return partner


def pairs_of_equals(keys: Ints) -> tuple[Ints, Ints]:
    """All pairs of positions with the same key, the lesser first."""
    order = np.argsort(keys, kind="stable")
    count = np.unique(keys[order], return_counts=True)[1]
    behind = np.repeat(count, count) - 1 - ranks_in_rows(count)
    one = np.repeat(np.arange(len(keys)), behind)
    other = one + 1 + ranks_in_rows(behind)
    return order[one], order[other]
