"""Border edges much longer than the mesh behind them, as refinement leaves them, are as good as short ones."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.geometry.refine import refine_faces
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance


def distance_to_sides(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distance of points in a convex polygon from its sides."""
    distances = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        part = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        distances.append(np.linalg.norm(points - a - part[:, None] * (b - a), axis=1))
    return np.min(distances, axis=0)


@pytest.mark.parametrize("fineness", [8, 16, 32])
@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0], [2, 0.1], [0.9, 1.6]],
        [[0, 0], [3, 0], [2.8, 0.9]],
        [[0, 0], [1.4, -0.1], [1.5, 1.1], [0.1, 1.0]],
    ],
    ids=["acute triangle", "obtuse triangle", "quadrilateral"],
)
def test_the_distance_in_a_flat_polygon_is_that_from_its_sides(corners: list[list[float]], fineness: int) -> None:
    sides = np.array([[*corner, 0.0] for corner in corners])
    faces = np.array([[0, k, k + 1] for k in range(1, len(sides) - 1)])
    fine = refine_faces(sides, faces, longest=1.0 / fineness)
    distance = measure_distance(SurfaceMesh(fine.vertices, fine.faces)).distance
    error = np.abs(distance - distance_to_sides(fine.vertices, sides)) * fineness
    assert error.max() < 0.02
    assert error.mean() < 1e-4
