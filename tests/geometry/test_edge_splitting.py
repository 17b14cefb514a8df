import numpy as np
import pytest

from planar_meshes import circle, plate
from weavecore.geometry.bisection import NOT_SPLIT, split_edges
from weavecore.geometry.halfedges import NO_TWIN, find_twins, halfedge_ends
from weavecore.model import SurfaceMesh


def split_some(surface, chosen):
    """Split the edges of the chosen halfedges at three tenths of their length."""
    tail, head = halfedge_ends(surface.faces)
    twins = surface.twins
    leads = np.flatnonzero(chosen & ((twins == NO_TWIN) | (np.arange(len(twins)) < twins)))
    middle = np.full(len(twins), NOT_SPLIT)
    middle[leads] = surface.n_vertices + np.arange(len(leads))
    paired = leads[twins[leads] != NO_TWIN]
    middle[twins[paired]] = middle[paired]
    a, b = surface.vertices[tail[leads]], surface.vertices[head[leads]]
    points = np.concatenate([surface.vertices, a + 0.3 * (b - a)])
    return points, *split_edges(points, surface.faces, twins, middle)


@pytest.mark.parametrize("part", [0.02, 0.3, 0.7, 1.0])
def test_any_set_of_edges_can_be_split(part):
    surface = SurfaceMesh(*plate([circle(1.0), circle(0.3, n=16)], 0.15))
    chosen = np.random.default_rng(2).random(3 * surface.n_faces) < part
    points, faces, part_of, twins = split_some(surface, chosen)
    after = SurfaceMesh(points, faces)  # manifold and oriented, or it would not be made
    assert np.array_equal(twins, find_twins(faces, len(points)))
    assert after.euler_characteristic == surface.euler_characteristic
    assert (after.face_normals[:, 2] > 0.99).all()
    area = np.linalg.norm(np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))), axis=1)
    corners = surface.vertices[surface.faces]
    whole = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    np.testing.assert_allclose(np.bincount(part_of, area), whole)
    assert np.array_equal(part_of[: surface.n_faces], np.arange(surface.n_faces))


def test_faces_without_a_split_edge_stay_as_they_are():
    surface = SurfaceMesh(*plate([circle(1.0)], 0.2))
    chosen = np.arange(3 * surface.n_faces) == 40
    _, faces, part_of, _ = split_some(surface, chosen)
    touched = {40 // 3, surface.twins[40] // 3}
    rest = [f for f in range(surface.n_faces) if f not in touched]
    assert np.array_equal(faces[rest], surface.faces[rest])
    assert len(faces) == surface.n_faces + 2
    assert set(part_of[surface.n_faces :].tolist()) == touched
