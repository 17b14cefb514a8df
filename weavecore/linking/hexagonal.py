"""Hexagonal: the dual of a triangular lattice, one node a triangle.

Three edges meet at every inner node: two of a ring that zigzags between two latitudes, and one that
ties it to the next ring.  The borders keep their rings.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Ints, rows_of
from weavecore.geometry.polygon_mesh import NONE, faces_about_nodes, find_fans
from weavecore.linking.edge_midpoints import (
    Places,
    join_places,
    middles_of_edges,
    onto_surface,
    places_of_nodes,
    rebuild,
)
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, Lattice


def hexagonal_lattice(lattice: Lattice, pattern: str) -> Lattice:
    """The dual of a lattice: its nodes are the middles of the faces, and those of the borders."""
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    face = rows_of(lattice.face_offsets)
    border = np.flatnonzero(fans.on_border)
    halves = np.flatnonzero(fans.n_faces == 1)
    half = np.full(lattice.n_edges, NONE, np.int64)
    half[halves] = lattice.n_faces + np.arange(len(halves))
    number = np.full(lattice.n_nodes, NONE, np.int64)
    number[border] = lattice.n_faces + len(halves) + np.arange(len(border))
    middles = middles_of_edges(lattice, halves, np.ones(len(halves), bool))
    places = join_places(_middles_of_faces(lattice), middles, places_of_nodes(lattice, border))
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
            _turned(lattice.edge_family[across]),
            _turned(lattice.edge_family[fans.side[on_half]]),
            np.tile(lattice.edge_family[halves], 2),
        ]
    )
    return rebuild(lattice, pattern, places, offsets, corners, edges, families)


def _turned(family: Ints) -> Ints:
    """Family of the edge across one: across a ring it is longitudinal, across a longitude it follows the ring."""
    turned: Ints = np.where(family == LATITUDINAL, LONGITUDINAL, np.where(family == LONGITUDINAL, LATITUDINAL, family))
    return turned


def _middles_of_faces(lattice: Lattice) -> Places:
    count = np.diff(lattice.face_offsets)
    middle = np.add.reduceat(lattice.nodes[lattice.face_nodes], lattice.face_offsets[:-1], axis=0) / count[:, None]
    points = onto_surface(middle, lattice)
    return Places(points, np.full(len(points), -1, np.int64), np.zeros(len(points)))
