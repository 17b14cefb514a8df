"""Cutting a mesh along curves."""

from __future__ import annotations

import numpy as np

from planar_meshes import plate, rectangle
from weavecore.geometry.cut import NONE, Marks, cut_along
from weavecore.geometry.halfedges import find_twins

SQUARE = np.array([[0, 1, 2], [0, 2, 3]])
"""Two triangles with the diagonal 0–2, of the corners of a unit square."""


def loop(vertex, halfedge, part, face):
    n = len(vertex)
    k = np.arange(n)
    return Marks((k + 1) % n, (k - 1) % n, *map(np.asarray, (vertex, halfedge, part, face)))


def small_loop():
    """A diamond about the middle of the square: two points on the diagonal, one inside either face."""
    diagonal = 2  # halfedge 2 → 0 of the first face
    return loop([4, 5, 6, 7], [diagonal, NONE, diagonal, NONE], [0.3, 0.0, 0.7, 0.0], [1, 1, 0, 0])


def test_a_loop_that_bends_inside_faces_cuts_out_its_inside():
    cells = cut_along(SQUARE, find_twins(SQUARE, 4), small_loop())
    assert len(np.unique(cells.cell_piece)) == 2
    assert len(np.unique(cells.left_piece)) == 1
    assert len(np.unique(cells.right_piece)) == 1
    assert cells.left_piece[0] != cells.right_piece[0]


def test_the_parts_of_each_cell_close():
    cells = cut_along(SQUARE, find_twins(SQUARE, 4), small_loop())
    for cell in range(len(cells.cell_piece)):
        own = cells.part_cell == cell
        after = dict(zip(cells.part_start[own].tolist(), cells.part_end[own].tolist()))
        assert len(after) == own.sum()
        v = start = next(iter(after))
        for _ in range(len(after)):
            v = after[v]
        assert v == start


def test_every_part_inside_the_mesh_is_found_from_both_sides():
    cells = cut_along(SQUARE, find_twins(SQUARE, 4), small_loop())
    sides = set(zip(cells.part_start.tolist(), cells.part_end.tolist()))
    naked = {(a, b) for a, b in sides if (b, a) not in sides}
    assert naked == {(0, 1), (1, 2), (2, 3), (3, 0)}


def test_a_level_of_a_fine_mesh_parts_it_in_inside_and_outside():
    vertices, faces = plate([rectangle(2.0, 2.0)], 0.2)
    twins = find_twins(faces, len(vertices))
    height = np.hypot(vertices[:, 0], vertices[:, 1]) - 0.613
    marks, count = trace(faces, twins, height, len(vertices))
    cells = cut_along(faces, twins, marks)
    pieces = np.concatenate([cells.face_piece[cells.face_piece != NONE], cells.cell_piece])
    assert len(np.unique(pieces)) == 2
    inside = cells.right_piece[0]
    area = dict.fromkeys(np.unique(pieces).tolist(), 0)
    for f in np.flatnonzero(cells.face_piece != NONE):
        assert (height[faces[f]] < 0).all() == (cells.face_piece[f] == inside)
        area[cells.face_piece[f]] += 1
    assert min(area.values()) > 0
    assert count == len(marks.vertex)


def trace(faces, twins, height, n):
    """The level 0 as marks, with the lower side on the right."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    rising = np.flatnonzero((height[tail] < 0) & (height[head] >= 0))
    leaves = {int(h // 3): int(h) for h in rising}
    enters = {int(h // 3): int(h) for h in np.flatnonzero((height[tail] >= 0) & (height[head] < 0))}
    face = next(iter(leaves))
    order = []
    for _ in range(len(leaves)):
        order.append(face)
        face = int(twins[leaves[face]]) // 3
    halfedge = np.array([enters[f] for f in order])
    part = height[tail[halfedge]] / (height[tail[halfedge]] - height[head[halfedge]])
    return loop(n + np.arange(len(order)), halfedge, part, order), len(leaves)


def test_marks_on_the_border_divide_it_without_cutting():
    border = loop([0, 4, 1, 2, 3], [NONE, 0, NONE, NONE, NONE], [0, 0.5, 0, 0, 0], [NONE] * 5)
    cells = cut_along(SQUARE, find_twins(SQUARE, 4), border)
    assert len(cells.cell_piece) == 1
    np.testing.assert_array_equal(np.sort(cells.part_start), [0, 1, 2, 4])
    assert cells.face_piece[1] == cells.cell_piece[0]
    assert cells.edge_piece[0] == cells.edge_piece[3]
