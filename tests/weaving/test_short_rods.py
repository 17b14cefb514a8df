from __future__ import annotations

import numpy as np
import pytest

from weavecore.geometry.matching import ALONE
from weavecore.model.rod_ends import LAST_RESORT, RING, USUAL, count_short_rods, lengthen_short_rods


def joint_of_a_long_and_a_short_rod(n: int) -> tuple[np.ndarray, np.ndarray, int, int, int]:
    """A rod of 2n edges along a line, and one of a single edge that ends at its middle: partners and tails of darts."""
    tails = []
    for k in range(2 * n):
        tails += [k, k + 1]
    tails += [2 * n + 1, n]
    tail = np.array(tails)
    partner = np.full(len(tail), ALONE)
    for k in range(1, 2 * n):
        partner[2 * k - 1], partner[2 * k] = 2 * k, 2 * k - 1
    behind, ahead, short = 2 * n - 1, 2 * n, len(tail) - 1
    return partner, tail, behind, ahead, short


def paired_anew(partner, tail, behind, ahead, short, last_resort=()) -> np.ndarray:
    """Partners after the short rod was offered both ways, ahead with the lesser turn."""
    pairs = [(short, behind), (short, ahead), (behind, ahead)]
    one, other = np.array(pairs).T
    kind = np.where([pair == last_resort for pair in pairs], LAST_RESORT, USUAL)
    return lengthen_short_rods(partner, tail, one, other, np.array([0.5, 0.3, 0.0]), kind)


def test_a_short_rod_takes_over_the_way_of_a_long_one() -> None:
    partner, tail, behind, ahead, short = joint_of_a_long_and_a_short_rod(5)
    found = paired_anew(partner, tail, behind, ahead, short)
    assert found[short] == ahead
    assert found[ahead] == short
    assert found[behind] == ALONE


def test_a_rod_does_not_become_short_for_another() -> None:
    partner, tail, behind, ahead, short = joint_of_a_long_and_a_short_rod(2)
    assert (paired_anew(partner, tail, behind, ahead, short) == partner).all()


def test_a_pair_of_last_resort_is_made_where_no_other_makes_a_short_rod_long() -> None:
    partner, tail, behind, ahead, short = joint_of_a_long_and_a_short_rod(5)
    found = paired_anew(partner, tail, behind, ahead, short, last_resort=(short, ahead))
    assert found[short] == behind
    partner, tail, behind, ahead, short = joint_of_a_long_and_a_short_rod(5)
    pairs = np.array([[short, ahead], [behind, ahead]]).T
    found = lengthen_short_rods(partner, tail, *pairs, np.array([0.3, 0.0]), np.array([LAST_RESORT, USUAL]))
    assert found[short] == ahead


def ring_and_two_short_rods(n: int) -> tuple[np.ndarray, np.ndarray]:
    """A ring of n edges, open opposite its first node, where two rods of one edge end: partners and tails."""
    tails = [node for k in range(n) for node in (k, (k + 1) % n)] + [n, 0, n + 1, 0]
    partner = np.full(len(tails), ALONE)
    for k in range(n):
        if k != n // 2:
            partner[(2 * k - 1) % (2 * n)], partner[2 * k] = 2 * k, (2 * k - 1) % (2 * n)
    return partner, np.array(tails)


@pytest.mark.parametrize(("n", "opens"), [(20, True), (14, False)])
def test_a_ring_is_opened_for_two_short_rods_where_its_pieces_stay_long(n: int, opens: bool) -> None:
    partner, tail = ring_and_two_short_rods(n)
    back, forth, left, right = 2 * n - 1, 0, 2 * n + 1, 2 * n + 3
    pairs = np.array([[back, forth], [left, forth], [right, back]])
    kind = np.array([RING, LAST_RESORT, LAST_RESORT])
    found = lengthen_short_rods(partner, tail, *pairs.T, np.zeros(3), kind)
    assert (found[left] == forth and found[right] == back) == opens
    assert (found == partner).all() != opens
    assert count_short_rods(found)[0] == (0 if opens else 2)
