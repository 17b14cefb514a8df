"""Turning edges, splitting edges, pairing."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.spatial import Delaunay

from planar_meshes import plate, rectangle
from weavecore.geometry.bisection import bisect_edges, bisect_long_edges, expected_bisections, unique_edges
from weavecore.geometry.lawson_flips import improve_triangles, turn_edges
from weavecore.geometry.matching import match_greedily
from weavecore.geometry.needles import divide_needles

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


def strip_of_needles(n=120, length=1.2, height=0.004):
    """A narrow strip, finely divided along its long sides: each of these in a fan about a far corner."""
    x = np.linspace(0.0, length, n + 1)
    points = np.concatenate([np.c_[x, 0 * x, 0 * x], np.c_[x, 0 * x + height, 0 * x]])
    k = np.arange(n)
    top = np.stack([0 * k, n + 2 + k, n + 1 + k], axis=1)
    return points, np.concatenate([top, np.stack([k, k + 1, 0 * k + 2 * n + 1], axis=1)])


def doubled_areas(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)[:, 2]


def test_inner_edges_of_needles_are_divided_at_once_and_border_and_area_stay():
    points, triangles = strip_of_needles()
    more, divided, origin = divide_needles(points, triangles, 0.01)
    edges, of_side = unique_edges(divided)
    count = np.bincount(of_side.ravel())
    length = np.linalg.norm(more[edges[:, 0]] - more[edges[:, 1]], axis=1)
    area = doubled_areas(more, divided)
    assert length[count == 2].max() <= 8 * 0.01
    assert np.mean(length[count == 2] > 0.02) < 0.02
    assert count.max() == 2
    assert (count == 1).sum() == 242
    assert (area > 0).all()
    assert area.sum() == pytest.approx(2 * 1.2 * 0.004)
    assert len(more) - len(edges) + len(divided) == 1
    assert len(divided) == len(triangles) + 2 * (len(more) - len(points))
    np.testing.assert_array_equal(origin[: len(points)], np.arange(len(points)))


def test_divided_needles_are_bisected_into_a_few_of_the_triangles_that_needles_are():
    mesh = strip_of_needles()
    n_whole = len(bisect_long_edges(*mesh, 0.01)[1])
    n_divided = len(bisect_long_edges(*divide_needles(*mesh, 0.01)[:2], 0.01)[1])
    assert 4 * n_divided < n_whole


def test_triangles_that_are_no_needles_and_needles_with_a_long_border_stay():
    for points, triangles in (plate([rectangle(1.0, 1.0)], 0.1), strip_of_needles(2, 3.0)):
        more, same, _ = divide_needles(points, triangles, 0.01)
        np.testing.assert_array_equal(more, points)
        np.testing.assert_array_equal(same, triangles)


@pytest.mark.parametrize("mesh", [strip_of_needles(), plate([rectangle(1.0, 1.0)], 0.1)])
def test_the_expected_number_of_triangles_is_about_what_bisection_makes(mesh):
    for longest in (0.01, 0.02, 0.3):
        n_made = len(bisect_long_edges(*mesh, longest)[1])
        assert 0.5 * n_made <= expected_bisections(*mesh, longest) <= 2 * n_made
