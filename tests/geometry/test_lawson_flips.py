"""Flips and shifts that bring a triangulated patch into shape."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.geometry.lawson_flips import (
    corner_cotangents,
    doubled_areas,
    flip_edges,
    least_angles,
    take_back_folds,
    wanted_shift,
)
from weavecore.geometry.triangulate2d import triangulate_region

NO_EDGES = np.zeros((0, 2), np.int64)


def patch(stretch: float = 6.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A square in the plane that is stretched in space: what is Delaunay in one is not in the other."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    draw = np.random.default_rng(5)
    plane = np.column_stack([x, y])
    inner = (x > 0) & (x < 8) & (y > 0) & (y < 8)
    plane[inner] += draw.uniform(-0.35, 0.35, (inner.sum(), 2))
    hull = np.concatenate([np.arange(9), np.arange(17, 81, 9), np.arange(79, 71, -1), np.arange(63, 0, -9)])
    faces = triangulate_region(plane, np.column_stack([hull, np.roll(hull, -1)])).faces
    points = np.column_stack([plane[:, 0] * stretch, plane[:, 1], 0.1 * plane[:, 0] ** 2])
    return plane, points, faces


def not_delaunay(points: np.ndarray, faces: np.ndarray) -> int:
    corner = {}
    for face in faces.tolist():
        for a, b, c in zip(face, face[1:] + face[:1], face[2:] + face[:2]):
            corner[a, b] = c
    pairs = [(a, b, c, corner[b, a]) for (a, b), c in corner.items() if (b, a) in corner]
    a, b, c, d = np.array(pairs).T
    return int((corner_cotangents(points, a, b, c) + corner_cotangents(points, b, a, d) < -1e-6).sum())


def test_flips_make_the_patch_delaunay_in_space_and_keep_the_plane():
    plane, points, faces = patch(stretch=1.7)
    flipped = flip_edges(faces, plane, points, np.arange(len(plane)), NO_EDGES)
    assert not_delaunay(points, faces) > 10
    assert not_delaunay(points, flipped) == 0
    assert doubled_areas(plane, flipped).min() > 0
    assert doubled_areas(plane, flipped).sum() == pytest.approx(doubled_areas(plane, faces).sum())


def test_held_edges_are_not_flipped():
    plane, points, faces = patch(stretch=1.7)
    sides = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    assert np.array_equal(flip_edges(faces, plane, points, np.arange(len(plane)), sides), faces)


def test_no_flip_joins_two_names_that_are_joined_already():
    plane = np.array([[0, 0], [1, -0.2], [2, 0], [1, 0.2], [3, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    points = np.column_stack([plane, np.zeros(5)])
    free = flip_edges(faces[:2], plane, points, np.arange(5), NO_EDGES)
    assert {1, 3} <= set(free[0].tolist())
    joined = flip_edges(faces, plane, points, np.array([0, 1, 2, 3, 3]), NO_EDGES)
    assert np.array_equal(joined[:2], faces[:2])


def test_shifts_lead_to_the_middle_of_the_triangles():
    angle = 2 * np.pi * np.arange(6) / 6
    points = np.vstack([[[0.3, -0.2, 0.0]], np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])])
    faces = np.column_stack([np.zeros(6, int), 1 + np.arange(6), 1 + (np.arange(6) + 1) % 6])
    for _ in range(30):
        points[0] += wanted_shift(faces, points, np.ones(7))[0]
    assert points[0] == pytest.approx([0, 0, 0], abs=1e-6)
    assert least_angles(points, faces) == pytest.approx(60.0, abs=1e-4)


def test_a_smaller_wanted_length_draws_vertices():
    angle = 2 * np.pi * np.arange(6) / 6
    points = np.vstack([[[0.0, 0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])])
    faces = np.column_stack([np.zeros(6, int), 1 + np.arange(6), 1 + (np.arange(6) + 1) % 6])
    sizes = np.where(points[:, 0] > 0.2, 0.5, 1.0)
    assert wanted_shift(faces, points, sizes)[0, 0] > 0.1


def test_shifts_that_would_fold_a_triangle_are_taken_back():
    plane, _, faces = patch()
    after = plane.copy()
    after[40] += [3.0, 0.0]
    after[20] += [0.01, 0.0]
    kept = take_back_folds(faces, plane, after)
    assert doubled_areas(kept, faces).min() > 0
    assert np.array_equal(kept[40], plane[40])
    assert np.array_equal(kept[20], after[20])
