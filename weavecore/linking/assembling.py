"""Putting the lattice together: faces, edges and their families."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of
from weavecore.linking.binding import Bound, longest_link
from weavecore.linking.cells import NO_CORNER, BandFaces
from weavecore.linking.patterns import Pattern
from weavecore.linking.splicing import are_among
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
