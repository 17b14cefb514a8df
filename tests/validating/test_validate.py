"""Each check of `validate` holds on what is right, and fails when one thing about it is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from open_cloth import CLOTHS, cloth_latitudes, path_through, plate, started, woven_cloth
from weavecore.errors import Broken, Unsupported
from weavecore.model import (
    LATITUDINAL,
    LONGITUDINAL,
    POCKET,
    Bands,
    Latitudes,
    Lattice,
    Origins,
    Polylines,
    Strands,
    SurfaceMesh,
)
from weavecore.validating import Finding, Report, validate
from weavecore.validating.check_lattices import free_border_edges
from woven_tube import COLUMNS, tube_latitudes, tube_lattice, tube_strands, tube_surface

BREAKERS: dict[str, dict[str, Callable]] = {"surface": {}, "latitudes": {}, "lattice": {}, "strands": {}}
MAKERS = {"surface": tube_surface, "latitudes": tube_latitudes, "lattice": tube_lattice, "strands": tube_strands}


def breaks(noun: str, finding: str) -> Callable:
    """Register a function that makes a right value wrong in the way that one finding tells."""

    def register(breaker: Callable) -> Callable:
        BREAKERS[noun][finding] = breaker
        return breaker

    return register


def changed(array: np.ndarray, at: object, to: object) -> np.ndarray:
    copy = array.copy()
    copy[at] = to
    return copy


# ---- a surface


@breaks("surface", "faces_without_area")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    return replace(surface, vertices=changed(surface.vertices, 1, surface.vertices[0]))


@breaks("surface", "vertices_unused")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    return replace(surface, vertices=np.vstack([surface.vertices, [[9.0, 9.0, 9.0]]]))


@breaks("surface", "cuts_off_edges")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    return replace(surface, cuts=(np.arange(COLUMNS, 2 * COLUMNS, 2),))


@breaks("surface", "cuts_that_meet")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    return replace(surface, cuts=(np.arange(COLUMNS),))  # along the border


@breaks("surface", "origins_astray")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    return started(surface, surface.borders[0][::-1], closed=True)  # the surface is on its right


@breaks("surface", "origins_that_meet")
def _(surface: SurfaceMesh) -> SurfaceMesh:
    loop = surface.borders[0]
    return replace(surface, starts=Origins((loop, loop[:3]), np.array([True, False])))


# ---- latitudes


def moved(latitudes: Latitudes, **arrays: np.ndarray) -> Latitudes:
    return replace(latitudes, polylines=replace(latitudes.polylines, **arrays))


def slid(latitudes: Latitudes, point: int, weights: list[float]) -> Latitudes:
    """Move a point to other barycentric coordinates in its face."""
    polylines, surface = latitudes.polylines, latitudes.surface
    place = np.array(weights) @ surface.vertices[surface.faces[polylines.face[point]]]
    return moved(
        latitudes,
        points=changed(polylines.points, point, place),
        barycentric=changed(polylines.barycentric, point, weights),
    )


@breaks("latitudes", "border_loops_lost")
def _(latitudes: Latitudes) -> Latitudes:
    one_bit = np.nextafter(latitudes.polylines.points[3], 9)
    return moved(latitudes, points=changed(latitudes.polylines.points, 3, one_bit))


@breaks("latitudes", "borders_not_first")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, generation=[0, 1, 1, 1, 2, 2])


@breaks("latitudes", "generations_out_of_order")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, generation=[0, 0, 2, 1, 2, 2])


@breaks("latitudes", "off_surface_of_size")
def _(latitudes: Latitudes) -> Latitudes:
    last = latitudes.polylines.points[-1]
    return moved(latitudes, points=changed(latitudes.polylines.points, -1, last + 1e-6))


@breaks("latitudes", "outside_face")
def _(latitudes: Latitudes) -> Latitudes:
    return slid(latitudes, -1, [1.0 + 1e-6, -1e-6, 0.0])


@breaks("latitudes", "short_polylines")
def _(latitudes: Latitudes) -> Latitudes:
    old = latitudes.polylines
    offsets = changed(old.offsets, -1, old.offsets[-2] + 2)
    kept = slice(0, int(offsets[-1]))
    return replace(
        latitudes, polylines=Polylines(old.points[kept], offsets, old.closed, old.face[kept], old.barycentric[kept])
    )


@breaks("latitudes", "ends_off_free_borders")
def _(latitudes: Latitudes) -> Latitudes:
    return moved(latitudes, closed=[True] * 5 + [False])


@breaks("latitudes", "segments_in_no_face")
def _(latitudes: Latitudes) -> Latitudes:
    old = latitudes.polylines
    keep = np.delete(np.arange(len(old.points)), -4)
    offsets = changed(old.offsets, -1, len(keep))
    fewer = Polylines(old.points[keep], offsets, old.closed, old.face[keep], old.barycentric[keep])
    return replace(latitudes, polylines=fewer)


@breaks("latitudes", "crossings")
def _(latitudes: Latitudes) -> Latitudes:
    # A point of the polyline at height 1, on an upright edge of length 2.5, goes above the one at 2.
    return slid(latitudes, latitudes.polylines.offsets[2] + 4, [0.1, 0.0, 0.9])


@breaks("latitudes", "shared_points")
def _(latitudes: Latitudes) -> Latitudes:
    return slid(latitudes, latitudes.polylines.offsets[2] + 4, [0.2, 0.0, 0.8])


@breaks("latitudes", "parents_unknown")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, parents=[[0, 2], [1, 3], [2, 4], [3, 6]])


@breaks("latitudes", "parent_links_wrong")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, parents=[[0, 2], [1, 3], [2, 4], [1, 5]])


@breaks("latitudes", "orphans")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, parents=[[0, 2], [1, 3], [2, 4]])


@breaks("latitudes", "parents_differ_from_bands")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, parents=[[0, 2], [1, 3], [2, 4], [2, 5]])


@breaks("latitudes", "distance_off_of_spacing")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, distance=[0, 0, 1, 1, 2, 2.001])


@breaks("latitudes", "step_over_spacing")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, distance=[0, 0, 1, 1, 2.1, 2.1])


@breaks("latitudes", "distances_not_rising")
def _(latitudes: Latitudes) -> Latitudes:
    return replace(latitudes, distance=[0, 0, 1, 1, 1, 1])


@breaks("latitudes", "coverage_gap_of_spacing")
def _(latitudes: Latitudes) -> Latitudes:
    old, keep = latitudes.polylines, latitudes.polylines.offsets[2]
    borders = Polylines(old.points[:keep], old.offsets[:3], [True, True], old.face[:keep], old.barycentric[:keep])
    pocket = Bands([0, 2], [0, 1], [True, True], [True, True], [0], [2.5])
    return replace(latitudes, polylines=borders, generation=[0, 0], distance=[0, 0], parents=[], bands=pocket)


def with_bands(latitudes: Latitudes, **arrays: object) -> Latitudes:
    return replace(latitudes, bands=replace(latitudes.bands, **arrays))


@breaks("latitudes", "euler_sum_off")
def _(latitudes: Latitudes) -> Latitudes:
    return with_bands(latitudes, euler=[0, 0, 0, 0, -2])


@breaks("latitudes", "bands_of_no_surface")
def _(latitudes: Latitudes) -> Latitudes:
    return with_bands(latitudes, euler=[0, 0, 0, 1, -1])


@breaks("latitudes", "bands_above_their_parents")
def _(latitudes: Latitudes) -> Latitudes:
    return with_bands(latitudes, depth=[1, 1, 2, 2, 1.9])


@breaks("latitudes", "sides_wrong")
def _(latitudes: Latitudes) -> Latitudes:
    return with_bands(latitudes, is_left=changed(latitudes.bands.is_left, -1, False))


# ---- open latitudes: from the left side of a plate with a hole, and from others

OPEN: dict[str, Callable] = {}


def breaks_open(finding: str) -> Callable:
    """Register a function that makes right latitudes of which some are open wrong in the way that one finding tells."""

    def register(breaker: Callable) -> Callable:
        OPEN[finding] = breaker
        return breaker

    return register


breaks("latitudes", "free_borders_touched_between_ends")(lambda _: OPEN["free_borders_touched_between_ends"]())
breaks("latitudes", "free_borders_between_bands")(lambda _: OPEN["free_borders_between_bands"]())


def replaced(latitudes: Latitudes, p: int, rows: np.ndarray, **arrays: object) -> Latitudes:
    """Give polyline ``p`` the points of ``rows`` of all points."""
    old = latitudes.polylines
    order = np.concatenate([np.arange(old.offsets[p]), rows, np.arange(old.offsets[p + 1], len(old.points))])
    offsets = old.offsets + np.where(np.arange(len(old) + 1) > p, len(rows) - old.counts[p], 0)
    lines = Polylines(old.points[order], offsets, old.closed, old.face[order], old.barycentric[order])
    return replace(latitudes, polylines=lines, **arrays)


def rows_of_polyline(latitudes: Latitudes, p: int) -> np.ndarray:
    return np.arange(latitudes.polylines.offsets[p], latitudes.polylines.offsets[p + 1])


@breaks_open("border_loops_lost")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side")
    return replaced(latitudes, 0, rows_of_polyline(latitudes, 0)[::-1])


@breaks_open("short_polylines")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side")
    return replaced(latitudes, 4, rows_of_polyline(latitudes, 4)[:1])


@breaks_open("ends_off_free_borders")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side with hole")
    return replaced(latitudes, 4, rows_of_polyline(latitudes, 4)[:-1])


@breaks_open("segments_in_no_face")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side")
    return replaced(latitudes, 4, np.delete(rows_of_polyline(latitudes, 4), 5))


@breaks_open("free_borders_touched_between_ends")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side")
    rows = rows_of_polyline(latitudes, 4)
    return replaced(latitudes, 4, np.r_[rows, rows[-2:][::-1], rows[-1]])


@breaks_open("free_borders_between_bands")
def _() -> Latitudes:
    # Run the other way, its left side is where the bands have its right side.
    latitudes = cloth_latitudes("side")
    return replaced(latitudes, 4, rows_of_polyline(latitudes, 4)[::-1])


@breaks_open("coverage_gap_of_spacing")
def _() -> Latitudes:
    # Of an origin along three sides; a segment that closed it would cover the fourth.
    latitudes = cloth_latitudes("three sides")
    old, n = latitudes.polylines, int(latitudes.polylines.offsets[1])
    alone = Polylines(old.points[:n], [0, n], [False], old.face[:n], old.barycentric[:n])
    pocket = Bands([0, 1], [0], [True], [True], [1], [120.0])
    arrays = {"generation": [0], "distance": [0], "parents": []}
    return replace(latitudes, polylines=alone, bands=pocket, spacing=80.0, **arrays)


@breaks_open("euler_sum_off")
def _() -> Latitudes:
    return with_bands(cloth_latitudes("slit"), euler=[0, 0, 0, 0, 1, 1, 1, 0])


@breaks_open("bands_of_no_surface")
def _() -> Latitudes:
    return with_bands(cloth_latitudes("slit"), euler=[1, -1, 0, 0, 1, 1, 1, 1])


@breaks_open("sides_wrong")
def _() -> Latitudes:
    latitudes = cloth_latitudes("path across")
    bands = latitudes.bands
    return with_bands(latitudes, is_left=np.where(bands.polyline == 0, True, bands.is_left))


@breaks_open("shared_points")
def _() -> Latitudes:
    latitudes = cloth_latitudes("side")
    rows = rows_of_polyline(latitudes, 4)
    return replaced(latitudes, 4, np.r_[rows, rows[-1]])


@pytest.mark.parametrize("name", CLOTHS)
def test_open_latitudes_hold(name: str) -> None:
    latitudes = cloth_latitudes(name)
    for value in (latitudes.surface, latitudes):
        report = validate(value)
        assert report.holds, str(report)


@pytest.mark.parametrize("name", OPEN)
def test_wrong_open_latitudes_break_their_finding(name: str) -> None:
    assert not validate(OPEN[name]())[name].holds


def test_an_origin_inside_may_touch_a_border_with_its_ends_alone() -> None:
    surface = plate()
    right = started(surface, path_through(surface, (9, 0), (9, 16)))
    bent = started(surface, path_through(surface, (9, 3), (9, 0), (12, 0)))
    assert validate(right)["origins_astray"].holds
    assert validate(bent)["origins_astray"].ids == (0,)


# ---- a lattice


@breaks("lattice", "faces_too_small")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, face_offsets=np.insert(lattice.face_offsets, 1, 1))  # a corner becomes a face


@breaks("lattice", "faces_with_a_node_twice")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, face_nodes=changed(lattice.face_nodes, 0, lattice.face_nodes[1]))


@breaks("lattice", "nodes_unused")
def _(lattice: Lattice) -> Lattice:
    return replace(
        lattice,
        nodes=np.vstack([lattice.nodes, [[0.0, 0.0, 0.0]]]),
        node_latitude=np.r_[lattice.node_latitude, -1],
        node_station=np.r_[lattice.node_station, 0.0],
    )


def without_faces(lattice: Lattice, gone: list[int]) -> Lattice:
    faces = np.delete(lattice.face_nodes.reshape(-1, 3), gone, axis=0)
    return replace(lattice, face_nodes=faces.ravel(), face_offsets=3 * np.arange(len(faces) + 1))


@breaks("lattice", "edges_repeated")
def _(lattice: Lattice) -> Lattice:
    turned = lattice.face_nodes.reshape(-1, 3).copy()
    turned[5] = turned[5, ::-1]
    return replace(lattice, face_nodes=turned.ravel())


@breaks("lattice", "pinched_nodes")
def _(lattice: Lattice) -> Lattice:
    star = np.flatnonzero((lattice.face_nodes.reshape(-1, 3) == 2 * COLUMNS + 3).any(1))
    return without_faces(lattice, [star[0], star[3]])


@breaks("lattice", "border_loops_off")
def _(lattice: Lattice) -> Lattice:
    return without_faces(lattice, [30])


@breaks("lattice", "euler_off")
def _(lattice: Lattice) -> Lattice:
    return without_faces(lattice, [30])


@breaks("lattice", "edges_differ_from_faces")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, edges=lattice.edges[1:], edge_family=lattice.edge_family[1:])


@breaks("lattice", "edges_not_in_order")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, edges=changed(lattice.edges, 7, lattice.edges[7, ::-1]))


@breaks("lattice", "degenerate_edges")
def _(lattice: Lattice) -> Lattice:
    a, b = lattice.edges[40]
    return replace(lattice, nodes=changed(lattice.nodes, a, lattice.nodes[b] + 5e-4))


@breaks("lattice", "nodes_off_latitudes_of_size")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, node_station=changed(lattice.node_station, 30, lattice.node_station[30] + 1e-6))


@breaks("lattice", "flipped_faces_share")
def _(lattice: Lattice) -> Lattice:
    inside_out = lattice.face_nodes.reshape(-1, 3)[:, ::-1]
    return replace(lattice, face_nodes=inside_out.ravel())


@breaks("lattice", "edges_off_surface_of_spacing")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, nodes=lattice.nodes + 2.0 * lattice.latitudes.surface.size)


@breaks("lattice", "families_unknown")
def _(lattice: Lattice) -> Lattice:
    return replace(lattice, edge_family=changed(lattice.edge_family, 0, 3))


def first_of(lattice: Lattice, family: int) -> int:
    return int(np.flatnonzero(lattice.edge_family == family)[0])


@breaks("lattice", "latitudinal_edges_astray")
def _(lattice: Lattice) -> Lattice:
    at = first_of(lattice, LONGITUDINAL)
    return replace(lattice, edge_family=changed(lattice.edge_family, at, LATITUDINAL))


@breaks("lattice", "rings_open")
def _(lattice: Lattice) -> Lattice:
    at = first_of(lattice, LATITUDINAL)
    return replace(lattice, edge_family=changed(lattice.edge_family, at, LONGITUDINAL))


@breaks("lattice", "rings_too_small")
def _(lattice: Lattice) -> Lattice:
    gone = np.flatnonzero(lattice.node_latitude == 5)[2:]
    return replace(lattice, node_latitude=changed(lattice.node_latitude, gone, -1))


@breaks("lattice", "longitudinal_edges_astray")
def _(lattice: Lattice) -> Lattice:
    in_pocket = (lattice.node_latitude[lattice.edges] >= 4).all(1)
    across = np.flatnonzero(in_pocket & (np.ptp(lattice.node_latitude[lattice.edges], axis=1) > 0))
    return replace(lattice, edge_family=changed(lattice.edge_family, across[0], LONGITUDINAL))


# ---- a lattice with free borders, on open latitudes


def cloth_lattice(name: str, pattern: str) -> Lattice:
    return woven_cloth(name, pattern).lattice


OPEN_LATTICE: dict[str, Callable] = {}


def breaks_open_lattice(finding: str) -> Callable:
    """Register a function that makes a right lattice with free borders wrong in the way that one finding tells."""

    def register(breaker: Callable) -> Callable:
        OPEN_LATTICE[finding] = breaker
        return breaker

    return register


for _name in ("rings_cut_short", "border_edges_astray", "nodes_off_free_borders_of_size"):
    breaks("lattice", _name)(lambda _, name=_name: OPEN_LATTICE[name]())


def end_nodes(lattice: Lattice, p: int) -> np.ndarray:
    """The nodes of an open polyline, from its beginning to its end."""
    nodes = np.flatnonzero(lattice.node_latitude == p)
    return nodes[np.argsort(lattice.node_station[nodes])]


@breaks_open_lattice("rings_cut_short")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    last = end_nodes(lattice, 3)[-1]
    return replace(lattice, node_station=changed(lattice.node_station, last, lattice.node_station[last] - 1e-3))


@breaks_open_lattice("border_edges_astray")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    return replace(lattice, edge_family=changed(lattice.edge_family, free_border_edges(lattice)[2], POCKET))


@breaks_open_lattice("nodes_off_free_borders_of_size")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    last = end_nodes(lattice, 3)[-1]
    return replace(lattice, nodes=changed(lattice.nodes, (last, 1), lattice.nodes[last, 1] + 1e-3))


@breaks_open_lattice("rings_open")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    first, second = np.sort(end_nodes(lattice, 3)[:2])
    at = np.flatnonzero((lattice.edges == (first, second)).all(1))
    return replace(lattice, edge_family=changed(lattice.edge_family, at, LONGITUDINAL))


@breaks_open_lattice("rings_too_small")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    gone = end_nodes(lattice, 3)[1:]
    return replace(lattice, node_latitude=changed(lattice.node_latitude, gone, -1))


@breaks_open_lattice("longitudinal_edges_astray")
def _() -> Lattice:
    lattice = cloth_lattice("side", "triangular")
    first, second = np.sort(end_nodes(lattice, 3)[2:4])
    at = np.flatnonzero((lattice.edges == (first, second)).all(1))
    return replace(lattice, edge_family=changed(lattice.edge_family, at, LONGITUDINAL))


@breaks_open_lattice("border_loops_off")
def _() -> Lattice:
    return without_faces(cloth_lattice("side", "triangular"), [30])


@pytest.mark.parametrize("name", CLOTHS)
@pytest.mark.parametrize("pattern", ["triangular", "quad", "diagonal"])
def test_lattices_with_free_borders_hold(name: str, pattern: str) -> None:
    lattice = cloth_lattice(name, pattern)
    report = validate(lattice)
    assert report.holds, str(report)
    report = validate(woven_cloth(name, pattern).strands, lattice=lattice)
    assert report.holds, str(report)


@pytest.mark.parametrize("name", OPEN_LATTICE)
def test_wrong_lattices_with_free_borders_break_their_finding(name: str) -> None:
    assert not validate(OPEN_LATTICE[name]())[name].holds


# ---- strands


@breaks("strands", "strands_too_short")
def _(strands: Strands) -> Strands:
    return replace(strands, closed=changed(strands.closed, -1, True))


@breaks("strands", "strands_off_edges")
def _(strands: Strands) -> Strands:
    return replace(strands, nodes=changed(strands.nodes, 5, strands.nodes[50]))


@breaks("strands", "edges_not_in_one_strand")
def _(strands: Strands) -> Strands:
    return replace(strands, closed=changed(strands.closed, 0, False))


@breaks("strands", "strands_of_mixed_families")
def _(strands: Strands) -> Strands:
    return replace(strands, family=changed(strands.family, 0, LONGITUDINAL))  # a ring


# ---- what the tests above are run on


def report_of(noun: str, value: object) -> Report:
    return validate(value, lattice=tube_lattice()) if noun == "strands" else validate(value)


@pytest.mark.parametrize("noun", sorted(MAKERS))
def test_a_right_value_holds(noun: str) -> None:
    report = report_of(noun, MAKERS[noun]())
    assert report.holds, str(report)
    report.raise_if_broken()


@pytest.mark.parametrize("noun", sorted(MAKERS))
def test_every_finding_is_broken_by_a_test(noun: str) -> None:
    assert {finding.name for finding in report_of(noun, MAKERS[noun]())} == set(BREAKERS[noun])


@pytest.mark.parametrize(("noun", "name"), [(noun, name) for noun in BREAKERS for name in BREAKERS[noun]])
def test_a_wrong_value_breaks_its_finding(noun: str, name: str) -> None:
    report = report_of(noun, BREAKERS[noun][name](MAKERS[noun]()))
    assert not report[name].holds
    assert not report.holds
    assert f"FAIL {name}" in str(report)


def test_what_offends_is_named() -> None:
    broken = BREAKERS["latitudes"]["crossings"](tube_latitudes())
    finding = validate(broken)["crossings"]
    assert finding.kind == "polyline"
    assert set(finding.ids) <= {2, 4}
    assert finding.ids


def test_a_broken_report_raises_with_code_ids_and_remedy() -> None:
    broken = BREAKERS["latitudes"]["orphans"](tube_latitudes())
    with pytest.raises(Broken, match="BROKEN: orphans is 1, limit 0") as caught:
        validate(broken).raise_if_broken()
    assert caught.value.ids == (5,)
    assert caught.value.kind == "polyline"
    assert caught.value.remedy


def test_a_figure_that_is_no_number_does_not_hold() -> None:
    assert not Report((Finding("gap", float("nan"), 1.0),)).holds


def test_an_unknown_finding_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        Report(())["gap"]


def test_what_no_stage_gives_is_refused() -> None:
    with pytest.raises(Unsupported, match="A list alone cannot be checked"):
        validate([1, 2, 3])


def test_strands_are_checked_with_their_lattice_only() -> None:
    with pytest.raises(Unsupported, match="A Strands alone cannot be checked"):
        validate(tube_strands())
