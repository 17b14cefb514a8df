"""Lattices on open polylines: strips, free borders, slits and border caps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bound_rings import check_weave
from open_cloth import CLOTHS, COLUMNS, EDGE, ROWS, cloth_latitudes, from_side, path_through, plate, started
from planar_meshes import circle
from planar_meshes import plate as flat_plate
from weavecore.linking.free_borders import (
    FreeBorder,
    PolylineEnd,
    divide_free_borders,
    find_free_borders,
    split_obstructed_chords,
)
from weavecore.linking.link import PATTERN_NAMES, link_pattern
from weavecore.model import Origins, SurfaceMesh
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL
from weavecore.offsetting.level_sets import offset_levels

SPACINGS = (1.1, 1.7, 3.1)


def naked_edges_of(lattice):
    corners, offsets = lattice.face_nodes, lattice.face_offsets
    sides = [
        (int(a), int(b))
        for start, end in zip(offsets[:-1], offsets[1:])
        for a, b in zip(corners[start:end], np.roll(corners[start:end], -1))
    ]
    directed = set(sides)
    return np.array([edge for edge in sides if edge[::-1] not in directed])


@pytest.mark.parametrize("name", CLOTHS)
@pytest.mark.parametrize("pattern", ["triangular", "quad", "twill"])
def test_the_lattice_is_a_manifold_like_the_surface(name, pattern):
    for spacing in SPACINGS:
        latitudes = offset_levels(CLOTHS[name](), spacing=spacing * EDGE)
        check_weave(link_pattern(latitudes, pattern=pattern))


@pytest.mark.parametrize("pattern", PATTERN_NAMES)
def test_every_pattern_keeps_the_topology(pattern):
    for name in ("side with hole", "slit", "half"):
        latitudes = cloth_latitudes(name)
        lattice = link_pattern(latitudes, pattern=pattern)
        assert lattice.n_nodes - lattice.n_edges + lattice.n_faces == latitudes.surface.euler_characteristic


def test_from_one_side_triangles_are_regular_and_begin_alike_in_turns():
    lattice = link_pattern(offset_levels(from_side(), spacing=2.0 * EDGE), pattern="triangular")
    degree = np.bincount(lattice.edges.ravel(), minlength=lattice.n_nodes)
    last = int(lattice.node_latitude.max())
    x, y = lattice.nodes[:, 0], lattice.nodes[:, 1]
    inside = (
        (x > 1.0) & (y > 1.0) & (y < ROWS * EDGE - 1.0) & (lattice.node_latitude >= 0) & (lattice.node_latitude < last)
    )
    assert inside.sum() > 40
    assert (degree[inside] == 6).all()
    gaps = [np.diff(np.sort(lattice.node_station[lattice.node_latitude == p]))[0] for p in range(2, last)]
    mean = np.mean(gaps)
    assert (np.sign(np.array(gaps)[1:] - mean) == -np.sign(np.array(gaps)[:-1] - mean)).all()


def test_from_one_side_quads_are_squares():
    lattice = link_pattern(offset_levels(from_side(), spacing=2.0 * EDGE), pattern="twill", edge_length=2.0 * EDGE)
    assert (np.diff(lattice.face_offsets) == 4).all()
    assert lattice.edge_lengths == pytest.approx(np.full(lattice.n_edges, 2.0 * EDGE), rel=1e-3)


def test_plain_strips_have_cells_with_an_even_number_of_sides():
    lattice = link_pattern(offset_levels(from_side(), spacing=2.3 * EDGE), pattern="plain")
    between = np.add.reduceat(lattice.node_latitude[lattice.face_nodes] < 0, lattice.face_offsets[:-1]) == 0
    assert between.sum() > 30
    assert (np.diff(lattice.face_offsets)[between] % 2 == 0).all()


@pytest.mark.parametrize("name", CLOTHS)
def test_ends_of_polylines_and_corners_of_free_borders_are_nodes(name):
    latitudes = cloth_latitudes(name)
    lattice = link_pattern(latitudes)
    lines = latitudes.polylines
    for p in np.flatnonzero(~lines.closed):
        ends = lines.points[[lines.offsets[p], lines.offsets[p + 1] - 1]]
        nodes = lattice.nodes[lattice.node_latitude == p]
        assert np.linalg.norm(nodes[:, None] - ends, axis=2).min(0).max() < 1e-9 * EDGE
    corners = np.array([[x, y, 0.0] for x in (0, COLUMNS) for y in (0, ROWS)]) * EDGE
    near = np.linalg.norm(lattice.nodes[:, None] - corners, axis=2).min(0)
    kept = near < 1e-9 * EDGE
    # A corner may be cut off only where a polyline ends close to it.
    for corner in corners[~kept]:
        points = lines.points[np.concatenate([lines.offsets[:-1], lines.offsets[1:] - 1])]
        assert np.linalg.norm(points - corner, axis=1).min() < 0.7 * lattice.edge_length


def test_edges_along_free_borders_are_longitudinal_and_along_origins_latitudinal():
    lattice = link_pattern(cloth_latitudes("side with hole"))
    naked = np.sort(naked_edges_of(lattice), axis=1)
    n = lattice.n_nodes
    family = lattice.edge_family[np.searchsorted(lattice.edges[:, 0] * n + lattice.edges[:, 1], naked @ [n, 1])]
    on_origin = (lattice.node_latitude[naked] == 0).all(1)
    assert on_origin.any()
    assert (family[on_origin] == LATITUDINAL).all()
    assert (family[~on_origin] == LONGITUDINAL).all()


def test_a_slit_is_woven_from_both_sides_and_stays_closed():
    latitudes = cloth_latitudes("slit")
    lattice = link_pattern(latitudes)
    slit = np.flatnonzero(lattice.node_latitude == 0)
    assert not np.isin(naked_edges_of(lattice), slit).any()
    ring = lattice.edges[(lattice.edge_family == LATITUDINAL) & np.isin(lattice.edges, slit).all(1)]
    assert len(ring) == len(slit) - 1


def test_a_hole_that_one_polyline_meets_keeps_three_nodes():
    surface = plate(lambda middle: np.abs(middle[:, :2] - (11.0, 7.0)).max(1) > 1.0)
    surface = started(surface, path_through(surface, (0, ROWS), (0, 0)))
    latitudes = offset_levels(surface, spacing=11.0 * EDGE)
    lattice = link_pattern(latitudes, edge_length=11.0 * EDGE)
    check_weave(lattice)


def test_free_borders_follow_the_border_from_end_to_end():
    latitudes = cloth_latitudes("side with hole")
    free_borders = find_free_borders(latitudes)
    lines, surface = latitudes.polylines, latitudes.surface
    total = 0.0
    for border in free_borders:
        total += border.length
        for end, point in ((border.first, border.points[0]), (border.last, border.points[-1])):
            at = lines.offsets[end.polyline + end.is_last] - end.is_last
            assert np.linalg.norm(lines.points[at] - point) < 1e-9 * EDGE
        steps = np.linalg.norm(np.diff(border.points, axis=0), axis=1)
        assert border.stations == pytest.approx(np.concatenate([[0.0], np.cumsum(steps)]))
    around = sum(
        np.linalg.norm(np.diff(surface.vertices[[*loop, loop[0]]], axis=0), axis=1).sum() for loop in surface.borders
    )
    assert total == pytest.approx(around - ROWS * EDGE)


def test_a_whole_border_that_no_polyline_meets_is_one_free_border():
    latitudes = offset_levels(CLOTHS["hole"](), spacing=1.1 * EDGE)
    keeps = int(np.flatnonzero(~latitudes.polylines.closed)[0])
    early = replace(
        latitudes,
        polylines=replace(
            latitudes.polylines,
            points=latitudes.polylines.points[: latitudes.polylines.offsets[keeps]],
            offsets=latitudes.polylines.offsets[: keeps + 1],
            closed=latitudes.polylines.closed[:keeps],
            face=latitudes.polylines.face[: latitudes.polylines.offsets[keeps]],
            barycentric=latitudes.polylines.barycentric[: latitudes.polylines.offsets[keeps]],
        ),
        generation=latitudes.generation[:keeps],
        distance=latitudes.distance[:keeps],
        parents=latitudes.parents[(latitudes.parents < keeps).all(1)],
    )
    (whole,) = find_free_borders(early)
    assert whole.closed
    assert whole.length == pytest.approx(2 * (COLUMNS + ROWS) * EDGE)
    (stations,) = divide_free_borders([whole], 4.0 * EDGE)
    places = np.array([whole.points[np.searchsorted(whole.stations, s)] for s in stations])
    assert all((np.abs(places - [x * EDGE, y * EDGE, 0]).max(1) < 1e-9).any() for x in (0, COLUMNS) for y in (0, ROWS))


def test_the_size_of_a_strip_does_not_matter():
    corners = np.array([[0.0, 0, 0], [8, 0, 0], [8, 4, 0], [0, 4, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    start = Origins((np.array([3, 0]),), np.array([False]))
    counts = set()
    for scale in (1e-6, 1.0, 1e6):
        surface = SurfaceMesh(corners * scale, faces, starts=start)
        lattice = link_pattern(offset_levels(surface, spacing=0.5 * scale))
        check_weave(lattice)
        counts.add((lattice.n_nodes, lattice.n_edges, lattice.n_faces))
    assert len(counts) == 1


@pytest.mark.parametrize("pattern", ["hexagonal", "kagome"])
def test_new_nodes_on_free_borders_lie_on_them(pattern):
    angle = np.linspace(0.0, 1.5, 40)
    rows = np.linspace(0.0, 8.0, 30)
    x, y = np.meshgrid(4.0 * np.cos(angle), rows)  # a part of a tube: its straight borders start, its arcs do not
    vertices = np.stack([x, y, np.broadcast_to(4.0 * np.sin(angle), x.shape)], axis=2).reshape(-1, 3)
    a = (np.arange(29)[:, None] * 40 + np.arange(39)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 41], 1), np.stack([a, a + 41, a + 40], 1)])
    side = np.arange(30) * 40
    surface = SurfaceMesh(vertices, faces)
    loop = surface.borders[0]
    forth = loop[(np.flatnonzero(loop == side[0])[0] + 1) % len(loop)] == side[1]
    surface = replace(surface, starts=Origins((side if forth else side[::-1],), np.array([False])))
    lattice = link_pattern(offset_levels(surface, spacing=0.9), pattern=pattern)
    rim = np.concatenate(naked_edges_of(lattice))
    on_arc = np.minimum(lattice.nodes[rim, 1], 8.0 - lattice.nodes[rim, 1])
    on_side = np.minimum(np.abs(lattice.nodes[rim, 0] - 4.0), np.abs(lattice.nodes[rim, 0] - 4.0 * np.cos(1.5)))
    assert np.minimum(on_arc, on_side).max() < 1e-9
    between = lattice.nodes[rim][on_arc < 1e-9]
    radius = np.hypot(between[:, 0], between[:, 2])
    assert radius.min() > 4.0 * np.cos(1.5 / 39 / 2) - 1e-9


def test_a_gap_between_the_ends_of_one_polyline_is_one_edge():
    latitudes = offset_levels(CLOTHS["slit"](), spacing=2.7 * EDGE)
    lattice = link_pattern(latitudes)
    assert lattice.edge_lengths.min() > 0.1 * lattice.edge_length


def test_a_free_border_does_not_cut_off_a_hole_right_beside_it():
    rim = 20.0 * np.stack([np.cos(np.arange(160) * np.pi / 80), np.sin(np.arange(160) * np.pi / 80)], axis=1)
    hole = circle(6.0, centre=(0.0, -13.9), n=48)  # a tenth of a unit off the rim
    vertices, faces = flat_plate([rim, hole], 0.7)
    surface = SurfaceMesh(vertices, faces)
    least = min(surface.borders, key=len)
    lattice = link_pattern(offset_levels(started(surface, least, closed=True), spacing=7.0))
    check_weave(lattice)
    a, b, c = (lattice.nodes[lattice.face_nodes[k::3]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize(
    ("height", "is_split"), [(0.15, True), (0.02, True), (-0.05, False), (0.25, False), (0.5, False)]
)
def test_a_chord_gets_a_node_where_a_node_lies_between_it_and_the_border_but_not_beyond_the_border(height, is_split):
    points = np.array([[0.0, 0, 0], [0.5, 0.2, 0], [1.0, 0, 0]])
    leg = float(np.hypot(0.5, 0.2))
    ends = PolylineEnd(0, 1), PolylineEnd(1, 0)
    border = FreeBorder(points, np.array([0, 3, -1]), np.zeros(3), leg * np.arange(3), 2 * leg, *ends)
    nodes = cKDTree([[0.0, 0, 0], [1.0, 0, 0], [0.5, height, 0]])
    stations = split_obstructed_chords(border, np.array([0.0, 2 * leg]), nodes)
    assert stations.tolist() == ([0.0, leg, 2 * leg] if is_split else [0.0, 2 * leg])


def test_an_end_of_a_polyline_is_its_first_or_last_element():
    offsets = np.array([0, 4, 4, 9])
    assert [PolylineEnd(p, end).element(offsets) for p in (0, 2) for end in (0, 1)] == [0, 3, 4, 8]
