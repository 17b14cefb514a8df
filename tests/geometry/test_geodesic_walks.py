"""Straight walks with the faces that they pass, and cycles of permutations."""

import numpy as np
import pytest

from planar_meshes import circle, plate
from weavecore.geometry.arrays import order_cycles
from weavecore.geometry.geodesics import Unfolding, on_halfedge, place_along, walk_far
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model import SurfaceMesh


@pytest.fixture(scope="module")
def disc():
    surface = SurfaceMesh(*plate([circle(1.0)], 0.12))
    return Unfolding(surface.vertices, surface.faces, surface.twins)


def points(frames, face, weights):
    return np.einsum("nk,nkd->nd", weights, frames.vertices[frames.faces[face]])


def walks_from_the_middle(frames, far, n=60):
    middle = frames.points(np.arange(len(frames.tail)), frames.length / 2)
    start = np.flatnonzero((np.linalg.norm(middle, axis=1) < 0.3) & (frames.twin != NO_TWIN))[:n]
    angle = np.linspace(0.1, np.pi - 0.1, len(start))
    along = 0.37 * frames.length[start]
    ux, uy = np.cos(angle), np.sin(angle)
    walks = walk_far(frames, start, along, np.zeros(len(start)), ux, uy, np.full(len(start), far))
    return walks, frames.points(start, along), frames.directions(start, ux, uy)


def test_walks_are_straight_and_unbroken(disc):
    walks, begin, direction = walks_from_the_middle(disc, 0.5)
    walk = np.repeat(np.arange(len(walks)), np.diff(walks.offsets))
    for weights, far in ((walks.start, walks.begin), (walks.end, walks.finish)):
        np.testing.assert_allclose(
            points(disc, walks.face, weights), begin[walk] + far[:, None] * direction[walk], atol=1e-6
        )
    np.testing.assert_allclose(walks.far, 0.5)
    assert not walks.is_blocked.any()
    inner = np.flatnonzero(walk[1:] == walk[:-1])
    np.testing.assert_array_equal(walks.finish[inner], walks.begin[inner + 1])
    assert (walks.face[inner] != walks.face[inner + 1]).all()


def test_a_place_along_a_walk_is_as_far_as_asked(disc):
    walks, begin, direction = walks_from_the_middle(disc, 0.5)
    far = np.linspace(0.0, 0.5, len(walks))
    face, weights = place_along(walks, far)
    np.testing.assert_allclose(points(disc, face, weights), begin + far[:, None] * direction, atol=1e-6)
    assert weights.min() > 0


def test_a_boundary_halfedge_blocks_and_the_walk_ends_on_it(disc):
    walks, _, _ = walks_from_the_middle(disc, 3.0)
    assert walks.is_blocked.all()
    last = walks.offsets[1:] - 1
    end = points(disc, walks.face[last], walks.end[last])
    assert np.linalg.norm(end, axis=1).min() > np.cos(np.pi / 48) - 1e-9


def test_some_walks_are_those_walks(disc):
    walks, _, _ = walks_from_the_middle(disc, 0.5)
    chosen = np.arange(len(walks)) % 3 == 1
    part = walks.take(chosen)
    rows = np.repeat(chosen, np.diff(walks.offsets))
    np.testing.assert_array_equal(part.face, walks.face[rows])
    np.testing.assert_array_equal(np.diff(part.offsets), np.diff(walks.offsets)[chosen])


def test_places_on_halfedges_have_no_weight_at_the_apex():
    halfedge = np.array([0, 1, 2, 7])
    weights = on_halfedge(halfedge, np.array([0.25, 0.25, 0.25, 0.0]))
    assert weights.tolist() == [[0.75, 0.25, 0], [0, 0.75, 0.25], [0.25, 0, 0.75], [0, 1, 0]]


def test_cycles_begin_with_their_least_element():
    order, offsets = order_cycles(np.array([3, 4, 2, 5, 1, 0]))
    assert order.tolist() == [0, 3, 5, 1, 4, 2]
    assert offsets.tolist() == [0, 3, 5, 6]
    assert [part.tolist() for part in order_cycles(np.zeros(0, np.int64))] == [[], [0]]
