"""Levels from chosen origins: against distances that are known, and cut open by free borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from open_cloth import CLOTHS, COLUMNS, EDGE, ROWS, cloth_latitudes, from_hole, from_side, path_through, plate, started
from weavecore.errors import BadIndex
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model import Origins, SurfaceMesh
from weavecore.offsetting.distance.reflected_double import reflected_double
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.offsetting.isolines.extract import prune_beside_free_borders, trace_latitudes
from weavecore.offsetting.level_sets import offset_levels

HELD_OFF = 2e-4 * EDGE
"""A polyline keeps half of that off the vertices that lie on it."""


def ends(latitudes):
    """First and last points of the open polylines that were traced."""
    lines = latitudes.polylines
    open_ = np.flatnonzero(~lines.closed & (latitudes.generation > 0))
    return lines.points[np.concatenate([lines.offsets[open_], lines.offsets[open_ + 1] - 1])]


def to_segment(points, a, b):
    part = np.clip(((points - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(points - (a + part[:, None] * (b - a)), axis=1)


def test_from_one_side_polylines_are_straight_across():
    latitudes = offset_levels(from_side(), spacing=2.3 * EDGE)
    assert len(latitudes) == latitudes.n_generations == 11
    for p in range(len(latitudes)):
        line = latitudes.polylines.polyline(p)
        assert np.abs(line[:, 0] - latitudes.distance[p]).max() < HELD_OFF
        assert sorted(line[[0, -1], 1].tolist()) == [0.0, ROWS * EDGE]


def test_ends_lie_on_selvedges():
    for name in CLOTHS:
        latitudes = cloth_latitudes(name)
        lines, surface = latitudes.polylines, latitudes.surface
        traced = ~lines.closed & (latitudes.generation > 0)
        point = np.concatenate([lines.offsets[:-1][traced], lines.offsets[1:][traced] - 1])
        apex = lines.barycentric[point].argmin(1)
        halfedge = 3 * lines.face[point] + (apex + 1) % 3
        assert (lines.barycentric[point].min(1) == 0).all(), name
        assert surface.is_free_border[halfedge].all(), name


def test_around_a_slit_levels_are_capsules():
    latitudes = cloth_latitudes("slit")
    a, b = np.array([8.0, 8.0, 0.0]) * EDGE, np.array([16.0, 8.0, 0.0]) * EDGE
    owner = latitudes.polylines.owner
    off = to_segment(latitudes.polylines.points, a, b) - latitudes.distance[owner]
    assert np.abs(off).max() < 0.01 * EDGE


def test_behind_a_hole_paths_bend_around_its_corners():
    latitudes = cloth_latitudes("side with hole")
    lines = latitudes.polylines
    points = lines.points[latitudes.generation[lines.owner] > 0] / EDGE
    distance = latitudes.distance[lines.owner][latitudes.generation[lines.owner] > 0] / EDGE
    behind = (points[:, 0] > 13.999) & (points[:, 1] > 4) & (points[:, 1] < 10)
    corners = np.array([[14.0, 4.0, 0.0], [14.0, 10.0, 0.0]])
    around = 14.0 + np.min([np.linalg.norm(points - corner, axis=1) for corner in corners], axis=0)
    known = np.where(behind, around, points[:, 0])
    off = np.abs(known - distance)
    assert behind.sum() > 50
    # On the ridge behind the hole, where both ways are as long, the mesh cuts off the tips of the polylines.
    assert off[np.abs(points[:, 1] - 7.0) > 1.0].max() < 0.02
    assert off.max() < 0.2


def test_where_two_sides_meet_the_nearer_one_is_first():
    latitudes = cloth_latitudes("two sides")
    x = latitudes.polylines.points[:, 0]
    known = np.minimum(x, COLUMNS * EDGE - x)
    assert np.abs(known - latitudes.distance[latitudes.polylines.owner]).max() < HELD_OFF


@pytest.mark.parametrize("name", CLOTHS)
def test_bands_are_the_surface_cut_along_all_polylines(name):
    latitudes = cloth_latitudes(name)
    bands, lines, surface = latitudes.bands, latitudes.polylines, latitudes.surface
    n_arcs = int((~lines.closed & (latitudes.generation > 0)).sum())
    cut_open = surface.euler_characteristic
    # A path inside the surface is cut along: an arc from border to border makes one more piece, a free end none.
    is_cut = surface.is_cut.any()
    on_border = np.zeros(surface.n_vertices, bool)
    on_border[np.concatenate(surface.borders)] = True
    for path, closed in zip(surface.origins.paths, surface.origins.closed):
        if is_cut and not closed:
            cut_open += int(on_border[path[[0, -1]]].sum()) - 1
    assert bands.euler.sum() - n_arcs == cut_open
    for p in np.flatnonzero(latitudes.generation > 0):
        sides = np.flatnonzero(bands.polyline == p)
        assert len(sides) == 2
        assert bands.is_parent[sides].sum() == 1


def test_all_borders_chosen_is_the_same_as_none():
    surface = plate(lambda middle: np.abs(middle[:, :2] - (11.0, 7.0)).max(1) > 3.0)
    plain = offset_levels(surface, spacing=1.3 * EDGE)
    chosen = offset_levels(started(surface, *surface.borders, closed=True), spacing=1.3 * EDGE)
    assert np.array_equal(plain.polylines.points, chosen.polylines.points)
    assert np.array_equal(plain.bands.euler, chosen.bands.euler)
    assert np.array_equal(plain.parents, chosen.parents)


def test_the_order_of_chosen_origins_is_that_of_generation_0():
    surface = plate()
    right = path_through(surface, (COLUMNS, 0), (COLUMNS, ROWS))
    left = path_through(surface, (0, ROWS), (0, 0))
    lines = offset_levels(started(surface, right, left), spacing=2.3 * EDGE).polylines
    assert np.array_equal(lines.polyline(0), surface.vertices[right])
    assert np.array_equal(lines.polyline(1), surface.vertices[left])


def test_glued_to_its_mirror_a_surface_keeps_walls_at_its_origins_alone():
    surface = from_hole()
    vertex, faces, twins = reflected_double(surface)
    assert np.array_equal(faces[: surface.n_faces], surface.faces)
    tail, head = vertex[faces].ravel(), vertex[faces[:, [1, 2, 0]]].ravel()
    inner = twins != NO_TWIN
    assert np.array_equal(tail[inner], head[twins[inner]])
    assert np.array_equal(twins[twins[inner]], np.flatnonzero(inner))
    walls = set(tail[~inner].tolist())
    assert walls == set(surface.origins.paths[0].tolist())


def test_a_line_right_before_the_far_side_is_left_out():
    surface = from_side()
    field = measure_distance(surface)
    spacing = (COLUMNS / 8 - 0.02) * EDGE
    traced = trace_latitudes(surface, field, spacing=spacing)
    kept = prune_beside_free_borders(traced)
    assert len(traced) == 9
    assert len(kept) == 8
    assert kept.bands.euler.tolist() == [1] * 8
    assert np.array_equal(kept.polylines.points, traced.polylines.points[: len(kept.polylines.points)])
    assert kept.bands.depth[-1] == pytest.approx(COLUMNS * EDGE)


def test_a_lone_line_stays_however_near_the_far_side_is():
    latitudes = offset_levels(from_side(), spacing=(COLUMNS - 3.0) * EDGE)
    assert len(latitudes) == 2


def test_long_edges_of_a_selvedge_are_split_and_those_of_an_origin_are_not():
    corners = np.array([[0.0, 0, 0], [8, 0, 0], [8, 4, 0], [0, 4, 0]])
    square = SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    latitudes = offset_levels(replace(square, starts=Origins((np.array([3, 0]),), np.array([False]))), spacing=0.5)
    assert len(latitudes) == 16
    assert np.array_equal(latitudes.polylines.polyline(0), corners[[3, 0]])
    assert np.abs(latitudes.polylines.points[:, 0] - latitudes.distance[latitudes.polylines.owner]).max() < 1e-4
    border = np.concatenate(latitudes.surface.borders)
    assert (np.isin([3, 0], border)).all()
    assert len(border) > 20


@pytest.mark.parametrize("name", ["hole", "slit", "three sides", "ring inside"])
def test_moving_and_turning_the_surface_moves_the_polylines(name):
    surface = CLOTHS[name]()
    draw = np.random.default_rng(3)
    # A grid has ties that rounding decides.
    surface = replace(surface, vertices=surface.vertices + draw.normal(scale=0.03 * EDGE, size=surface.vertices.shape))
    turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = replace(surface, vertices=surface.vertices @ turn.T + (5.0, -3.0, 20.0))
    before, after = offset_levels(surface, spacing=1.7 * EDGE), offset_levels(moved, spacing=1.7 * EDGE)
    assert np.array_equal(before.polylines.offsets, after.polylines.offsets)
    assert np.abs(before.polylines.points @ turn.T + (5.0, -3.0, 20.0) - after.polylines.points).max() < 1e-6


def test_the_opened_ends_are_those_of_the_levels():
    assert (np.abs(ends(cloth_latitudes("path across"))[:, 1] % (ROWS * EDGE)) < 1e-9).all()


@pytest.mark.parametrize("path", [[0, 2], [0, 1, 10_000], [-1, 0]])
def test_paths_off_the_edges_are_refused(path):
    with pytest.raises(BadIndex, match="do not run along edges"):
        started(plate(), np.array(path))
