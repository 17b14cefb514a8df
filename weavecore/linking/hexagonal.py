"""Hexagonal: the dual of a triangular lattice, one node a triangle.

Three edges meet at every inner node: two of a ring that zigzags between two latitudes, and one that
joins it to the next ring.  The borders keep their rings.

    ●───●───●              ·           a face for each node, a node for each face, and across each edge one edge;
     ╲ ╱ ╲ ╱     →      ·     ·        on a border a node in the middle of each edge as well
      ●───●             │     │

Time is O(N log N) for N nodes, for the closest points on the surface.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Ints, rows_of
from weavecore.geometry.polygon_mesh import NONE, faces_about_nodes, find_fans
from weavecore.linking.derived_lattice import (
    DerivedNodes,
    closest_on_surface,
    concatenate_nodes,
    edge_midpoints,
    nodes_of,
    rebuild_lattice,
)
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, Lattice


def hexagonal_lattice(lattice: Lattice, pattern: str) -> Lattice:
    """The dual of a lattice: its nodes are the centroids of the faces, and the nodes of the borders.

    Parameters
    ----------
    lattice : Lattice
        Triangular.
    pattern : str
        Name of the new pattern.
    """
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    face = rows_of(lattice.face_offsets)
    border = np.flatnonzero(fans.on_border)
    halves = np.flatnonzero(fans.n_faces == 1)
    half = np.full(lattice.n_edges, NONE, np.int64)
    half[halves] = lattice.n_faces + np.arange(len(halves))
    number = np.full(lattice.n_nodes, NONE, np.int64)
    number[border] = lattice.n_faces + len(halves) + np.arange(len(border))
    middles = edge_midpoints(lattice, halves, np.ones(len(halves), bool))
    nodes = concatenate_nodes(_face_centroids(lattice), middles, nodes_of(lattice, border))
    offsets, corners = faces_about_nodes(fans, face, half[fans.first_side], half[fans.last_side], number)
    # Across each inner edge its two faces are joined.
    order = np.argsort(fans.side, kind="stable")
    pair = np.flatnonzero(fans.side[order][1:] == fans.side[order][:-1])
    across = fans.side[order[pair]]
    on_half = np.flatnonzero(fans.n_faces[fans.side] == 1)
    ends = lattice.edges[halves].T
    edges = np.concatenate(
        [
            np.c_[face[order[pair]], face[order[pair + 1]]],
            np.c_[face[on_half], half[fans.side[on_half]]],
            *(np.c_[number[end], half[halves]] for end in ends),
        ]
    )
    families = np.concatenate(
        [
            _crossing_family(lattice.edge_family[across]),
            _crossing_family(lattice.edge_family[fans.side[on_half]]),
            np.tile(lattice.edge_family[halves], 2),
        ]
    )
    return rebuild_lattice(lattice, pattern, nodes, offsets, corners, edges, families)


def _crossing_family(family: Ints) -> Ints:
    """Family of the edge that crosses one: across a ring longitudinal, across a longitudinal edge along the ring."""
    crossing: Ints = np.where(
        family == LATITUDINAL, LONGITUDINAL, np.where(family == LONGITUDINAL, LATITUDINAL, family)
    )
    return crossing


def _face_centroids(lattice: Lattice) -> DerivedNodes:
    count = np.diff(lattice.face_offsets)
    centroid = np.add.reduceat(lattice.nodes[lattice.face_nodes], lattice.face_offsets[:-1], axis=0) / count[:, None]
    points = closest_on_surface(centroid, lattice)
    return DerivedNodes(points, np.full(len(points), -1, np.int64), np.zeros(len(points)))
