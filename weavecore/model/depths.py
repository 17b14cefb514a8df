"""How deep the nodes of a lattice lie: their distance from the borders along the surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Floats
from weavecore.model.lattice import Lattice


def node_depths(lattice: Lattice) -> Floats:
    """(N,) distance of each node from the borders along the surface; off the latitudes that of the nearest vertex."""
    latitudes = lattice.latitudes
    depths = latitudes.distance[lattice.node_latitude]
    off = np.flatnonzero(lattice.node_latitude < 0)
    if len(off):
        _, vertex = cKDTree(latitudes.surface.vertices).query(lattice.nodes[off])
        depths[off] = latitudes.vertex_distance[vertex]
    return depths


def node_generations(lattice: Lattice) -> Floats:
    """(N,) generation of each node, with a fraction where it lies between the latitudes."""
    latitudes = lattice.latitudes
    between = node_depths(lattice) / latitudes.spacing
    generations: Floats = np.where(lattice.node_latitude < 0, between, latitudes.generation[lattice.node_latitude])
    return generations
