"""How long edges are wanted, and meshes so coarse that edges of different faces could fall together."""

from __future__ import annotations

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.reading.rhino_surfaces import mesh_object
from weavecore.reading.rhino_surfaces.grids import face_grid
from weavecore.reading.rhino_surfaces.objects import as_brep
from weavecore.reading.rhino_surfaces.paths import edge_path
from weavecore.reading.rhino_surfaces.shape import brep_shape
from weavecore.reading.rhino_surfaces.sizing import graded_sizes, size_limits


@pytest.mark.parametrize("name", ["cone", "hourglass", "punched"])
def test_wanted_lengths_grow_by_a_quarter_of_the_distance_at_most(name):
    shape = brep_shape(as_brep(getattr(make, name)()))
    grids = [face_grid(face) for face in shape.faces]
    paths = [edge_path(edge) for edge in shape.edges]
    closed = [a == b for a, b in shape.edge_vertices.tolist()]
    limits = size_limits(grids, paths, None, 1e-3)
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
