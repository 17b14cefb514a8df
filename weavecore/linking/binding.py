"""Binding divided polylines and selvedges to each other by faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.bisecting import naked_edges
from weavecore.geometry.delaunay import improve_triangles
from weavecore.linking.cells import BandFaces, as_quads, faces_of_zip
from weavecore.linking.division import points_at
from weavecore.linking.evening import even_out
from weavecore.linking.patterns import Pattern
from weavecore.linking.pockets import fill_bands
from weavecore.linking.quads import pair_triangles
from weavecore.linking.rings import Rings, Zip
from weavecore.linking.selvedges import Hem, plain_strips
from weavecore.linking.splicing import faces_with_long_links, splice
from weavecore.linking.uprighting import find_fallen, node_normals, turn_upright
from weavecore.model.latitudes import Latitudes

_STRETCH = 0.97


@dataclass(frozen=True, eq=False)
class Bound:
    """Nodes and the faces between them.

    Parameters
    ----------
    rings : Rings
    hem : Hem
    nodes : (N, 3) float64
        Those of the polylines, of the selvedges, and hubs.
    latitude, station : (M,)
        The polyline of each node that is no hub, -1 on a selvedge, and the station on it.
    faces : BandFaces
    fallen : (k, 3) int64
        Nodes of the triangles at borders that look against the surface, if some of the borders are selvedges.
    """

    rings: Rings
    hem: Hem
    nodes: Floats
    latitude: Ints
    station: Floats
    faces: BandFaces
    fallen: Ints


def longest_link(spacing: float, edge_length: float) -> float:
    """The longest link between two rings: that of a triangle whose tip lies well beyond its base."""
    return _STRETCH * float(np.hypot(spacing, 1.25 * edge_length))


def bind(latitudes: Latitudes, rings: Rings, hem: Hem, design: Pattern, edge_length: float) -> Bound:
    """The zips of plain bands where they hold, and what fills the others."""
    counts, n_more = rings.counts, len(hem.places)
    latitude = np.concatenate([rows_of(offsets_of(counts)), np.full(n_more, -1)])
    station = np.concatenate([*rings.nodes, np.zeros(n_more)])
    n = len(latitude) - n_more
    places = np.concatenate([points_at(latitudes.polylines, latitude[:n], station[:n]), hem.places])
    ring_edges = np.concatenate([_ring_edges(counts, latitudes.polylines.closed), hem.edges()])
    strips = plain_strips(latitudes, hem.selvedges, hem.stations)
    zips = {band: zipped for band, zipped in rings.zips.items() if zipped.closed or strips[band]}
    zipped = _zip_faces(zips, counts, design)
    longest = longest_link(latitudes.spacing, edge_length)
    bad = faces_with_long_links(zipped, places, ring_edges, longest)
    is_wanted = np.ones(len(latitudes.bands), bool)
    is_wanted[np.setdiff1d(zipped.band, zipped.band[bad])] = False
    taken = np.concatenate([ring_edges, zipped.where(~is_wanted[zipped.band]).edges()])
    nodes, filled = _fill(latitudes, rings.nodes, hem, places, np.flatnonzero(is_wanted), taken, edge_length)
    faces = splice(zipped, bad, filled, ring_edges)
    if design.has_diagonals:
        faces = _evened(nodes, latitude, faces, ring_edges, longest)
    normals = node_normals(latitudes, latitude, station, faces, len(nodes))
    faces = turn_upright(latitudes.surface, nodes, normals, faces, ring_edges)
    fallen = np.zeros((0, 3), np.int64)
    if hem.selvedges:
        on_border = (latitude < 0) | (latitudes.generation[latitude] == 0)
        hubs = np.zeros(len(nodes) - len(latitude), bool)
        fallen = find_fallen(latitudes.surface, nodes, normals, faces)
        fallen = fallen[np.concatenate([on_border, hubs])[fallen].any(1)]
    if not design.has_diagonals:
        faces = pair_triangles(faces, nodes, ring_edges, leave_few=design.in_pairs)
    return Bound(rings, hem, nodes, latitude, station, faces, fallen)


def _evened(nodes: Floats, latitude: Ints, faces: BandFaces, ring_edges: Ints, longest: float) -> BandFaces:
    """The same faces with edges turned where that gives the nodes more even numbers of edges."""
    of_node = np.concatenate([latitude, np.full(len(nodes) - len(latitude), -1)])
    is_border = np.zeros(len(nodes), bool)
    is_border[naked_edges(faces.corners[:, :3])] = True
    triangles = even_out(nodes, of_node, is_border, faces.corners[:, :3], ring_edges, longest)
    return BandFaces(as_quads(triangles), faces.band)


def _zip_faces(zips: dict[int, Zip], counts: Ints, pattern: Pattern) -> BandFaces:
    """The faces of all plain bands."""
    first = offsets_of(counts)
    parts = []
    for band, zipped in zips.items():
        parent = np.arange(first[zipped.parent], first[zipped.parent + 1])
        child = np.arange(first[zipped.child], first[zipped.child + 1])
        corners = faces_of_zip(zipped, parent, child, has_diagonals=pattern.has_diagonals)
        parts.append(BandFaces(corners, np.full(len(corners), band)))
    return BandFaces.of(parts)


def _ring_edges(counts: Ints, closed: Bools) -> Ints:
    """(N, 2) the edges along the polylines, the lesser node first."""
    offsets = offsets_of(counts)
    after = next_in_loop(offsets)
    edges: Ints = np.sort(np.c_[np.arange(len(after)), after], axis=1)
    return np.delete(edges, offsets[1:][~closed] - 1, axis=0)


def _fill(
    latitudes: Latitudes, stations: list[Floats], hem: Hem, places: Floats, bands: Ints, taken: Ints, edge_length: float
) -> tuple[Floats, BandFaces]:
    """All nodes, hubs among them, and the faces that fill these bands."""
    if len(bands) == 0:
        return places, BandFaces.of([])
    filling = fill_bands(latitudes, stations, hem, places, bands, taken, edge_length)
    nodes = np.concatenate([places, filling.hubs])
    keys = np.unique(taken[:, 0] * np.int64(len(nodes)) + taken[:, 1])
    return nodes, BandFaces(as_quads(improve_triangles(nodes, filling.triangles, keys)), filling.band)
