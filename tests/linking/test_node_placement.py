"""Where the nodes of a polyline lie."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from weavecore.linking.arc_length import index_at
from weavecore.linking.node_placement import divide_closed_border, divide_ring, turning_angles
from weavecore.linking.parent_projections import find_cusps, sample_polylines
from weavecore.model import Polylines

SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]], float)


def test_a_border_is_divided_between_its_corners():
    stations = divide_closed_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, 12)
    np.testing.assert_allclose(stations, np.arange(12.0))


@pytest.mark.parametrize("count", [4, 5, 7, 13, 50])
def test_corners_get_nodes_and_every_node_is_used(count):
    stations = divide_closed_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, count)
    assert len(stations) == count
    assert (np.diff(stations) > 0).all()
    assert set(np.round([0.0, 4.0, 6.0, 10.0], 9)) <= set(np.round(stations, 9))


def test_fewer_nodes_than_corners_are_spread_evenly():
    stations = divide_closed_border(SQUARE, np.array([0.0, 4.0, 6.0, 10.0]), 12.0, 3)
    np.testing.assert_allclose(np.diff(stations), 4.0)


def test_the_division_of_a_smooth_border_does_not_depend_on_where_it_begins():
    turn = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    points = (
        np.stack([2 * np.cos(turn), np.sin(turn), 0 * turn], axis=1) + [0.001, 0, 0] * (np.arange(100) == 7)[:, None]
    )

    def nodes(points):
        gaps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        stations = np.append(0, np.cumsum(gaps))
        at = divide_closed_border(points, stations[:-1], stations[-1], 20)
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
    np.testing.assert_allclose(divide_ring(10.0, 5, 1.25), [0.5, 2.5, 4.5, 6.5, 8.5])


def test_a_square_turns_a_right_angle_at_each_corner():
    np.testing.assert_allclose(turning_angles(SQUARE), np.pi / 2)


def test_a_cusp_gets_a_node_and_its_neighbours_follow():
    stations = divide_ring(20.0, 20, 0.0, np.array([7.4]))
    moved = stations - np.arange(20)
    np.testing.assert_allclose(moved[7], 0.4)
    np.testing.assert_allclose(moved[[4, 10]], 0.0)
    assert (np.diff(moved[4:8]) > 0).all()
    assert (np.diff(moved[7:11]) < 0).all()


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("cusps", [[0.2, 19.9], [3.4, 5.1, 3.9, 12.0], [9.5], np.arange(20) + 0.5])
def test_stations_rise_by_at_most_a_turn_whatever_the_cusps_are(phase, cusps):
    stations = divide_ring(20.0, 20, phase, np.array(cusps))
    assert (np.diff(np.append(stations, stations[0] + 20.0)) > 0.3).all()
    assert np.abs((stations - cusps[0] + 10) % 20 - 10).min() < 1e-9


def test_cusps_are_found_where_a_polyline_turns_back():
    wedge = np.array([[0, 0, 0], [6, 0, 0], [6, 0.2, 0], [0, 2, 0]], float)
    cusps = cusps_of(wedge, count=16)
    assert abs(cusps[0] - 6.1) < 0.2


def test_a_ring_has_no_cusp():
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    assert len(cusps_of(np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1), count=12)) == 0


def cusps_of(points, count):
    n = len(points)
    lines = Polylines(points, [0, n], [True], np.zeros(n, int), np.tile([1.0, 0, 0], (n, 1)))
    samples = sample_polylines(SimpleNamespace(polylines=lines), np.array([count]))
    return find_cusps(samples).get(0, np.zeros(0))
