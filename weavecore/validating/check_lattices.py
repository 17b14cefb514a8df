"""Checks of `Lattice` and `Strands`.

A lattice is a manifold with the topology of its surface; its edges are in the right families (Yan et al. 2016, §5):
latitudinal ones run along latitudes, longitudinal ones bind a child to a parent or end on a *free border*, from which
no distance starts. Every edge lies in exactly one strand, and rings have latitudinal edges only.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.lattice import FAMILIES, LATITUDINAL, LONGITUDINAL, Lattice
from weavecore.model.lattice_fit import edge_gaps, inverted_faces
from weavecore.model.strands import Strands
from weavecore.validating.band_curves import origins_along_borders
from weavecore.validating.report import Finding, count

_OFF_LATITUDE = 1e-9
"""Parts of the surface's size by which a node may miss its station on its latitude, or its free border: rounding."""

_SHORTEST_EDGE = 1e-3
"""Edges are longer than this part of the spacing: shorter ones are degenerate."""

_INVERTED_SHARE = 0.002
"""Greatest share of faces whose normal is against the surface: a lattice coarser than a fold inverts a face or two."""

_GAP = 0.6
"""Distance of an edge from the surface as a part of the spacing or of the edge length, whichever is longer: an edge
over a crease of 90° leaves it by up to 0.5 of its own length."""

RINGS_BETWEEN = ("hexagonal", "kagome")
"""Patterns whose inner rings run between the latitudes."""

RINGS_LEFT_OUT = (*RINGS_BETWEEN, "diagonal")
"""Patterns that keep the rings on the latitudes along the borders only."""


def check_lattice(lattice: Lattice) -> Iterator[Finding]:
    """Check the faces, the edges and their families.

    Parameters
    ----------
    lattice : Lattice
    """
    yield from _check_faces(lattice)
    yield from _check_topology(lattice)
    yield from _check_edges(lattice)
    yield from _check_places(lattice)
    yield from _check_families(lattice)


def check_strands(strands: Strands, lattice: Lattice) -> Iterator[Finding]:
    """Check that strands partition the edges of a lattice.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice
    """
    counts = np.diff(strands.offsets)
    yield count("strands_too_short", np.flatnonzero(counts < np.where(strands.closed, 3, 2)), "strand")
    owner = rows_of(strands.offsets)
    after = next_in_loop(strands.offsets)
    # An open strand has no step from its last node back to its first.
    step = np.flatnonzero(strands.closed[owner] | (after > np.arange(len(owner))))
    a, b, n = strands.nodes[step], strands.nodes[after[step]], lattice.n_nodes
    keys = lattice.edges @ (n, 1)
    order = np.argsort(keys, kind="stable")
    wanted = np.minimum(a, b) * n + np.maximum(a, b)
    at = np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)
    edge = order[at]
    known = keys[edge] == wanted
    yield count("strands_off_edges", owner[step[~known]], "strand")
    edge, strand = edge[known], owner[step[known]]
    times = np.bincount(edge, minlength=lattice.n_edges)
    yield count("edges_not_in_one_strand", np.flatnonzero(times != 1), "edge")
    # A longitude may go on through a pocket, or along a ring that is broken there; no other rod has edges of two kinds.
    family = lattice.edge_family[edge]
    least, most = np.full(len(strands), len(FAMILIES)), np.full(len(strands), -1)
    np.minimum.at(least, strand, family)
    np.maximum.at(most, strand, family)
    mixed = strands.family != np.where(least == most, least, LONGITUDINAL)
    yield count("strands_of_mixed_families", np.flatnonzero(mixed), "strand")


def _check_faces(lattice: Lattice) -> Iterator[Finding]:
    """Faces have three distinct corners at least, and every node is in one."""
    face = rows_of(lattice.face_offsets)
    yield count("faces_too_small", np.flatnonzero(np.diff(lattice.face_offsets) < 3), "face")
    corner = face * lattice.n_nodes + lattice.face_nodes
    key, times = np.unique(corner, return_counts=True)
    yield count("faces_with_a_node_twice", key[times > 1] // max(1, lattice.n_nodes), "face")
    used = np.bincount(lattice.face_nodes, minlength=lattice.n_nodes) > 0
    yield count("nodes_unused", np.flatnonzero(~used), "node")


def _check_topology(lattice: Lattice) -> Iterator[Finding]:
    """The lattice is an oriented manifold with the surface's borders and Euler characteristic."""
    tail, head = _halfedges_of(lattice)
    n, surface = lattice.n_nodes, lattice.latitudes.surface
    key, times = np.unique(tail * n + head, return_counts=True)
    yield count("edges_repeated", key[times > 1] // n, "node")
    has_no_twin = ~np.isin(head * n + tail, key)
    fans = np.bincount(_fan_nodes(tail, head, lattice.face_offsets), minlength=n)
    yield count("pinched_nodes", np.flatnonzero(fans > 1), "node")
    yield Finding("border_loops_off", float(abs(_n_loops(tail[has_no_twin], head[has_no_twin]) - len(surface.borders))))
    n_edges = len(np.unique(np.minimum(tail, head) * n + np.maximum(tail, head)))
    euler = len(np.unique(tail)) - n_edges + lattice.n_faces
    yield Finding("euler_off", float(abs(euler - surface.euler_characteristic)))


def _fan_nodes(tail: Ints, head: Ints, offsets: Ints) -> Ints:
    """The node of each fan: corners at the same node, joined across the sides that they share."""
    n = int(max(tail.max(initial=-1), head.max(initial=-1))) + 1
    forth, back = tail * n + head, head * n + tail
    order = np.argsort(forth, kind="stable")
    at = np.minimum(np.searchsorted(forth, back, sorter=order), len(forth) - 1)
    twin = order[at]
    inner = np.flatnonzero(forth[twin] == back)
    turned = next_in_loop(offsets)[twin[inner]]
    _, fan = np.unique(_component(inner, turned, len(tail)), return_index=True)
    nodes: Ints = tail[fan]
    return nodes


def _n_loops(tail: Ints, head: Ints) -> int:
    """How many connected pieces directed edges make."""
    nodes, ends = np.unique(np.concatenate([tail, head]), return_inverse=True)
    a, b = ends.reshape(2, -1)
    return len(np.unique(_component(a, b, len(nodes))))


def _component(a: Ints, b: Ints, n: int) -> Ints:
    """Connected component (n,) of each of ``n`` things, linked by pairs."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(a), bool), (a, b)), shape=(n, n))
    return connected_components(links, directed=False)[1].astype(np.int64)


def _check_edges(lattice: Lattice) -> Iterator[Finding]:
    """The edges are the sides of the faces, each listed once, and none has no length."""
    tail, head = _halfedges_of(lattice)
    n, (low, high) = lattice.n_nodes, lattice.edges.T
    sides = np.minimum(tail, head) * n + np.maximum(tail, head)
    listed, times = np.unique(low * n + high, return_counts=True)
    differ = np.concatenate([np.setxor1d(listed, sides), listed[times > 1]])
    yield count("edges_differ_from_faces", differ, "edge key")
    yield count("edges_not_in_order", np.flatnonzero(low >= high), "edge")
    short = lattice.edge_lengths <= _SHORTEST_EDGE * lattice.latitudes.spacing
    yield count("degenerate_edges", np.flatnonzero(short), "edge")


def _check_places(lattice: Lattice) -> Iterator[Finding]:
    """Nodes lie at their stations, or anywhere on the surface; faces look the way the surface looks."""
    surface = lattice.latitudes.surface
    on_ring = np.flatnonzero((lattice.node_latitude >= 0) & (_on_border(lattice) | (not lattice.off_latitudes)))
    off = np.linalg.norm(_places_on_latitudes(lattice, on_ring) - lattice.nodes[on_ring], axis=1)
    yield Finding("nodes_off_latitudes_of_size", float(off.max(initial=0.0)) / surface.size, _OFF_LATITUDE)
    if lattice.off_latitudes:
        _, place = surface.face_finder.find(lattice.nodes)
        off = np.linalg.norm(place - lattice.nodes, axis=1)
        yield Finding("nodes_off_surface_of_size", float(off.max(initial=0.0)) / surface.size, _OFF_LATITUDE)
    flipped = inverted_faces(lattice)
    share = len(flipped) / max(1, lattice.n_faces)
    yield Finding("flipped_faces_share", share, _INVERTED_SHARE, tuple(flipped.tolist()), "face")
    reach = max(lattice.latitudes.spacing, lattice.edge_length)
    gaps = edge_gaps(lattice) / reach
    off_edges = np.flatnonzero(gaps > _GAP)
    yield Finding("edges_off_surface_of_spacing", float(gaps.max(initial=0.0)), _GAP, tuple(off_edges.tolist()), "edge")


def _on_border(lattice: Lattice) -> Bools:
    """(N,) nodes on a side of a single face."""
    tail, head = _halfedges_of(lattice)
    n = lattice.n_nodes
    naked = ~np.isin(head * n + tail, tail * n + head)
    flag = np.zeros(n, bool)
    flag[tail[naked]] = flag[head[naked]] = True
    return flag


def _check_families(lattice: Lattice) -> Iterator[Finding]:
    """Latitudinal edges run along latitudes, longitudinal ones bind a child to a parent (§5) or end on a free border.

    In patterns whose rings run between the latitudes that is asked of the borders only.
    """
    family = lattice.edge_family
    unknown = (family < 0) | (family >= len(FAMILIES))
    yield count("families_unknown", np.flatnonzero(unknown), "edge")
    latitude = lattice.node_latitude[lattice.edges]
    on_one = (latitude[:, 0] == latitude[:, 1]) & (latitude[:, 0] >= 0)
    runs_between = lattice.pattern in RINGS_BETWEEN
    astray = (family == LATITUDINAL) & ~on_one & (not runs_between)
    yield count("latitudinal_edges_astray", np.flatnonzero(astray), "edge")
    yield from _check_rings(lattice, (family == LATITUDINAL) & on_one)
    n, parents = len(lattice.latitudes), lattice.latitudes.parents
    bound = np.isin(latitude[:, 0] * n + latitude[:, 1], np.r_[parents @ (n, 1), parents @ (1, n)])
    # On a surface without free borders no edge ends on one.
    on_border = free_border_edges(lattice) if lattice.latitudes.surface.is_free_border.any() else np.zeros(0, np.int64)
    on_free_border = np.isin(np.arange(lattice.n_nodes), lattice.edges[on_border]) & (lattice.node_latitude < 0)
    astray = (family == LONGITUDINAL) & ~bound & (not runs_between) & ~on_free_border[lattice.edges].any(1)
    astray[on_border] = False
    yield count("longitudinal_edges_astray", np.flatnonzero(astray), "edge")
    yield from _check_free_borders(lattice)


def _check_rings(lattice: Lattice, on_ring: Bools) -> Iterator[Finding]:
    """Rings close on their latitudes, and rods along open ones reach from end to end.

    In patterns whose rings run between the latitudes, or are left out, that is asked of the borders only.
    """
    polylines = lattice.latitudes.polylines
    asked = np.ones(len(polylines) + 1, bool)
    if lattice.pattern in RINGS_LEFT_OUT:
        asked[len(lattice.latitudes.surface.origins) :] = False
        asked[: len(lattice.latitudes.surface.origins)] = origins_along_borders(lattice.latitudes.surface)
    asked[-1] = False
    of_ring = np.flatnonzero(asked[lattice.node_latitude])
    latitude = lattice.node_latitude[of_ring]
    wanted = np.full(lattice.n_nodes, 2)
    order = of_ring[np.lexsort([lattice.node_station[of_ring], latitude])]
    rings, first = np.unique(lattice.node_latitude[order], return_index=True)
    last = np.append(first[1:], len(order))[: len(first)] - 1
    ends = np.stack([order[first], order[last]], axis=1)[~polylines.closed[rings]]
    wanted[ends] = 1
    degree = np.bincount(lattice.edges[on_ring].ravel(), minlength=lattice.n_nodes)
    yield count("rings_open", latitude[degree[of_ring] != wanted[of_ring]], "polyline")
    fewest = np.where(polylines.closed, 3, 2)
    per_ring = np.bincount(latitude, minlength=len(polylines))
    # A ring without a node was left out as too small to be bent; a border never is.
    is_linked = (per_ring > 0) | (lattice.latitudes.generation == 0)
    yield count("rings_too_small", np.flatnonzero(asked[:-1] & is_linked & (per_ring < fewest)), "polyline")
    open_ = rings[~polylines.closed[rings]]
    short = np.abs(lattice.node_station[ends] - np.stack([np.zeros(len(open_)), polylines.lengths[open_]], axis=1))
    room = _OFF_LATITUDE * lattice.latitudes.surface.size
    yield count("rings_cut_short", open_[(short > room).any(1)], "polyline")


def free_border_edges(lattice: Lattice) -> Ints:
    """Find the edges of a single face that do not run along an origin on a border.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    (h,) int64
    """
    n = lattice.n_nodes
    tail, head = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    side, times = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head), return_counts=True)
    has_one_face = np.isin(lattice.edges.min(1) * n + lattice.edges.max(1), side[times == 1])
    along = np.append(np.zeros(len(lattice.latitudes), bool), False)
    borders = origins_along_borders(lattice.latitudes.surface)
    along[: len(borders)] = borders
    a, b = lattice.node_latitude[lattice.edges].T
    on_origin = (a == b) & along[a] & (lattice.edge_family == LATITUDINAL)
    edges: Ints = np.flatnonzero(has_one_face & ~on_origin)
    return edges


def _check_free_borders(lattice: Lattice) -> Iterator[Finding]:
    """Edges of a single face run along an origin on a border, or are longitudinal and end on free borders."""
    surface, edges = lattice.latitudes.surface, free_border_edges(lattice)
    free = np.flatnonzero(surface.is_free_border)
    astray = edges[lattice.edge_family[edges] != LONGITUDINAL] if len(free) else edges
    yield count("border_edges_astray", astray, "edge")
    off = np.zeros(0)
    if len(free) and len(edges):
        tail, head = (ends[free] for ends in halfedge_ends(surface.faces))
        nodes = lattice.nodes[np.unique(lattice.edges[edges])]
        # A degenerate face stands for its edge.
        _, place = closest_faces(nodes, surface.vertices, np.stack([tail, head, head], axis=1))
        off = np.linalg.norm(place - nodes, axis=1)
    yield Finding("nodes_off_free_borders_of_size", float(off.max(initial=0.0)) / surface.size, _OFF_LATITUDE)


def _halfedges_of(lattice: Lattice) -> tuple[Ints, Ints]:
    """Tail and head node (C,) of every side of every face."""
    return lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]


def _places_on_latitudes(lattice: Lattice, nodes: Ints) -> Floats:
    """Points (n, 3) at the stations of nodes that lie on latitudes."""
    polylines = lattice.latitudes.polylines
    start = _segments_at(lattice, nodes)
    along = lattice.node_station[nodes] - polylines.stations[start]
    length = polylines.segment_lengths[start]
    part = np.divide(along, length, out=np.zeros_like(along), where=length > 0)[:, None]
    after = next_in_loop(polylines.offsets)[start]
    places: Floats = polylines.points[start] * (1 - part) + polylines.points[after] * part
    return places


def _segments_at(lattice: Lattice, nodes: Ints) -> Ints:
    """First point of the segment on which each node lies."""
    polylines = lattice.latitudes.polylines
    latitude = lattice.node_latitude[nodes]
    # Stations of all polylines end to end make one rising row to search in.
    base = np.concatenate([[0.0], np.cumsum(polylines.lengths)])
    row = base[polylines.owner] + polylines.stations
    found = np.searchsorted(row, base[latitude] + lattice.node_station[nodes], side="right") - 1
    start: Ints = np.clip(found, polylines.offsets[latitude], polylines.offsets[latitude + 1] - 1)
    return start
