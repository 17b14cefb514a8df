"""Putting the lattice together: faces, edges and their families."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.bisection import naked_edges
from weavecore.geometry.lawson_flips import improve_triangles
from weavecore.linking.band_faces import (
    NO_CORNER,
    BandFaces,
    are_among,
    as_quads,
    faces_of_zip,
    faces_with_long_links,
    pair_triangles,
    splice,
)
from weavecore.linking.flips import even_out, find_fallen, node_normals, turn_upright
from weavecore.linking.free_borders import Hem, plain_strips
from weavecore.linking.patterns import Pattern
from weavecore.linking.resample import points_at
from weavecore.linking.strips import Rings, Zip
from weavecore.linking.voronoi_fill import fill_bands
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, POCKET, Lattice


def assemble(latitudes: Latitudes, bound: Bound, pattern: Pattern, edge_length: float) -> Lattice:
    """The lattice of the given faces; nodes beyond those that have a station are hubs, kept where a face has them.

    An edge along a polyline is latitudinal.  One that binds a child to its parent is
    longitudinal, also where several meet in one band, unless it is longer than
    `longest_link`; so is one from a polyline to a selvedge, and all along one are.  The others are of the second
    step.
    """
    hem, latitude = bound.hem, bound.latitude
    corners, nodes = _without_idle_hubs(bound.faces.corners, bound.nodes, len(latitude))
    corners = corners[np.lexsort(np.sort(corners, axis=1).T)]
    n_hubs = len(nodes) - len(latitude)
    node_latitude = np.concatenate([latitude, np.full(n_hubs, -1, np.int64)])
    edges = BandFaces(corners, bound.faces.band).edges()
    family = edge_families(latitudes, edges, node_latitude)
    first_hub = len(latitude)
    on_hem = (edges >= first_hub - len(hem.places)) & (edges < first_hub)
    family[on_hem.any(1) & (on_hem | (node_latitude[edges] >= 0)).all(1)] = LONGITUDINAL
    too_long = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1) > longest_link(
        latitudes.spacing, edge_length
    )
    family[too_long & (family == LONGITUDINAL)] = POCKET
    family[are_among(edges[:, 0], edges[:, 1], hem.edges())] = LONGITUDINAL
    return Lattice(
        latitudes=latitudes,
        nodes=nodes,
        face_offsets=offsets_of((corners != NO_CORNER).sum(1)),
        face_nodes=corners[corners != NO_CORNER],
        edges=edges,
        edge_family=family,
        node_latitude=node_latitude,
        node_station=np.concatenate([bound.station, np.zeros(n_hubs)]),
        pattern=pattern.name,
        edge_length=edge_length,
    )


def _without_idle_hubs(corners: Ints, nodes: Floats, n_ring_nodes: int) -> tuple[Ints, Floats]:
    used = np.zeros(len(nodes) + 1, bool)
    used[:n_ring_nodes] = True
    used[corners] = True
    used[-1] = False  # where the missing corner of a triangle points
    number = np.where(used, np.cumsum(used) - 1, NO_CORNER)
    return number[corners], nodes[used[:-1]]


def edge_families(latitudes: Latitudes, edges: Ints, node_latitude: Ints) -> Ints:
    """Family of each edge by the polylines of its ends."""
    count = np.bincount(node_latitude[node_latitude >= 0], minlength=len(latitudes))
    first = np.cumsum(count) - count
    a, b = edges.T
    p, q = node_latitude[a], node_latitude[b]
    same = (p == q) & (p >= 0)
    gap = b - a
    ring = same & ((gap == 1) | ((a == first[p]) & (gap == count[p] - 1) & latitudes.polylines.closed[p]))
    n = len(latitudes)
    parents = latitudes.parents
    related = np.concatenate([parents[:, 0] * n + parents[:, 1], parents[:, 1] * n + parents[:, 0]])
    binds = np.isin(np.where((p >= 0) & (q >= 0), p * n + q, -1), related)
    family: Ints = np.where(ring, LATITUDINAL, np.where(binds, LONGITUDINAL, POCKET))
    return family


# ----------------------------------------------------------------------
# Binding divided polylines and selvedges to each other by faces.

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
