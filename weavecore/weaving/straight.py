"""Rods that go straight on at a crossing, by the order of the edges about the node."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints
from weavecore.geometry.fans import NONE, darts_across, find_fans
from weavecore.model.lattice import LATITUDINAL, Lattice


def find_straight(lattice: Lattice) -> tuple[Ints, Bools]:
    """For each dart (2E,) the one that goes straight on at the same node, or -1 where the bend decides.

    That is the one across where two rods cross, each within its family, and the other one along
    the border at a node of that.

    Also whether each node (N,) is on a border.

    Where both rods are of one family, as in kagome, the least bend alone could make them swap
    at a sharp crossing.
    """
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    across = darts_across(fans, lattice.edges)
    node, is_ring = lattice.edges.ravel(), np.repeat(lattice.edge_family == LATITUDINAL, 2)
    known = np.flatnonzero(across != NONE)
    is_mixed = np.zeros(lattice.n_nodes, bool)
    is_mixed[node[known[is_ring[known] != is_ring[across[known]]]]] = True
    across[is_mixed[node]] = NONE
    border = np.flatnonzero(fans.on_border)
    first, last = (side[border] for side in (fans.first_side, fans.last_side))
    first, last = 2 * first + (lattice.edges[first, 1] == border), 2 * last + (lattice.edges[last, 1] == border)
    across[first], across[last] = last, first
    return across, fans.on_border
