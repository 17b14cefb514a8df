"""Vectors against the normals of nearest faces: as by looking up every nearest face."""

from __future__ import annotations

import numpy as np
import pytest

from bound_rings import hemisphere
from weavecore.geometry.nearest_normals import NearestNormals
from weavecore.model import SurfaceMesh


@pytest.fixture(scope="module")
def surface() -> SurfaceMesh:
    return SurfaceMesh(*hemisphere())


def near_points(surface: SurfaceMesh, off: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points beside a surface, the nearest faces, and bounds on the distances."""
    draw = np.random.default_rng(4)
    middle = surface.vertices[surface.faces].mean(1)[draw.integers(0, surface.n_faces, 400)]
    shift = off * draw.normal(size=middle.shape)
    return middle + shift, surface.face_finder.find(middle + shift)[0], np.linalg.norm(shift, axis=1)


@pytest.mark.parametrize("off", [1e-9, 0.05, 0.7])
def test_the_same_as_by_looking_up_the_nearest_faces(surface: SurfaceMesh, off: float) -> None:
    points, face, near = near_points(surface, off)
    normals = surface.face_normals[face]
    for spread in (0.1, 1.0, 3.0):
        vectors = normals + spread * np.random.default_rng(5).normal(size=normals.shape)
        wanted = (normals * vectors).sum(1) <= 0
        assert np.array_equal(surface.nearest_normals.are_against(points, vectors, near), wanted)


def test_most_vectors_that_follow_the_surface_need_no_nearest_face(surface: SurfaceMesh) -> None:
    points, face, near = near_points(surface, 1e-3)
    looked_up: list[int] = []

    class Finder:
        def find(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            looked_up.append(len(points))
            return surface.face_finder.find(points)

    normals = NearestNormals(surface.vertices, surface.faces, surface.face_normals, Finder())  # type: ignore[arg-type]
    assert not normals.are_against(points, surface.face_normals[face], near).any()
    assert sum(looked_up) < 0.1 * len(points)


def test_vectors_without_length_count_as_against(surface: SurfaceMesh) -> None:
    points, _, near = near_points(surface, 1e-3)
    assert surface.nearest_normals.are_against(points, np.zeros_like(points), near).all()
    assert len(surface.nearest_normals.are_against(points[:0], points[:0], near[:0])) == 0
