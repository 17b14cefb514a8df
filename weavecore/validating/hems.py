"""What must hold of the border of a lattice: rods along the origins there, and along the selvedges between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Ints, next_in_loop
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, Lattice
from weavecore.validating.nodes import OFF_LATITUDE
from weavecore.validating.report import Finding, count
from weavecore.validating.selvedges import origins_along_borders


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
        tail, head = (ends[selvedge] for ends in halfedge_ends(surface.faces))
        nodes = lattice.nodes[np.unique(lattice.edges[hem])]
        # Faces that are flat stand for their edges.
        _, place = closest_faces(nodes, surface.vertices, np.stack([tail, head, head], axis=1))
        off = np.linalg.norm(place - nodes, axis=1)
    yield Finding("nodes_off_selvedges_of_size", float(off.max(initial=0.0)) / surface.size, OFF_LATITUDE)
