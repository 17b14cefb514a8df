"""Where the nodes of a lattice lie on the latitudes, and where the surface looks there."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop
from weavecore.model.lattice import Lattice


def places_on_latitudes(lattice: Lattice, nodes: Ints) -> Floats:
    """Points (n, 3) at the stations of nodes that lie on latitudes."""
    polylines = lattice.latitudes.polylines
    start = _segments_at(lattice, nodes)
    along = lattice.node_station[nodes] - polylines.stations[start]
    length = polylines.segment_lengths[start]
    part = np.divide(along, length, out=np.zeros_like(along), where=length > 0)[:, None]
    after = next_in_loop(polylines.offsets)[start]
    places: Floats = polylines.points[start] * (1 - part) + polylines.points[after] * part
    return places


def node_normals(lattice: Lattice) -> Floats:
    """Direction (N, 3), not of unit length, in which the surface looks at each node."""
    from scipy.spatial import cKDTree

    surface, polylines = lattice.latitudes.surface, lattice.latitudes.polylines
    normals = np.zeros((lattice.n_nodes, 3))
    on_ring = np.flatnonzero(lattice.node_latitude >= 0)
    start = _segments_at(lattice, on_ring)
    after = next_in_loop(polylines.offsets)[start]
    normals[on_ring] = surface.face_normals[polylines.face[start]] + surface.face_normals[polylines.face[after]]
    hubs = np.flatnonzero(lattice.node_latitude < 0)
    if len(hubs):
        _, nearest = cKDTree(surface.vertices[surface.faces].mean(1)).query(lattice.nodes[hubs])
        normals[hubs] = surface.face_normals[nearest]
    return normals


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
