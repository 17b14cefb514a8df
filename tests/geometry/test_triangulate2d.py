"""Constrained triangulation of regions of the plane."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from weavecore.geometry.lawson_flips import doubled_areas
from weavecore.geometry.triangulate2d import inside_polygons, triangulate_polygon, triangulate_region


def ring(n: int, radius, start: int = 0, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    angle = phase + 2 * np.pi * np.arange(n) / n
    points = np.column_stack([np.cos(angle), np.sin(angle)]) * np.reshape(radius, (-1, 1))
    index = start + np.arange(n)
    return points, np.column_stack([index, np.roll(index, -1)])


def area_of(points: np.ndarray) -> float:
    x, y = points.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def sides_of(faces: np.ndarray) -> set[tuple[int, int]]:
    return {tuple(sorted(pair)) for face in faces.tolist() for pair in zip(face, face[1:] + face[:1])}


@given(st.integers(0, 10_000), st.integers(5, 60), st.floats(0.02, 1.0))
def test_a_jagged_polygon_is_filled_to_its_sides(seed, n, flat):
    draw = np.random.default_rng(seed)
    border, segments = ring(n, draw.uniform(0.2, 1.0, n))
    border = border * [1.0, flat]
    seeds = draw.uniform(-1, 1, (150, 2)) * [1.0, flat]
    seeds = seeds[inside_polygons(seeds, border[segments[:, 0]], border[segments[:, 1]])]
    points = np.vstack([border, seeds])
    region = triangulate_region(points, segments)
    assert len(region.missing) == 0
    areas = doubled_areas(points, region.faces) / 2
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(area_of(border), rel=1e-9)
    assert {tuple(sorted(s)) for s in segments.tolist()} <= sides_of(region.faces)
    assert len(region.faces) == 2 * len(points) - n - 2


def test_holes_and_islands_in_them_alternate():
    outer, first = ring(40, 3.0)
    hole, second = ring(30, 2.0, 40)
    island, third = ring(20, 1.0, 70)
    points = np.vstack([outer, hole, island])
    region = triangulate_region(points, np.vstack([first, second, third]))
    assert doubled_areas(points, region.faces).sum() / 2 == pytest.approx(
        area_of(outer) - area_of(hole) + area_of(island)
    )


def test_a_slit_is_kept_as_edges_and_bounds_nothing():
    border, around = ring(12, 1.0)
    points = np.vstack([border, [[-0.5, 0.01], [0.5, -0.02], [0.0, 0.4], [0.0, -0.4]]])
    slit = np.array([[12, 13], [13, 12]])
    region = triangulate_region(points, np.vstack([around, slit]))
    assert doubled_areas(points, region.faces).sum() / 2 == pytest.approx(area_of(border))
    assert (12, 13) in sides_of(region.faces)


def test_sides_that_cross_are_named():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    across = np.array([[0, 2], [2, 1], [1, 3], [3, 0]])
    region = triangulate_region(square, across)
    assert set(region.missing.tolist()) == {0, 2}
    assert len(region.faces) == 0


def test_a_side_through_a_corner_is_named():
    points = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 0.0]])
    through = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    assert triangulate_region(points, through).missing.tolist() == [0]


def test_points_on_a_straight_side_give_no_flat_triangles_inside():
    x = np.linspace(0, 1, 11)
    low, high = np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x + 0.3])
    points = np.vstack([low, high])
    index = np.arange(len(points))
    region = triangulate_region(points, np.column_stack([index, np.roll(index, -1)]))
    assert len(region.faces) == len(points) - 2
    assert doubled_areas(points, region.faces).min() > 1e-3


def test_where_the_polygon_lies_does_not_matter():
    border, around = ring(25, np.linspace(0.5, 1.0, 25))
    here = triangulate_region(border, around).faces
    assert np.array_equal(triangulate_region(border * 1e6 + 1e7, around).faces, here)


@given(st.integers(0, 10_000), st.integers(4, 30), st.booleans())
def test_a_polygon_in_space_is_cut_into_triangles_that_run_as_it_does(seed, n, is_turned):
    draw = np.random.default_rng(seed)
    border, _ = ring(n, draw.uniform(0.2, 1.0, n))
    frame = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    polygon = draw.normal(size=3) + 5.0 * border[:: -1 if is_turned else 1] @ frame[:2]
    normal = 3.0 * np.cross(frame[0], frame[1]) * (-1 if is_turned else 1)
    faces = triangulate_polygon(polygon, normal)
    a, b, c = (polygon[faces[:, k]] for k in range(3))
    heights = np.cross(b - a, c - a) @ normal / np.linalg.norm(normal) / 2
    assert len(faces) == n - 2
    assert heights.min() > 0
    assert heights.sum() == pytest.approx(25.0 * abs(area_of(border)), rel=1e-9)


def test_a_polygon_that_crosses_itself_is_not_cut_into_triangles():
    bow_tie = np.array([[0.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0], [-0.5, 0.5, 0]])
    assert triangulate_polygon(bow_tie, np.array([0.0, 0, 1])) is None
