"""Building a lattice of other cells from one that is linked already: new nodes at midpoints, and renumbering.

New nodes lie on the surface: on a latitude they are halfway between two nodes by arc length, on a free border at its
closest point, elsewhere at the closest point of the surface.  The patterns (`kagome`, `hexagonal`, `diagonal`) give
the nodes, faces and edges; `rebuild_lattice` leaves out nodes without a face and sorts the edges.

Time is O(N log N) for N new nodes, for the closest points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.linking.arc_length import points_at
from weavecore.model.lattice import LATITUDINAL, Lattice


@dataclass(frozen=True, eq=False)
class DerivedNodes:
    """Nodes of a derived lattice.

    Parameters
    ----------
    points : (n, 3) float64
    latitude : (n,) int64
        Polyline, or -1 between polylines.
    station : (n,) float64
        Arc length along it, 0 between polylines.
    """

    points: Floats
    latitude: Ints
    station: Floats


def edge_midpoints(lattice: Lattice, edges: Ints, is_border: Bools) -> DerivedNodes:
    """Nodes in the middle of edges: halfway along the latitude, or on the surface near the middle.

    Parameters
    ----------
    lattice : Lattice
    edges : (k,) int64
        Indices of ``lattice.edges``.
    is_border : (k,) bool
        Whether each lies on the border: its node then lies on the latitude there, or on the free border.
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
    on_free_border = is_border & ~on_ring
    inside = ~on_ring & ~on_free_border
    points[inside] = closest_on_surface(points[inside], lattice)
    points[on_free_border] = _closest_on_free_borders(points[on_free_border], lattice)
    return DerivedNodes(points, latitude, station)


def nodes_of(lattice: Lattice, nodes: Ints) -> DerivedNodes:
    """Nodes of a lattice that stay.

    Parameters
    ----------
    lattice : Lattice
    nodes : (k,) int64
    """
    return DerivedNodes(lattice.nodes[nodes], lattice.node_latitude[nodes], lattice.node_station[nodes])


def concatenate_nodes(*parts: DerivedNodes) -> DerivedNodes:
    """All nodes, one part after the other."""
    return DerivedNodes(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.latitude for part in parts]),
        np.concatenate([part.station for part in parts]),
    )


def closest_on_surface(points: Floats, lattice: Lattice) -> Floats:
    """The closest points of the lattice's surface.

    Parameters
    ----------
    points : (k, 3) float64
    lattice : Lattice

    Returns
    -------
    (k, 3) float64
    """
    surface = lattice.latitudes.surface
    return surface.face_finder.find(points)[1]


def _closest_on_free_borders(points: Floats, lattice: Lattice) -> Floats:
    if len(points) == 0:
        return points
    surface = lattice.latitudes.surface
    tail, head = (ends[surface.is_free_border] for ends in halfedge_ends(surface.faces))
    # Degenerate triangles stand for the edges.
    return closest_faces(points, surface.vertices, np.stack([tail, head, head], axis=1))[1]


def rebuild_lattice(
    lattice: Lattice, pattern: str, nodes: DerivedNodes, offsets: Ints, corners: Ints, edges: Ints, families: Ints
) -> Lattice:
    """The lattice with other nodes, faces and edges; nodes without a face are left out.

    Parameters
    ----------
    lattice : Lattice
        From which the new one is derived.
    pattern : str
        Name of the new one.
    nodes : DerivedNodes
    offsets : (F+1,) int64
    corners : (C,) int64
        Corners of face ``f``: ``corners[offsets[f]:offsets[f + 1]]``, counter-clockwise seen from outside.
    edges : (E, 2) int64
        Each once, in any order.
    families : (E,) int64
    """
    used = np.bincount(corners, minlength=len(nodes.points)) > 0
    number = np.cumsum(used) - 1
    edges = np.sort(number[edges], axis=1)
    order = np.lexsort(edges.T[::-1])
    return Lattice(
        latitudes=lattice.latitudes,
        nodes=nodes.points[used],
        face_offsets=offsets,
        face_nodes=number[corners],
        edges=edges[order],
        edge_family=families[order],
        node_latitude=nodes.latitude[used],
        node_station=nodes.station[used],
        pattern=pattern,
        edge_length=lattice.edge_length,
    )
