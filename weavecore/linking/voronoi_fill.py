"""Step two (Yan et al. 2016, §5): the bands that are no plain rings.

Caps, ridges, fronts that meet head-on, splits, merges and handles are all linked the same
way: who faces whom across the band is read off the surface, which gives a triangulation
with the right topology whatever the band is; where the band is wide, hubs are set between the
polylines.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.bisection import unique_edges
from weavecore.linking.band_mesh import BandMesh, mesh_bands, refine_edges
from weavecore.linking.free_borders import Hem
from weavecore.model.latitudes import Latitudes

HUB_DEPTH = 0.7
HUB_GAP = 0.9
LEAST_HUB_DEPTH = 0.003
"""Parts of the edge length: where a hub is set, how far hubs keep from each other, and how
near to a side one may be set where the topology asks for it."""
_MOST_REPAIRS = 50


@dataclass(frozen=True, eq=False)
class Filling:
    """Triangles that fill bands.

    Parameters
    ----------
    triangles : (t, 3) int64
        Nodes, counter-clockwise seen from outside; hubs are numbered on from the nodes of the rings.
    band : (t,) int64
    hubs : (k, 3) float64
        Where the hubs are.
    """

    triangles: Ints
    band: Ints
    hubs: Floats


def fill_bands(
    latitudes: Latitudes, nodes: list[Floats], hem: Hem, places: Floats, wanted: Ints, taken: Ints, edge_length: float
) -> Filling:
    """Fill bands of any topology with triangles.

    Parameters
    ----------
    latitudes : Latitudes
    nodes : list of (n,) float64
        Stations of the nodes of each polyline.
    hem : Hem
    places : (N, 3) float64
        Where these nodes are.
    wanted : (b,) int64
        The bands to fill.
    taken : (k, 2) int64
        Pairs of nodes that are joined already, the lesser first.
    edge_length : float
    """
    mesh = mesh_bands(latitudes, nodes, hem, wanted, edge_length)
    graph = EdgeGraph(mesh)
    regions = Regions(mesh, graph, np.zeros(0, np.int64))
    hubs = _wide_places(regions, edge_length)
    for _ in range(_MOST_REPAIRS):
        if len(hubs) != regions.n_hubs:
            regions = Regions(mesh, graph, hubs)
        owner_node = np.concatenate([mesh.seat_node, len(places) + np.arange(len(hubs))])
        more, coarse = _missing_hubs(regions, owner_node, taken, LEAST_HUB_DEPTH * edge_length)
        hubs = np.concatenate([hubs, more])
        if coarse.any():
            mesh = refine_edges(mesh, coarse)
            graph = EdgeGraph(mesh)
            regions = Regions(mesh, graph, hubs)
        elif len(more) == 0:
            break
    else:
        raise _not_linked(wanted)
    owner_band = np.concatenate([mesh.seat_band, mesh.band[hubs]])
    _check_euler(latitudes, regions, owner_band, wanted)
    triangles = regions.dual.triangles
    return Filling(owner_node[triangles], owner_band[triangles[:, 0]], mesh.points[hubs])


def _check_euler(latitudes: Latitudes, regions: Regions, owner_band: Ints, wanted: Ints) -> None:
    """Refuse to go on where what was found is not what the band is."""
    dual, n = regions.dual, len(latitudes.bands)
    corners = np.bincount(owner_band, minlength=n)
    links = np.bincount(owner_band[dual.links[:, 0]], minlength=n)
    triangles = np.bincount(owner_band[dual.triangles[:, 0]], minlength=n)
    wrong = (corners - links + triangles != latitudes.bands.euler)[wanted]
    if wrong.any():
        raise _not_linked(wanted[wrong])


def _not_linked(bands: Ints) -> Degenerate:
    return Degenerate(
        "Bands between the polylines that are too small for their shape to be linked",
        remedy="Take a smaller edge length or another spacing.",
        ids=bands.tolist(),
        kind="band",
    )


def _wide_places(regions: Regions, edge_length: float) -> Ints:
    """Points for hubs: the deepest first, until no place is left that is far from sides and hubs."""
    deep = np.flatnonzero(regions.distance > HUB_DEPTH * edge_length)
    depth = regions.depth(deep)
    deep, depth = deep[depth > HUB_DEPTH * edge_length], depth[depth > HUB_DEPTH * edge_length]
    if len(deep) == 0:
        return deep
    order = np.lexsort((deep, -depth))
    deep = deep[order]
    spots = regions.spots(deep)
    tree = cKDTree(spots)
    is_free = np.ones(len(deep), bool)
    hubs = []
    for k in range(len(deep)):
        if is_free[k]:
            hubs.append(deep[k])
            is_free[tree.query_ball_point(spots[k], HUB_GAP * edge_length)] = False
    return np.array(hubs, np.int64)


def _missing_hubs(regions: Regions, owner_node: Ints, taken: Ints, least: float) -> tuple[Ints, Bools]:
    """Points for further hubs where the topology asks for them, and the edges (E,) that are too coarse to hold one."""
    graph = regions.graph
    owner_a, owner_b = regions.owner[graph.a], regions.owner[graph.b]
    bad = regions.not_discs()
    if len(bad):
        edges = np.flatnonzero((owner_a == owner_b) & np.isin(owner_a, bad))
        groups = np.searchsorted(bad, owner_a[edges])
    else:
        bad = _bad_links(regions, owner_node, taken)
        edges = np.flatnonzero(np.isin(regions.dual.edge_class, bad))
        groups = np.searchsorted(bad, regions.dual.edge_class[edges])
    points = np.concatenate([graph.a[edges], graph.b[edges]])
    found = regions.deepest(np.tile(groups, 2), points, len(bad), least)
    coarse = np.zeros(len(graph.a), bool)
    coarse[edges[found[groups] < 0]] = True
    return np.unique(found[found >= 0]), coarse


def _bad_links(regions: Regions, owner_node: Ints, taken: Ints) -> Ints:
    """Links that join what is joined already, or a node with itself."""
    dual, graph = regions.dual, regions.graph
    n = np.int64(owner_node.max() + 1)
    pair = np.sort(owner_node[dual.links], axis=1)
    key = pair[:, 0] * n + pair[:, 1]
    is_border = np.bincount(graph.of_triangle.ravel(), minlength=len(graph.a)) == 1
    is_ring = np.zeros(len(key), bool)
    is_ring[dual.edge_class[is_border & (dual.edge_class >= 0)]] = True
    inner = np.flatnonzero(~is_ring)
    repeated = np.ones(len(inner), bool)
    repeated[np.unique(key[inner], return_index=True)[1]] = False
    clash = repeated | np.isin(key[inner], taken[:, 0] * n + taken[:, 1]) | (pair[inner, 0] == pair[inner, 1])
    bad: Ints = inner[clash]
    return bad


# ----------------------------------------------------------------------
# Who faces whom across a band: the dual of the regions nearest to each seat.
#
# Every point of a `BandMesh` gets the seat or hub whose place it is nearest to along the surface.
# Shortest paths do not
# cross, so the points of one owner hang together.  Where an owner's region is a disc it may be
# shrunk to a point; what is left of the mesh then is a triangulation with the owners as
# corners that is the same surface.  Where it is not, or where two owners meet along two
# different lines, the place for another hub is told.


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
