"""Borders that are none: almost equal vertices, vertices that two fans share."""

import numpy as np
import pytest

from raw_meshes import grid, loose, moved, together, triangles
from weavecore.errors import TooFarFromOrigin
from weavecore.model.notes import Note
from weavecore.reading import surface_from_arrays


def codes(surface):
    return [note.code for note in surface.notes]


def noted(surface, code):
    return next(note for note in surface.notes if note.code == code)


def dome(n=12, size=100.0):
    vertices, quads = grid(n, n)
    vertices = (vertices / n - [0.5, 0.5, 0.0]) * size
    vertices[:, 2] = size / 8 * (1 - (2 * vertices[:, :2] / size) ** 2).prod(1)
    return vertices, triangles(quads)


class TestNearVertices:
    def test_a_soup_whose_last_digits_differ_becomes_one_piece(self):
        vertices, faces = loose(*dome())
        shaken = vertices + np.random.default_rng(5).integers(-1, 2, vertices.shape) * 1e-5
        surface = surface_from_arrays(shaken, faces)
        assert (len(surface.borders), surface.n_vertices, surface.euler_characteristic) == (1, 169, 1)
        assert dict(noted(surface, "WELDED").numbers)["distance"] < 1e-4

    def test_a_seam_apart_by_less_than_the_tolerance_closes_and_a_wider_one_does_not(self):
        vertices, faces = dome()
        left, right = faces[vertices[faces].mean(1)[:, 0] < 0], faces[vertices[faces].mean(1)[:, 0] > 0]
        both = together((vertices, left), (moved(vertices, 0.0005, 0, 0), right))
        assert len(surface_from_arrays(*both, tolerance=0.001).borders) == 1
        assert len(surface_from_arrays(*both, tolerance=0.0).borders) == 2

    def test_a_weld_that_crowds_an_edge_is_undone(self):
        vertices, quads = grid(6, 1)
        sheets = [vertices, vertices * [1, -1, 1] + [0, -0.0002, 0], vertices[:, [0, 2, 1]] + [0, 0.0002, 0]]
        surface = surface_from_arrays(*together(*((sheet, quads) for sheet in sheets)), tolerance=0.001)
        assert len(surface.borders) == 3

    def test_a_fine_mesh_in_a_coarse_file_keeps_its_vertices(self):
        vertices, faces = dome(size=1e-3)
        assert surface_from_arrays(vertices, faces, tolerance=0.01).n_vertices == len(vertices)


class TestSharedVertices:
    def test_a_vertex_that_two_fans_share_is_split(self):
        vertices, quads = grid(2, 2)
        surface = surface_from_arrays(vertices, quads[[0, 3]])
        assert (surface.n_vertices, len(surface.borders)) == (8, 2)
        note = noted(surface, "SPLIT")
        assert note.points == ((1.0, 1.0, 0.0),)
        assert dict(note.numbers) == {"count": 1.0}
        assert not note.is_doubt

    def test_two_openings_that_share_a_corner_become_one(self):
        vertices, quads = grid(5, 5)
        keep = np.delete(np.arange(25), [6, 12])
        surface = surface_from_arrays(vertices, quads[keep])
        assert len(surface.borders) == 2
        assert "WELDED" not in codes(surface)


class TestFarCoordinates:
    def test_coordinates_that_went_through_single_precision_are_refused_far_away(self):
        vertices, faces = dome()
        far = moved(vertices, 5e6, 4e7, 0).astype(np.float32).astype(float)
        with pytest.raises(TooFarFromOrigin) as refused:
            surface_from_arrays(far, faces)
        assert "origin" in refused.value.remedy

    def test_whole_numbers_far_away_are_exact(self):
        vertices, quads = grid()
        surface = surface_from_arrays(vertices * 1000 + [2.0**20, 0, 0], quads)
        assert codes(surface) == ["TRIANGULATED"]

    def test_steps_that_edges_show_are_a_doubt(self):
        vertices, faces = dome()
        far = moved(vertices, 4e5, 0, 0).astype(np.float32).astype(float)
        assert noted(surface_from_arrays(far, faces), "FAR").is_doubt

    def test_doubles_far_away_pass(self):
        vertices, faces = dome()
        assert codes(surface_from_arrays(moved(vertices, 5e6, 4e7, 0), faces)) == []


def test_a_note_keeps_eight_places_and_an_unknown_code_is_refused():
    assert len(Note("SLIT", "Slits.", {"count": 20}, np.zeros((20, 3))).points) == 8
    with pytest.raises(ValueError, match="no note"):
        Note("ODD", "Odd.")


def strip_dome(n, m, keep):
    """One half of a dome, n by m quads, on one side of x = 0."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(-1, 1, m + 1))
    vertices = np.stack([keep * x.ravel(), y.ravel(), 0.25 * (1 - x.ravel() ** 2) * (1 - y.ravel() ** 2)], axis=1)
    _, quads = grid(n, m)
    return vertices * 100, triangles(quads)


class TestStitching:
    @pytest.mark.parametrize("other", [13, 16, 18, 24])
    def test_a_curved_seam_divided_differently_on_its_sides_closes(self, other):
        surface = surface_from_arrays(*together(strip_dome(6, 12, -1), strip_dome(6, other, 1)))
        assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
        assert dict(noted(surface, "STITCHED").numbers)["count"] > 0

    def test_a_vertex_on_the_edge_of_a_neighbour_leaves_no_slit(self):
        vertices, faces = triangles_with_a_hanging_vertex()
        surface = surface_from_arrays(vertices, faces)
        assert len(surface.borders) == 1
        assert noted(surface, "STITCHED").points == ((0.5, 1.0, 0.0),)

    def test_a_narrow_slit_with_an_area_stays(self):
        vertices, quads = grid(4, 4)
        keep = np.delete(np.arange(16), [5, 6])
        vertices[[11, 12, 13], 1] = 1.05
        surface = surface_from_arrays(vertices, quads[keep])
        assert len(surface.borders) == 2
        assert "STITCHED" not in codes(surface)


def triangles_with_a_hanging_vertex():
    vertices = grid(1, 2)[0]
    vertices = np.concatenate([vertices, [[0.5, 1.0, 0.0]]])
    return vertices, np.array([[0, 1, 6], [0, 6, 2], [1, 3, 6], [2, 3, 5], [2, 5, 4]])


class TestSheetsThatAreThereTwice:
    @pytest.mark.parametrize("is_soup", [False, True])
    @pytest.mark.parametrize("is_turned", [False, True])
    def test_the_second_is_left_out_whatever_its_diagonals(self, is_soup, is_turned):
        vertices, faces = dome()
        quads = grid(12, 12)[1]
        other = np.concatenate([quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]])
        both = together((vertices, faces), (vertices, other[:, ::-1] if is_turned else other))
        surface = surface_from_arrays(*(loose(*both) if is_soup else both))
        assert (surface.n_faces, len(surface.borders)) == (288, 1)
        assert dict(noted(surface, "COINCIDENT").numbers)["count"] == 288
        assert noted(surface, "COINCIDENT").is_doubt

    def test_a_patch_on_a_sheet_is_left_out(self):
        vertices, faces = dome()
        patch = grid(5, 3)[0] * 3 + [1.3, 2.1, 0]
        flat = vertices * [1, 1, 0]
        surface = surface_from_arrays(*together((flat, faces), (patch, triangles(grid(5, 3)[1]))))
        assert surface.n_faces == 288

    def test_sheets_that_overlap_in_part_are_kept_and_not_joined(self):
        vertices, quads = grid(6, 4)
        both = together((vertices, quads), (moved(vertices, 2.4, 0, 0), quads))
        surface = surface_from_arrays(*both)
        assert len(surface.borders) == 2
        assert "they are kept" in noted(surface, "COINCIDENT").text

    def test_two_plates_apart_are_not_the_same(self):
        vertices, quads = grid(6, 4)
        assert "COINCIDENT" not in codes(
            surface_from_arrays(*together((vertices, quads), (moved(vertices, 0, 0, 0.01), quads)))
        )
