"""The zip between two rings, on indices alone."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.linking.band_faces import BandFaces, faces_of_zip
from weavecore.linking.strip_dp import choose_tips, feet_of_nodes, nearest_tips, unroll_feet
from weavecore.linking.strips import Zip


def evenly(n, m, phase=0.0):
    """Feet of m equally spaced nodes on a ring of n."""
    return (np.arange(m) + phase) * (n / m)


def zipped(n, m, wanted=None, phases=(0.0,)):
    feet = np.array([evenly(n, m, p) for p in phases])
    wanted = np.ones(n, np.int64) if wanted is None else wanted
    division, tips = choose_tips(feet, n, sits=0.5, wanted=wanted)
    return division, tips, feet[division]


@pytest.mark.parametrize(("n", "m"), [(12, 12), (13, 12), (12, 13), (40, 33), (9, 3), (3, 9), (3, 3), (100, 61)])
def test_a_walk_goes_around_both_rings_once(n, m):
    _, tips, _ = zipped(n, m)
    assert len(tips) == n
    steps = np.diff(np.append(tips, tips[0] + m))
    assert (steps >= 0).all()
    assert steps.sum() == m
    faces = faces_of_zip(Zip(0, 1, True, tips), np.arange(n), n + np.arange(m), has_diagonals=True)
    assert len(faces) == n + m
    tail, head, _ = BandFaces(faces, np.zeros(len(faces), np.int64)).sides()
    sides = sorted(zip(tail.tolist(), head.tolist()))
    assert len(set(sides)) == len(sides)
    naked = {(a, b) for a, b in sides if (b, a) not in set(sides)}
    rings = {(i, (i + 1) % n) for i in range(n)} | {(n + (k + 1) % m, n + k) for k in range(m)}
    assert naked == rings


def quads_between(n, m):
    _, tips = choose_tips(evenly(n, m)[None], n, sits=0.0, wanted=np.ones(n, np.int64), in_pairs=True)
    return faces_of_zip(Zip(0, 1, True, tips), np.arange(n), n + np.arange(m), has_diagonals=False)


@pytest.mark.parametrize(("n", "m"), [(12, 12), (14, 12), (12, 14), (9, 3), (3, 9), (40, 32), (61, 75), (30, 18)])
def test_rings_whose_counts_differ_by_an_even_number_are_bound_by_cells_of_four(n, m):
    faces = quads_between(n, m)
    assert (faces >= 0).all()
    assert 2 * len(faces) == n + m
    tail, head, _ = BandFaces(faces, np.zeros(len(faces), np.int64)).sides()
    sides = set(zip(tail.tolist(), head.tolist()))
    assert len(sides) == 4 * len(faces)
    naked = {(a, b) for a, b in sides if (b, a) not in sides}
    assert naked == {(i, (i + 1) % n) for i in range(n)} | {(n + (k + 1) % m, n + k) for k in range(m)}


@pytest.mark.parametrize(("n", "m"), [(12, 12), (14, 12), (26, 30)])
def test_quads_lie_where_both_rings_advance(n, m):
    faces = quads_between(n, m)
    assert ((faces < n).sum(1) == 2).sum() == min(n, m)


@pytest.mark.parametrize(("n", "m"), [(13, 12), (9, 4), (4, 9)])
def test_rings_whose_counts_differ_by_an_odd_number_keep_triangles(n, m):
    _, tips = choose_tips(evenly(n, m)[None], n, sits=0.0, wanted=np.ones(n, np.int64))
    faces = faces_of_zip(Zip(0, 1, True, tips), np.arange(n), n + np.arange(m), has_diagonals=False)
    corners = (faces >= 0).sum()
    assert corners - 2 * len(faces) == n + m
    assert set((faces >= 0).sum(1).tolist()) == {3, 4}


def test_each_tip_is_over_the_middle_of_its_edge_where_counts_agree():
    _, tips, feet = zipped(24, 24, phases=(0.0, 0.25, 0.5, 0.75))
    over = feet[tips % 24] + 24 * (tips // 24)
    np.testing.assert_allclose(over, np.arange(24) + 0.5)


def test_nodes_that_have_three_links_above_are_the_ones_to_get_a_single_one_below():
    wanted = np.ones(40, np.int64)
    few = np.array([3, 12, 22, 31])
    wanted[few] = 0
    _, tips, _ = zipped(40, 36, wanted, phases=np.arange(8) / 8)
    advance = tips - np.append(tips[-1] - 36, tips[:-1])
    np.testing.assert_array_equal(np.flatnonzero(advance == 0), few)


def test_the_zip_does_not_depend_on_where_the_rings_begin():
    wanted = np.ones(30, np.int64)
    wanted[[4, 17]] = 0
    _, tips, _ = zipped(30, 28, wanted)
    turned = np.roll(wanted, 9)
    feet = np.sort((evenly(30, 28) + 9) % 30)
    shift = np.searchsorted(feet, 9.0 - 1e-9)
    _, other = choose_tips(feet[None], 30, sits=0.5, wanted=turned)
    back = np.roll(other, -9) - shift
    np.testing.assert_array_equal(back % 28, tips % 28)


def test_feet_that_do_not_go_around_once_cannot_be_unrolled():
    assert unroll_feet(np.array([0.0, 1.0, 2.0, 1.0]), 12) is None
    assert unroll_feet(evenly(12, 24), 12) is not None


def test_feet_that_run_back_a_long_way_cannot_be_unrolled():
    feet = evenly(12, 48)
    feet[20:24] += 3.0
    assert unroll_feet(feet, 12) is None


def test_feet_that_run_back_a_little_are_held():
    feet = evenly(12, 48)
    feet[20] += 0.4
    rising = unroll_feet(feet, 12)
    assert (np.diff(rising) >= 0).all()


def test_feet_of_nodes_lie_between_those_of_the_samples():
    rising = unroll_feet(evenly(10, 40), 10)
    stations = np.array([[0.0, 1.0, 2.0, 3.0, 4.0], [0.5, 1.5, 2.5, 3.5, 5.25]])
    np.testing.assert_allclose(feet_of_nodes(rising, stations, 5.0), 2 * stations)


@pytest.mark.parametrize("turned", [0, 3, 8])
@pytest.mark.parametrize("small", [3, 4, 7])
def test_a_small_ring_off_the_middle_is_bound_all_around(small, turned):
    turn = 2 * np.pi * (np.arange(11) + turned) / 11
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    turn = 2 * np.pi * np.arange(small) / small
    child = np.stack([0.6 + 0.05 * np.cos(turn), 0.05 * np.sin(turn), 0 * turn], axis=1)
    _, tips = nearest_tips(ring, child)
    steps = np.diff(np.append(tips, tips[0] + small))
    assert (steps >= 0).all()
    assert steps.sum() == small
    faces = faces_of_zip(Zip(0, 1, True, tips), np.arange(11), 11 + np.arange(small), has_diagonals=True)
    nodes = np.concatenate([ring, child])[faces[:, :3]]
    area = np.cross(nodes[:, 1] - nodes[:, 0], nodes[:, 2] - nodes[:, 0])[:, 2]
    assert (area > 0).all()
    assert area.sum() / 2 == pytest.approx(polygon_area(ring) - polygon_area(child))


def polygon_area(points):
    x, y = points[:, 0], points[:, 1]
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
