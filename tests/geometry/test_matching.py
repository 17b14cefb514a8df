"""Pairing things that like each other best."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from weavecore.geometry.matching import ALONE, match_best, match_greedily


def best_by_trying_all(pairs: list[tuple[int, int, float]], n: int) -> tuple[int, float]:
    """The largest number of pairs, and the least sum of that many."""
    for size in range(n // 2, 0, -1):
        sums = [
            sum(cost for _, _, cost in chosen)
            for chosen in combinations(pairs, size)
            if len({thing for a, b, _ in chosen for thing in (a, b)}) == 2 * size
        ]
        if sums:
            return size, min(sums)
    return 0, 0.0


def cost_of(partner: np.ndarray, pairs: list[tuple[int, int, float]]) -> float:
    return sum(cost for a, b, cost in pairs if partner[a] == b)


@pytest.mark.parametrize("seed", range(12))
def test_the_best_matching_is_as_good_as_any(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n = int(draw.integers(4, 9))
    all_pairs = list(combinations(range(n), 2))
    chosen = draw.choice(len(all_pairs), size=min(len(all_pairs), 11), replace=False)
    pairs = [(*all_pairs[k], float(draw.uniform(0, 5))) for k in sorted(chosen.tolist())]
    one, other, cost = (np.array(column) for column in zip(*pairs))
    partner = match_best(one, other, cost, n)
    met = np.flatnonzero(partner != ALONE)
    assert np.array_equal(partner[partner[met]], met)
    size, least = best_by_trying_all(pairs, n)
    assert len(met) == 2 * size
    assert cost_of(partner, pairs) == pytest.approx(least)


def test_the_cheapest_pair_first_may_leave_two_alone() -> None:
    one, other, cost = np.array([0, 1, 2]), np.array([1, 2, 3]), np.array([2.0, 1.0, 2.0])
    assert match_greedily(one, other, cost, 4).tolist() == [ALONE, 2, 1, ALONE]
    assert match_best(one, other, cost, 4).tolist() == [1, 0, 3, 2]


def test_nothing_to_pair_leaves_all_alone() -> None:
    nothing = np.zeros(0, np.int64)
    assert match_best(nothing, nothing, np.zeros(0), 3).tolist() == [ALONE] * 3
