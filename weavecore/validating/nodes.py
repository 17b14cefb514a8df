"""Where the nodes of a lattice lie on the latitudes."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop
from weavecore.model.lattice import Lattice

OFF_LATITUDE = 1e-9
"""Parts of the surface's size by which a node may miss its station on its latitude, or the selvedge that it is on."""


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
