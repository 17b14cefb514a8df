"""Whole lattices: whatever the surface is, the lattice is one like it."""

from __future__ import annotations

import numpy as np
import pytest

from bound_rings import (
    check_weave,
    cone_frustum,
    cylinder,
    dumbbell,
    hemisphere,
    holed_torus,
    linked,
    pair_of_pants,
    sphere,
    thin_fold,
    torus,
)
from planar_meshes import plate, rectangle
from weavecore.errors import TooMuchWork, Unsupported
from weavecore.linking import assemble, band_mesh, pocket_filling
from weavecore.linking.bending_smoothing import smooth_bending
from weavecore.linking.link import link_latitudes, link_pattern
from weavecore.model import LATITUDINAL, LONGITUDINAL, POCKET, SurfaceMesh
from weavecore.model.rod_ends import count_short_rods
from weavecore.model.rod_pairing import pair_darts
from weavecore.offsetting.distance.solver import DistanceField
from weavecore.offsetting.isolines.extract import trace_latitudes
from weavecore.offsetting.level_sets import offset_levels
from woven_rods import sample_latitudes

SHAPES = {
    "hemisphere": (hemisphere, 0.1),
    "cylinder": (cylinder, 0.3),
    "cone": (cone_frustum, 0.21),
    "torus with a hole": (holed_torus, 0.3),
    "pair of pants": (pair_of_pants, 0.2),
    "dumbbell": (dumbbell, 0.17),
    "thin fold": (thin_fold, 0.2),
}


@pytest.mark.parametrize("pattern", ["triangular", "quad"])
@pytest.mark.parametrize("name", SHAPES)
def test_the_lattice_is_a_manifold_like_its_surface(name, pattern):
    make, spacing = SHAPES[name]
    linked(make(), spacing, pattern=pattern)


@pytest.mark.parametrize("edge_length", [0.05, 0.4, 3.0, 1000.0])
def test_any_edge_length_gives_a_lattice(edge_length):
    lattice = linked(pair_of_pants(), 0.25, edge_length=edge_length)
    counts = np.bincount(lattice.node_latitude[lattice.node_latitude >= 0])
    ideal = np.maximum(3, lattice.latitudes.polylines.lengths / edge_length)
    off = np.log(counts / ideal)
    slack = np.maximum(np.log(1.4), 0.5 / ideal) + 1e-9
    assert (off >= -slack).all()
    # Edges far longer than the spacing get more nodes where faces would be inverted.
    assert (off <= slack).all() or edge_length > 1.0
    assert counts.min() >= 3


@pytest.mark.parametrize("spacing", [0.9, 1.3])
def test_rings_that_are_few_and_far_between_are_linked(spacing):
    mesh, equator = sphere()
    linked(mesh, spacing, cuts=(equator,), edge_length=5.0)


def test_both_sides_of_a_cut_are_woven():
    mesh, equator = sphere()
    lattice = linked(mesh, 0.2, cuts=(equator,))
    on_cut = np.flatnonzero(lattice.node_latitude == 0)
    other = np.setxor1d(lattice.edges[np.isin(lattice.edges, on_cut).any(1)], on_cut)
    assert (lattice.nodes[other, 2] > 0.1).any()
    assert (lattice.nodes[other, 2] < -0.1).any()


def test_a_cut_that_does_not_part_the_surface_is_woven_on_both_sides():
    mesh = torus()
    around_the_tube = np.arange(36) * 56
    lattice = linked(mesh, 0.3, cuts=(around_the_tube,))
    assert lattice.latitudes.surface.euler_characteristic == 0


def test_a_band_that_meets_the_same_cut_from_both_sides_is_woven():
    # The tube is shorter than two spacings, so one band has the cut on its left and on its right.
    vertices, faces = torus()
    border = np.linalg.norm(vertices[faces].mean(1) - [-2.0, 0, 0.8], axis=1) > 0.45
    used, numbered = np.unique(faces[border], return_inverse=True)
    place = np.full(len(vertices), -1)
    place[used] = np.arange(len(used))
    cut = place[np.arange(36) * 56]
    surface = SurfaceMesh(vertices[used], numbered.reshape(-1, 3), cuts=(cut,))
    latitudes = offset_levels(surface, spacing=2.2)
    first = latitudes.bands.polyline[: latitudes.bands.offsets[1]]
    assert (np.bincount(first) == 2).any()
    check_weave(link_latitudes(latitudes))


@pytest.mark.parametrize("edge_length", [0.25, 0.6, 4.0])
def test_a_handle_inside_a_pocket_is_kept(edge_length):
    measured = offset_levels(SurfaceMesh(*holed_torus()), spacing=0.4)
    shallow = np.minimum(measured.vertex_distance, 0.7)
    latitudes = trace_latitudes(measured.surface, DistanceField(shallow, np.zeros((len(shallow), 3))), spacing=0.4)
    assert latitudes.bands.euler.tolist() == [0, -1]
    check_weave(link_latitudes(latitudes, edge_length=edge_length))


def test_links_do_not_jump_through_the_air_between_two_sheets():
    lattice = linked(thin_fold(gap=0.06), 0.2)
    a, b = lattice.nodes[lattice.edges[:, 0]], lattice.nodes[lattice.edges[:, 1]]
    apart = (a[:, 2] * b[:, 2] < 0) & (np.minimum(a[:, 0], b[:, 0]) > 0.25)
    # The sheets hang together at the fold only, near x = 0.
    assert not apart.any()


def test_the_first_latitudes_are_the_borders_and_their_corners_are_nodes():
    lattice = linked(plate([rectangle(3.0, 2.0)], 0.1), 0.15)
    corners = [[x, y, 0.0] for x in (-1.5, 1.5) for y in (-1.0, 1.0)]
    nodes = lattice.nodes[lattice.node_latitude == 0]
    for corner in corners:
        assert np.linalg.norm(nodes - corner, axis=1).min() < 1e-12


@pytest.mark.parametrize("pattern", ["triangular", "quad"])
@pytest.mark.parametrize("spacing", [0.06, 0.1, 0.3])
def test_two_large_triangles_are_woven(spacing, pattern):
    corners = np.array(
        [[1.7517, -0.5383, 0.2208], [1.3736, 1.3992, -1.6298], [0.4645, 0.9335, -0.7466], [-0.1289, 0.9543, 0.0364]]
    )
    lattice = linked((corners, np.array([[0, 1, 3], [1, 2, 3]])), spacing, pattern=pattern)
    assert lattice.edge_lengths.min() > 0.02 * spacing


def test_a_smooth_shell_is_woven_evenly():
    lattice = linked(hemisphere(rows=40, columns=100), 0.07)
    length = lattice.edge_lengths
    valence = np.bincount(lattice.edges.ravel(), minlength=lattice.n_nodes)
    inner = lattice.node_latitude != 0
    assert length.max() <= 1.5 * np.median(length)
    assert np.mean(valence[inner] == 6) >= 0.93
    assert least_angles(lattice).min() > np.radians(30)


def least_angles(lattice):
    corners = lattice.nodes[lattice.face_nodes.reshape(-1, 3)]
    angles = []
    for k in range(3):
        u, v = corners[:, k - 2] - corners[:, k], corners[:, k - 1] - corners[:, k]
        cosine = (u * v).sum(1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
        angles.append(np.arccos(cosine))
    return np.min(angles, axis=0)


def test_a_straight_tube_has_six_edges_at_every_inner_node():
    lattice = linked(cylinder(height=3.9), 0.3)
    valence = np.bincount(lattice.edges.ravel())
    inner = lattice.latitudes.generation[lattice.node_latitude] > 0
    assert (valence[inner] == 6).all()


def test_a_tube_in_quads_has_no_triangle_but_in_its_pocket():
    lattice = linked(cylinder(height=3.9), 0.3, pattern="quad")
    sides = np.diff(lattice.face_offsets)
    assert np.mean(sides == 4) > 0.99


def test_rings_have_even_counts_in_quads():
    lattice = linked(cone_frustum(), 0.2, pattern="quad")
    assert (np.bincount(lattice.node_latitude[lattice.node_latitude >= 0]) % 2 == 0).all()


def test_fronts_that_meet_head_on_are_joined_by_pocket_edges():
    lattice = linked(cylinder(), 0.3)
    generation = lattice.latitudes.generation[lattice.node_latitude]
    pocket = lattice.edges[lattice.edge_family == POCKET]
    assert len(pocket) > 0
    assert (generation[pocket] == generation.max()).all()
    heights = lattice.nodes[pocket][:, :, 2]
    assert ((heights < 2.0).any(1) & (heights > 2.0).any(1)).all()


def test_a_wide_cap_gets_a_steiner_vertex_at_its_deepest_place():
    lattice = linked(hemisphere(), np.pi / 2 / 7.95)
    steiner = np.flatnonzero(lattice.node_latitude == -1)
    assert len(steiner) == 1
    assert np.linalg.norm(lattice.nodes[steiner[0]] - [0, 0, 1]) < 0.05


def test_children_are_joined_to_their_parents_also_where_a_front_splits():
    lattice = linked(dumbbell(), 0.17)
    bands = lattice.latitudes.bands
    split = int(np.argmin(bands.euler))
    children = bands.polyline[bands.offsets[split] : bands.offsets[split + 1]][1:]
    latitude = lattice.node_latitude[lattice.edges[lattice.edge_family == LONGITUDINAL]]
    for child in children:
        assert (latitude == child).any()


def test_rings_are_divided_almost_evenly_and_their_edges_are_latitudinal():
    lattice = linked(hemisphere(), 0.1)
    for p in range(len(lattice.latitudes)):
        nodes = lattice.node_latitude == p
        gaps = np.diff(np.sort(lattice.node_station[nodes]))
        assert gaps.std() < 0.15 * gaps.mean()
        assert gaps.min() > 0.5 * gaps.mean()
        assert (lattice.edge_family == LATITUDINAL).sum() == (lattice.node_latitude >= 0).sum()


def test_nodes_lie_on_their_polylines():
    lattice = linked(dumbbell(), 0.17)
    polylines = lattice.latitudes.polylines
    for p in range(len(lattice.latitudes)):
        line = polylines.polyline(p)
        after = np.roll(line, -1, axis=0)
        for node in lattice.nodes[lattice.node_latitude == p]:
            along = np.clip(((node - line) * (after - line)).sum(1) / ((after - line) ** 2).sum(1), 0, 1)
            assert np.linalg.norm(line + (after - line) * along[:, None] - node, axis=1).min() < 1e-12


@pytest.mark.parametrize("edge_length", [0.0, -1.0, float("nan"), float("inf")])
def test_an_edge_length_that_is_no_length_is_refused(edge_length):
    latitudes = offset_levels(SurfaceMesh(*cylinder()), spacing=0.5)
    with pytest.raises(Unsupported, match="positive"):
        link_latitudes(latitudes, edge_length=edge_length)


def test_a_pattern_that_does_not_exist_is_refused_with_those_that_do():
    latitudes = offset_levels(SurfaceMesh(*cylinder()), spacing=0.5)
    with pytest.raises(Unsupported, match=r"houndstooth.*triangular"):
        link_latitudes(latitudes, pattern="houndstooth")


def test_progress_rises_and_can_cancel():
    latitudes = offset_levels(SurfaceMesh(*cylinder()), spacing=0.5)
    told = []
    link_latitudes(latitudes, progress=lambda fraction, label: told.append((fraction, label)))
    assert [f for f, _ in told] == sorted({f for f, _ in told})

    def cancel(fraction, label):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        link_latitudes(latitudes, progress=cancel)


def test_a_pocket_in_which_no_steiner_vertex_fits_is_refused_before_its_mesh_grows_without_end(monkeypatch):
    x, y = (k.ravel() for k in np.meshgrid(np.arange(4.0), np.arange(4.0)))
    vertices = np.stack([x, y, np.zeros(16)], axis=1)
    vertices[5, 2] = 1000.0
    a = (np.arange(3)[:, None] * 4 + np.arange(3)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 5], 1), np.stack([a, a + 5, a + 4], 1)])
    latitudes = offset_levels(SurfaceMesh(vertices, faces), spacing=200.0)
    sizes = []
    split = pocket_filling.split_edges_of
    monkeypatch.setattr(pocket_filling, "split_edges_of", lambda *of: sizes.append(len(of[0].points)) or split(*of))
    with pytest.raises(TooMuchWork, match="too narrow"):
        link_latitudes(latitudes)
    assert max(sizes) < 30 * sizes[0]


def test_pockets_that_would_take_too_many_points_are_refused_before_they_are_refined(monkeypatch):
    latitudes = offset_levels(SurfaceMesh(*plate([rectangle(4.0, 4.0)], 0.5)), spacing=0.3)
    monkeypatch.setattr(band_mesh, "MOST_POINTS", 50)
    monkeypatch.setattr(band_mesh, "bisect_long_edges", None)
    with pytest.raises(TooMuchWork, match=r"would have about \d+ points, more than 50"):
        link_latitudes(latitudes)


def test_smoothing_does_not_make_rods_short_that_went_on_before():
    # Rings of nine edges turn by 40° at a node: a little more, and they are broken.
    latitudes = sample_latitudes("six_way_joint", 2.0)
    smoothed = link_pattern(latitudes)
    n_short, _ = count_short_rods(pair_darts(smoothed))
    assert n_short <= 3
    free, _ = count_short_rods(pair_darts(smooth_bending(smoothed)))
    assert free > 3 + n_short


@pytest.mark.parametrize("name", ["shell_2400x1600", "narrow_neck"])
def test_filling_around_long_links_gives_the_faces_of_whole_bands(monkeypatch, name):
    latitudes = sample_latitudes(name, 1.0)

    def places_of_faces():
        lattice = link_latitudes(latitudes)
        corners = lattice.nodes[lattice.face_nodes].reshape(-1, 3, 3)
        return sorted(np.round(corners.mean(1), 6).tolist())

    around = places_of_faces()
    monkeypatch.setattr(band_mesh, "_faces_near", lambda mesh, *_: np.arange(len(mesh.faces)))
    assert places_of_faces() == around


def test_what_is_filled_grows_where_a_stretch_of_long_links_goes_on(monkeypatch):
    latitudes = sample_latitudes("shell_2400x1600", 1.0)
    whole = link_latitudes(latitudes)
    monkeypatch.setattr(assemble, "_REACH", 0.05)
    assert link_latitudes(latitudes).n_faces == whole.n_faces
