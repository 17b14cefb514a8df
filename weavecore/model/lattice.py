"""`Lattice`: the woven structure as nodes, faces and edges in families."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.model.latitudes import Latitudes

LATITUDINAL, LONGITUDINAL, POCKET = 0, 1, 2
"""Families of edges and strands, as the arrays hold them."""

FAMILIES = ("latitudinal", "longitudinal", "pocket")
"""Their names, in this order."""

_SPACING_IN_RODS = 48.0
"""Spacing, or mean edge where that is shorter, over the rod diameter that is assumed before one is chosen."""


@dataclass(frozen=True, eq=False, repr=False)
class Lattice:
    """Nodes on the latitudes and the edges between them (Yan et al. 2016, §5).

    Parameters
    ----------
    latitudes : Latitudes
        The latitudes that it was made from.
    nodes : (N, 3) float64
    face_offsets : (F+1,) int64
    face_nodes : (C,) int64
        Corners of face ``f``: ``face_nodes[face_offsets[f]:face_offsets[f + 1]]``,
        counter-clockwise seen from outside.
    edges : (E, 2) int64
        Each once, lesser node first, sorted.
    edge_family : (E,) int64
        `LATITUDINAL`, `LONGITUDINAL` or `POCKET` (the paper's second step, §5).
    node_latitude : (N,) int64
        Polyline of each node, -1 where it lies between them (a Steiner vertex).
    node_station : (N,) float64
        Arc length along that polyline, 0 where there is none.
    pattern : str
    edge_length : float
        Target length of the edges.
    off_latitudes : bool
        Whether nodes inside moved off the latitudes on which they were linked; ``node_latitude`` and
        ``node_station`` then say where that was.  Those on borders stay on these.
    """

    latitudes: Latitudes
    nodes: Floats
    face_offsets: Ints
    face_nodes: Ints
    edges: Ints
    edge_family: Ints
    node_latitude: Ints
    node_station: Floats
    pattern: str
    edge_length: float
    off_latitudes: bool = False

    def __repr__(self) -> str:
        return f"<Lattice: {self.pattern}, {self.n_nodes} nodes, {self.n_edges} edges, {self.n_faces} faces>"

    def __post_init__(self) -> None:
        n_nodes, n_edges = len(self.nodes), len(self.edges)
        for name, dtype, shape in (
            ("nodes", np.float64, (n_nodes, 3)),
            ("face_offsets", np.int64, (-1,)),
            ("face_nodes", np.int64, (-1,)),
            ("edges", np.int64, (n_edges, 2)),
            ("edge_family", np.int64, (n_edges,)),
            ("node_latitude", np.int64, (n_nodes,)),
            ("node_station", np.float64, (n_nodes,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    @property
    def n_nodes(self) -> int:
        """Count of nodes."""
        return len(self.nodes)

    @property
    def n_faces(self) -> int:
        """Count of faces."""
        return len(self.face_offsets) - 1

    @property
    def n_edges(self) -> int:
        """Count of edges."""
        return len(self.edges)

    @cached_property
    def edge_lengths(self) -> Floats:
        """(E,) straight length of each edge."""
        a, b = self.edges.T
        lengths: Floats = np.linalg.norm(self.nodes[b] - self.nodes[a], axis=1)
        return lengths

    @property
    def assumed_diameter(self) -> float:
        """Rod diameter that is reckoned with before one is chosen, in the model's unit: see `_SPACING_IN_RODS`."""
        edge = float(self.edge_lengths.mean()) if self.n_edges else np.inf
        return min(self.latitudes.spacing, edge) / _SPACING_IN_RODS

    @cached_property
    def node_depths(self) -> Floats:
        """(N,) distances of the nodes from the origins along the surface; off the latitudes of the nearest vertices."""
        from scipy.spatial import cKDTree

        latitudes = self.latitudes
        depths = latitudes.distance[self.node_latitude]
        off = np.flatnonzero(self.node_latitude < 0)
        if len(off):
            _, vertex = cKDTree(latitudes.surface.vertices).query(self.nodes[off])
            depths[off] = latitudes.vertex_distance[vertex]
        depths.flags.writeable = False
        return depths


def node_generations(lattice: Lattice) -> Floats:
    """Generations of the nodes, with a fraction between the latitudes.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    (N,) float64
    """
    latitudes = lattice.latitudes
    between = lattice.node_depths / latitudes.spacing
    generations: Floats = np.where(lattice.node_latitude < 0, between, latitudes.generation[lattice.node_latitude])
    return generations
