"""Kagome: rods through the midpoints of the edges of a triangular lattice (its medial graph).

         ●                    Two rods cross at every inner node.  Each triangle of the lattice contains a small one,
        ╱ ╲                   and around each of its nodes there is a polygon, a hexagon where the node has six edges.
       x───x      x new node  Rods run halfway between the latitudes and along both diagonals.
      ╱ ╲ ╱ ╲     ● old node
     ●───x───●

Over and under can alternate on every orientable surface: faces are of two kinds, triangles and polygons, and each
edge has one of either kind beside it.  On a border its ring or free border stays, and rods end there.

Time is O(N log N) for N nodes, for the closest points on the surface.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Ints, next_in_loop
from weavecore.geometry.polygon_mesh import NONE, Fans, faces_about_nodes, find_fans
from weavecore.linking.derived_lattice import concatenate_nodes, edge_midpoints, nodes_of, rebuild_lattice
from weavecore.model.lattice import FAMILIES, Lattice


def kagome_lattice(lattice: Lattice, pattern: str) -> Lattice:
    """The kagome of a lattice: its nodes are the midpoints of the edges, and the nodes of the borders.

    Parameters
    ----------
    lattice : Lattice
        Triangular.
    pattern : str
        Name of the new pattern.
    """
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    border = np.flatnonzero(fans.on_border)
    number = np.full(lattice.n_nodes, NONE, np.int64)
    number[border] = lattice.n_edges + np.arange(len(border))
    middles = edge_midpoints(lattice, np.arange(lattice.n_edges), fans.n_faces == 1)
    nodes = concatenate_nodes(middles, nodes_of(lattice, border))
    none = np.full(lattice.n_nodes, NONE)
    outer_offsets, outer = faces_about_nodes(fans, fans.side, none, fans.last_side, number)
    family = _corner_families(lattice, fans)
    a, b = fans.side, fans.previous_side
    halves = np.flatnonzero(fans.n_faces == 1)
    tails, heads = lattice.edges[halves].T
    edges = np.concatenate([np.c_[a, b], np.c_[number[tails], halves], np.c_[number[heads], halves]])
    families = np.concatenate([family, np.tile(lattice.edge_family[halves], 2)])
    offsets = np.concatenate([lattice.face_offsets, lattice.face_offsets[-1] + outer_offsets[1:]])
    return rebuild_lattice(lattice, pattern, nodes, offsets, np.concatenate([fans.side, outer]), edges, families)


def _corner_families(lattice: Lattice, fans: Fans) -> Ints:
    """Family (C,) of the edge that cuts each corner: that of most sides that its rod runs beside.

    The edge that cuts a corner of a triangle runs parallel to the opposite side.  At the midpoint of a side a rod
    goes on from the corner at one end of the side to the corner at its other end in the face across.
    """
    after = next_in_loop(lattice.face_offsets)
    beside = lattice.edge_family[fans.side[after]]
    tail = lattice.face_nodes
    corner = np.arange(len(tail))
    # At its side's middle the edge of a corner meets that of the far end's corner in the other face.
    order = np.lexsort([tail, fans.side])
    side = fans.side[order]
    inner = np.flatnonzero(side[1:] == side[:-1])
    one, other = order[inner], order[inner + 1]
    links = np.concatenate([np.c_[corner[one], corner[other]], np.c_[after[one], after[other]]])
    graph = coo_matrix((np.ones(len(links), np.int8), links.T), shape=(len(tail), len(tail)))
    _, rod = connected_components(graph, directed=False)
    votes = np.bincount(rod * len(FAMILIES) + beside, minlength=(rod.max() + 1) * len(FAMILIES))
    family: Ints = votes.reshape(-1, len(FAMILIES)).argmax(1)[rod]
    return family
