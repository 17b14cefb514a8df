"""Patches that share vertices by name become one mesh without doubled edges."""

from __future__ import annotations

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.geometry.halfedges import border_loops, find_twins
from weavecore.reading.nurbs_mesher.brep_mesh import welded
from weavecore.reading.nurbs_mesher.brep_patches import Patches
from weavecore.reading.nurbs_mesher.brep_shape import brep_shape
from weavecore.reading.nurbs_mesher.face_grid import face_grid
from weavecore.reading.nurbs_mesher.objects import as_brep

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def two_squares(names: list[int]) -> Patches:
    """Two squares in a plane, each halved by its diagonal, with vertices of these names."""
    face = brep_shape(as_brep(make.plate())).faces[0]
    grid = face_grid(face)
    uv = np.vstack([SQUARE, SQUARE])
    return Patches(
        surfaces=(face, face),
        grids=(grid, grid),
        sizes=(np.ones_like(grid.curvature), np.ones_like(grid.curvature)),
        uv=uv,
        plane=grid.to_chart(uv),
        points=np.column_stack([uv, np.zeros(8)]),
        vertex_ids=np.array(names),
        owner=np.repeat([0, 1], 4),
        inner=np.zeros(8, bool),
        faces=np.vstack([HALVES, HALVES + 4]),
        creases=np.zeros((0, 2), np.int64),
    )


def test_vertices_of_one_name_are_one():
    vertices, faces = welded(two_squares([0, 1, 2, 3, 1, 4, 5, 2]))
    twins = find_twins(faces, len(vertices))
    assert len(vertices) == 6
    assert len(border_loops(faces, twins)) == 1


def test_diagonals_that_join_the_same_two_vertices_are_halved():
    """Both diagonals run between the vertices 0 and 2: as one edge it would have four faces."""
    vertices, faces = welded(two_squares([0, 1, 2, 3, 0, 4, 2, 5]))
    find_twins(faces, len(vertices))
    assert len(vertices) == 8
    assert len(faces) == 8
    middles = vertices[np.isclose(vertices, [0.5, 0.5, 0.0]).all(1)]
    assert len(middles) == 2


def test_triangles_with_a_vertex_twice_collapse():
    vertices, faces = welded(two_squares([0, 1, 2, 3, 6, 6, 7, 8]))
    assert len(faces) == 3
    corners = vertices[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas == pytest.approx(0.5)
