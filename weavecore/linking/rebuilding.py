"""A lattice of other cells on the same latitudes."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Ints
from weavecore.linking.midpoints import Places
from weavecore.model.lattice import Lattice


def rebuild(
    lattice: Lattice, pattern: str, places: Places, offsets: Ints, corners: Ints, edges: Ints, families: Ints
) -> Lattice:
    """The lattice with these nodes, ragged faces and edges (E, 2); nodes without a face are left out."""
    used = np.bincount(corners, minlength=len(places.points)) > 0
    number = np.cumsum(used) - 1
    edges = np.sort(number[edges], axis=1)
    order = np.lexsort(edges.T[::-1])
    return Lattice(
        latitudes=lattice.latitudes,
        nodes=places.points[used],
        face_offsets=offsets,
        face_nodes=number[corners],
        edges=edges[order],
        edge_family=families[order],
        node_latitude=places.latitude[used],
        node_station=places.station[used],
        pattern=pattern,
        edge_length=lattice.edge_length,
    )
