"""The strip between two rings, on indices alone."""

from __future__ import annotations

from itertools import combinations, combinations_with_replacement

import numpy as np
import pytest

from weavecore.linking.band_faces import BandFaces, faces_of_strip
from weavecore.linking.ring_to_parent import Strip
from weavecore.linking.strip_triangulation import (
    interpolate_projections,
    triangulate_annulus,
    triangulate_open_strip,
    triangulate_small_child,
    unwrap_closed,
)


def evenly(n, m, phase=0.0):
    """Feet of m equally spaced nodes on a ring of n."""
    return (np.arange(m) + phase) * (n / m)


def strip_between(n, m, target=None, phases=(0.0,)):
    projections = np.array([evenly(n, m, p) for p in phases])
    target = np.ones(n, np.int64) if target is None else target
    division, apexes = triangulate_annulus(projections, n, child_phase=0.5, target_advance=target)
    return division, apexes, projections[division]


@pytest.mark.parametrize(("n", "m"), [(12, 12), (13, 12), (12, 13), (40, 33), (9, 3), (3, 9), (3, 3), (100, 61)])
def test_a_walk_goes_around_both_rings_once(n, m):
    _, apexes, _ = strip_between(n, m)
    assert len(apexes) == n
    steps = np.diff(np.append(apexes, apexes[0] + m))
    assert (steps >= 0).all()
    assert steps.sum() == m
    faces = faces_of_strip(Strip(0, 1, True, apexes), np.arange(n), n + np.arange(m), has_diagonals=True)
    assert len(faces) == n + m
    tail, head, _ = BandFaces(faces, np.zeros(len(faces), np.int64)).sides()
    sides = sorted(zip(tail.tolist(), head.tolist()))
    assert len(set(sides)) == len(sides)
    naked = {(a, b) for a, b in sides if (b, a) not in set(sides)}
    rings = {(i, (i + 1) % n) for i in range(n)} | {(n + (k + 1) % m, n + k) for k in range(m)}
    assert naked == rings


def quads_between(n, m):
    _, apexes = triangulate_annulus(
        evenly(n, m)[None], n, child_phase=0.0, target_advance=np.ones(n, np.int64), even_cells=True
    )
    return faces_of_strip(Strip(0, 1, True, apexes), np.arange(n), n + np.arange(m), has_diagonals=False)


@pytest.mark.parametrize(("n", "m"), [(12, 12), (14, 12), (12, 14), (9, 3), (3, 9), (40, 32), (61, 75), (30, 18)])
def test_rings_whose_counts_differ_by_an_even_number_are_joined_by_cells_of_four(n, m):
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
    _, apexes = triangulate_annulus(evenly(n, m)[None], n, child_phase=0.0, target_advance=np.ones(n, np.int64))
    faces = faces_of_strip(Strip(0, 1, True, apexes), np.arange(n), n + np.arange(m), has_diagonals=False)
    corners = (faces >= 0).sum()
    assert corners - 2 * len(faces) == n + m
    assert set((faces >= 0).sum(1).tolist()) == {3, 4}


def test_each_apex_is_over_the_middle_of_its_edge_where_counts_agree():
    _, apexes, projections = strip_between(24, 24, phases=(0.0, 0.25, 0.5, 0.75))
    over = projections[apexes % 24] + 24 * (apexes // 24)
    np.testing.assert_allclose(over, np.arange(24) + 0.5)


def test_nodes_that_have_three_links_above_are_the_ones_to_get_a_single_one_below():
    target = np.ones(40, np.int64)
    few = np.array([3, 12, 22, 31])
    target[few] = 0
    _, apexes, _ = strip_between(40, 36, target, phases=np.arange(8) / 8)
    advance = apexes - np.append(apexes[-1] - 36, apexes[:-1])
    np.testing.assert_array_equal(np.flatnonzero(advance == 0), few)


def test_the_strip_does_not_depend_on_where_the_rings_begin():
    target = np.ones(30, np.int64)
    target[[4, 17]] = 0
    _, apexes, _ = strip_between(30, 28, target)
    turned = np.roll(target, 9)
    projections = np.sort((evenly(30, 28) + 9) % 30)
    shift = np.searchsorted(projections, 9.0 - 1e-9)
    _, other = triangulate_annulus(projections[None], 30, child_phase=0.5, target_advance=turned)
    back = np.roll(other, -9) - shift
    np.testing.assert_array_equal(back % 28, apexes % 28)


def test_projections_that_do_not_go_around_once_cannot_be_unwrapped():
    assert unwrap_closed(np.array([0.0, 1.0, 2.0, 1.0]), 12) is None
    assert unwrap_closed(evenly(12, 24), 12) is not None


def test_projections_that_run_back_a_long_way_cannot_be_unwrapped():
    projections = evenly(12, 48)
    projections[20:24] += 3.0
    assert unwrap_closed(projections, 12) is None


def test_projections_that_run_back_a_little_are_held():
    projections = evenly(12, 48)
    projections[20] += 0.4
    rising = unwrap_closed(projections, 12)
    assert (np.diff(rising) >= 0).all()


def test_projections_of_nodes_lie_between_those_of_the_samples():
    rising = unwrap_closed(evenly(10, 40), 10)
    stations = np.array([[0.0, 1.0, 2.0, 3.0, 4.0], [0.5, 1.5, 2.5, 3.5, 5.25]])
    np.testing.assert_allclose(interpolate_projections(rising, stations, 5.0), 2 * stations)


@pytest.mark.parametrize("turned", [0, 3, 8])
@pytest.mark.parametrize("small", [3, 4, 7])
def test_a_small_ring_off_the_middle_is_joined_all_around(small, turned):
    turn = 2 * np.pi * (np.arange(11) + turned) / 11
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    turn = 2 * np.pi * np.arange(small) / small
    child = np.stack([0.6 + 0.05 * np.cos(turn), 0.05 * np.sin(turn), 0 * turn], axis=1)
    _, apexes = triangulate_small_child(ring, child)
    steps = np.diff(np.append(apexes, apexes[0] + small))
    assert (steps >= 0).all()
    assert steps.sum() == small
    faces = faces_of_strip(Strip(0, 1, True, apexes), np.arange(11), 11 + np.arange(small), has_diagonals=True)
    nodes = np.concatenate([ring, child])[faces[:, :3]]
    area = np.cross(nodes[:, 1] - nodes[:, 0], nodes[:, 2] - nodes[:, 0])[:, 2]
    assert (area > 0).all()
    assert area.sum() / 2 == pytest.approx(polygon_area(ring) - polygon_area(child))


def polygon_area(points):
    x, y = points[:, 0], points[:, 1]
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def cost_of(apexes, projections, target, child_phase):
    """Cost of closed walks (w, n) from the definition, for one division of a child."""
    n, m = len(target), len(projections)
    slant = projections[apexes % m] + n * (apexes // m) - (np.arange(n) + child_phase)
    advance = apexes - np.concatenate([apexes[:, -1:] - m, apexes[:, :-1]], axis=1)
    slanted = slant**2 + 30.0 * np.maximum(np.abs(slant) - 0.55, 0.0) ** 2
    return slanted.sum(1) + 2.0 * ((advance - target) ** 2).sum(1)


def all_walks(n, m):
    """Apexes (w, n) of all closed walks around rings of n and m nodes, with the first in a range of three turns."""
    dividers = np.array(list(combinations(range(n + m - 1), n - 1)))
    advances = (
        np.diff(
            np.concatenate([np.full((len(dividers), 1), -1), dividers, np.full((len(dividers), 1), n + m - 1)], 1),
            axis=1,
        )
        - 1
    )
    rising = np.cumsum(advances, axis=1)
    return (rising + np.arange(-m - 1, 2 * m + 1)[:, None, None] - m).reshape(-1, n)


def has_even_cells(apexes, m):
    """Walks whose apexes advance by odd numbers, or stay for an even number of nodes in a row."""
    n = apexes.shape[1]
    advance = apexes - np.concatenate([apexes[:, -1:] - m, apexes[:, :-1]], axis=1)
    stays = advance == 0
    odd_run = np.zeros(len(apexes), bool)
    for start in range(n):
        run = np.zeros(len(apexes), np.int64)
        going = ~stays[:, start - 1] & stays[:, start]
        for k in range(n):
            going = going & stays[:, (start + k) % n]
            run += going
        odd_run |= run % 2 == 1
    return (stays | (advance % 2 == 1)).all(1) & ~odd_run


@pytest.mark.parametrize("even_cells", [False, True])
@pytest.mark.parametrize("size", [(3, 3), (5, 4), (4, 6), (6, 6), (7, 3), (3, 8)])
def test_the_walk_is_the_cheapest_of_all_closed_walks(size, even_cells):
    n, m = size
    if even_cells and (n + m) % 2:
        m += 1
    walks = all_walks(n, m)
    if even_cells:
        walks = walks[has_even_cells(walks, m)]
    for seed in range(25):
        draw = np.random.default_rng(seed)
        # Nodes of the child may crowd over a part of the parent.
        crowded = np.sort(draw.random((3, m)) ** draw.choice([1.0, 3.0])) * n + draw.random() * n
        target = np.ones(n, np.int64) if even_cells else draw.integers(0, 3, n)
        phase = float(draw.choice([0.0, 0.5]))
        division, apexes = triangulate_annulus(
            crowded, n, child_phase=phase, target_advance=target, even_cells=even_cells
        )
        least = min(cost_of(walks, projections, target, phase).min() for projections in crowded)
        assert cost_of(apexes[None], crowded[division], target, phase)[0] == pytest.approx(least, rel=1e-12)
        if even_cells:
            assert has_even_cells(apexes[None], m)[0]


def test_an_apex_is_found_far_from_the_nearest_node():
    # Six nodes of the child lie over one edge of the parent, so some links reach across several edges.
    projections = np.array([[0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35]])
    target = np.ones(8, np.int64)
    _, apexes = triangulate_annulus(projections, 8, child_phase=0.5, target_advance=target)
    least = cost_of(all_walks(8, 8), projections[0], target, 0.5).min()
    assert cost_of(apexes[None], projections[0], target, 0.5)[0] == pytest.approx(least, rel=1e-12)


def test_rings_of_odd_and_even_counts_have_no_strip_of_even_cells():
    target = np.ones(6, np.int64)
    assert (
        triangulate_annulus(evenly(6, 5)[None], 6, child_phase=0.0, target_advance=target, even_cells=True)[1] is None
    )


def test_an_open_strip_has_the_cheapest_apexes_of_all():
    for seed in range(40):
        draw = np.random.default_rng(seed)
        n, m = (int(k) for k in draw.integers(3, 7, 2))
        projections = np.sort(np.concatenate([[0.0, n - 1.0], draw.random(m - 2) * (n - 1)]))
        target = draw.integers(0, 3, n)
        _cost, apexes = triangulate_open_strip(projections, n, child_phase=0.5, target_advance=target)
        walks = np.array(list(combinations_with_replacement(range(m), n - 1)))
        slant = projections[walks] - (np.arange(n - 1) + 0.5)
        slanted = slant**2 + 30.0 * np.maximum(np.abs(slant) - 0.55, 0.0) ** 2
        between = 2.0 * ((np.diff(walks, axis=1) - target[1:-1]) ** 2).sum(1)
        totals = slanted.sum(1) + between
        chosen = np.flatnonzero((walks == apexes[:-1]).all(1))
        assert totals[chosen[0]] == pytest.approx(totals.min(), rel=1e-12)
        assert apexes[-1] == m
