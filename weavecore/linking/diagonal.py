"""Diagonal: both diagonals of a triangular lattice, without the rings between the borders.

Each inner edge along a latitude is left out, and its two triangles become one cell.  Only
where a node would keep a single edge, as at a sharp turn of a latitude, the ring stays beside it.

    ──●─────●──        ╲   ╱ ╲   ╱
     ╱ ╲   ╱ ╲    →      ●     ●
    ●─────●────●       ╱   ╲ ╱   ╲

Time is linear in the number of faces, times the size of the largest cell.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, next_in_loop, offsets_of
from weavecore.geometry.polygon_mesh import find_fans
from weavecore.linking.derived_lattice import nodes_of, rebuild_lattice
from weavecore.model.lattice import LATITUDINAL, Lattice

_FEWEST_EDGES = 2
"""Edges other than along rings that a node needs for the ring beside it to be left out."""


def diagonal_lattice(lattice: Lattice, pattern: str) -> Lattice:
    """The lattice without its inner rings.

    Parameters
    ----------
    lattice : Lattice
        Triangular.
    pattern : str
        Name of the new pattern.
    """
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    left_out = _edges_left_out(lattice, fans.n_faces)
    offsets, corners = _joined_faces(lattice, fans.side, left_out)
    nodes = nodes_of(lattice, np.arange(lattice.n_nodes))
    edges, families = lattice.edges[~left_out], lattice.edge_family[~left_out]
    return rebuild_lattice(lattice, pattern, nodes, offsets, corners, edges, families)


def _edges_left_out(lattice: Lattice, n_faces: Ints) -> Bools:
    ring = (lattice.edge_family == LATITUDINAL) & (n_faces == 2)
    degree = np.bincount(lattice.edges[~ring].ravel(), minlength=lattice.n_nodes)
    left_out: Bools = ring & (degree[lattice.edges] >= _FEWEST_EDGES).all(1)
    return left_out


def _joined_faces(lattice: Lattice, side: Ints, left_out: Bools) -> tuple[Ints, Ints]:
    """Offsets and corners of the faces after those on both sides of the edges that are left out were joined."""
    after = next_in_loop(lattice.face_offsets)
    gone = left_out[side]
    order = np.argsort(side, kind="stable")
    pair = np.flatnonzero(side[order][1:] == side[order][:-1])
    twin = np.full(len(side), -1, np.int64)
    twin[order[pair]], twin[order[pair + 1]] = order[pair + 1], order[pair]
    following = after.copy()
    while gone[following].any():
        following = np.where(gone[following], after[twin[following]], following)
    kept = np.flatnonzero(~gone)
    least = kept.copy()
    # The least corner of each face, found by walking: joined faces stay small.
    at = following[kept]
    size = np.ones(len(kept), np.int64)
    while (at != kept).any():
        going = at != kept
        least = np.where(going, np.minimum(least, at), least)
        size += going
        at = np.where(going, following[at], at)
    first = kept[least == kept]
    sizes = size[least == kept]
    offsets = offsets_of(sizes)
    corners = np.empty(offsets[-1], np.int64)
    at = first
    for place in range(int(sizes.max(initial=0))):
        goes_on = place < sizes
        corners[offsets[:-1][goes_on] + place] = lattice.face_nodes[at[goes_on]]
        at = following[at]
    return offsets, corners
