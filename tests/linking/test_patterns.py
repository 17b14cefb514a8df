"""Edge length and spacing of each pattern, where only one of them is asked for."""

from __future__ import annotations

import pytest

from weavecore.errors import Unsupported
from weavecore.linking.link import PATTERN_NAMES, link_pattern, spacing_for_edges
from weavecore.offsetting.level_sets import offset_levels
from woven_tube import tube_surface


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_an_edge_length_gives_the_spacing_that_gives_the_edge_length(pattern: str) -> None:
    latitudes = offset_levels(tube_surface(), spacing=spacing_for_edges(1.2, pattern=pattern))
    assert link_pattern(latitudes, pattern=pattern).edge_length == pytest.approx(1.2)


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_squares_are_as_high_as_their_edge_and_triangles_are_equilateral(pattern: str) -> None:
    height = 1.0 if pattern in ("quad", "plain", "twill") else 3**0.5 / 2
    assert spacing_for_edges(2.0, pattern=pattern) == pytest.approx(2.0 * height)


def test_an_unknown_pattern_has_no_spacing() -> None:
    with pytest.raises(Unsupported, match="plaid"):
        spacing_for_edges(1.0, pattern="plaid")
