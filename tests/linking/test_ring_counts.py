from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from weavecore.linking.ring_counts import EVENNESS, Balance, choose_counts

CHAIN = [Balance(np.array([k, k + 1]), np.array([1, -1]), np.zeros(2)) for k in range(9)]


def counts_of(
    ideal: np.ndarray, *, step: int = 1, remainder: int = 0, slack: float = 1.4, jump: float = 0.0
) -> np.ndarray:
    n = len(ideal)
    return choose_counts(
        ideal, np.arange(n), CHAIN[: n - 1], np.zeros(n, bool), step=step, remainder=remainder, slack=slack, jump=jump
    )


def test_rings_of_one_length_have_one_count() -> None:
    assert (counts_of(np.full(8, 30.0)) == 30).all()


def test_a_waist_within_the_slack_ends_no_rod() -> None:
    ideal = np.array([36.0, 34.0, 31.0, 29.0, 28.0, 29.0, 31.0, 34.0])
    assert len(np.unique(counts_of(ideal))) == 1


def test_no_count_is_further_off_than_the_slack() -> None:
    ideal = 60.0 * 0.8 ** np.arange(10)
    counts = counts_of(ideal)
    assert np.abs(np.log(counts / ideal)).max() <= np.log(1.4) + 1e-9
    assert (np.diff(counts) <= 0).all()


def test_beside_a_border_the_count_stays() -> None:
    ideal = np.array([50.0, 47.0, 44.0, 41.0, 36.0, 30.0, 24.0, 18.0])
    counts = counts_of(ideal)
    assert len(np.unique(counts[:4])) == 1


def test_a_dear_change_makes_few_large_ones() -> None:
    ideal = 60.0 * 0.9 ** np.arange(10)
    changes = [np.count_nonzero(np.diff(counts_of(ideal, jump=jump))) for jump in (0.0, 5.0)]
    assert changes[1] < changes[0]


@pytest.mark.parametrize(("step", "remainder"), [(2, 0), (4, 0), (2, 1)])
def test_counts_are_multiples_plus_a_remainder(step: int, remainder: int) -> None:
    assert (counts_of(np.linspace(40.0, 12.0, 8), step=step, remainder=remainder) % step == remainder).all()


def test_a_branch_keeps_to_its_length() -> None:
    ideal = np.array([40.0, 38.0, 30.0])
    branches = np.array([False, False, True])
    counts = choose_counts(ideal, np.arange(3), CHAIN[:2], branches, step=1, remainder=0, slack=1.4, jump=0.0)
    assert abs(counts[2] - 30) <= 1


def test_where_a_ring_splits_its_count_is_the_sum_of_those_of_its_children_and_of_what_goes_across_the_neck() -> None:
    ideal = np.array([76.0, 70.0, 33.0, 24.0])
    split = Balance(np.array([1, 2, 3]), np.array([1, -1, -1]), np.array([0.1, 0.0, 0.0]))
    for bands in ([CHAIN[0], split], [split, CHAIN[0]]):
        counts = choose_counts(
            ideal, np.array([0, 1, 2, 2]), bands, np.zeros(4, bool), step=1, remainder=0, slack=1.4, jump=0.0
        )
        assert counts[0] == counts[1]
        assert counts[1] - 2 * np.rint(0.05 * counts[1]) == counts[2] + counts[3]


def test_the_sum_over_a_split_is_the_least_of_all_counts() -> None:
    ideal, generation = np.array([9.0, 4.0, 3.5, 3.0]), np.array([4, 5, 5, 6])
    bands = [
        Balance(np.array([0, 1, 2]), np.array([1, -1, -1]), np.zeros(3)),
        Balance(np.array([2, 3]), np.array([1, -1]), np.zeros(2)),
    ]
    found = choose_counts(ideal, generation, bands, np.zeros(4, bool), step=1, remainder=0, slack=1.6, jump=0.3)

    def cost(n: np.ndarray) -> float:
        off = [abs(n[0] - n[1] - n[2]), abs(n[2] - n[3])]
        return float((EVENNESS * ideal * np.log(n / ideal) ** 2).sum() + sum(x + 0.3 * (x > 0) for x in off))

    near = [np.arange(np.ceil(x / 1.6), np.floor(x * 1.6) + 1) for x in ideal]
    assert cost(found) == pytest.approx(min(cost(np.array(n)) for n in product(*near)), abs=1e-5)
