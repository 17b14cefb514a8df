"""Polylines from a field that is known exactly: places, order, orientation, islets."""

from functools import cache

import numpy as np
import pytest

from flat_fields import distance_at, flat_field, flat_surface, without_directions
from planar_meshes import circle, plate, rectangle
from weavecore.errors import SpacingTooLarge, TooMuchWork
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField
from weavecore.offsetting.isolines.extract import trace_latitudes
from weavecore.offsetting.spacing import LevelSchedule
from weavecore.tolerances import LEVEL_FROM_VERTEX
from weavecore.validating import validate

STAR = circle(4.0, n=200) * (1 + 0.3 * np.cos(5 * np.arange(200) * 2 * np.pi / 200))[:, None]
SHAPES = {
    "disc": [circle(5.0, n=120)],
    "annulus": [circle(5.0, n=120), circle(1.5, n=40)],
    "eccentric": [circle(5.0, n=120), circle(1.5, (1.2, 0.3), 40)],
    "square": [rectangle(9, 9)],
    "corner": [np.array([[0, 0], [10, 0], [10, 4], [4, 4], [4, 10], [0, 10.0]])],
    "star": [STAR],
    "four holes": [circle(6.0, n=120), *(circle(0.8, c, 24) for c in ((2, 0), (-2, 0.3), (0, 2.5), (0.3, -2.4)))],
}


@cache
def traced(name):
    surface = flat_surface(SHAPES[name], 0.3)
    return surface, trace_latitudes(surface, flat_field(surface), spacing=1.1)


def errors_of(latitudes):
    """How far the points of each traced polyline are from its distance, in spacings."""
    polylines = latitudes.polylines
    is_traced = latitudes.generation[polylines.owner] > 0
    exact, _ = distance_at(latitudes.surface, polylines.points[is_traced])
    return np.abs(exact - latitudes.distance[polylines.owner[is_traced]]) / latitudes.spacing


def assert_holds(latitudes):
    report = validate(latitudes)
    assert report.holds, f"\n{report}"


def loops_per_generation(latitudes):
    return np.bincount(latitudes.generation).tolist()


def grid(n, m):
    """A grid of squares of side 1, each halved."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(m + 1.0), indexing="ij")
    i = np.arange(n * (m + 1)).reshape(n, m + 1)[:, :-1].ravel()
    faces = np.concatenate([np.stack([i, i + m + 1, i + m + 2], 1), np.stack([i, i + m + 2, i + 1], 1)])
    return SurfaceMesh(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), faces)


@pytest.mark.parametrize("name", SHAPES)
def test_points_lie_at_their_distance_and_all_promises_hold(name):
    _, latitudes = traced(name)
    error = errors_of(latitudes)
    assert error.mean() < 0.003
    assert np.quantile(error, 0.9) < 0.003
    assert error.max() < 0.09  # where a neck is cut, a level gives way by twice the least cap
    assert_holds(latitudes)


def test_directions_place_points_ten_times_better_than_distances_alone():
    surface = flat_surface(SHAPES["square"], 0.4)
    field = flat_field(surface)
    error = errors_of(trace_latitudes(surface, field, spacing=1.3))
    blind = errors_of(trace_latitudes(surface, without_directions(field), spacing=1.3))
    assert blind.max() > 0.05
    assert error.max() < 0.1 * blind.max()


@pytest.mark.parametrize("name", SHAPES)
def test_the_unexplored_side_is_on_the_left(name):
    surface, latitudes = traced(name)
    polylines = latitudes.polylines
    after = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in zip(polylines.offsets, polylines.offsets[1:])])
    along = polylines.points[after] - polylines.points
    length = np.linalg.norm(along, axis=1, keepdims=True)
    left = np.cross([0, 0, 1], along / length) * 1e-3
    middle = (polylines.points + polylines.points[after]) / 2
    seen = (polylines.owner >= len(surface.borders)) & (length[:, 0] > 0.02)
    rises = distance_at(surface, (middle + left)[seen])[0] > distance_at(surface, (middle - left)[seen])[0]
    assert rises.mean() > 0.98


def test_borders_come_first_point_for_point():
    surface, latitudes = traced("four holes")
    for k, loop in enumerate(surface.borders):
        assert np.array_equal(latitudes.polylines.polyline(k), surface.vertices[loop])
    assert (np.diff(latitudes.generation) >= 0).all()
    assert (latitudes.distance == latitudes.generation * 1.1).all()


def test_noise_leaves_no_islets():
    surface = flat_surface([circle(5.0, n=120)], 0.25)
    exact = flat_field(surface)
    noise = np.random.default_rng(3).uniform(-0.018, 0.018, surface.n_vertices)
    noise[surface.borders[0]] = 0.0
    noisy = DistanceField(exact.distance + noise, np.zeros_like(exact.gradient))
    latitudes = trace_latitudes(surface, noisy, spacing=0.9)
    assert loops_per_generation(latitudes) == [1] * 6
    assert_holds(latitudes)


def test_a_pit_however_deep_is_filled():
    surface = flat_surface([circle(5.0, n=120)], 0.3)
    field = flat_field(surface)
    distance = field.distance.copy()
    distance[np.linalg.norm(surface.vertices - [1.0, 0.5, 0], axis=1) < 0.5] = 0.2
    latitudes = trace_latitudes(surface, DistanceField(distance, field.gradient), spacing=1.1)
    assert loops_per_generation(latitudes)[:4] == [1, 1, 1, 1]
    assert_holds(latitudes)


def test_a_pit_in_a_pit_is_filled():
    surface = flat_surface([circle(5.0, n=120)], 0.25)
    field = flat_field(surface)
    distance = field.distance.copy()
    away = np.linalg.norm(surface.vertices, axis=1)
    distance[away < 1.2] = 2.5
    distance[away < 0.9] = 1.5
    distance[away < 0.5] = 0.2
    latitudes = trace_latitudes(surface, DistanceField(distance, 0 * field.gradient), spacing=1.1)
    assert loops_per_generation(latitudes) == [1, 1, 1, 1]
    assert latitudes.parents.tolist() == [[0, 1], [1, 2], [2, 3]]


def test_a_vertex_at_a_level_counts_as_beyond_it():
    surface = grid(12, 12)
    x, y = surface.vertices[:, :2].T
    field = DistanceField(np.minimum(np.minimum(x, 12 - x), np.minimum(y, 12 - y)), np.zeros((surface.n_vertices, 3)))
    latitudes = trace_latitudes(surface, field, spacing=2.0)
    assert loops_per_generation(latitudes) == [1, 1, 1]  # the middle, 6 deep, is a cap of no height
    assert_holds(latitudes)
    polylines = latitudes.polylines
    assert polylines.segment_lengths.min() > 0
    error = errors_of(latitudes) * 2.0
    assert error.max() <= LEVEL_FROM_VERTEX * 1.01
    inside = polylines.points[latitudes.generation[polylines.owner] > 0]
    assert (distance_at(surface, inside)[0] < np.round(distance_at(surface, inside)[0])).all()


def test_rounding_does_not_tear_a_level_through_vertices():
    surface = grid(30, 30)
    x, y = surface.vertices[:, :2].T * 0.1
    distance = np.minimum(np.minimum(x, 3.0 - x), np.minimum(y, 3.0 - y))
    tenth = SurfaceMesh(surface.vertices * 0.1, surface.faces)
    latitudes = trace_latitudes(tenth, DistanceField(distance, np.zeros((len(x), 3))), spacing=0.3)
    assert loops_per_generation(latitudes) == [1] * 5
    assert_holds(latitudes)


def test_distances_are_compared_with_levels_as_people_would():
    assert LevelSchedule.of(0.1).levels_below(np.array([0.3, 0.6, 0.7, 0.2999])).tolist() == [3, 6, 7, 2]


def test_an_edge_may_be_crossed_by_many_levels():
    rim = circle(1.0, n=7)
    vertices = np.concatenate([[[0, 0, 0]], np.c_[rim, np.zeros(7)]])
    faces = np.array([[0, 1 + k, 1 + (k + 1) % 7] for k in range(7)])
    surface = SurfaceMesh(vertices, faces)
    depth = np.cos(np.pi / 7)
    field = DistanceField(np.array([depth] + [0] * 7), np.zeros((8, 3)))
    latitudes = trace_latitudes(surface, field, spacing=depth / 60.5)
    assert loops_per_generation(latitudes) == [1] * 61
    assert_holds(latitudes)
    assert errors_of(latitudes).max() < 1e-9
    assert latitudes.bands.euler.tolist() == [0] * 60 + [1]


def test_a_direction_that_lies_in_the_next_face_around_a_bend_is_turned_into_the_edge():
    n, n_rings, side = 16, 9, 0.5
    lean = np.pi / 9 * (-1.0) ** np.arange(n_rings - 1)  # rings zigzag by 40 degrees
    radius = 2 + side * np.concatenate([[0], np.cumsum(np.sin(lean))])
    height = side * np.concatenate([[0], np.cumsum(np.cos(lean))])
    around = np.concatenate([circle(1.0, n=n), np.zeros((n, 1))], axis=1)
    rings = radius[:, None, None] * around + height[:, None, None] * [0, 0, 1.0]
    k, j = np.arange(n), (np.arange(n) + 1) % n
    faces = []
    for low in range(0, n * (n_rings - 1), n):
        faces += [np.c_[low + k, low + j, low + n + j], np.c_[low + k, low + n + j, low + n + k]]
    surface = SurfaceMesh(rings.reshape(-1, 3), np.concatenate(faces))
    distance = side * np.minimum(np.arange(n_rings), n_rings - 1 - np.arange(n_rings))
    direction = np.zeros_like(rings)
    direction[1:4] = (rings[2:5] - rings[1:4]) / side
    direction[5:8] = (rings[4:7] - rings[5:8]) / side
    field = DistanceField(np.repeat(distance, n), direction.reshape(-1, 3))
    polylines = trace_latitudes(surface, field, spacing=0.7).polylines
    first = polylines.polyline(2)
    turn = np.arctan2(first[:, 1], first[:, 0]) * n / (2 * np.pi)
    on_meridian = np.flatnonzero(np.abs(turn - np.round(turn)) < 1e-9)
    # 0.7 is two fifths of the way from the second ring to the third.
    z = height[1] + 0.4 * (height[2] - height[1])
    assert len(on_meridian) == n
    np.testing.assert_allclose(first[on_meridian, 2], z, atol=1e-3 * side)


@pytest.mark.parametrize("name", ["eccentric", "corner", "four holes"])
def test_renumbering_gives_the_same_polylines(name):
    vertices, faces = plate(SHAPES[name], 0.3, 0.25, np.random.default_rng(1))
    rng = np.random.default_rng(5)
    place = rng.permutation(len(vertices))
    turned = place[faces[rng.permutation(len(faces))]]
    moved = np.empty_like(vertices)
    moved[place] = vertices
    turned = np.take_along_axis(turned, (rng.integers(0, 3, len(turned))[:, None] + np.arange(3)) % 3, 1)

    def polylines(surface):
        latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.1)
        return [
            (generation, frozenset(map(tuple, np.round(latitudes.polylines.polyline(p), 9) + 0.0)))
            for p, generation in enumerate(latitudes.generation)
        ]

    here, there = polylines(SurfaceMesh(vertices, faces)), polylines(SurfaceMesh(moved, turned))
    assert len(here) == len(there)
    assert set(here) == set(there)


def test_the_same_input_gives_the_same_bytes():
    surface, one = traced("four holes")
    other = trace_latitudes(surface, flat_field(surface), spacing=1.1)
    assert one.polylines.points.tobytes() == other.polylines.points.tobytes()
    assert one.bands.polyline.tobytes() == other.bands.polyline.tobytes()


def test_a_spacing_too_large_says_what_would_do():
    surface = flat_surface([circle(5.0, n=120)], 0.4)
    with pytest.raises(SpacingTooLarge, match=r"about 4.8. deep.*2\.4 or less"):
        trace_latitudes(surface, flat_field(surface), spacing=5.0)


@pytest.mark.parametrize("spacing", [1e-5, 1e-7, 1e-300])
def test_too_many_points_are_refused_before_they_are_made(spacing):
    surface = flat_surface([circle(5.0, n=120)], 0.4)
    with pytest.raises(TooMuchWork, match="spacing of"):
        trace_latitudes(surface, flat_field(surface), spacing=spacing)
