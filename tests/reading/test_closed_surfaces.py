"""Closed surfaces cut in two: by a plane that is given, or by themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from raw_meshes import area, ball, grid, together, torus, triangles, volume
from weavecore.errors import Degenerate
from weavecore.geometry.halfedges import components
from weavecore.model import SurfaceMesh
from weavecore.model.notes import texts_of
from weavecore.reading import surface_from_arrays


def sides(surface: SurfaceMesh):
    """Areas of the pieces that the cuts part."""
    n, piece = components(surface.twins, surface.is_cut)
    corners = surface.vertices[surface.faces]
    faces = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    return np.bincount(piece, faces, minlength=n)


def lengths(surface: SurfaceMesh):
    loops = [surface.vertices[loop] for loop in surface.cuts]
    return [float(np.linalg.norm(np.roll(p, -1, axis=0) - p, axis=1).sum()) for p in loops]


def least_angle(surface: SurfaceMesh):
    corners = surface.vertices[surface.faces]
    a, b = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), (a * b).sum(2)).min())


def hold(surface: SurfaceMesh, vertices, faces):
    """The cut is made of edges, its loops share no vertex, and the shape is as it was."""
    assert surface.is_closed
    assert surface.edge_lengths.min() > 0
    loops = np.concatenate(surface.cuts)
    assert len(np.unique(loops)) == len(loops)
    assert surface.is_cut.sum() == 2 * len(loops)
    assert area(surface.vertices, surface.faces) == pytest.approx(area(vertices, faces))
    assert volume(surface.vertices, surface.faces) == pytest.approx(volume(vertices, faces))
    assert np.array_equal(surface.vertices[: len(vertices)], vertices)


class TestByAPlane:
    def test_a_ball_has_one_loop_in_the_plane(self):
        vertices, faces = ball(4)
        surface = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0.31], [0.2, 0.1, 2]))
        hold(surface, vertices, faces)
        assert len(surface.cuts) == 1
        assert len(sides(surface)) == 2
        normal = np.array([0.2, 0.1, 2]) / np.linalg.norm([0.2, 0.1, 2])
        off = (surface.vertices[surface.cuts[0]] - [0, 0, 0.31]) @ normal
        assert np.abs(off).max() < 0.1 * np.median(surface.edge_lengths)
        assert least_angle(surface) > 1.5

    def test_a_torus_cut_flat_has_two_loops(self):
        vertices, faces = torus()
        surface = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0.1], [0, 0, 1]))
        assert surface.euler_characteristic == 0
        assert sorted(lengths(surface)) == pytest.approx([2 * np.pi * 2, 2 * np.pi * 4], rel=0.03)

    def test_a_plane_through_vertices_makes_no_new_ones(self):
        vertices, faces = ball(3)
        surface = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0], [0, 0, 1]))
        assert surface.n_vertices == len(vertices)
        assert np.abs(surface.vertices[surface.cuts[0], 2]).max() == 0

    def test_the_side_that_the_normal_points_to_is_on_the_left_of_the_cut(self):
        vertices, faces = ball(3)
        for up in (1, -1):
            (loop,) = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0.1], [0, 0, up])).cuts
            p = np.concatenate([vertices, np.empty((0, 3))])
            p = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0.1], [0, 0, up])).vertices[loop]
            turn = np.cross(p, np.roll(p, -1, axis=0)).sum(0)[2]
            assert np.sign(turn) == up

    def test_a_flat_face_in_the_plane_is_not_met(self):
        box = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
        with pytest.raises(Degenerate, match="intersects no closed part"):
            surface_from_arrays(box, quads, cut_plane=([0, 0, 1], [0, 0, 1]))

    def test_a_part_that_the_plane_misses_is_cut_by_itself(self):
        vertices, faces = together(ball(2), (ball(2)[0] + [5, 0, 0], ball(2)[1]))
        surface = surface_from_arrays(vertices, faces, cut_plane=([4.9, 0, 0], [1, 0, 0]))
        hold(surface, vertices, faces)
        assert len(surface.cuts) == 2
        assert len(sides(surface)) == 4

    @pytest.mark.parametrize(
        "plane", [([0, 0, 0], [0, 0, 0]), ([0, 0, 0], [0, 0, np.nan]), ([0, 0], [0, 1]), ([9, 0, 0], [1, 0, 0])]
    )
    def test_a_plane_that_is_none_or_misses_is_refused(self, plane):
        with pytest.raises(Degenerate):
            surface_from_arrays(*ball(2), cut_plane=plane)

    def test_a_plane_through_a_saddle_leaves_loops_that_do_not_touch(self):
        vertices, quads = torus(24, 12)
        surface = surface_from_arrays(vertices, quads, cut_plane=([2, 0, 0], [1, 0, 0]))
        hold(surface, vertices, triangles(quads))
        assert np.abs(vertices - [2, 0, 0]).max(1).min() < 1e-12

    def test_a_plane_in_which_a_terrace_lies_goes_along_one_side_of_it(self):
        vertices, faces = ball(4)
        terrace = (vertices[:, 2] > 0.2) & (vertices[:, 2] < 0.5)
        vertices[terrace, 2] = 0.3
        surface = surface_from_arrays(vertices, faces, cut_plane=([0, 0, 0.3], [0, 0, 1]))
        hold(surface, vertices, faces)
        assert len(sides(surface)) == 2
        assert terrace[faces].all(1).sum() > 100

    @given(st.integers(0, 2**32 - 1))
    def test_any_plane_cuts_a_rough_body_cleanly(self, seed):
        rng = np.random.default_rng(seed)
        vertices, faces = ball(3)
        vertices = np.round(vertices * (1 + 0.3 * rng.random((len(vertices), 1))), 1 + seed % 3)
        normal = rng.normal(size=3) if seed % 2 else np.eye(3)[seed % 3]
        surface = surface_from_arrays(vertices, faces, cut_plane=(np.round(rng.normal(size=3) * 0.2, 1), normal))
        hold(surface, vertices, faces)
        assert len(sides(surface)) >= 2


class TestByItself:
    def test_a_ball_is_cut_at_its_equator(self):
        vertices, faces = ball(4)
        surface = surface_from_arrays(vertices, faces)
        hold(surface, vertices, faces)
        assert lengths(surface) == pytest.approx([2 * np.pi], rel=0.02)
        assert sides(surface) == pytest.approx([2 * np.pi] * 2, rel=0.02)
        assert np.abs(surface.vertices[surface.cuts[0], 2]).max() < 0.05

    def test_a_long_body_is_cut_across_its_length_however_it_lies(self):
        vertices, faces = ball(4, (5, 1, 1.2))
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        for rotation in (np.eye(3), turn * np.sign(np.linalg.det(turn))):
            surface = surface_from_arrays(vertices @ rotation.T, faces)
            hold(surface, vertices @ rotation.T, faces)
            assert lengths(surface) == pytest.approx([6.93], rel=0.03)
            parts = sides(surface)
            assert parts.min() > 0.45 * parts.sum()

    def test_a_torus_is_cut_across_its_tube_by_two_loops(self):
        vertices, faces = torus(40, 16)
        surface = surface_from_arrays(vertices, faces)
        assert surface.euler_characteristic == 0
        assert lengths(surface) == pytest.approx([2 * np.pi] * 2, rel=0.05)
        assert sides(surface).min() > 0.45 * sides(surface).sum()

    def test_a_body_with_a_neck_is_cut_at_the_neck(self):
        vertices, faces = ball(4, (3, 1, 1))
        vertices[:, 1:] *= 0.2 + np.minimum((vertices[:, :1] - 0.5) ** 2, 0.8)
        surface = surface_from_arrays(vertices, faces)
        assert len(surface.cuts) == 1
        assert surface.vertices[surface.cuts[0]][:, 0].mean() == pytest.approx(0.5, abs=0.3)

    def test_small_bumps_get_no_loop_of_their_own(self):
        vertices, faces = ball(4, (3, 1, 1))
        spikes = np.abs(vertices[:, 0]) < 1.5
        rng = np.random.default_rng(0)
        vertices[spikes] += rng.normal(size=(int(spikes.sum()), 3)) * [0.25, 0, 0]
        surface = surface_from_arrays(vertices, faces)
        assert len(surface.cuts) == 1
        assert len(sides(surface)) == 2

    def test_each_closed_part_is_cut_and_open_ones_are_not(self):
        sheet = grid(6, 6)
        vertices, faces = together(
            ball(2), (sheet[0] + [3, 0, 0], triangles(sheet[1])), (ball(2)[0] - [5, 0, 0], ball(2)[1])
        )
        surface = surface_from_arrays(vertices, faces)
        assert len(surface.cuts) == 2
        assert len(surface.borders) == 1
        assert not np.isin(np.concatenate(surface.cuts), surface.borders[0]).any()
        assert "Cut 2 closed parts in two along 2 loops." in texts_of(surface.notes)

    def test_the_coarsest_bodies_are_cut(self):
        tetrahedron = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
        surface = surface_from_arrays(*tetrahedron)
        assert len(surface.cuts) == 1
        assert len(sides(surface)) == 2

    def test_twice_the_same_gives_the_same_bytes(self):
        first, second = (surface_from_arrays(*torus(30, 14)) for _ in range(2))
        assert first.vertices.tobytes() == second.vertices.tobytes()
        assert [loop.tobytes() for loop in first.cuts] == [loop.tobytes() for loop in second.cuts]

    @pytest.mark.parametrize("shift", [1e5, 1e7])
    def test_far_from_the_origin_it_is_cut_alike(self, shift):
        vertices, faces = ball(3, (3, 1, 1.2))
        near, far = surface_from_arrays(vertices, faces), surface_from_arrays(vertices + shift, faces)
        assert [len(loop) for loop in near.cuts] == [len(loop) for loop in far.cuts]

    def test_an_open_surface_is_left_alone(self):
        assert surface_from_arrays(*grid()).cuts == ()

    def test_a_plane_for_an_open_surface_is_told_to_be_of_no_use(self):
        surface = surface_from_arrays(*grid(), cut_plane=([2, 0, 0], [1, 0, 0]))
        assert surface.cuts == ()
        assert "The cutting plane was not used" in " ".join(texts_of(surface.notes))
