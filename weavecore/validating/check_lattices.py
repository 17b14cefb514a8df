"""What must hold of a `Lattice`: a manifold like the surface, its edges in the right families."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.lattice import FAMILIES, LATITUDINAL, LONGITUDINAL, Lattice
from weavecore.model.strands import Strands
from weavecore.validating.check_latitudes import OFF_LATITUDE, places_on_latitudes
from weavecore.validating.free_borders_of_bands import origins_along_borders
from weavecore.validating.report import Finding, count

SHORTEST_EDGE = 1e-3
"""An edge is longer than this part of the spacing."""

FLIPPED_SHARE = 0.002
"""Faces that look against the surface, at most: a lattice coarser than a fold turns a face or two."""

RINGS_BETWEEN = ("hexagonal", "kagome")
"""Patterns whose inner rings run between the latitudes."""

RINGS_LEFT_OUT = (*RINGS_BETWEEN, "diagonal")
"""Patterns that keep the rings on the latitudes along the borders only."""


def check_lattice(lattice: Lattice) -> Iterator[Finding]:
    """All findings about the faces, the edges and their families."""
    yield from _check_faces(lattice)
    yield from _check_topology(lattice)
    yield from _check_edges(lattice)
    yield from _check_places(lattice)
    yield from _check_families(lattice)


def halfedges_of(lattice: Lattice) -> tuple[Ints, Ints]:
    """Tail and head node of every side of every face."""
    return lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]


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
    tail, head = halfedges_of(lattice)
    n, surface = lattice.n_nodes, lattice.latitudes.surface
    key, times = np.unique(tail * n + head, return_counts=True)
    yield count("edges_repeated", key[times > 1] // n, "node")
    naked = ~np.isin(head * n + tail, key)
    fans = np.bincount(_fan_nodes(tail, head, lattice.face_offsets), minlength=n)
    yield count("pinched_nodes", np.flatnonzero(fans > 1), "node")
    yield Finding("border_loops_off", float(abs(_n_loops(tail[naked], head[naked]) - len(surface.borders))))
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
    tail, head = halfedges_of(lattice)
    n, (low, high) = lattice.n_nodes, lattice.edges.T
    sides = np.minimum(tail, head) * n + np.maximum(tail, head)
    listed, times = np.unique(low * n + high, return_counts=True)
    differ = np.concatenate([np.setxor1d(listed, sides), listed[times > 1]])
    yield count("edges_differ_from_faces", differ, "edge key")
    yield count("edges_not_in_order", np.flatnonzero(low >= high), "edge")
    short = lattice.edge_lengths <= SHORTEST_EDGE * lattice.latitudes.spacing
    yield count("degenerate_edges", np.flatnonzero(short), "edge")


def _check_places(lattice: Lattice) -> Iterator[Finding]:
    """Nodes lie at their stations, and faces look the way the surface looks."""
    on_ring = np.flatnonzero(lattice.node_latitude >= 0)
    off = np.linalg.norm(places_on_latitudes(lattice, on_ring) - lattice.nodes[on_ring], axis=1)
    size = lattice.latitudes.surface.size
    yield Finding("nodes_off_latitudes_of_size", float(off.max(initial=0.0)) / size, OFF_LATITUDE)
    middle, area = _middles_and_areas(lattice)
    surface = lattice.latitudes.surface
    near, _ = closest_faces(middle, surface.vertices, surface.faces)
    flipped = np.flatnonzero((surface.face_normals[near] * area).sum(1) <= 0)
    share = len(flipped) / max(1, lattice.n_faces)
    yield Finding("flipped_faces_share", share, FLIPPED_SHARE, tuple(flipped.tolist()), "face")


def _middles_and_areas(lattice: Lattice) -> tuple[Floats, Floats]:
    """Mean of the corners (F, 3) and area vector (F, 3) of each face, planar or not."""
    tail, head = halfedges_of(lattice)
    face = rows_of(lattice.face_offsets)
    corners = np.maximum(np.diff(lattice.face_offsets), 1)[:, None]
    middle = _sum_by_face(lattice.nodes[tail], face, lattice.n_faces) / corners
    cross = np.cross(lattice.nodes[tail] - middle[face], lattice.nodes[head] - middle[face]) / 2
    return middle, _sum_by_face(cross, face, lattice.n_faces)


def _sum_by_face(values: Floats, face: Ints, n_faces: int) -> Floats:
    sums: Floats = np.stack([np.bincount(face, column, minlength=n_faces) for column in values.T], axis=1)
    return sums


def _check_families(lattice: Lattice) -> Iterator[Finding]:
    """Latitudinal edges run along latitudes, longitudinal ones bind a child to a parent (§5) or end on a selvedge.

    In patterns whose rings run between the latitudes that is asked of the borders only.
    """
    family = lattice.edge_family
    unknown = (family < 0) | (family >= len(FAMILIES))
    yield count("families_unknown", np.flatnonzero(unknown), "edge")
    latitude = lattice.node_latitude[lattice.edges]
    on_one = (latitude[:, 0] == latitude[:, 1]) & (latitude[:, 0] >= 0)
    is_between = lattice.pattern in RINGS_BETWEEN
    astray = (family == LATITUDINAL) & ~on_one & (not is_between)
    yield count("latitudinal_edges_astray", np.flatnonzero(astray), "edge")
    yield from _check_rings(lattice, (family == LATITUDINAL) & on_one)
    n, parents = len(lattice.latitudes), lattice.latitudes.parents
    bound = np.isin(latitude[:, 0] * n + latitude[:, 1], np.r_[parents @ (n, 1), parents @ (1, n)])
    # Of a surface that has no selvedge no edge ends on one.
    hem = hem_edges(lattice) if lattice.latitudes.surface.is_selvedge.any() else np.zeros(0, np.int64)
    on_hem = np.isin(np.arange(lattice.n_nodes), lattice.edges[hem]) & (lattice.node_latitude < 0)
    astray = (family == LONGITUDINAL) & ~bound & (not is_between) & ~on_hem[lattice.edges].any(1)
    astray[hem] = False
    yield count("longitudinal_edges_astray", np.flatnonzero(astray), "edge")
    yield from check_hem(lattice)


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
    yield count("rings_too_small", np.flatnonzero(asked[:-1] & (per_ring < fewest)), "polyline")
    open_ = rings[~polylines.closed[rings]]
    short = np.abs(lattice.node_station[ends] - np.stack([np.zeros(len(open_)), polylines.lengths[open_]], axis=1))
    room = OFF_LATITUDE * lattice.latitudes.surface.size
    yield count("rings_cut_short", open_[(short > room).any(1)], "polyline")


# ----------------------------------------------------------------------
# What must hold of `Strands`: every edge of the lattice lies in exactly one, and rings keep to themselves.


def check_strands(strands: Strands, lattice: Lattice) -> Iterator[Finding]:
    """All findings about strands and the lattice whose edges they part among them."""
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
    # A longitude may go on through a pocket; a ring keeps to itself.
    family = lattice.edge_family[edge]
    mixed = (family < strands.family[strand]) | ((strands.family[strand] == LATITUDINAL) & (family != LATITUDINAL))
    yield count("strands_of_mixed_families", strand[mixed], "strand")


# ----------------------------------------------------------------------
# What must hold of the border of a lattice: rods along the origins there, and along the selvedges between them.


def hem_edges(lattice: Lattice) -> Ints:
    """Edges (h,) of a single face that do not run along an origin on a border."""
    n = lattice.n_nodes
    tail, head = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    side, times = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head), return_counts=True)
    naked = np.isin(lattice.edges.min(1) * n + lattice.edges.max(1), side[times == 1])
    along = np.append(np.zeros(len(lattice.latitudes), bool), False)
    borders = origins_along_borders(lattice.latitudes.surface)
    along[: len(borders)] = borders
    a, b = lattice.node_latitude[lattice.edges].T
    on_origin = (a == b) & along[a] & (lattice.edge_family == LATITUDINAL)
    hem: Ints = np.flatnonzero(naked & ~on_origin)
    return hem


def check_hem(lattice: Lattice) -> Iterator[Finding]:
    """Edges of a single face run along an origin on a border, or are longitudinal and end on selvedges."""
    surface, hem = lattice.latitudes.surface, hem_edges(lattice)
    selvedge = np.flatnonzero(surface.is_selvedge)
    astray = hem[lattice.edge_family[hem] != LONGITUDINAL] if len(selvedge) else hem
    yield count("border_edges_astray", astray, "edge")
    off = np.zeros(0)
    if len(selvedge) and len(hem):
        tail, head = (ends[selvedge] for ends in halfedge_ends(surface.faces))
        nodes = lattice.nodes[np.unique(lattice.edges[hem])]
        # Faces that are flat stand for their edges.
        _, place = closest_faces(nodes, surface.vertices, np.stack([tail, head, head], axis=1))
        off = np.linalg.norm(place - nodes, axis=1)
    yield Finding("nodes_off_selvedges_of_size", float(off.max(initial=0.0)) / surface.size, OFF_LATITUDE)
