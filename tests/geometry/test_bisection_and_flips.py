"""Turning edges, splitting edges, pairing."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.spatial import Delaunay

from planar_meshes import plate, rectangle
from weavecore.geometry.bisection import bisect_edges, bisect_long_edges, unique_edges
from weavecore.geometry.lawson_flips import improve_triangles, turn_edges
from weavecore.geometry.matching import match_greedily

NOTHING = np.zeros(0, np.int64)


def fan_of(n, rng):
    """Points about a circle, triangulated badly: all triangles from the first."""
    turn = np.sort(rng.uniform(0, 2 * np.pi, n))
    points = np.stack([np.cos(turn), np.sin(turn) * 0.7, 0 * turn], axis=1)
    k = np.arange(1, n - 1)
    return points, np.stack([0 * k, k, k + 1], axis=1)


def edges(triangles):
    return {tuple(e) for e in unique_edges(np.asarray(triangles))[0].tolist()}


@pytest.mark.parametrize("seed", range(4))
def test_flips_of_a_flat_polygon_end_in_its_delaunay_triangulation(seed):
    points, fan = fan_of(20, np.random.default_rng(seed))
    better = improve_triangles(points, fan, NOTHING)
    assert edges(better) == edges(np.sort(Delaunay(points[:, :2]).simplices.astype(np.int64)))


def test_edges_that_are_taken_are_neither_turned_nor_made():
    points = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0]], float)
    points[:, 0] += points[:, 1]  # a parallelogram whose long diagonal is 0–2
    bad = np.array([[0, 1, 2], [0, 2, 3]])
    assert (1, 3) in edges(improve_triangles(points, bad, NOTHING))
    assert (0, 2) in edges(improve_triangles(points, bad, np.array([0 * 4 + 2])))
    assert (0, 2) in edges(improve_triangles(points, bad, np.array([1 * 4 + 3])))


def test_flips_keep_the_orientation_and_the_border():
    points, fan = fan_of(30, np.random.default_rng(7))
    better = improve_triangles(points, fan, NOTHING)

    def border(triangles):
        sides = Counter((int(t[k]), int(t[k - 2])) for t in triangles for k in range(3))
        assert max(sides.values()) == 1
        return {s for s in sides if s[::-1] not in sides}

    assert border(better) == border(fan)


def test_long_inner_edges_are_split_and_the_surface_stays_closed_up():
    vertices, faces = without_inside(*plate([rectangle(4.0, 1.0)], 0.25))
    points, triangles, origin = bisect_long_edges(vertices, faces, 0.3)
    all_edges, of_side = unique_edges(triangles)
    length = np.linalg.norm(points[all_edges[:, 0]] - points[all_edges[:, 1]], axis=1)
    count = np.bincount(of_side.ravel())
    assert count.max() == 2
    assert length[count == 2].max() <= 0.3
    assert len(points) - len(all_edges) + len(triangles) == 1
    u, v = points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    assert (area > 0).all()
    np.testing.assert_allclose(area.sum() / 2, 4.0)
    np.testing.assert_array_equal(origin[: len(vertices)], np.arange(len(vertices)))


def without_inside(vertices, faces):
    """Only the vertices of the border, in a fan about their middle."""
    sides = {(int(f[k - 1]), int(f[k])) for f in faces for k in range(3)}
    after = {a: b for a, b in sides if (b, a) not in sides}
    order = [min(after)]
    while after[order[-1]] != order[0]:
        order.append(after[order[-1]])
    middle = vertices[order].mean(0)
    k = np.arange(len(order))
    return np.concatenate([vertices[order], [middle]]), np.stack([k, np.roll(k, -1), 0 * k + len(order)], axis=1)


def test_edges_are_not_split_for_ever_where_the_border_is_coarse():
    vertices, faces = plate([rectangle(4.0, 1.0)], 1.0)
    points, _, _ = bisect_long_edges(vertices, faces, 1e-3)
    assert len(points) < 50


def test_border_edges_are_never_split():
    vertices, faces = plate([rectangle(1.0, 1.0)], 2.0)
    all_edges, of_side = unique_edges(faces)
    points, triangles, _ = bisect_edges(vertices, faces, np.ones(len(all_edges), bool))
    before = {tuple(e) for e in all_edges[np.bincount(of_side.ravel()) == 1].tolist()}
    after_edges, after_side = unique_edges(triangles)
    assert {tuple(e) for e in after_edges[np.bincount(after_side.ravel()) == 1].tolist()} == before
    assert len(points) == len(vertices) + len(all_edges) - len(before)


def test_the_cheapest_pairs_are_made_first():
    one, other = np.array([0, 1, 2, 3]), np.array([1, 2, 3, 4])
    partner = match_greedily(one, other, np.array([2.0, 1.0, 2.0, 3.0]), 6)
    np.testing.assert_array_equal(partner, [-1, 2, 1, 4, 3, -1])


def test_equal_pairs_are_made_in_the_order_of_their_numbers():
    one, other = np.array([2, 0, 1]), np.array([3, 1, 2])
    partner = match_greedily(one, other, np.ones(3), 4)
    np.testing.assert_array_equal(partner, [1, 0, 3, 2])


def test_edges_at_one_corner_are_not_turned_together_where_gains_depend_on_each_other():
    # A fan of six about a middle that wants only four: two edges go, not three or six.
    k = np.arange(6)
    fan = np.stack([0 * k, k + 1, (k + 1) % 6 + 1], axis=1)

    def gain(triangles, a, b, c, d):
        spokes = len(np.unique(triangles[(triangles == 0).any(1)])) - 1
        return np.where((a == 0) | (b == 0), spokes - 4.0, 0.0)

    turned = turn_edges(fan, 7, NOTHING, gain, one_a_corner=True)
    assert len(np.unique(turned[(turned == 0).any(1)])) - 1 == 4
