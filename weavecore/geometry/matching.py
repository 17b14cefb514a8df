"""Pairing things that like each other best."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

ALONE = -1


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
