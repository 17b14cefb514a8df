import numpy as np
import pytest

from planar_meshes import circle, plate
from weavecore.geometry.geodesics import Unfolding, back_to_edge, barycentric_at, walk_straight
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model import SurfaceMesh


@pytest.fixture(scope="module")
def disc():
    surface = SurfaceMesh(*plate([circle(1.0)], 0.12))
    return Unfolding(surface.vertices, surface.faces, surface.twins)


def inner_edges(frames, within=0.4):
    middle = frames.points(np.arange(len(frames.tail)), frames.length / 2)
    return np.flatnonzero((np.linalg.norm(middle, axis=1) < within) & (frames.twin != NO_TWIN))


def test_frames_place_the_apex_where_it_is_in_space(disc):
    every = np.arange(len(disc.tail))
    apex = disc.vertices[disc.tail] + disc.directions(every, disc.apex_x, disc.apex_y)
    np.testing.assert_allclose(apex, disc.vertices[disc.apex], atol=1e-12)


def test_angles_around_inner_vertices_of_a_plane_are_a_full_turn(disc):
    inner = ~disc.on_boundary
    np.testing.assert_allclose(disc.total_angle[inner], 2 * np.pi, atol=1e-9)


def test_walks_in_a_plane_are_straight_segments(disc):
    rng = np.random.default_rng(3)
    start = rng.choice(inner_edges(disc), 200)
    along = rng.uniform(0.01, 0.99, 200) * disc.length[start]
    angle = rng.uniform(-np.pi, np.pi, 200)
    far = rng.uniform(0.0, 0.5, 200)
    at, x, y, ux, uy, arrived = walk_straight(disc, start, along, np.cos(angle), np.sin(angle), far)
    assert arrived.all()
    begin = disc.points(start, along)
    direction = disc.directions(start, np.cos(angle), np.sin(angle))
    end = disc.vertices[disc.tail[at]] + disc.directions(at, x, y)
    np.testing.assert_allclose(end, begin + far[:, None] * direction, atol=1e-9)
    np.testing.assert_allclose(disc.directions(at, ux, uy), direction, atol=1e-9)
    weights = barycentric_at(disc, at, x, y)
    assert weights.min() > -1e-9
    np.testing.assert_allclose(weights.sum(1), 1.0)


def test_walks_stop_short_at_boundary_halfedges(disc):
    start = inner_edges(disc)[:20]
    arrived = walk_straight(disc, start, disc.length[start] / 2, np.zeros(20), np.ones(20), np.full(20, 3.0))[5]
    assert not arrived.any()


def test_a_line_moved_back_to_its_edge_passes_the_same_point(disc):
    start = inner_edges(disc)[:50]
    along = disc.length[start] * 0.3
    angle = np.linspace(0.2, 2.9, 50)
    at, x, y, ux, uy, _ = walk_straight(disc, start, along, np.cos(angle), np.sin(angle), np.full(50, 0.3))
    edge, place, ex, ey, back = back_to_edge(disc, at, x, y, ux, uy)
    assert (ey > 0).all()
    assert (back >= 0).all()
    point = disc.points(edge, place) + back[:, None] * disc.directions(edge, ex, ey)
    np.testing.assert_allclose(point, disc.vertices[disc.tail[at]] + disc.directions(at, x, y), atol=1e-7)
    assert (edge // 3 == at // 3).all()
