"""A growing mesh takes splits back, and a path that is barred leaves nothing behind."""

from __future__ import annotations

import numpy as np
import pytest

from raw_meshes import grid, triangles
from weavecore.errors import BadCurve
from weavecore.geometry.curve_embedding.growing_mesh import GrowingMesh
from weavecore.geometry.curve_embedding.path import PathDrawing
from weavecore.geometry.halfedges import find_twins


def square(n: int = 6) -> GrowingMesh:
    vertices, quads = grid(n, n)
    faces = triangles(quads)
    return GrowingMesh(vertices / [n, n, 1], faces, find_twins(faces, len(vertices)))


def split_at_random(mesh: GrowingMesh, rng: np.random.Generator, count: int) -> None:
    for _ in range(count):
        if rng.random() < 0.5:
            halfedge = int(rng.integers(3 * mesh.n_faces))
            mesh.split_edge(halfedge, (mesh.point(mesh.tail(halfedge)) + mesh.point(mesh.head(halfedge))) / 2)
        else:
            face = int(rng.integers(mesh.n_faces))
            mesh.split_face(face, mesh.vertices[list(mesh.corners(face))].mean(0))


def state(mesh: GrowingMesh) -> tuple[object, ...]:
    twins = [mesh.twin(h) for h in range(3 * mesh.n_faces)]
    fans = [mesh.fan(v) for v in range(mesh.n_vertices)]
    pieces = [mesh.pieces(f) for f in range(72)]
    return mesh.vertices.tobytes(), mesh.faces.tobytes(), twins, fans, pieces


@pytest.mark.parametrize("seed", range(5))
def test_undone_splits_leave_the_mesh_as_it_was_at_the_mark(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = square()
    split_at_random(mesh, rng, 40)
    before, mark = state(mesh), mesh.mark()
    split_at_random(mesh, rng, 300)
    inner = mesh.mark()
    split_at_random(mesh, rng, 20)
    mesh.undo(inner)
    mesh.undo(mark)
    assert state(mesh) == before
    assert np.array_equal(find_twins(mesh.faces, mesh.n_vertices), [mesh.twin(h) for h in range(3 * mesh.n_faces)])


def barred_square() -> tuple[GrowingMesh, PathDrawing]:
    """A square with another path along its middle, from side to side."""
    mesh = square()
    middle = np.flatnonzero(mesh.vertices[:, 0] == 0.5)
    return mesh, PathDrawing(mesh, np.stack([middle[:-1], middle[1:]], axis=1))


def draw(mesh: GrowingMesh, drawing: PathDrawing, places: list[list[float]], *, is_exact: bool) -> np.ndarray:
    points = np.c_[np.array(places), np.zeros(len(places))]
    corners = mesh.vertices[mesh.faces][:, :, :2]
    inside = [np.linalg.norm(corners.mean(1) - point[:2], axis=1).argmin() for point in points]
    return drawing.draw(
        points,
        np.array(inside),
        is_exact=np.full(len(points), is_exact),
        room=np.full(len(points), np.inf),
        on_border=np.zeros(len(points), bool),
        is_closed=False,
    )


# Centroids of faces, so that the nearest centroid is that of the face a place lies in.
HERE, THERE, ACROSS = [1 / 9, 1 / 18], [5 / 18 + 1 / 9, 1 / 2 + 1 / 18], [5 / 6 + 1 / 18, 2 / 3 + 1 / 9]


def test_a_place_that_is_left_out_leaves_no_splits() -> None:
    (mesh, drawing), (plain, other) = barred_square(), barred_square()
    path = draw(mesh, drawing, [HERE, ACROSS, THERE], is_exact=False)
    assert np.array_equal(path, draw(plain, other, [HERE, THERE], is_exact=False))
    assert mesh.vertices.tobytes() == plain.vertices.tobytes()
    assert mesh.faces.tobytes() == plain.faces.tobytes()


def test_an_exact_place_that_is_barred_is_refused_with_its_reason() -> None:
    mesh, drawing = barred_square()
    with pytest.raises(BadCurve, match="another origin near"):
        draw(mesh, drawing, [HERE, ACROSS], is_exact=True)
