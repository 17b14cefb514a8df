"""Where a height is reached between the ends of an edge."""

import numpy as np
import pytest

from weavecore.offsetting.isolines.crossings import invert_cubic, invert_kink

HEIGHT = np.linspace(0, 1, 1001)


@pytest.mark.parametrize("start", [0.0, 0.4, 1.0, 1.7, 3.0])
@pytest.mark.parametrize("end", [0.0, 0.6, 1.0, 2.2, 3.0])
def test_the_cubic_with_these_slopes_has_the_height_that_was_asked_for(start, end):
    part = invert_cubic(HEIGHT, np.full(1001, start), np.full(1001, end))
    value = (1 - part) ** 2 * part * start + part**2 * (3 - 2 * part) - part**2 * (1 - part) * end
    np.testing.assert_allclose(value, HEIGHT, atol=1e-8)


@pytest.mark.parametrize("start", [-5.0, 0.0, 1.0, 9.0])
@pytest.mark.parametrize("end", [-5.0, 0.0, 1.0, 9.0])
def test_higher_lies_further_on_whatever_the_slopes(start, end):
    for invert in (invert_cubic, invert_kink):
        part = invert(HEIGHT, np.full(1001, start), np.full(1001, end))
        assert (np.diff(part) > 0).all()
        assert part.min() >= 0
        assert part.max() <= 1


def test_slopes_too_steep_for_a_monotone_cubic_are_eased():
    steep, eased = (invert_cubic(HEIGHT, np.full(1001, slope), np.full(1001, slope)) for slope in (9.0, 3.0))
    np.testing.assert_array_equal(steep, eased)


def test_a_kink_follows_the_lesser_of_two_lines():
    # From 0 with slope 3, into 1 with slope 1/2: they meet at (1/5, 3/5).
    part = invert_kink(np.array([0.3, 0.6, 0.8]), np.full(3, 3.0), np.full(3, 0.5))
    np.testing.assert_allclose(part, [0.1, 0.2, 0.6])


def test_a_circle_about_a_point_is_met_far_better_than_on_a_line():
    # An edge of length 1 that begins at distance 1 from the point and runs off at 60 degrees.
    low, high = 1.0, np.sqrt(1 + 1 + 1)
    start, end = 0.5, (1 + 0.5) / high
    level = np.linspace(1.05, 1.7, 14)
    rise = np.full(14, high - low)
    part = invert_cubic((level - low) / rise, start / rise, end / rise)
    exact = -0.5 + np.sqrt(0.25 + level**2 - 1)
    assert np.abs(part - exact).max() < 0.004
    assert np.abs((level - low) / rise - exact).max() > 0.05
