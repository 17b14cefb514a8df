"""Where distances start: chosen borders and curves on the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from weavecore.errors import BadIndex, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.offsetting.starting import start_at
from woven_tube import COLUMNS, tube_surface


def test_a_surface_for_which_nothing_is_chosen_is_itself() -> None:
    surface = tube_surface()
    assert start_at(surface) is surface


@pytest.mark.parametrize("chosen", [[0], [1], [1, 0], [0, 0]])
def test_distances_start_at_the_chosen_borders_in_their_order(chosen: list[int]) -> None:
    surface = tube_surface()
    started = start_at(surface, borders=chosen)
    each_once = list(dict.fromkeys(chosen))
    assert [path.tolist() for path in started.origins.paths] == [surface.borders[b].tolist() for b in each_once]
    assert started.origins.closed.all()
    assert started.is_origin.sum() == COLUMNS * len(each_once)
    assert started.is_selvedge.sum() == COLUMNS * (2 - len(each_once))
    assert not started.is_cut.any()
    assert np.array_equal(started.vertices, surface.vertices)


def test_the_cuts_of_the_reader_give_way_to_what_is_chosen() -> None:
    surface = tube_surface()
    cut = replace(surface, cuts=(np.arange(COLUMNS, 2 * COLUMNS),))
    assert start_at(cut, borders=[0]).cuts == ()


@pytest.mark.parametrize("chosen", [[2], [0, -1], [0, 7]])
def test_a_border_that_is_not_there_is_told_with_those_that_are(chosen: list[int]) -> None:
    with pytest.raises(BadIndex, match=r"2 borders, numbers 0 to 1 .*0: 6\.2117, 1: 6\.2117") as caught:
        start_at(tube_surface(), borders=chosen)
    assert caught.value.ids == tuple(number for number in chosen if number not in (0, 1))


def test_a_closed_surface_has_no_border_to_choose() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    closed = SurfaceMesh(points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    with pytest.raises(BadIndex, match="closed: it has no border"):
        start_at(closed, borders=[0])


def test_an_empty_choice_is_refused() -> None:
    with pytest.raises(Unsupported, match="Nothing is chosen"):
        start_at(tube_surface(), borders=[])
