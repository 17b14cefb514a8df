"""What the benchmarks run on: a freeform shell with a wavy rim and a hole off its middle, and a scan of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

HOLE = np.array([0.25, 0.1])
HOLE_RADIUS = 0.18


def make_shell(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and faces (F, 3) of the shell, with about ``n_faces`` irregular triangles.

    The plan is a disc with five waves in its rim and a round hole; its height is a dome with
    two bumps.  Points stand on a triangular grid, each a little out of place (the seed is
    fixed), and are joined by Delaunay's rule in the plan.
    """
    area = np.pi * (1 + 0.08**2 / 2 - HOLE_RADIUS**2)
    edge = np.sqrt(area / n_faces * 4 / np.sqrt(3))
    turn = 2 * np.pi * np.arange(round(2 * np.pi * 1.03 / edge)) / round(2 * np.pi * 1.03 / edge)
    rim = _rim(turn)[:, None] * np.c_[np.cos(turn), np.sin(turn)]
    turn = 2 * np.pi * np.arange(round(2 * np.pi * HOLE_RADIUS / edge)) / round(2 * np.pi * HOLE_RADIUS / edge)
    hole = HOLE + HOLE_RADIUS * np.c_[np.cos(turn), np.sin(turn)]
    plan = np.concatenate([rim, hole, _grid(edge)])
    faces = Delaunay(plan).simplices
    centre = plan[faces].mean(1)
    # Delaunay also fills the hole and the waves of the rim: what has its centre there goes.
    faces = faces[_depth(centre) > 0]
    a, b, c = (plan[faces[:, k]] for k in range(3))
    turned = np.cross(np.c_[b - a, np.zeros(len(a))], np.c_[c - a, np.zeros(len(a))])[:, 2] < 0
    faces[turned] = faces[turned][:, ::-1]
    used, faces = np.unique(faces, return_inverse=True)
    plan = plan[used]
    return np.c_[plan, _height(plan)], faces.reshape(-1, 3)


def make_scan(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """The shell as a scanner gives it: vertices off the surface by a tenth of an edge, and faces missing.

    Twelve holes with radii of 1 to 6 edges lie where the scanner did not see, with ragged borders.  The seed is fixed.
    """
    rng = np.random.default_rng(1)
    vertices, faces = make_shell(n_faces)
    edge = np.sqrt(np.pi / n_faces * 4 / np.sqrt(3))
    vertices = vertices + rng.normal(0.0, 0.1 * edge, vertices.shape)
    middle = vertices[faces].mean(1)
    for radius in np.linspace(1, 6, 12) * edge:
        place = middle[rng.integers(len(middle))]
        away = np.linalg.norm(middle - place, axis=1) > radius
        faces, middle = faces[away], middle[away]
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


def write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Write a mesh as a binary ``.ply``."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    path.write_bytes(header.encode() + vertices.astype("<f8").tobytes() + rows.tobytes())


def _rim(turn: np.ndarray) -> np.ndarray:
    return 1 + 0.08 * np.cos(5 * turn)


def _grid(edge: float) -> np.ndarray:
    """Points of a triangular grid inside the plan, half an edge from its borders."""
    n = int(1.2 / edge) + 1
    i, j = np.meshgrid(np.arange(-2 * n, 2 * n), np.arange(-2 * n, 2 * n))
    points = np.c_[(i + j / 2).ravel(), (j * np.sqrt(3) / 2).ravel()] * edge
    points = points + np.random.default_rng(0).uniform(-0.15, 0.15, points.shape) * edge
    return points[_depth(points) > 0.6 * edge]


def _depth(points: np.ndarray) -> np.ndarray:
    """About how far points of the plan lie from its borders; negative outside."""
    rim = _rim(np.arctan2(points[:, 1], points[:, 0])) - np.linalg.norm(points, axis=1)
    return np.minimum(rim, np.linalg.norm(points - HOLE, axis=1) - HOLE_RADIUS)


def _height(points: np.ndarray) -> np.ndarray:
    x, y = points.T
    dome = 0.6 * (1.2 - x**2 - y**2)
    return dome + 0.12 * np.sin(3 * x + 1) * np.cos(4 * y) + 0.1 * np.exp(-12 * ((x + 0.4) ** 2 + (y - 0.3) ** 2))
