"""Curves drawn into a mesh: a path along edges where the curve is, on the same surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from raw_meshes import ball, grid, torus, triangles
from weavecore.errors import BadCurve, NonFinite
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_embedding.embed import embed_curve
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins


def sheet(n, m=None):
    """The unit square as n by m quads in triangles."""
    vertices, faces = grid(n, m or n)
    return vertices / [n, m or n, 1], triangles(faces)


def doodle(rng, n=200):
    """A closed curve about the middle of the unit square that does not cross itself."""
    turn = np.linspace(0, 2 * np.pi, n)
    reach = sum(rng.normal() / k * np.cos(k * turn + rng.uniform(0, 6)) for k in range(1, 7))
    reach = 0.1 + 0.32 * (reach - reach.min()) / (np.ptp(reach) + 0.1)
    return np.stack([0.5 + reach * np.cos(turn), 0.5 + reach * np.sin(turn), 0 * turn], axis=1)


def spiral(rng, n=200):
    turn = np.linspace(1, 1 + rng.uniform(2, 5), n if rng.random() < 0.5 else 60)
    x, y = np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)
    return np.stack([0.5 + 0.45 * turn / turn[-1] * x, 0.5 + 0.45 * turn / turn[-1] * y, 0 * turn], axis=1)


def zigzag(rng, n=12):
    x = np.where(np.arange(n) % 2, 0.1, 0.9) + rng.uniform(-0.05, 0.05, n)
    return np.stack([x, np.linspace(0.05, 0.95, n), 0 * x], axis=1)


def scattered(rng):
    """The unit square in triangles of all sizes and shapes, slivers among them."""
    points = np.concatenate([[[0, 0], [1, 0], [1, 1], [0, 1]], rng.random((rng.integers(4, 80), 2)) ** 2])
    faces = Delaunay(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces[area < 0] = faces[area < 0][:, [0, 2, 1]]
    return np.c_[points, np.zeros(len(points))], faces


def planks(rng):
    """The unit square in a few columns of long thin triangles."""
    vertices, faces = sheet(4, 30)
    vertices[:, 0] = np.concatenate([[0], np.sort(rng.random(3)), [1]])[np.round(vertices[:, 0] * 4).astype(int)]
    return vertices, faces


def area(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def distance_from_line(points, line, is_closed):
    after = np.roll(line, -1, axis=0) if is_closed else line[1:]
    every = np.concatenate([line, after])
    k = np.arange(len(after))
    foot = closest_faces(points, every, np.stack([k, len(line) + k, len(line) + k], axis=1))[1]
    return np.linalg.norm(foot - points, axis=1)


def hold(made, vertices, faces, curve, *, within):
    """The promises of `embed_curve`; the path is no further than ``within`` from the curve and back."""
    assert np.array_equal(made.vertices[: len(vertices)], vertices)
    twins = find_twins(made.faces, len(made.vertices))
    check_manifold_vertices(made.faces, twins, len(made.vertices))
    assert area(made.vertices, made.faces) == pytest.approx(area(vertices, faces), rel=1e-9)
    assert len(np.unique(made.path)) == len(made.path)
    edges = {frozenset(edge) for face in made.faces.tolist() for edge in zip(face, face[1:] + face[:1])}
    steps = list(zip(made.path.tolist(), np.roll(made.path, -1).tolist()))
    assert edges.issuperset(map(frozenset, steps if made.is_closed else steps[:-1]))
    old, new = border_loops(faces, find_twins(faces, len(vertices))), border_loops(made.faces, twins)
    assert len(old) == len(new)
    for before, after in zip(old, new):
        assert [v for v in after.tolist() if v < len(vertices)] == before.tolist()
        assert distance_from_line(made.vertices[after], vertices[before], True).max() < 1e-12
    assert distance_from_line(made.vertices[made.path], curve, False).max() <= within
    assert distance_from_line(curve, made.vertices[made.path], made.is_closed).max() <= within


@pytest.mark.parametrize("seed", range(100))
def test_curves_of_all_kinds_come_to_lie_in_meshes_of_all_kinds(seed):
    rng = np.random.default_rng(seed)
    mesh = (lambda _: sheet(int(rng.integers(1, 16))), scattered, planks)[seed % 3]
    curve = (doodle, spiral, zigzag)[seed // 3 % 3](rng)
    vertices, faces = mesh(rng)
    made = embed_curve(vertices, faces, curve)
    hold(made, vertices, faces, curve, within=0.02)
    assert made.is_closed == (seed // 3 % 3 == 0)
    assert made.deviation < 0.02


@pytest.mark.parametrize("seed", range(6))
def test_the_same_curve_gives_the_same_bytes(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = scattered(rng)
    curve = doodle(rng)
    made, again = (embed_curve(vertices, faces, curve) for _ in range(2))
    assert made.vertices.tobytes() == again.vertices.tobytes()
    assert made.faces.tobytes() == again.faces.tobytes()
    assert made.path.tobytes() == again.path.tobytes()


@pytest.mark.parametrize("seed", range(6))
def test_the_place_and_the_size_of_it_all_change_nothing(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = scattered(rng)
    curve = spiral(rng)
    scale, away = 10.0 ** rng.uniform(-3, 3), rng.normal(size=3) * 1e4
    made = embed_curve((vertices + away) * scale, faces, (curve + away) * scale)
    hold(made, (vertices + away) * scale, faces, (curve + away) * scale, within=0.02 * scale)


@pytest.mark.parametrize("n", [1, 2, 4, 7])
@pytest.mark.parametrize(
    "curve",
    [
        [[0, 0.5, 0], [1, 0.5, 0]],
        [[0, 0, 0], [1, 1, 0]],
        [[1, 0, 0], [0, 1, 0]],
        [[0.25, 0.25, 0], [0.75, 0.25, 0], [0.75, 0.75, 0], [0.25, 0.75, 0], [0.25, 0.25, 0]],
    ],
)
def test_what_runs_along_edges_and_through_vertices_is_exact(n, curve):
    vertices, faces = sheet(n)
    hold(embed_curve(vertices, faces, np.array(curve)), vertices, faces, np.array(curve), within=1e-12)


def test_kinks_and_ends_stay_where_they_are():
    vertices, faces = sheet(9)
    curve = zigzag(np.random.default_rng(4))
    made = embed_curve(vertices, faces, curve)
    for corner in curve:
        assert np.linalg.norm(made.vertices[made.path] - corner, axis=1).min() < 1e-4
    assert np.allclose(made.vertices[made.path[[0, -1]]], curve[[0, -1]], rtol=0, atol=1e-4)


def test_a_quad_is_refined_only_along_a_curve_that_bends_more_than_it():
    vertices, faces = sheet(1)
    turn = np.linspace(0, 2 * np.pi, 500)
    curve = np.stack([0.7 + 0.05 * np.cos(turn), 0.3 + 0.05 * np.sin(turn), 0 * turn], axis=1)
    made = embed_curve(vertices, faces, curve)
    hold(made, vertices, faces, curve, within=5e-4)
    assert len(made.path) > 30
    assert len(made.faces) < 1000
    assert len(embed_curve(vertices, faces, np.array([[0.2, 0.3, 0], [0.9, 0.4, 0]])).faces) < 10


def test_a_curve_far_denser_than_the_mesh_leaves_no_crowd_of_points():
    vertices, faces = sheet(8)
    curve = np.stack([np.linspace(0.1, 0.9, 20_000), np.full(20_000, 0.37), np.zeros(20_000)], axis=1)
    made = embed_curve(vertices, faces, curve)
    hold(made, vertices, faces, curve, within=0.006)
    assert len(made.path) < 40


def test_on_closed_surfaces_a_few_points_tell_where_a_loop_runs():
    vertices, faces = ball(4)
    turn = 2 * np.pi * np.arange(9) / 8
    curve = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * 0.995
    made = embed_curve(vertices, faces, curve)
    assert made.is_closed
    place = made.vertices[made.path]
    assert np.abs(place[:, 2]).max() < 0.01
    assert len(np.unique(np.floor(np.arctan2(place[:, 1], place[:, 0]) / (np.pi / 16)))) >= 32
    vertices, quads = torus(48, 24)
    meridian = np.stack([3 + np.cos(turn), 0 * turn, np.sin(turn)], axis=1) @ np.array(
        [[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]]
    )
    made = embed_curve(vertices, triangles(quads), meridian)
    assert made.is_closed
    assert np.unwrap(np.arctan2(*made.vertices[made.path][:, 1::-1].T)).std() < 0.02


class TestBesideTheBorder:
    def test_ends_near_a_border_are_put_on_it(self):
        vertices, faces = sheet(10)
        made = embed_curve(vertices, faces, np.array([[0.004, 0.33, 0], [0.995, 0.61, 0]]))
        ends = made.vertices[made.path[[0, -1]]]
        assert ends[:, 0].tolist() == [0, 1]
        assert not made.is_closed
        short = embed_curve(vertices, faces, np.array([[0.03, 0.33, 0], [0.97, 0.61, 0]]))
        assert np.allclose(short.vertices[short.path[[0, -1]]][:, 0], [0.03, 0.97])
        told = embed_curve(vertices, faces, np.array([[0.03, 0.33, 0], [0.97, 0.61, 0]]), tolerance=0.04)
        assert told.vertices[told.path[[0, -1]]][:, 0].tolist() == [0, 1]

    @pytest.mark.parametrize("is_turned", [False, True])
    def test_a_curve_along_a_border_becomes_that_stretch_with_the_surface_on_its_left(self, is_turned):
        vertices, faces = sheet(10)
        curve = np.array([[0.33, 0.002, 0], [0.7, 0.0, 0], [1, 0, 0], [0.999, 0.5, 0]])
        made = embed_curve(vertices, faces, curve[::-1] if is_turned else curve)
        hold(made, vertices, faces, curve, within=0.003)
        place = made.vertices[made.path]
        assert np.allclose(place[[0, -1]], [[0.33, 0, 0], [1, 0.5, 0]])
        assert len(place) == 1 + 7 + 5  # the end that is no vertex of old, then those of the grid

    def test_both_ends_may_lie_on_one_edge(self):
        vertices, faces = sheet(2)
        made = embed_curve(vertices, faces, np.array([[0.1, 0, 0], [0.4, 0, 0]]))
        assert made.vertices[made.path].tolist() == [[0.1, 0, 0], [0.4, 0, 0]]

    def test_a_curve_round_a_whole_border_is_that_border(self):
        vertices, faces = sheet(6)
        curve = np.array([[0.5, 0, 0], [0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0], [0.5, 0, 0]])
        made = embed_curve(vertices, faces, curve)
        assert made.is_closed
        assert made.path.tolist() == border_loops(faces, find_twins(faces, len(vertices)))[0].tolist()
        assert np.array_equal(made.faces, faces)

    @pytest.mark.parametrize(
        ("curve", "told"),
        [
            ([[0, 0, 0], [0.6, 0, 0], [0.6, 0.5, 0]], "runs along a border in part"),
            ([[0.2, 0.5, 0], [0.5, 0, 0], [0.8, 0.5, 0]], "touches a border between its ends"),
        ],
    )
    def test_a_border_is_not_met_in_passing(self, curve, told):
        with pytest.raises(BadCurve, match=told):
            embed_curve(*sheet(10), np.array(curve, float))


class TestRefusals:
    @pytest.mark.parametrize(
        ("curve", "told"),
        [
            ([[0.2, 0.2, 0.5], [0.8, 0.8, 0.5]], r"0\.5 off the surface.*unit"),
            ([[0.2, 0.2, 0], [0.8, 0.8, 0], [0.8, 0.2, 0], [0.2, 0.8, 0]], "crosses or touches itself"),
            ([[0.2, 0.2, 0], [0.8, 0.2, 0], [0.5, 0.2, 0], [0.5, 0.8, 0]], "crosses or touches itself"),
            ([[0.2, 0.2, 0], [0.2, 0.2, 0]], "without length"),
            ([[0.5, 0.5, 0]], "without length"),
            ([[0.2, 0.2, 0], [0.201, 0.2, 0]], "is too short for a mesh"),
            ([[0.2, 0.2], [0.8, 0.8]], r"got \(2, 2\)"),
        ],
    )
    def test_no_path_is_made_of_what_is_no_line_on_the_surface(self, curve, told):
        with pytest.raises(BadCurve, match=told):
            embed_curve(*sheet(10), np.array(curve))

    def test_coordinates_must_be_finite(self):
        with pytest.raises(NonFinite, match="point 1"):
            embed_curve(*sheet(4), np.array([[0.2, 0.2, 0], [np.nan, 0, 0], [0.8, 0.8, 0]]))

    def test_other_paths_are_neither_crossed_nor_split(self):
        vertices, faces = sheet(10)
        first = embed_curve(vertices, faces, np.array([[0.1, 0.33, 0], [0.9, 0.47, 0]]))
        fixed = np.stack([first.path[:-1], first.path[1:]], axis=1)
        with pytest.raises(BadCurve, match="crosses or touches another"):
            embed_curve(first.vertices, first.faces, np.array([[0.5, 0.1, 0], [0.5, 0.9, 0]]), fixed=fixed)
        beside = np.array([[0.1, 0.335, 0], [0.9, 0.475, 0]])
        second = embed_curve(first.vertices, first.faces, beside, fixed=fixed)
        assert not np.isin(second.path, first.path).any()
        hold(second, first.vertices, first.faces, beside, within=0.006)


def test_a_kink_between_long_thin_faces_is_not_overshot():
    vertices, faces = sheet(4, 59)
    vertices[:, 0] = np.array([0, 0.3601, 0.4918, 0.7094, 1])[np.round(vertices[:, 0] * 4).astype(int)]
    turn = np.linspace(1, 9, 60)
    reach = 0.45 * turn / turn[-1]
    curve = np.stack([0.5 + reach * np.cos(2 * np.pi * turn), 0.5 + reach * np.sin(2 * np.pi * turn), 0 * turn], axis=1)
    hold(embed_curve(vertices, faces, curve), vertices, faces, curve, within=0.01)


@pytest.mark.parametrize("seed", range(8))
def test_a_hand_that_trembles_draws_the_line_that_was_meant(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(12)
    meant = doodle(rng, 800)
    drawn = meant + rng.normal(size=meant.shape) * 0.002
    drawn[-1] = drawn[0]
    made = embed_curve(vertices, faces, drawn)
    assert made.is_closed
    hold(made, vertices, faces, drawn * [1, 1, 0], within=0.02)
    assert distance_from_line(made.vertices[made.path], meant, False).max() < 0.02
