"""What is mended on the way in, and what is told of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from raw_meshes import area, ball, band, grid, loose, moved, together, torus, triangles, volume
from weavecore.errors import BadIndex, Degenerate, NonFinite, NonManifold, NotOrientable, TooFarFromOrigin
from weavecore.model.notes import texts_of
from weavecore.reading import surface_from_arrays


def said(surface):
    return " ".join(texts_of(surface.notes))


class TestWelding:
    def test_a_loose_sheet_becomes_one_piece(self):
        vertices, quads = grid(5, 4)
        surface = surface_from_arrays(*loose(vertices, triangles(quads)))
        assert (surface.n_vertices, surface.n_faces, len(surface.borders)) == (30, 40, 1)
        assert "Welded 90 vertices" in said(surface)

    def test_zero_and_minus_zero_are_one_place(self):
        vertices, quads = grid(4, 1)
        vertices, faces = loose(vertices - [2, 0, 0], triangles(quads))
        vertices[::2] = np.where(vertices[::2] == 0, -0.0, vertices[::2])
        assert surface_from_arrays(vertices, faces).n_vertices == 10

    def test_a_clean_mesh_comes_back_as_it_was(self):
        vertices, faces = ball(2)
        faces = faces[vertices[faces].mean(1)[:, 2] > 0.1]
        used = np.unique(faces)
        vertices, faces = vertices[used], np.searchsorted(used, faces)
        surface = surface_from_arrays(vertices, faces)
        assert np.array_equal(surface.vertices, vertices)
        assert np.array_equal(surface.faces, faces)
        assert texts_of(surface.notes) == ()

    def test_unused_vertices_are_dropped_and_told(self):
        vertices, quads = grid()
        surface = surface_from_arrays(np.insert(vertices, 0, [9.0, 9, 9], axis=0), quads + 1)
        assert np.array_equal(surface.vertices, vertices)
        assert "Dropped 1 vertex that no face uses." in texts_of(surface.notes)

    def test_sheets_that_touch_in_one_place_stay_two(self):
        vertices, quads = grid(2, 2)
        surface = surface_from_arrays(*together((vertices, quads), (moved(vertices, 2, 2, 0), quads)))
        assert len(surface.borders) == 2
        assert surface.n_vertices == 18
        assert "Left 1 vertex apart" in said(surface)

    def test_closed_bodies_that_lie_against_each_other_stay_two(self):
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        box = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
        surface = surface_from_arrays(*together((corners, box), (moved(corners, 1, 0, 0), box)))
        assert surface.component_of_face.max() == 1
        assert surface.euler_characteristic == 4

    def test_a_copy_in_the_same_place_is_dropped(self):
        sheet = grid()
        surface = surface_from_arrays(*together(sheet, sheet))
        assert surface.n_faces == 24
        assert "repeat others" in said(surface)

    def test_a_face_given_twice_is_dropped(self):
        vertices, quads = grid()
        faces = triangles(quads)
        surface = surface_from_arrays(vertices, np.concatenate([faces, faces[3:4, [1, 2, 0]], faces[5:6, ::-1]]))
        assert np.array_equal(surface.faces, faces)
        assert "Dropped 2 faces that repeat others." in texts_of(surface.notes)

    @given(st.integers(0, 2**32 - 1))
    def test_numbering_changes_nothing_but_the_numbers(self, seed):
        vertices, quads = grid(4, 3)
        vertices[:, 0] += 0.3 * vertices[:, 1] + 0.05 * vertices[:, 1] ** 2
        start = surface_from_arrays(vertices, quads)
        rng = np.random.default_rng(seed)
        shuffle, turn = rng.permutation(len(vertices)), rng.integers(0, 4, len(quads))
        where = np.argsort(shuffle)
        turned = where[quads][np.arange(len(quads))[:, None], (turn[:, None] + np.arange(4)) % 4]
        other = surface_from_arrays(vertices[shuffle], turned[rng.permutation(len(quads))])

        def as_set(surface):
            return {frozenset(map(tuple, corners)) for corners in surface.vertices[surface.faces].tolist()}

        assert as_set(start) == as_set(other)


class TestQuads:
    def test_both_ways_to_write_a_triangle_among_quads(self):
        vertices = grid(2, 1)[0]
        for last in (4, -1):
            surface = surface_from_arrays(vertices, [[0, 1, 4, last], [1, 2, 5, 4], [0, 4, 3, 3]])
            assert surface.n_faces == 4
            assert "Split 1 quad " in said(surface)

    def test_the_diagonal_with_the_larger_least_angle_is_taken(self):
        kite = np.array([[0, 0, 0], [1, -0.2, 0], [3, 0, 0], [1, 0.2, 0]])
        assert surface_from_arrays(kite, [[0, 1, 2, 3]]).faces.tolist() == [[0, 1, 3], [1, 2, 3]]
        assert surface_from_arrays(kite, [[1, 2, 3, 0]]).n_faces == 2

    def test_a_dart_is_not_folded(self):
        dart = np.array([[0, 0, 0], [2, -2, 0], [0.5, 0, 0], [2, 2, 0]], float)
        for turn in range(4):
            quad = np.roll([0, 1, 2, 3], turn)
            surface = surface_from_arrays(dart, [quad])
            assert area(surface.vertices, surface.faces) == pytest.approx(1.0)

    def test_a_square_is_split_alike_however_it_is_turned_in_space(self):
        square = grid(1, 1)[0]
        for angle in np.linspace(0, 3, 40):
            c, s = np.cos(angle), np.sin(angle)
            turned = square @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
            assert surface_from_arrays(turned, [[0, 1, 3, 2]]).faces.tolist() == [[0, 1, 3], [0, 3, 2]]


class TestFacesWithoutArea:
    def test_a_face_with_two_corners_in_one_place_leaves_no_crack(self):
        vertices = grid(2, 1)[0]
        vertices = np.concatenate([vertices, vertices[1:2]])
        faces = [[0, 1, 4], [0, 4, 3], [6, 2, 5], [6, 5, 4], [1, 6, 4]]
        surface = surface_from_arrays(vertices, faces)
        assert (surface.n_faces, len(surface.borders), surface.n_vertices) == (4, 1, 6)
        assert "Dropped 1 face without area." in texts_of(surface.notes)

    def test_a_cap_is_flipped_so_that_no_slit_opens(self):
        vertices = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, -1, 0], [1.5, -1, 0]], float)
        faces = [[0, 1, 3], [0, 2, 1], [0, 4, 2], [2, 5, 1], [4, 5, 2]]
        surface = surface_from_arrays(vertices, faces)
        assert len(surface.borders) == 1
        assert surface.n_faces == 5
        assert surface.euler_characteristic == 1
        assert area(surface.vertices, surface.faces) == pytest.approx(2.5)

    def test_a_cap_on_the_border_is_dropped(self):
        vertices = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [0.5, -1, 0], [1.5, -1, 0]], float)
        surface = surface_from_arrays(vertices, [[0, 2, 1], [0, 3, 2], [2, 4, 1], [3, 4, 2]])
        assert (surface.n_faces, len(surface.borders)) == (3, 1)

    @pytest.mark.parametrize("n", [3, 20])
    def test_a_chain_of_caps_is_flipped_through(self, n):
        along = np.linspace(0, 1, n + 1)
        line = np.stack([along, 0 * along, 0 * along], axis=1)
        vertices = np.concatenate([line, [[0.4, 1, 0], [0.6, -1, 0]]])
        caps = [[0, k + 1, k] for k in range(1, n)]
        below = [[k + 1, k, n + 2] for k in range(n)]
        surface = surface_from_arrays(vertices, [[0, n, n + 1], *caps, *below])
        assert len(surface.borders) == 1
        assert surface.n_faces == 2 * n
        assert area(surface.vertices, surface.faces) == pytest.approx(1.0)

    def test_a_needle_no_wider_than_the_last_bit_is_closed(self):
        vertices = grid(2, 1)[0]
        vertices = np.concatenate([vertices, moved(vertices[1:2], 2**-52, 0, 0)])
        faces = [[0, 1, 4], [0, 4, 3], [6, 2, 5], [6, 5, 4], [1, 6, 4]]
        surface = surface_from_arrays(vertices, faces)
        assert (surface.n_faces, surface.n_vertices, len(surface.borders)) == (4, 6, 1)

    def test_nothing_left_is_refused(self):
        with pytest.raises(Degenerate):
            surface_from_arrays([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
        with pytest.raises(Degenerate):
            surface_from_arrays(np.zeros((3, 3)), [[0, 1, 2]])
        with pytest.raises(Degenerate):
            surface_from_arrays(np.empty((0, 3)), np.empty((0, 3), int))


class TestOrientation:
    def test_the_side_of_most_faces_is_kept(self):
        vertices, quads = grid(5, 5)
        faces = triangles(quads)
        mixed = faces.copy()
        mixed[::3] = mixed[::3, ::-1]
        surface = surface_from_arrays(vertices, mixed)
        assert (surface.face_normals[:, 2] > 0).all()
        assert "Reversed 17 faces" in said(surface)
        surface = surface_from_arrays(vertices, mixed[:, ::-1])
        assert (surface.face_normals[:, 2] < 0).all()

    def test_each_part_is_turned_by_itself(self):
        vertices, quads = grid(3, 3)
        surface = surface_from_arrays(*together((vertices, quads), (moved(vertices, 9, 0, 0), quads[:, ::-1])))
        up = surface.face_normals[:, 2] > 0
        assert up[surface.component_of_face == 0].all()
        assert not up[surface.component_of_face == 1].any()
        assert "Reversed" not in said(surface)

    def test_closed_parts_look_outwards(self):
        vertices, faces = ball(2)
        inside_out = faces[:, ::-1].copy()
        inside_out[7] = inside_out[7, ::-1]
        surface = surface_from_arrays(moved(vertices, 50, 60, 70), inside_out)
        assert volume(surface.vertices - [50, 60, 70], surface.faces) > 3
        assert "face outwards" in said(surface)
        assert "Reversed 1 face to orient all alike." in texts_of(surface.notes)

    def test_a_moebius_strip_is_refused_with_faces_to_cut_along(self):
        vertices, quads = band(14, twisted=True)
        with pytest.raises(NotOrientable) as refused:
            surface_from_arrays(vertices, quads)
        bad = list(refused.value.ids)
        assert refused.value.kind == "face"
        assert 0 < len(bad) < 14
        assert surface_from_arrays(vertices, np.delete(quads, bad, axis=0)).n_faces == 2 * (14 - len(bad))

    def test_a_band_is_fine(self):
        assert len(surface_from_arrays(*band(14)).borders) == 2


class TestRefusals:
    def test_three_faces_on_an_edge(self):
        vertices = grid(2, 1)[0]
        fin = [[1.0, 0.5, 2.0]]
        with pytest.raises(NonManifold) as refused:
            surface_from_arrays(np.concatenate([vertices, fin]), [[0, 1, 4], [1, 2, 4], [1, 4, 6], [0, 4, 3]])
        assert refused.value.ids == (0, 1, 2)
        assert refused.value.kind == "face"

    def test_three_loose_sheets_along_one_line(self):
        vertices, quads = grid(1, 1)
        up = vertices[:, [2, 1, 0]]
        with pytest.raises(NonManifold):
            surface_from_arrays(*together((vertices, quads), (vertices * [-1, 1, 1], quads), (up, quads)))

    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    def test_coordinates_that_are_not_finite(self, bad):
        vertices, quads = grid()
        vertices[7, 1] = bad
        with pytest.raises(NonFinite) as refused:
            surface_from_arrays(vertices, quads)
        assert refused.value.ids == (7,)

    @pytest.mark.parametrize("bad", [-2, 20, 2**40])
    def test_indices_out_of_range(self, bad):
        vertices, quads = grid()
        quads[5, 2] = bad
        with pytest.raises(BadIndex) as refused:
            surface_from_arrays(vertices, quads)
        assert refused.value.ids == (5,)

    def test_minus_one_is_allowed_only_as_a_fourth_corner(self):
        vertices, quads = grid()
        quads[5, 1] = -1
        with pytest.raises(BadIndex):
            surface_from_arrays(vertices, quads)

    def test_faces_are_named_as_the_caller_numbers_them(self):
        vertices = grid(2, 1)[0]
        with pytest.raises(NonManifold) as refused:
            surface_from_arrays(
                np.concatenate([vertices, [[1.0, 0.5, 2.0]]]),
                [[0, 1, 4], [1, 2, 4], [1, 4, 6]],
                face_ids=np.array([10, 20, 30]),
            )
        assert refused.value.ids == (10, 20, 30)

    def test_too_far_from_the_origin_for_its_edges(self):
        vertices, quads = grid(8, 8)
        assert surface_from_arrays(moved(vertices, 1e9, -1e9, 0), quads).n_faces == 128
        with pytest.raises(TooFarFromOrigin):
            surface_from_arrays(moved(vertices, 1e15, 0, 0), quads)
        with pytest.raises(TooFarFromOrigin):
            surface_from_arrays(vertices * 1e60, quads)
        with pytest.raises(TooFarFromOrigin):
            surface_from_arrays(moved(vertices, 1e6, 0, 0), quads, epsilon=float(np.finfo(np.float32).eps))

    @pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e6, 1e9])
    def test_the_unit_does_not_matter(self, scale):
        vertices, quads = torus(10, 6)
        surface = surface_from_arrays(vertices * scale, quads)
        assert surface.n_faces == surface_from_arrays(vertices, quads).n_faces

    def test_the_callers_arrays_are_not_changed(self):
        vertices, quads = grid()
        kept = vertices.copy(), quads.copy()
        surface_from_arrays(vertices, quads)
        assert np.array_equal(vertices, kept[0])
        assert np.array_equal(quads, kept[1])
