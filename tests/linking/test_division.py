"""Where the nodes of a polyline lie."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.linking.division import divide_border, divide_evenly, index_at, turns

SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]], float)


def test_a_border_is_divided_between_its_corners():
    stations = divide_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, 12)
    np.testing.assert_allclose(stations, np.arange(12.0))


@pytest.mark.parametrize("count", [4, 5, 7, 13, 50])
def test_corners_get_nodes_and_every_node_is_used(count):
    stations = divide_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, count)
    assert len(stations) == count
    assert (np.diff(stations) > 0).all()
    assert set(np.round([0.0, 4.0, 6.0, 10.0], 9)) <= set(np.round(stations, 9))


def test_fewer_nodes_than_corners_are_spread_evenly():
    stations = divide_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, 3)
    np.testing.assert_allclose(np.diff(stations), 4.0)


def test_the_division_of_a_smooth_border_does_not_depend_on_where_it_begins():
    turn = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    points = (
        np.stack([2 * np.cos(turn), np.sin(turn), 0 * turn], axis=1) + [0.001, 0, 0] * (np.arange(100) == 7)[:, None]
    )

    def nodes(points):
        gaps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        stations = np.append(0, np.cumsum(gaps))
        at = divide_border(points, stations[:-1], stations[-1], 20)
        closed = np.concatenate([points, points[:1]])
        return np.stack([np.interp(at, stations, closed[:, k]) for k in range(3)], axis=1)

    one, other = nodes(points), nodes(np.roll(points, 31, axis=0))
    apart = np.linalg.norm(one[:, None] - other[None], axis=2).min(1)
    assert apart.max() < 1e-9


def test_indices_count_nodes_around_more_than_one_turn():
    nodes = np.array([1.0, 3.0, 8.0])
    station = np.array([1.0, 2.0, 3.0, 5.5, 8.0, 9.5, 11.0, 13.0, -2.0])
    np.testing.assert_allclose(index_at(nodes, 10.0, station), [0, 0.5, 1, 1.5, 2, 2.5, 3, 4, -1])


def test_equal_arcs_begin_at_their_phase():
    np.testing.assert_allclose(divide_evenly(10.0, 5, 1.25), [0.5, 2.5, 4.5, 6.5, 8.5])


def test_a_square_turns_a_right_angle_at_each_corner():
    np.testing.assert_allclose(turns(SQUARE), np.pi / 2)
