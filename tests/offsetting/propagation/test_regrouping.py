"""Taking intersections apart (Yan et al. 2016, §4.3 and §4.4)."""

import numpy as np
import pytest

from drawn_curves import draw, signed_areas, square_ground
from planar_meshes import circle
from weavecore.offsetting.propagation.intersections import lengths_of, meet_themselves, regroup


@pytest.fixture(scope="module")
def ground():
    return square_ground()


def taken_apart(ground, *loops):
    raw = draw(ground, *loops)
    meetings = meet_themselves(ground, raw)
    return raw, meetings, regroup(ground, raw, meetings)


def figure_eight(size=4.0, n=60):
    t = 2 * np.pi * (np.arange(n) + 0.5) / n
    return size * np.stack([np.sin(t), np.sin(t) * np.cos(t)], axis=1) + 0.013


def test_a_polyline_that_crosses_itself_becomes_two(ground):
    raw, meetings, regrouped = taken_apart(ground, figure_eight())
    assert (len(raw), len(meetings), len(regrouped.curves)) == (1, 1, 2)
    areas = signed_areas(regrouped.curves)
    assert areas[0] * areas[1] < 0
    assert lengths_of(regrouped.curves).sum() == pytest.approx(lengths_of(raw).sum())


def test_two_polylines_that_cross_become_one_and_what_they_both_enclose(ground):
    loops = circle(3.0, (-1.5, 0.1), n=50), circle(3.0, (1.5, 0.0), n=50)
    raw, meetings, regrouped = taken_apart(ground, *loops)
    assert (len(raw), len(meetings), len(regrouped.curves)) == (2, 2, 2)
    areas = signed_areas(regrouped.curves)
    # Both run counter-clockwise: the lens between them is enclosed twice, the union once.
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(signed_areas(raw).sum())
    lens, union = np.argsort(areas)
    assert regrouped.height[lens] == regrouped.height[union] + 1
    assert regrouped.group[lens] == regrouped.group[union]


def test_polylines_that_run_opposite_ways_become_one(ground):
    loops = circle(3.0, (-1.5, 0.1), n=50), circle(3.0, (1.5, 0.0), n=50)[::-1]
    _, meetings, regrouped = taken_apart(ground, *loops)
    # Two crescents, one on the left of its side and one on the right: equally high would be wrong.
    assert (len(meetings), len(regrouped.curves)) == (2, 2)
    assert np.sign(signed_areas(regrouped.curves)).tolist().count(1) == 1


def test_a_loop_of_a_sharp_corner_is_one_lower(ground):
    # A front that turned too sharply: its two sides run on past each other, then back along the end.
    front = np.array([[-4.1, 3.1], [-4, -3.1], [6, -3], [4.1, -5], [4, 3.2]])
    _, meetings, regrouped = taken_apart(ground, front)
    assert len(meetings) == 1
    tail, main = np.argsort(lengths_of(regrouped.curves))
    assert signed_areas(regrouped.curves)[tail] < 0 < signed_areas(regrouped.curves)[main]
    assert regrouped.height[tail] == regrouped.height[main] - 1


@pytest.mark.parametrize("seed", range(4))
def test_of_a_tangle_nothing_crosses_afterwards_and_no_length_is_lost(ground, seed):
    tangle = np.random.default_rng(seed).uniform(-8, 8, (25, 2))
    raw, meetings, regrouped = taken_apart(ground, tangle)
    assert len(meetings) > 20
    assert len(meet_themselves(ground, regrouped.curves)) == 0
    assert lengths_of(regrouped.curves).sum() == pytest.approx(lengths_of(raw).sum())
    # Each exchange of followers parts a loop in two or joins two: the parity is that of the crossings.
    assert (len(regrouped.curves) - 1 - len(meetings)) % 2 == 0


def test_what_does_not_cross_stays_as_it_is(ground):
    raw, meetings, regrouped = taken_apart(ground, circle(2.0, (-4, 0)), circle(2.0, (4, 0)))
    assert len(meetings) == 0
    np.testing.assert_array_equal(regrouped.curves.points, raw.points)
    assert regrouped.group.tolist() == [0, 1]
