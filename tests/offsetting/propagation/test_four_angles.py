"""The sum of four angles (Yan et al. 2016, §4.3), and who decides where it is in doubt."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from weavecore.offsetting.propagation.intersections import (
    DOUBT,
    find_sides,
    locate_crossings,
    segments_cross,
    sum_of_four_angles,
)

FULL = 2 * np.pi


def rows(*segments):
    return [np.array([point], float) for segment in segments for point in segment]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (((-1, 0), (1, 0)), ((0, -1), (0, 1))),
        (((-1, 0), (5, 0)), ((-0.9, -3), (-0.5, 0.01))),
        (((0, 0), (1, 1)), ((1, 0), (0.001, 0.002))),
    ],
)
def test_segments_that_cross_have_a_full_sum(first, second):
    assert sum_of_four_angles(*rows(first, second))[0] == pytest.approx(FULL, abs=1e-12)
    assert segments_cross(*rows(first, second))[0]
    assert segments_cross(*rows(second, first))[0]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (((-1, 0), (1, 0)), ((0, 0.1), (0, 1))),  # one ends before the other
        (((-1, 0), (1, 0)), ((2, -1), (2, 1))),  # beside its end
        (((-1, 0), (1, 0)), ((-1, 0.5), (1, 0.5))),  # parallel
        (((0, 0), (1, 0)), ((100, 50), (101, 53))),  # far apart
        (((0, 0), (1, 0)), ((2, 0), (3, 0))),  # in line, one behind the other
    ],
)
def test_segments_that_do_not_cross_have_less(first, second):
    assert sum_of_four_angles(*rows(first, second))[0] < FULL - DOUBT
    assert not segments_cross(*rows(first, second))[0]


def test_four_far_points_in_convex_position_cross_only_as_diagonals():
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    pairs = {((0, 2), (1, 3)): True, ((0, 1), (2, 3)): False, ((1, 2), (0, 3)): False}
    for (one, other), crosses in pairs.items():
        segments = rows([square[k] for k in one], [square[k] for k in other])
        assert (sum_of_four_angles(*segments)[0] > FULL - DOUBT) == crosses
        assert segments_cross(*segments)[0] == crosses


def test_touching_segments_are_in_doubt_and_one_side_is_chosen_for_good():
    first, second = ((-1, 0), (1, 0)), ((0, 0), (0, 1))
    assert sum_of_four_angles(*rows(first, second))[0] == pytest.approx(FULL)
    # A point on a line counts as left of it: who comes from the left does not cross, who comes from the right does.
    assert not segments_cross(*rows(first, second))[0]
    assert segments_cross(*rows(first, ((0, 0), (0, -1))))[0]


def test_a_hair_decides_where_the_angles_cannot():
    hair = 2.0**-60
    above, below = ((0.5, hair), (0.5, 1)), ((0.5, -hair), (0.5, 1))
    first = ((0.25, 0), (0.75, 0))
    assert sum_of_four_angles(*rows(first, above))[0] == sum_of_four_angles(*rows(first, below))[0]
    assert not segments_cross(*rows(first, above))[0]
    assert segments_cross(*rows(first, below))[0]


near = st.integers(-3, 3).map(lambda k: 0.5 + k * 2.0**-53)
coordinates = st.one_of(st.floats(-4, 4), near)


@given(*[st.tuples(coordinates, coordinates) for _ in range(3)])
def test_sides_are_exact(a, b, p):
    (ax, ay), (bx, by), (px, py) = (tuple(map(Fraction, q)) for q in (a, b, p))
    area = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    assert find_sides(*rows((a, b, p)))[0] == (1 if area >= 0 else -1)


def test_a_crossing_is_located_on_both_segments():
    on_first, on_second = locate_crossings(*rows(((0, 0), (4, 0)), ((1, -1), (1, 3))))
    assert (on_first[0], on_second[0]) == (0.25, 0.25)
