"""Rigid motion, scale and renumbering change nothing but the coordinates."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from shell import make_shell
from stages import Woven, hold, weave
from weavecore.model import Lattice, SurfaceMesh

SPACING = 0.13
VERTICES, FACES = make_shell(1500)
NEAR = 1e-6
"""Parts of the size of the surface that coordinates may be off."""


@cache
def still() -> Woven:
    return weave(SurfaceMesh(VERTICES, FACES), spacing=SPACING)


def assert_same_but_moved(moved: Woven, places: np.ndarray, nodes: np.ndarray, size: float) -> None:
    """The same polylines, faces and strands, with their points at the given places."""
    for noun, names in (
        ("latitudes", ["generation", "parents"]),
        ("lattice", ["face_offsets", "edges", "edge_family", "node_latitude"]),
        ("strands", ["offsets", "nodes", "family", "closed"]),
    ):
        for name in names:
            here, there = getattr(getattr(still(), noun), name), getattr(getattr(moved, noun), name)
            assert np.array_equal(here, there), f"{noun}.{name}"
    assert np.array_equal(as_cycles(still().lattice), as_cycles(moved.lattice))
    assert np.array_equal(still().latitudes.polylines.offsets, moved.latitudes.polylines.offsets)
    assert np.abs(moved.latitudes.polylines.points - places).max() <= NEAR * size
    assert np.abs(moved.lattice.nodes - nodes).max() <= NEAR * size


def as_cycles(lattice: Lattice) -> np.ndarray:
    """Triangles from their least node on: where a cycle begins means nothing."""
    faces = lattice.face_nodes.reshape(-1, 3)
    return np.take_along_axis(faces, (faces.argmin(1)[:, None] + np.arange(3)) % 3, axis=1)


def matrix_of(quaternion: np.ndarray) -> np.ndarray:
    """The rotation that a quaternion of any length stands for."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    right = np.array([[w, x, y, z], [-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
    return (left @ right)[1:, 1:]


def test_the_surface_that_is_moved_is_worth_it() -> None:
    hold(still())
    assert still().latitudes.n_generations >= 4
    assert len(still().latitudes) > still().latitudes.n_generations


@settings(max_examples=8)
@given(
    quaternion=st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1),
    shift=st.lists(st.floats(-10, 10), min_size=3, max_size=3),
)
def test_motion_changes_only_coordinates(quaternion: list[float], shift: list[float]) -> None:
    turn = matrix_of(np.array(quaternion))
    moved = weave(SurfaceMesh(VERTICES @ turn + shift, FACES), spacing=SPACING)
    size = still().latitudes.surface.size
    places, nodes = still().latitudes.polylines.points, still().lattice.nodes
    assert_same_but_moved(moved, places @ turn + shift, nodes @ turn + shift, size)


@settings(max_examples=8)
@given(exponent=st.floats(-6, 6))
def test_scale_changes_only_coordinates(exponent: float) -> None:
    scale = 10.0**exponent
    moved = weave(SurfaceMesh(VERTICES * scale, FACES), spacing=SPACING * scale)
    size = still().latitudes.surface.size * scale
    assert_same_but_moved(moved, still().latitudes.polylines.points * scale, still().lattice.nodes * scale, size)


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32 - 1))
def test_renumbering_changes_no_ring(seed: int) -> None:
    other = weave(SurfaceMesh(*renumbered(VERTICES, FACES, seed)), spacing=SPACING)
    hold(other)
    here, there = still().latitudes, other.latitudes
    assert np.array_equal(here.generation, there.generation)
    # Each ring finds its like, point for point, with as many nodes; where it begins is free.
    gap, match = cKDTree(there.polylines.points).query(here.polylines.points)
    assert gap.max() <= NEAR * here.surface.size
    ring = there.polylines.owner[match[here.polylines.offsets[:-1]]]
    assert np.array_equal(there.polylines.counts[ring], here.polylines.counts)
    assert np.array_equal(nodes_per_ring(other.lattice)[ring], nodes_per_ring(still().lattice))
    assert other.lattice.n_faces == still().lattice.n_faces


def renumbered(vertices: np.ndarray, faces: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The same mesh with vertices, faces and first corners in another order."""
    draw = np.random.default_rng(seed)
    new = draw.permutation(len(vertices))
    faces = new[faces][draw.permutation(len(faces))]
    faces = np.take_along_axis(faces, (draw.integers(0, 3, len(faces))[:, None] + np.arange(3)) % 3, axis=1)
    return vertices[np.argsort(new)], faces


def nodes_per_ring(lattice: Lattice) -> np.ndarray:
    return np.bincount(lattice.node_latitude[lattice.node_latitude >= 0], minlength=len(lattice.latitudes))


@pytest.mark.parametrize("scale", [0.25, 1024.0])
def test_a_power_of_two_changes_no_digit(scale: float) -> None:
    moved = weave(SurfaceMesh(VERTICES * scale, FACES), spacing=SPACING * scale)
    assert np.array_equal(moved.latitudes.polylines.points, still().latitudes.polylines.points * scale)
    assert np.array_equal(moved.lattice.nodes, still().lattice.nodes * scale)
