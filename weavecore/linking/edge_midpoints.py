"""The places of new nodes in the middle of edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.linking.resample import points_at
from weavecore.model.lattice import LATITUDINAL, Lattice


@dataclass(frozen=True, eq=False)
class Places:
    """Nodes: where they are, and on which latitude."""

    points: Floats
    latitude: Ints
    station: Floats


def middles_of_edges(lattice: Lattice, edges: Ints, is_border: Bools) -> Places:
    """The middle of each of the given edges: halfway along the latitude, or on the surface near the middle.

    On the border (``is_border``, of each edge) that is a place of the latitude there, or of the selvedge.
    """
    a, b = lattice.edges[edges].T
    points = (lattice.nodes[a] + lattice.nodes[b]) / 2.0
    on_ring = lattice.edge_family[edges] == LATITUDINAL
    latitude = np.where(on_ring, lattice.node_latitude[a], -1)
    length = lattice.latitudes.polylines.lengths[lattice.node_latitude[a]]
    low, high = np.sort([lattice.node_station[a], lattice.node_station[b]], axis=0)
    middle = (low + high) / 2.0
    # The edge that closes a ring runs from its last station over the end to its first.
    closing = (high - low > length / 2.0) & lattice.latitudes.polylines.closed[lattice.node_latitude[a]]
    middle = np.where(closing, (middle + length / 2.0) % length, middle)
    station = np.where(on_ring, middle, 0.0)
    points[on_ring] = points_at(lattice.latitudes.polylines, latitude[on_ring], station[on_ring])
    on_selvedge = is_border & ~on_ring
    inside = ~on_ring & ~on_selvedge
    points[inside] = onto_surface(points[inside], lattice)
    points[on_selvedge] = _onto_selvedges(points[on_selvedge], lattice)
    return Places(points, latitude, station)


def join_places(*parts: Places) -> Places:
    """All places, one part after the other."""
    return Places(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.latitude for part in parts]),
        np.concatenate([part.station for part in parts]),
    )


def places_of_nodes(lattice: Lattice, nodes: Ints) -> Places:
    """The places of nodes of a lattice."""
    return Places(lattice.nodes[nodes], lattice.node_latitude[nodes], lattice.node_station[nodes])


def _onto_selvedges(points: Floats, lattice: Lattice) -> Floats:
    """The closest points of the selvedges of the lattice's surface."""
    if len(points) == 0:
        return points
    surface = lattice.latitudes.surface
    tail, head = (ends[surface.is_selvedge] for ends in halfedge_ends(surface.faces))
    # Faces that are flat stand for their edges.
    return closest_faces(points, surface.vertices, np.stack([tail, head, head], axis=1))[1]


def onto_surface(points: Floats, lattice: Lattice) -> Floats:
    """The closest points of the lattice's surface."""
    surface = lattice.latitudes.surface
    return closest_faces(points, surface.vertices, surface.faces)[1]


# ----------------------------------------------------------------------
# A lattice of other cells on the same latitudes.


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
