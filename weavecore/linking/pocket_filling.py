"""Step two (Yan et al. 2016, §5): pockets and all other bands that are no strips are filled with triangles.

Caps, fronts that meet head-on, splits, merges and handles are filled the same way, by the dual of a Voronoi diagram
on the surface of the band (geodesic Delaunay triangulation; Peyré and Cohen 2006, restricted to edges of the mesh):

1. Every vertex of the band mesh gets its *site*, the node (or Steiner vertex) that is nearest along edges of the mesh
   (Dijkstra).  Shortest paths do not cross, so the region of a site is connected.
2. Where each region is a disc, contracting it to a point leaves a triangulation of the band with the sites as corners:

       a a│b b        a triangle of the mesh with three sites      a ─── b
       a ╱ ╲ b        is a triangle of the filling; all else   →    ╲   ╱
       c c c c        collapses                                       c

   It has the topology of the band, whatever that is.
3. Steiner vertices are sites inside the band: in wide bands, at the deepest places first, until none is deeper than
   `STEINER_DEPTH`; and wherever the topology needs one: in a region that is not a disc, or between two sites that
   meet twice.  Where no vertex of the mesh is far enough from the boundary the edges there are bisected.

Where only a part of a band is filled the mesh ends inside it.  Regions that reach there are *outer*: they are not
looked at, and their triangles are left out.

The Euler characteristic of each filling of a whole band is compared with that of the band.  Each round is O(N log N)
for N vertices of the band mesh; a band in which no Steiner vertex fits is refused as soon as that is certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Optional

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from weavecore.errors import Degenerate, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.bisection import unique_edges
from weavecore.linking.band_mesh import MOST_POINTS, BandMesh, mesh_bands, split_edges_of
from weavecore.linking.free_borders import FreeBorderNodes
from weavecore.model.latitudes import Latitudes
from weavecore.model.notes import at
from weavecore.polling import poll

STEINER_DEPTH = 0.7
"""Part of the edge length: a place deeper than this gets a Steiner vertex.  The centre of a regular hexagon is 0.87
edges deep, and gets one; that of a square is 0.5 edges deep, and gets none."""
STEINER_GAP = 0.9
"""Part of the edge length: how far Steiner vertices keep from each other, so that edges between them are about one."""
LEAST_STEINER_DEPTH = 0.003
"""Part of the edge length: how near to the boundary a Steiner vertex may be where the topology needs one."""
_MOST_ROUNDS = 50
"""Rounds in which Steiner vertices are added or edges bisected; a few suffice."""
_MOST_VAIN_ROUNDS = 10
"""Rounds in a row that bisect edges and add no Steiner vertex.  Half an edge length is bisected to less than the least
depth in eight; each round may double the edges."""


@dataclass(frozen=True, eq=False)
class Filling:
    """Triangles that fill bands.

    Parameters
    ----------
    triangles : (t, 3) int64
        Nodes, counter-clockwise seen from outside; numbers of Steiner vertices follow those of the nodes.
    band : (t,) int64
    steiner_points : (k, 3) float64
    partial : (b,) int64
        Bands that are filled in part.
    """

    triangles: Ints
    band: Ints
    steiner_points: Floats
    partial: Ints


def fill_bands(
    latitudes: Latitudes,
    stations: list[Floats],
    border_nodes: FreeBorderNodes,
    n_nodes: int,
    bands: Ints,
    existing_edges: Ints,
    edge_length: float,
    *,
    near: Optional[Floats] = None,
    reach: float = 0.0,
) -> Filling:
    """Fill bands of any topology with triangles.

    Parameters
    ----------
    latitudes : Latitudes
    stations : list of (n,) float64
        Of the nodes of each polyline.
    border_nodes : FreeBorderNodes
    n_nodes : int
        Number of nodes on polylines and free borders.
    bands : (b,) int64
        The bands to fill.
    existing_edges : (k, 2) int64
        Pairs of nodes that are joined already, the lesser first; no other edge may join them.
    edge_length : float
        Wanted length of the edges.
    near : (k, 3) float64, optional
        Bands are filled within ``reach`` of these points only, up to the last triangle that does not depend on what
        lies beyond.
    reach : float

    Raises
    ------
    Degenerate
        Where a band is too small for its topology.
    TooMuchWork
        Where no Steiner vertex fits however fine the mesh is, or that would have too many points.
    """
    mesh = mesh_bands(latitudes, stations, border_nodes, bands, edge_length, near=near, reach=reach)
    graph = EdgeGraph(mesh)
    voronoi = VoronoiRegions(mesh, graph, np.zeros(0, np.int64))
    steiner = _wide_places(voronoi, edge_length)
    n_vain = 0
    for _ in range(_MOST_ROUNDS):
        poll()
        if len(steiner) != voronoi.n_steiner:
            voronoi = VoronoiRegions(mesh, graph, steiner)
        site_node = np.concatenate([mesh.copy_node, n_nodes + np.arange(len(steiner))])
        more, coarse = _missing_steiner(voronoi, site_node, existing_edges, LEAST_STEINER_DEPTH * edge_length)
        steiner = np.concatenate([steiner, more])
        if coarse.any():
            n_vain = n_vain + 1 if len(more) == 0 else 0
            _check_refinement(mesh, graph, coarse, n_vain)
            mesh = split_edges_of(mesh, coarse)
            graph = EdgeGraph(mesh)
            voronoi = VoronoiRegions(mesh, graph, steiner)
        elif len(more) == 0:
            break
    else:
        raise _too_small(bands)
    site_band = np.concatenate([mesh.copy_band, mesh.band[steiner]])
    partial = np.zeros(0, np.int64)
    if near is not None:
        partial = np.union1d(site_band[voronoi.is_outer], np.setdiff1d(bands, site_band))
    _check_euler(latitudes, voronoi, site_band, np.setdiff1d(bands, partial))
    triangles = voronoi.dual.triangles
    triangles = triangles[~voronoi.is_outer[triangles].any(1)]
    return Filling(site_node[triangles], site_band[triangles[:, 0]], mesh.points[steiner], partial)


def _wide_places(voronoi: VoronoiRegions, edge_length: float) -> Ints:
    """Vertices for Steiner vertices: the deepest first, until none is left that is far from boundary and others."""
    deep = np.flatnonzero(voronoi.distance > STEINER_DEPTH * edge_length)
    depth = voronoi.depth(deep)
    deep, depth = deep[depth > STEINER_DEPTH * edge_length], depth[depth > STEINER_DEPTH * edge_length]
    if len(deep) == 0:
        return deep
    order = np.lexsort((deep, -depth))
    deep = deep[order]
    spots = voronoi.spots(deep)
    tree = cKDTree(spots)
    is_free = np.ones(len(deep), bool)
    steiner = []
    for k in range(len(deep)):
        if is_free[k]:
            steiner.append(deep[k])
            is_free[tree.query_ball_point(spots[k], STEINER_GAP * edge_length)] = False
    return np.array(steiner, np.int64)


def _missing_steiner(
    voronoi: VoronoiRegions, site_node: Ints, existing_edges: Ints, least: float
) -> tuple[Ints, Bools]:
    """Vertices for Steiner vertices that the topology needs, and the edges (E,) that are too coarse to hold one."""
    graph = voronoi.graph
    site_a, site_b = voronoi.site[graph.a], voronoi.site[graph.b]
    bad = voronoi.not_discs()
    if len(bad):
        edges = np.flatnonzero((site_a == site_b) & np.isin(site_a, bad))
        groups = np.searchsorted(bad, site_a[edges])
    else:
        bad = _bad_links(voronoi, site_node, existing_edges)
        edges = np.flatnonzero(np.isin(voronoi.dual.edge_link, bad))
        groups = np.searchsorted(bad, voronoi.dual.edge_link[edges])
    points = np.concatenate([graph.a[edges], graph.b[edges]])
    found = voronoi.deepest(np.tile(groups, 2), points, len(bad), least)
    coarse = np.zeros(len(graph.a), bool)
    coarse[edges[found[groups] < 0]] = True
    return np.unique(found[found >= 0]), coarse


def _check_refinement(mesh: BandMesh, graph: EdgeGraph, coarse: Bools, n_vain: int) -> None:
    """Refuse to bisect edges once more after ``n_vain`` rounds in vain, or so many that memory would not suffice."""
    if n_vain < _MOST_VAIN_ROUNDS and len(mesh.points) + int(coarse.sum()) <= MOST_POINTS:
        return
    where = mesh.points[graph.a[coarse][0]]
    raise TooMuchWork(
        f"A pocket needs a node near {at(where)}, where it is too narrow for one",
        remedy="Use a smaller edge length or another spacing.",
        ids=np.unique(mesh.band[graph.a[coarse]]).tolist(),
        kind="band",
        points=[where.tolist()],
    )


def _bad_links(voronoi: VoronoiRegions, site_node: Ints, existing_edges: Ints) -> Ints:
    """Links that join what is joined already, or a node with itself."""
    dual, graph = voronoi.dual, voronoi.graph
    n = np.int64(site_node.max() + 1)
    pair = np.sort(site_node[dual.links], axis=1)
    key = pair[:, 0] * n + pair[:, 1]
    is_border = np.bincount(graph.of_triangle.ravel(), minlength=len(graph.a)) == 1
    is_ring = np.zeros(len(key), bool)
    is_ring[dual.edge_link[is_border & (dual.edge_link >= 0)]] = True
    inner = np.flatnonzero(~is_ring)
    repeated = np.ones(len(inner), bool)
    repeated[np.unique(key[inner], return_index=True)[1]] = False
    existing = np.isin(key[inner], existing_edges[:, 0] * n + existing_edges[:, 1])
    wrong = repeated | existing | (pair[inner, 0] == pair[inner, 1])
    bad: Ints = inner[wrong & ~voronoi.is_outer[dual.links[inner]].any(1)]
    return bad


def _check_euler(latitudes: Latitudes, voronoi: VoronoiRegions, site_band: Ints, bands: Ints) -> None:
    """Refuse fillings whose Euler characteristic is not that of their band."""
    dual, n = voronoi.dual, len(latitudes.bands)
    corners = np.bincount(site_band, minlength=n)
    links = np.bincount(site_band[dual.links[:, 0]], minlength=n)
    triangles = np.bincount(site_band[dual.triangles[:, 0]], minlength=n)
    wrong = (corners - links + triangles != latitudes.bands.euler)[bands]
    if wrong.any():
        raise _too_small(bands[wrong])


def _too_small(bands: Ints) -> Degenerate:
    return Degenerate(
        "Bands between the polylines are too small for their shape to be linked",
        remedy="Use a smaller edge length or another spacing.",
        ids=bands.tolist(),
        kind="band",
    )


class EdgeGraph:
    """The edges of a band mesh, each once, as a graph weighted by length.

    Parameters
    ----------
    mesh : BandMesh

    Attributes
    ----------
    a, b : (E,) int64
        Ends of each edge.
    of_triangle : (t, 3) int64
        The edge on each side of each triangle.
    """

    def __init__(self, mesh: BandMesh) -> None:
        n = len(mesh.points)
        edges, self.of_triangle = unique_edges(mesh.triangles)
        self.a, self.b = edges.T
        length = np.linalg.norm(mesh.points[self.b] - mesh.points[self.a], axis=1)
        # In a sparse matrix a length of 0 would be no edge at all.
        self.length: Floats = np.maximum(length, np.finfo(float).tiny)
        self.matrix: csr_matrix = coo_matrix((self.length, (self.a, self.b)), shape=(n, n)).tocsr()

    def nearest(self, sources: Ints) -> tuple[Floats, Ints]:
        """For each point the length of the shortest path to a source, and that source.

        Parameters
        ----------
        sources : (k,) int64
        """
        poll()
        distance, _, source = dijkstra(
            self.matrix, directed=False, indices=sources, min_only=True, return_predecessors=True
        )
        poll()
        return distance, source.astype(np.int64)


@dataclass(frozen=True, eq=False)
class DualTriangulation:
    """The triangulation whose corners are the sites.

    Parameters
    ----------
    triangles : (t, 3) int64
        Sites, counter-clockwise.
    edge_link : (E,) int64
        The link that each edge of the mesh between two regions belongs to, else -1.
    links : (l, 2) int64
        The two sites of each link, the lesser first.
    """

    triangles: Ints
    edge_link: Ints
    links: Ints


class VoronoiRegions:
    """The points of a band mesh by their nearest sites: copies of nodes first, then Steiner vertices.

    Parameters
    ----------
    mesh : BandMesh
    graph : EdgeGraph
    steiner : (k,) int64
        Points of the mesh that are Steiner vertices.

    Attributes
    ----------
    distance : (n,) float64
        Length of the shortest path along edges to the boundary or a Steiner vertex.
    source : (n,) int64
        The point where that path ends.
    site : (n,) int64
    is_outer : (s,) bool
        Sites whose regions end where the mesh does though its band goes on.
    """

    def __init__(self, mesh: BandMesh, graph: EdgeGraph, steiner: Ints) -> None:
        self.mesh = mesh
        self.graph = graph
        on_boundary = np.flatnonzero(mesh.copy >= 0)
        site = mesh.copy.copy()
        site[steiner] = len(mesh.copy_node) + np.arange(len(steiner))
        self.distance, self.source = graph.nearest(np.concatenate([on_boundary, steiner]))
        self.site: Ints = site[self.source]
        self.n_steiner = len(steiner)
        self.n_sites = len(mesh.copy_node) + len(steiner)
        self.is_outer: Bools = np.zeros(self.n_sites, bool)
        self.is_outer[self.site[mesh.is_outer]] = True

    @cached_property
    def dual(self) -> DualTriangulation:
        """What is left when each region is contracted to a point."""
        poll()
        graph, corner = self.graph, self.site[self.mesh.triangles]
        x, y = self.site[graph.a], self.site[graph.b]
        differs = x != y
        sides = corner != np.roll(corner, -1, axis=1)
        # A triangle of two sites becomes a single link: its two sides between them are one.
        two = sides.sum(1) == 2
        joined = graph.of_triangle[two][sides[two]].reshape(-1, 2)
        n_edges = len(graph.a)
        poll()
        same = coo_matrix((np.ones(len(joined), np.int8), joined.T), shape=(n_edges, n_edges))
        _, label = connected_components(same, directed=False)
        kept, first_edge = np.unique(label[differs], return_index=True)
        edge_link = np.full(n_edges, -1, np.int64)
        edge_link[differs] = np.searchsorted(kept, label[differs])
        first = np.flatnonzero(differs)[first_edge]
        ends = np.sort(np.c_[x[first], y[first]], axis=1)
        return DualTriangulation(corner[sides.all(1)], edge_link, ends)

    def not_discs(self) -> Ints:
        """Sites whose region cannot be contracted to a point: its Euler characteristic is not 1."""
        poll()
        x, y = self.site[self.graph.a], self.site[self.graph.b]
        corner = self.site[self.mesh.triangles]
        whole = (corner == corner[:, :1]).all(1)
        euler = (
            np.bincount(self.site, minlength=self.n_sites)
            - np.bincount(x[x == y], minlength=self.n_sites)
            + np.bincount(corner[whole, 0], minlength=self.n_sites)
        )
        return np.flatnonzero((euler != 1) & ~self.is_outer)

    def deepest(self, groups: Ints, points: Ints, n_groups: int, least: float) -> Ints:
        """Of each group of points the deepest; -1 where none is deeper than ``least``.

        Parameters
        ----------
        groups, points : (k,) int64
        n_groups : int
        least : float

        Returns
        -------
        (n_groups,) int64
        """
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
        """Straight distance (k,) to the nearest boundary point of the same band, or Steiner vertex.

        Paths along edges may be longer, but not shorter.

        Parameters
        ----------
        points : (k,) int64
        """
        nearest, _ = self._sources_tree.query(self.spots(points))
        depths: Floats = np.minimum(self.distance[points], nearest)
        return depths

    @cached_property
    def _sources_tree(self) -> cKDTree:
        is_source = np.zeros(len(self.distance), bool)
        is_source[self.source] = True
        return cKDTree(self.spots(np.flatnonzero(is_source)))

    def spots(self, points: Ints) -> Floats:
        """Points with their band as a fourth coordinate, so far apart that no other band is ever nearer.

        Parameters
        ----------
        points : (k,) int64

        Returns
        -------
        (k, 4) float64
        """
        poll()
        apart = 4.0 * float(np.linalg.norm(np.ptp(self.mesh.points, axis=0)))
        spots: Floats = np.c_[self.mesh.points[points], apart * self.mesh.band[points]]
        return spots
