"""Matching: pairs of things with the least cost.

Greedy matching takes the cheapest pair first, in O(k log k) for k allowed pairs; the best matching (as many pairs as
possible, then the least sum of costs) is an integer programme, solved by HiGHS.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, ranks_in_rows

ALONE = -1
_MAX_PAIRS = 20_000
"""Allowed pairs up to which the best matching is computed: the time of an integer programme has no bound."""

_TIE = 1e-3
"""Part of the least cost by which costs are made unlike each other at most."""


def match_greedily(one: Ints, other: Ints, cost: Floats, n: int) -> Ints:
    """Pair things, the cheapest of the allowed pairs first.

    Parameters
    ----------
    one, other : (k,) int64
        The allowed pairs.
    cost : (k,) float64
        Where two cost the same, the pair with the lesser numbers goes first.
    n : int
        How many things there are.

    Returns
    -------
    (n,) int64
        Partner of each, -1 where it has none.
    """
    partner = np.full(n, ALONE, np.int64)
    order = np.lexsort((other, one, cost))
    one, other = one[order], other[order]
    # Pairs that are the cheapest for both are taken together; so a few rounds are enough.
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
    """Pair things so that as few as possible stay alone, and then with the least sum of costs.

    Parameters
    ----------
    one, other, cost, n
        As of `match_greedily`, which also does the work if there are more than `_MAX_PAIRS` pairs.

    Returns
    -------
    (n,) int64
        Partner of each, -1 where it has none.
    """
    if len(one) == 0 or len(one) > _MAX_PAIRS:
        return match_greedily(one, other, cost, n)
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_matrix

    pair = np.arange(len(one))
    which = np.r_[one, other], np.r_[pair, pair]
    shares = coo_matrix((np.ones(2 * len(one)), which), shape=(n, len(one))).tocsr()
    # Among several best matchings another release of the solver may find another one, so no two costs are alike.
    least = np.min(cost, where=cost > 0, initial=1.0)
    cost = cost + _TIE * least * np.random.default_rng(0).random(len(cost))
    # One more pair outweighs all costs that it adds.
    reward = 2.0 * (1.0 + cost.max()) + cost.max() * np.sqrt(n)
    found = milp(
        cost - reward,
        constraints=LinearConstraint(shares, ub=1.0),
        integrality=np.ones(len(one), np.int64),
        bounds=Bounds(0, 1),
        # With presolve HiGHS prints a line now and then that nothing else can silence.
        options={"presolve": False, "mip_rel_gap": 0.0},
    )
    if found.x is None:
        return match_greedily(one, other, cost, n)
    taken = found.x > 0.5
    partner = np.full(n, ALONE, np.int64)
    partner[one[taken]], partner[other[taken]] = other[taken], one[taken]
    return partner


def pairs_of_equals(keys: Ints) -> tuple[Ints, Ints]:
    """Find all pairs of positions with the same key.

    Parameters
    ----------
    keys : (n,) int64

    Returns
    -------
    one, other : (k,) int64
        The lesser position first.
    """
    order = np.argsort(keys, kind="stable")
    count = np.unique(keys[order], return_counts=True)[1]
    behind = np.repeat(count, count) - 1 - ranks_in_rows(count)
    one = np.repeat(np.arange(len(keys)), behind)
    other = one + 1 + ranks_in_rows(behind)
    return order[one], order[other]
