"""What must hold of the border of a lattice: rods along the origins there, and along the selvedges between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.geometry.segments import segment_distances
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, Lattice
from weavecore.validating.nodes import OFF_LATITUDE
from weavecore.validating.report import Finding, count
from weavecore.validating.selvedges import origins_along_borders

_PAIRS_AT_ONCE = 1_000_000


def hem_edges(lattice: Lattice) -> Ints:
    """Edges (h,) of a single face that do not run along an origin on a border."""
    n = lattice.n_nodes
    tail, head = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    side, times = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head), return_counts=True)
    naked = np.isin(lattice.edges.min(1) * n + lattice.edges.max(1), side[times == 1])
    along = np.append(np.zeros(len(lattice.latitudes), bool), False)
    borders = origins_along_borders(lattice.latitudes.surface)
    along[: len(borders)] = borders
    a, b = lattice.node_latitude[lattice.edges].T
    on_origin = (a == b) & along[a] & (lattice.edge_family == LATITUDINAL)
    hem: Ints = np.flatnonzero(naked & ~on_origin)
    return hem


def check_hem(lattice: Lattice) -> Iterator[Finding]:
    """Edges of a single face run along an origin on a border, or are longitudinal and end on selvedges."""
    surface, hem = lattice.latitudes.surface, hem_edges(lattice)
    selvedge = np.flatnonzero(surface.is_selvedge)
    astray = hem[lattice.edge_family[hem] != LONGITUDINAL] if len(selvedge) else hem
    yield count("border_edges_astray", astray, "edge")
    off = np.zeros(0)
    if len(selvedge) and len(hem):
        tail, head = (surface.vertices[ends[selvedge]] for ends in halfedge_ends(surface.faces))
        off = _distances(lattice.nodes[np.unique(lattice.edges[hem])], tail, head)
    yield Finding("nodes_off_selvedges_of_size", float(off.max(initial=0.0)) / surface.size, OFF_LATITUDE)


def _distances(points: Floats, a: Floats, b: Floats) -> Floats:
    """Distance (n,) of points to the nearest of the segments from ``a`` (m, 3) to ``b``."""
    least = np.empty(len(points))
    step = max(1, _PAIRS_AT_ONCE // len(a))
    for begin in range(0, len(points), step):
        here = points[begin : begin + step]
        p = np.repeat(here, len(a), axis=0)
        found, _ = segment_distances(p, p, np.tile(a, (len(here), 1)), np.tile(b, (len(here), 1)))
        least[begin : begin + step] = found.reshape(len(here), -1).min(1)
    return least
