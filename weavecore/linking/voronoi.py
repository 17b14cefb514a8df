"""Who faces whom across a band: the dual of the regions nearest to each seat.

Every point of a `BandMesh` gets the seat or hub whose place it is nearest to along the surface.  Shortest paths do not
cross, so the points of one owner hang together.  Where an owner's region is a disc it may be
shrunk to a point; what is left of the mesh then is a triangulation with the owners as
corners that is the same surface.  Where it is not, or where two owners meet along two
different lines, the place for another hub is told.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.bisecting import unique_edges
from weavecore.linking.band_mesh import BandMesh


class EdgeGraph:
    """The edges of a band mesh, each once."""

    def __init__(self, mesh: BandMesh) -> None:
        n = len(mesh.points)
        edges, self.of_triangle = unique_edges(mesh.triangles)
        self.a, self.b = edges.T
        length = np.linalg.norm(mesh.points[self.b] - mesh.points[self.a], axis=1)
        # A length of 0 would be no edge at all.
        self.length: Floats = np.maximum(length, np.finfo(float).tiny)
        self.matrix: csr_matrix = coo_matrix((self.length, (self.a, self.b)), shape=(n, n)).tocsr()

    def nearest(self, sources: Ints) -> tuple[Floats, Ints]:
        """For each point the length of the shortest way to a source, and that source."""
        distance, _, source = dijkstra(
            self.matrix, directed=False, indices=sources, min_only=True, return_predecessors=True
        )
        return distance, source.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Dual:
    """Owners as corners of triangles.

    Parameters
    ----------
    triangles : (t, 3) int64
        Owners, counter-clockwise.
    edge_class : (E,) int64
        For each edge of the mesh between two owners the link that it belongs to, else -1.
    links : (l, 2) int64
        The two owners of each link, the lesser first.
    """

    triangles: Ints
    edge_class: Ints
    links: Ints


class Regions:
    """The points of a band mesh by their owners: seats first, then hubs."""

    def __init__(self, mesh: BandMesh, graph: EdgeGraph, hubs: Ints) -> None:
        self.mesh = mesh
        self.graph = graph
        on_side = np.flatnonzero(mesh.seat >= 0)
        owner = mesh.seat.copy()
        owner[hubs] = len(mesh.seat_node) + np.arange(len(hubs))
        self.distance, source = graph.nearest(np.concatenate([on_side, hubs]))
        self.owner: Ints = owner[source]
        self.source = source
        self.n_hubs = len(hubs)
        self.n_owners = len(mesh.seat_node) + len(hubs)

    @cached_property
    def dual(self) -> Dual:
        """What is left when each region is shrunk to a point."""
        graph, corner = self.graph, self.owner[self.mesh.triangles]
        x, y = self.owner[graph.a], self.owner[graph.b]
        apart = x != y
        sides = corner != np.roll(corner, -1, axis=1)
        # A triangle of two owners becomes a single link: its two sides between them are one.
        two = sides.sum(1) == 2
        joined = graph.of_triangle[two][sides[two]].reshape(-1, 2)
        n_edges = len(graph.a)
        links = coo_matrix((np.ones(len(joined), np.int8), joined.T), shape=(n_edges, n_edges))
        _, label = connected_components(links, directed=False)
        kept, edge_class = np.unique(label[apart], return_index=True)
        classes = np.full(n_edges, -1, np.int64)
        classes[apart] = np.searchsorted(kept, label[apart])
        first = np.flatnonzero(apart)[edge_class]
        ends = np.sort(np.c_[x[first], y[first]], axis=1)
        return Dual(corner[sides.all(1)], classes, ends)

    def not_discs(self) -> Ints:
        """Owners whose region cannot be shrunk to a point: its Euler characteristic is not 1."""
        x, y = self.owner[self.graph.a], self.owner[self.graph.b]
        corner = self.owner[self.mesh.triangles]
        whole = (corner == corner[:, :1]).all(1)
        euler = (
            np.bincount(self.owner, minlength=self.n_owners)
            - np.bincount(x[x == y], minlength=self.n_owners)
            + np.bincount(corner[whole, 0], minlength=self.n_owners)
        )
        return np.flatnonzero(euler != 1)

    def deepest(self, groups: Ints, points: Ints, n_groups: int, least: float) -> Ints:
        """Of each group of points the one furthest from sides and hubs; -1 where none is further than ``least``."""
        inside = self.distance[points] > least
        groups, points = groups[inside], points[inside]
        depth = self.depth(points)
        groups, points, depth = groups[depth > least], points[depth > least], depth[depth > least]
        order = np.lexsort((points, -depth, groups))
        best = np.full(n_groups, -1, np.int64)
        first = np.unique(groups[order], return_index=True)
        best[first[0]] = points[order][first[1]]
        return best

    def depth(self, points: Ints) -> Floats:
        """Straight distance to the nearest point on a side of the same band, or hub; ways along edges may be longer."""
        nearest, _ = self._sources_tree.query(self.spots(points))
        depths: Floats = np.minimum(self.distance[points], nearest)
        return depths

    @cached_property
    def _sources_tree(self) -> cKDTree:
        return cKDTree(self.spots(np.unique(self.source)))

    def spots(self, points: Ints) -> Floats:
        """Points with their band as a fourth coordinate, so far apart that no other band is ever nearer."""
        apart = 4.0 * float(np.linalg.norm(np.ptp(self.mesh.points, axis=0)))
        spots: Floats = np.c_[self.mesh.points[points], apart * self.mesh.band[points]]
        return spots
