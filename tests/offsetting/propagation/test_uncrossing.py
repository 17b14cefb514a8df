"""Taking intersections apart (Yan et al. 2016, §4.3 and §4.4)."""

import numpy as np
import pytest

from drawn_curves import draw, signed_areas, square_domain
from planar_meshes import circle
from weavecore.offsetting.propagation.intersections import find_intersections
from weavecore.offsetting.propagation.uncrossing import reconnect_at_crossings


@pytest.fixture(scope="module")
def domain():
    return square_domain()


def taken_apart(domain, *loops):
    raw = draw(domain, *loops)
    crossings = find_intersections(domain, raw)
    return raw, crossings, reconnect_at_crossings(domain, raw, crossings)


def figure_eight(size=4.0, n=60):
    t = 2 * np.pi * (np.arange(n) + 0.5) / n
    return size * np.stack([np.sin(t), np.sin(t) * np.cos(t)], axis=1) + 0.013


def test_a_polyline_that_crosses_itself_becomes_two(domain):
    raw, crossings, uncrossed = taken_apart(domain, figure_eight())
    assert (len(raw), len(crossings), len(uncrossed.curves)) == (1, 1, 2)
    areas = signed_areas(uncrossed.curves)
    assert areas[0] * areas[1] < 0
    assert uncrossed.curves.curve_lengths.sum() == pytest.approx(raw.curve_lengths.sum())


def test_two_polylines_that_cross_become_one_and_what_they_both_enclose(domain):
    loops = circle(3.0, (-1.5, 0.1), n=50), circle(3.0, (1.5, 0.0), n=50)
    raw, crossings, uncrossed = taken_apart(domain, *loops)
    assert (len(raw), len(crossings), len(uncrossed.curves)) == (2, 2, 2)
    areas = signed_areas(uncrossed.curves)
    # Both run counter-clockwise: the lens between them is enclosed twice, the union once.
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(signed_areas(raw).sum())
    lens, union = np.argsort(areas)
    assert uncrossed.winding[lens] == uncrossed.winding[union] + 1
    assert uncrossed.group[lens] == uncrossed.group[union]


def test_polylines_that_run_opposite_ways_become_one(domain):
    loops = circle(3.0, (-1.5, 0.1), n=50), circle(3.0, (1.5, 0.0), n=50)[::-1]
    _, crossings, uncrossed = taken_apart(domain, *loops)
    # Two crescents, one on the left of its side and one on the right: equally high would be wrong.
    assert (len(crossings), len(uncrossed.curves)) == (2, 2)
    assert np.sign(signed_areas(uncrossed.curves)).tolist().count(1) == 1


def test_a_loop_of_a_sharp_corner_is_one_lower(domain):
    # A front that turned too sharply: its two sides run on past each other, then back along the end.
    front = np.array([[-4.1, 3.1], [-4, -3.1], [6, -3], [4.1, -5], [4, 3.2]])
    _, crossings, uncrossed = taken_apart(domain, front)
    assert len(crossings) == 1
    tail, main = np.argsort(uncrossed.curves.curve_lengths)
    assert signed_areas(uncrossed.curves)[tail] < 0 < signed_areas(uncrossed.curves)[main]
    assert uncrossed.winding[tail] == uncrossed.winding[main] - 1


@pytest.mark.parametrize("seed", range(4))
def test_of_a_tangle_nothing_crosses_afterwards_and_no_length_is_lost(domain, seed):
    tangle = np.random.default_rng(seed).uniform(-8, 8, (25, 2))
    raw, crossings, uncrossed = taken_apart(domain, tangle)
    assert len(crossings) > 20
    assert len(find_intersections(domain, uncrossed.curves)) == 0
    assert uncrossed.curves.curve_lengths.sum() == pytest.approx(raw.curve_lengths.sum())
    # Each exchange of followers parts a loop in two or joins two: the parity is that of the crossings.
    assert (len(uncrossed.curves) - 1 - len(crossings)) % 2 == 0


def test_what_does_not_cross_stays_as_it_is(domain):
    raw, crossings, uncrossed = taken_apart(domain, circle(2.0, (-4, 0)), circle(2.0, (4, 0)))
    assert len(crossings) == 0
    np.testing.assert_array_equal(uncrossed.curves.points, raw.points)
    assert uncrossed.group.tolist() == [0, 1]
