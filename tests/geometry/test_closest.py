"""The closest face is found among faces of all sizes."""

from __future__ import annotations

import numpy as np
import pytest

from shell import make_shell
from weavecore.geometry.closest import closest_faces, nearest_on_triangles


def uneven_mesh() -> tuple[np.ndarray, np.ndarray]:
    """A shell of small faces, and a few large ones and slivers through and beside it."""
    vertices, faces = make_shell(400)
    large = np.array(
        [[-3, -3, 0.2], [3, -3, 0.25], [0, 4, 0.3], [-3, 1.2, 0.9], [3, 1.2, 0.9], [0, 1.201, 0.9], [5, 5, 5]]
    )
    more = np.array([[0, 1, 2], [3, 4, 5], [6, 6, 6]]) + len(vertices)
    return np.concatenate([vertices, large]), np.concatenate([faces, more])


def test_no_face_is_closer_than_the_closest() -> None:
    vertices, faces = uneven_mesh()
    points = np.random.default_rng(3).uniform(-1.5, 1.5, (300, 3))
    face, place = closest_faces(points, vertices, faces)
    each = np.repeat(np.arange(len(points)), len(faces))
    every = nearest_on_triangles(points[each], vertices[np.tile(faces, (len(points), 1))])
    gaps = np.linalg.norm(every - points[each], axis=1).reshape(len(points), -1)
    found = np.linalg.norm(place - points, axis=1)
    assert np.allclose(found, gaps.min(1), rtol=0, atol=1e-12)
    assert np.allclose(gaps[np.arange(len(points)), face], found, rtol=0, atol=1e-12)
    assert {len(faces) - 3, len(faces) - 2} <= set(face.tolist())


def test_the_least_of_equally_close_faces_is_taken() -> None:
    vertices, faces = make_shell(400)
    face, place = closest_faces(vertices, vertices, faces)
    first = np.full(len(vertices), len(faces))
    np.minimum.at(first, faces.ravel(), np.repeat(np.arange(len(faces)), 3))
    assert np.array_equal(face, first)
    assert np.allclose(place, vertices, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("point", "nearest"),
    [
        ([0.2, 0.2, 3.0], [0.2, 0.2, 0.0]),  # above the inside
        ([0.5, -2.0, 1.0], [0.5, 0.0, 0.0]),  # beyond a side
        ([2.0, 2.0, 0.0], [0.5, 0.5, 0.0]),  # beyond the long side
        ([-1.0, -1.0, 5.0], [0.0, 0.0, 0.0]),  # beyond a corner
    ],
)
def test_the_nearest_place_of_a_triangle(point: list[float], nearest: list[float]) -> None:
    triangle = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    assert np.allclose(nearest_on_triangles(np.array([point]), triangle), [nearest])


def test_a_flat_triangle_has_a_nearest_place() -> None:
    flat = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0]]])
    assert np.allclose(nearest_on_triangles(np.array([[3.0, 2.0, 0.0]]), flat), [[3.0, 0.0, 0.0]])
