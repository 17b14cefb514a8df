"""How long edges are wanted, and meshes so coarse that edges of different faces could fall together."""

from __future__ import annotations

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.reading.nurbs_mesher import mesh_object
from weavecore.reading.nurbs_mesher.brep_shape import brep_shape
from weavecore.reading.nurbs_mesher.edge_paths import edge_path
from weavecore.reading.nurbs_mesher.face_grid import face_grid
from weavecore.reading.nurbs_mesher.objects import as_brep
from weavecore.reading.nurbs_mesher.sizing import Fineness, graded_sizes, size_limits


@pytest.mark.parametrize("name", ["cone", "hourglass", "punched"])
def test_wanted_lengths_grow_by_a_quarter_of_the_distance_at_most(name):
    shape = brep_shape(as_brep(getattr(make, name)()))
    grids = [face_grid(face) for face in shape.faces]
    paths = [edge_path(edge) for edge in shape.edges]
    closed = [a == b for a, b in shape.edge_vertices.tolist()]
    limits = size_limits(grids, paths, Fineness(chord=1e-3))
    sizes, along = graded_sizes(grids, paths, closed, limits)
    assert max(s.max() for s in sizes) <= limits.edge
    for grid, size in zip(grids, sizes):
        for axis in (0, 1):
            apart = np.linalg.norm(np.diff(grid.points, axis=axis), axis=2)
            assert (np.abs(np.diff(size, axis=axis)) <= 0.25 * apart + 1e-9).all()
    points = np.concatenate([path.points for path in paths])
    on_edges = np.concatenate(along)
    for grid, size in zip(grids, sizes):
        apart = np.linalg.norm(grid.points.reshape(-1, 1, 3) - points, axis=2)
        # The distance is taken along neighbours, which is a little longer than straight.
        assert (size.ravel() <= (on_edges + 0.4 * apart).min(1) + 1e-9).all()


@pytest.mark.parametrize(
    ("name", "n_borders", "characteristic"),
    [
        ("box", 0, 2),
        ("sphere", 0, 2),
        ("can", 0, 2),
        ("tube", 2, 0),
        ("torus", 0, 0),
        ("pipe", 0, 0),
        ("punched", 0, 0),
    ],
)
def test_the_coarsest_mesh_is_still_manifold(name, n_borders, characteristic):
    mesh = mesh_object(getattr(make, name)(), edge_target=1e3, chord=1e3)
    twins = find_twins(mesh.faces, len(mesh.vertices))
    check_manifold_vertices(mesh.faces, twins, len(mesh.vertices))
    assert len(border_loops(mesh.faces, twins)) == n_borders
    edges = (len(twins) + int((twins < 0).sum())) // 2
    assert len(mesh.vertices) - edges + len(mesh.faces) == characteristic


def rise_of_a_sphere(points):
    return np.abs(np.linalg.norm(points, axis=-1) - 2.0)


def rise_of_a_torus(points):
    ring = np.hypot(points[..., 0], points[..., 1]) - 3.0
    return np.abs(np.hypot(ring, points[..., 2]) - 1.0)


def rise_of_a_cylinder(points):
    return np.abs(np.hypot(points[..., 0], points[..., 1]) - 1.0)


EXACT = {"sphere": rise_of_a_sphere, "torus": rise_of_a_torus, "tube": rise_of_a_cylinder}


def true_error(mesh, rise):
    """The greatest distance between mesh and surface, at a hundred places of each triangle."""
    n = 13
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    return float(rise(np.einsum("kc,fcx->fkx", weights, mesh.vertices[mesh.faces])).max())


@pytest.mark.parametrize("name", EXACT)
def test_the_mesh_is_by_default_within_a_thousandth_of_the_size_of_the_exact_surface(name):
    mesh = mesh_object(getattr(make, name)())
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    assert true_error(mesh, EXACT[name]) <= 1e-3 * size


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("share", [3e-4, 4e-3])
def test_the_mesh_is_within_the_chord_error_that_is_asked_for(name, share):
    size = np.linalg.norm(np.ptp(mesh_object(getattr(make, name)()).vertices, axis=0))
    mesh = mesh_object(getattr(make, name)(), chord=share * size, edge_target=size)
    assert share * size / 10 <= true_error(mesh, EXACT[name]) <= share * size


@pytest.mark.parametrize("name", ["plate", "sphere"])
def test_a_spacing_asks_for_two_edges_at_least(name):
    size = np.linalg.norm(np.ptp(mesh_object(getattr(make, name)()).vertices, axis=0))
    spacing = size / 50
    mesh = mesh_object(getattr(make, name)(), spacing=spacing)
    sides = mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)]
    length = np.linalg.norm(sides, axis=2)
    assert np.median(length) <= 0.52 * spacing
    assert length.max() <= 0.8 * spacing


def test_a_wide_spacing_makes_no_coarser_mesh_and_a_tiny_one_no_huge_mesh():
    usual, wide, tiny = (mesh_object(make.sphere(), spacing=s) for s in (None, 10.0, 1e-6))
    assert len(wide.faces) == len(usual.faces)
    assert 4 * len(usual.faces) < len(tiny.faces) < 150_000


def test_an_edge_target_goes_before_the_spacing():
    asked, both = (mesh_object(make.plate(), edge_target=0.2, spacing=s) for s in (None, 0.01))
    assert len(asked.faces) == len(both.faces)
