"""Borders that are none: almost equal vertices, vertices that two fans share."""

import numpy as np
import pytest

from messy_exports import MESSES
from raw_meshes import ball, grid, loose, moved, together, triangles
from tough_surfaces import TOUGH
from weavecore.errors import Degenerate, Doubtful, NonManifold, NoSurface, TooFarFromOrigin
from weavecore.model.notes import Note
from weavecore.pipeline import link, offset, refuse_doubts
from weavecore.reading import read_surface, surface_from_arrays
from weavecore.reading.raw import RawMesh, RepairOptions
from weavecore.reading.repair import repair
from weavecore.reading.thickness import note_thickness


def codes(surface):
    return [note.code for note in surface.notes]


def noted(surface, code):
    return next(note for note in surface.notes if note.code == code)


def dome(n=12, size=100.0):
    vertices, quads = grid(n, n)
    vertices = (vertices / n - [0.5, 0.5, 0.0]) * size
    vertices[:, 2] = size / 8 * (1 - (2 * vertices[:, :2] / size) ** 2).prod(1)
    return vertices, triangles(quads)


def seam(left: int, right: int, gap: float, rise: float):
    """Two halves of a sheet of 10 by 10, arched along their seam, which they divide into so many edges each."""
    halves = []
    for n, start in ((left, 0.0), (right, 5.0 + gap)):
        vertices, quads = grid(4, n)
        x, y = vertices[:, 0] * 1.25 + start, vertices[:, 1] * 10.0 / n
        halves.append((np.column_stack([x, y, rise * np.sin(np.pi * y / 10)]), triangles(quads)))
    return together(*halves)


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

    def test_sides_of_a_seam_that_stay_apart_are_doubted_with_the_weld_that_closes_them(self):
        vertices, faces = dome()
        left, right = faces[vertices[faces].mean(1)[:, 0] < 0], faces[vertices[faces].mean(1)[:, 0] > 0]
        both = together((vertices, left), (moved(vertices, 0.1, 0, 0), right))
        note = noted(surface_from_arrays(*both), "GAP")
        assert note.is_doubt
        assert "--weld 0.101" in note.text
        assert np.abs(np.array(note.points)[:, 0]).max() < 0.2
        closed = repair(RawMesh(*both), options=RepairOptions(weld=0.101))
        assert (len(closed.borders), "GAP" in codes(closed)) == (1, False)

    def test_a_soup_that_stays_one_is_doubted(self):
        vertices, faces = loose(*dome())
        shaken = vertices + np.random.default_rng(5).integers(-1, 2, vertices.shape) * 0.02
        assert dict(noted(surface_from_arrays(shaken, faces), "GAP").numbers)["count"] == len(faces)

    @pytest.mark.parametrize(
        "name", ["slits", "plate_with_holes", "hole_near_the_rim", "ring_strip", "comb", "closed_ring"]
    )
    def test_other_borders_are_no_seams(self, name):
        assert "GAP" not in codes(surface_from_arrays(*TOUGH[name](3)))

    @pytest.mark.parametrize("gap", [0.0002, 0.002, 0.005, 0.01])
    @pytest.mark.parametrize("rise", [0.0, 2.0])
    def test_sides_divided_differently_that_stay_apart_are_doubted(self, gap, rise):
        surface = surface_from_arrays(*seam(17, 29, gap, rise))
        assert len(surface.borders) == 1 or noted(surface, "GAP").is_doubt

    def test_a_seam_that_closed_in_part_is_doubted_with_the_weld_that_closes_it(self):
        both = seam(17, 29, 0.005, 2.0)
        surface = surface_from_arrays(*both)
        assert len(surface.borders) == 3
        weld = 1.01 * dict(noted(surface, "GAP").numbers)["gap"]
        assert len(repair(RawMesh(*both), options=RepairOptions(weld=weld)).borders) == 1

    def test_borders_that_touch_at_split_vertices_are_no_seams(self):
        vertices, quads = grid(12, 12)
        is_chequered = (np.arange(144) // 12 + np.arange(144) % 12) % 2 == 0
        found = codes(surface_from_arrays(vertices, triangles(quads[is_chequered])))
        assert ("SPLIT" in found, "GAP" in found) == (True, False)

    def test_a_weld_that_crowds_an_edge_is_undone(self):
        vertices, quads = grid(6, 1)
        sheets = [vertices, vertices * [1, -1, 1] + [0, -0.0002, 0], vertices[:, [0, 2, 1]] + [0, 0.0002, 0]]
        surface = surface_from_arrays(*together(*((sheet, quads) for sheet in sheets)), tolerance=0.001)
        assert len(surface.borders) == 3

    def test_faces_that_a_weld_leaves_none_of_are_degenerate(self):
        vertices, quads = grid(3, 1)
        with pytest.raises(Degenerate, match="narrower than the tolerance"):
            repair(RawMesh(vertices * [1, 0.01, 1], quads), options=RepairOptions(weld=0.02))

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


def test_a_vertex_that_also_lies_near_another_border_goes_where_it_lies_on_the_edge():
    spoiled = MESSES["t_junctions"].spoil(*TOUGH["hole_near_the_rim"](102), np.random.default_rng(3))
    surface = surface_from_arrays(*spoiled)
    assert len(surface.borders) == 2


def test_the_pointed_end_of_a_curved_slit_stays_open():
    vertices, faces = TOUGH["crumpled"](2)
    surface = surface_from_arrays(vertices, faces)
    assert "STITCHED" not in codes(surface)
    assert surface.n_faces == len(faces)


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
        assert ": kept," in noted(surface, "COINCIDENT").text

    def test_a_soup_of_two_close_sides_whose_last_digits_differ_is_one_tube(self):
        surface = surface_from_arrays(*MESSES["last_digits"].spoil(*TOUGH["pinched_tube"](7), np.random.default_rng(3)))
        assert len(surface.borders) == 2
        assert "COINCIDENT" not in codes(surface)

    def test_slender_faces_beside_a_seam_do_not_lie_on_each_other(self):
        spoiled = MESSES["other_divisions"].spoil(*TOUGH["cone"](3), np.random.default_rng(1))
        surface = surface_from_arrays(*spoiled)
        assert len(surface.borders) == 1
        assert "COINCIDENT" not in codes(surface)

    def test_two_plates_apart_are_not_the_same(self):
        vertices, quads = grid(6, 4)
        assert "COINCIDENT" not in codes(
            surface_from_arrays(*together((vertices, quads), (moved(vertices, 0, 0, 0.01), quads)))
        )


def thick_dome(thickness):
    """A dome as a solid with sharp edges at its rim."""
    vertices, faces = dome()
    n = len(vertices)
    loop = next(iter(surface_from_arrays(vertices, faces).borders))
    after = np.roll(loop, -1)
    rim = np.concatenate([np.stack([after, loop, loop + n], 1), np.stack([after, loop + n, after + n], 1)])
    return np.concatenate([vertices, vertices - [0, 0, thickness]]), np.concatenate([faces, faces[:, ::-1] + n, rim])


class TestPieces:
    def test_scraps_are_a_doubt_and_the_largest_piece_can_be_taken(self):
        vertices, faces = dome()
        both = together((vertices, faces), (np.eye(3) + 200, np.array([[0, 1, 2]])))
        assert noted(surface_from_arrays(*both), "SCRAPS").is_doubt
        surface = repair(RawMesh(*both), options=RepairOptions(is_largest_only=True))
        assert (surface.n_faces, codes(surface)) == (288, ["LEFT_OUT"])

    def test_a_hole_up_to_the_length_is_filled_and_the_outer_border_stays(self):
        vertices, faces = dome()
        raw = RawMesh(vertices, np.delete(faces, [42, 66, 100], axis=0))
        assert len(repair(raw).borders) == 4
        surface = repair(raw, options=RepairOptions(fill_holes=1e9))
        assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
        assert noted(surface, "FILLED").points

    def test_a_missing_face_of_a_closed_body_is_a_doubt_and_can_be_filled(self):
        vertices, faces = ball(3)
        surface = surface_from_arrays(vertices, faces[1:])
        assert noted(surface, "SLIT").is_doubt
        longest = dict(noted(surface, "SLIT").numbers)["longest"]
        raw = RawMesh(vertices, faces[1:])
        filled = repair(raw, options=RepairOptions(fill_holes=1.01 * longest), is_cut=False)
        assert (filled.n_faces, len(filled.borders)) == (len(faces), 0)

    def test_a_hole_far_smaller_than_the_spacing_is_closed_unless_the_weave_starts_there(self):
        vertices, faces = dome()
        corner = vertices[faces[100]]
        inner = corner.mean(0) + 1e-3 * (corner - corner.mean(0))
        a, b, c, n = *faces[100], len(vertices)
        around = [[a, b, n + 1], [a, n + 1, n], [b, c, n + 2], [b, n + 2, n + 1], [c, a, n], [c, n, n + 2]]
        surface = surface_from_arrays(
            np.concatenate([vertices, inner]), np.concatenate([np.delete(faces, 100, 0), around])
        )
        latitudes = offset(surface, spacing=10.0)
        assert (len(surface.borders), len(latitudes.surface.borders)) == (2, 1)
        assert noted(latitudes.surface, "FILLED").points
        assert link(latitudes).edge_lengths.min() > 1.0
        assert len(offset(surface, spacing=10.0, borders=[0, 1]).surface.borders) == 2
        assert len(offset(surface, spacing=1.0).surface.borders) == 2

    def test_the_only_border_of_an_open_body_is_not_a_slit(self):
        vertices, faces = ball(3)
        surface = surface_from_arrays(vertices, faces[vertices[faces][:, :, 2].max(1) < 0.9])
        assert codes(surface) == ["DROPPED"]

    def test_a_slit_is_a_doubt(self):
        vertices, quads = grid(8, 8)
        vertices = np.concatenate([vertices, vertices[[40]] + [0, 1e-3, 0]])
        upper = np.flatnonzero(vertices[quads].mean(1)[:, 1] > 4)
        quads[upper] = np.where(quads[upper] == 40, 81, quads[upper])
        surface = repair(RawMesh(vertices, quads), options=RepairOptions(weld=1e-9))
        assert dict(noted(surface, "SLIT").numbers)["count"] == 1
        assert len(repair(RawMesh(vertices, quads), options=RepairOptions(weld=0.01)).borders) == 1


def test_long_faces_of_a_tube_do_not_lie_on_their_neighbours_though_an_edge_is_divided_on_one_side():
    vertices, faces = TOUGH["long_faced_tube"](7014)
    surface = surface_from_arrays(*MESSES["t_junctions"].spoil(vertices, faces, np.random.default_rng(5)))
    assert (len(surface.borders), codes(surface)) == (2, ["STITCHED"])


class TestThickness:
    def test_a_thin_solid_is_noted_with_its_thickness_and_its_outer_side_can_be_taken(self):
        vertices, faces = thick_dome(2.0)
        surface = note_thickness(surface_from_arrays(vertices, faces), 10.0)
        assert dict(noted(surface, "THIN").numbers)["median"] == pytest.approx(2.0, rel=0.15)
        outer = repair(RawMesh(vertices, faces), options=RepairOptions(side="outer"))
        assert (outer.n_faces, len(outer.borders)) == (288, 1)

    def test_a_solid_thicker_than_the_spacing_is_not_noted(self):
        surface = surface_from_arrays(*thick_dome(40.0))
        assert note_thickness(surface, 5.0) is surface

    def test_a_shell_of_two_closed_pieces_is_thin_though_both_face_outwards(self):
        vertices, faces = ball(3)
        surface = surface_from_arrays(*together((30 * vertices, faces), (29 * vertices, faces[:, ::-1])))
        note = noted(note_thickness(surface, 6.0), "THIN")
        assert dict(note.numbers)["least"] < 1.1

    def test_pieces_side_by_side_are_not_thin(self):
        vertices, faces = dome()
        beside = surface_from_arrays(*together((vertices, faces), (moved(vertices, 101, 0, 3), faces)))
        assert note_thickness(beside, 10.0) is beside

    def test_a_sheet_has_no_outer_side(self):
        with pytest.raises(Degenerate):
            repair(RawMesh(*dome()), options=RepairOptions(side="outer"))

    def test_a_tube_narrower_than_the_spacing_is_coarse_with_the_spacing_that_would_do(self):
        turn, along = np.meshgrid(2 * np.pi * np.arange(24) / 24, np.linspace(0, 100, 41))
        radius = np.where(np.abs(along - 50) < 15, 2.0, 30.0)
        vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), along], -1).reshape(-1, 3)
        row, column = np.divmod(np.arange(40 * 24), 24)
        after = row * 24 + (column + 1) % 24
        here = row * 24 + column
        quads = np.stack([here, after, after + 24, here + 24], 1)
        note = noted(note_thickness(surface_from_arrays(vertices, quads), 8.0), "COARSE")
        assert dict(note.numbers)["spacing_that_would_do"] <= 4.1


def test_parts_of_an_obj_are_taken_by_object_or_group(tmp_path):
    path = tmp_path / "two.obj"
    sheet = "v 0 0 {0}\nv 1 0 {0}\nv 1 1 {0}\nv 0 1 {0}\n"
    path.write_text(
        "o roof\n" + sheet.format(0) + "f 1 2 3 4 # above\no chair\ng seat\n" + sheet.format(5) + "f 5 6 7\nf 5 7 8\n"
    )
    assert read_surface(path).n_faces == 4
    assert read_surface(path, object="roof").vertices[:, 2].max() == 0
    assert read_surface(path, object="seat").vertices[:, 2].min() == 5
    with pytest.raises(NoSurface) as refused:
        read_surface(path, object="table")
    assert refused.value.ids == ("roof", "chair", "seat")
    assert read_surface(path, object="roof", guarded=True).n_vertices == 4


def test_doubts_are_refused_where_that_is_asked_for():
    surface = surface_from_arrays(*together(dome(), (np.eye(3) + 200, np.array([[0, 1, 2]]))))
    with pytest.raises(Doubtful, match="SCRAPS"):
        refuse_doubts(surface)
    refuse_doubts(surface_from_arrays(*dome()))


def test_borders_stay_apart_where_welding_would_join_more_than_two_faces_at_an_edge() -> None:
    vertices, faces = TOUGH["comb"](61020)  # Its slits end 2e-8 wide, less than the tolerance.
    surface = surface_from_arrays(vertices, faces)
    assert (surface.n_faces, len(surface.borders)) == (len(faces), 1)
    (note,) = surface.notes
    assert (note.code, note.is_doubt) == ("GAP", True)
    assert len(note.points) == 4
    with pytest.raises(NonManifold, match="first at"):
        repair(RawMesh(vertices, faces), options=RepairOptions(weld=1e-6))
