"""Where distances start: chosen borders and curves on the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from weavecore.errors import BadCurve, BadIndex, NonFinite, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.offsetting.preparation import refuse_closed
from weavecore.offsetting.sources import start_at
from weavecore.pipeline import offset, suggest_spacing
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
    assert started.is_free_border.sum() == COLUMNS * (2 - len(each_once))
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


@pytest.mark.parametrize("chosen", [{"borders": []}, {"curves": []}, {"borders": np.zeros(0, int), "curves": []}])
def test_an_empty_choice_is_refused(chosen) -> None:
    with pytest.raises(Unsupported, match="No border or curve chosen"):
        start_at(tube_surface(), **chosen)


@pytest.mark.parametrize("wrap", [np.array, iter, np.uint8])
@pytest.mark.parametrize("numbers", [[0], [1], [1, 0]])
def test_borders_come_in_anything_that_lists_whole_numbers(wrap, numbers) -> None:
    surface = tube_surface()
    paths = start_at(surface, borders=wrap(numbers)).origins.paths
    assert [path.tolist() for path in paths] == [surface.borders[number].tolist() for number in numbers]


@pytest.mark.parametrize(
    "chosen", [0, 1, "0", ["0"], [0.0], [None], [[0]], [float("nan")], [True], np.array([True, False])]
)
def test_borders_that_are_no_whole_numbers_are_refused(chosen) -> None:
    with pytest.raises(BadIndex, match="must be a list of integers"):
        start_at(tube_surface(), borders=chosen)


def ring(z: float) -> np.ndarray:
    turn = 2 * np.pi * np.arange(COLUMNS + 1) / COLUMNS
    return np.stack([np.cos(turn), np.sin(turn), np.full(COLUMNS + 1, z)], axis=1)


@pytest.mark.parametrize("wrap", [np.array, iter])
def test_curves_come_in_anything_that_lists_them(wrap) -> None:
    assert len(start_at(tube_surface(), curves=wrap([ring(1.3)])).origins) == 1


@pytest.mark.parametrize(
    ("curves", "told"),
    [
        (3, "int is not a list of curves"),
        (ring(1.3), r"got \(3,\)\) \(curve 0\)"),
        ([ring(1.3), "waist"], r"str is not a curve \(curve 1\)"),
    ],
)
def test_what_is_no_list_of_curves_is_refused(curves, told) -> None:
    with pytest.raises(BadCurve, match=told):
        offset(tube_surface(), curves=curves)


@pytest.mark.parametrize("coordinate", [np.nan, np.inf, 1e200])
def test_a_coordinate_that_is_not_finite_or_far_too_large_is_told_by_curve_and_point(coordinate) -> None:
    points = ring(1.3)
    points[5, 1] = coordinate
    with pytest.raises(NonFinite, match=r"first at point 5 \(curve 1\)"):
        start_at(tube_surface(), curves=[ring(3.0), points])


def lengthwise(column: int) -> np.ndarray:
    """From border to border along the edges between two columns of faces."""
    turn = 2 * np.pi * column / COLUMNS
    return np.array([[np.cos(turn), np.sin(turn), z] for z in (0.0, 5.0)])


def test_a_curve_alone_leaves_all_borders_as_selvedges() -> None:
    surface = tube_surface()
    started = start_at(surface, curves=[ring(1.3)])
    (path,) = started.origins.paths
    assert started.origins.closed.tolist() == [True]
    assert np.allclose(started.vertices[path][:, 2], 1.3)
    assert started.is_cut.sum() == 2 * len(path)
    assert started.is_free_border.sum() == 2 * COLUMNS
    assert np.array_equal(started.vertices[: surface.n_vertices], surface.vertices)
    assert (started.unit, started.name) == (surface.unit, surface.name)


def test_borders_come_before_curves_and_keep_their_numbers() -> None:
    surface = tube_surface()
    curve = lengthwise(3)
    curve[0, 2] = 1.0  # It ends on border 1 alone, which it splits nowhere: there is a vertex.
    started = start_at(surface, borders=[0], curves=[curve.tolist(), ring(0.5)[1:6]])
    assert started.origins.closed.tolist() == [True, False, False]
    assert started.origins.paths[0].tolist() == surface.borders[0].tolist()
    assert np.allclose(started.vertices[started.origins.paths[1][-1]], curve[1])
    assert np.isin(started.origins.paths[1], started.borders[1]).sum() == 1


def test_curves_that_split_the_same_border_leave_its_number_and_each_other() -> None:
    surface = tube_surface()
    started = start_at(surface, curves=[ring(5.0)[:3], lengthwise(6), lengthwise(9)])
    assert [len(np.intersect1d(path, started.borders[1])) for path in started.origins.paths] == [3, 1, 1]
    assert all((path[:1] != path[1:]).all() for path in started.origins.paths)
    assert len(started.borders) == 2


@pytest.mark.parametrize(
    ("borders", "curves", "told"),
    [
        (None, [ring(1.0), ring(1.0)], r"touches another origin.*\(curve 1\)"),
        (None, [ring(2.0), lengthwise(4)], r"crosses or touches another origin.*\(curve 1\)"),
        ([1], [lengthwise(4)], r"touches border 1, from which distances also start \(curve 0\)"),
        ([0], [ring(0.0)], r"touches border 0"),
        (None, [ring(1.0), ring(1.0) * 2], r"1 off the surface.*\(curve 1\)"),
        (None, [[[0, 0, 0], [1, 1]]], r"must be rows of numbers \(curve 0\)"),
    ],
)
def test_curves_that_cannot_be_origins_are_told_by_their_number(borders, curves, told) -> None:
    with pytest.raises(BadCurve, match=told):
        start_at(tube_surface(), borders=borders, curves=curves)


def test_a_component_without_an_origin_is_refused() -> None:
    tube = tube_surface()
    two = replace(
        tube,
        vertices=np.concatenate([tube.vertices, tube.vertices + np.array([9, 0, 0])]),
        faces=np.concatenate([tube.faces, tube.faces + tube.n_vertices]),
    )
    with pytest.raises(Unsupported, match="A component without any of the borders and curves"):
        refuse_closed(start_at(two, curves=[ring(1.0)]))
    refuse_closed(start_at(two, borders=[2], curves=[ring(1.0)]))


def test_offset_takes_both_and_suggests_a_spacing_for_them() -> None:
    latitudes = offset(tube_surface(), borders=[0])
    assert [path.tolist() for path in latitudes.surface.origins.paths] == [tube_surface().borders[0].tolist()]
    assert latitudes.spacing == suggest_spacing(start_at(tube_surface(), borders=[0]))
    from_curve = offset(tube_surface(), curves=[ring(2.0)], spacing=0.5)
    assert from_curve.generation[0] == 0
    assert from_curve.n_generations > 5
