"""From divided polylines to the lattice: the faces of all bands, then edges and their families.

    strips (`band_faces`)  ─┐
                            ├─ splice ─ valence optimisation ─ inverted-face repair ─ quads ─ edges, families
    pockets (`pocket_filling`) ─┘

A strip is kept where its links are no longer than `longest_link`; other stretches of its band are filled as pockets
are.  Only the surface around these is cut and meshed for it: time goes with the pockets, not with the bands.

Families (Yan et al. 2016, §5): an edge along a polyline is *latitudinal*, one that joins a child to its parent
*longitudinal*, any other is a *pocket* edge.  Edges along a free border, and from a polyline to one, are longitudinal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, ranges, rows_of
from weavecore.geometry.bisection import naked_edges
from weavecore.geometry.lawson_flips import improve_triangles
from weavecore.linking.arc_length import points_at
from weavecore.linking.band_faces import (
    NO_CORNER,
    BandFaces,
    are_among,
    faces_of_strip,
    faces_with_long_links,
    pair_triangles,
    splice,
    triangles_as_faces,
)
from weavecore.linking.flips import find_inverted_triangles, node_normals, optimise_valences, repair_inverted_faces
from weavecore.linking.free_borders import FreeBorderNodes, find_open_strips
from weavecore.linking.patterns import Pattern
from weavecore.linking.pocket_filling import Filling, fill_bands
from weavecore.linking.ring_to_parent import DividedPolylines, Strip
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.polling import each

_STRETCH = 0.97
"""Part of the diagonal of `longest_link` that a link may have: chords are shorter than distances along the surface."""
_REACH = 2.0
"""Edges around a bad face, and spacings from the boundary of a band without a strip, that are filled at first."""
_LEAN = 1.25
"""Edge lengths by which the apex of the longest link lies off one end of its base: half an edge is upright."""


@dataclass(frozen=True, eq=False)
class BandFilling:
    """Nodes and the faces between them.

    Parameters
    ----------
    divided : DividedPolylines
    border_nodes : FreeBorderNodes
    nodes : (N, 3) float64
        Those of the polylines, of the free borders, and Steiner vertices.
    latitude, station : (M,)
        The polyline of each node that is no Steiner vertex, -1 on a free border, and the arc length on it.
    faces : BandFaces
    inverted : (k, 3) int64
        Nodes of the inverted triangles; in patterns of even rings only of those at free borders.
    """

    divided: DividedPolylines
    border_nodes: FreeBorderNodes
    nodes: Floats
    latitude: Ints
    station: Floats
    faces: BandFaces
    inverted: Ints


def fill_all_bands(
    latitudes: Latitudes, divided: DividedPolylines, border_nodes: FreeBorderNodes, pattern: Pattern, edge_length: float
) -> BandFilling:
    """The faces of all bands: strips where their links are short enough, and fillings elsewhere.

    Parameters
    ----------
    latitudes : Latitudes
    divided : DividedPolylines
    border_nodes : FreeBorderNodes
    pattern : Pattern
    edge_length : float
        Wanted length of the edges.
    """
    counts, n_border = divided.counts, len(border_nodes.points)
    latitude = np.concatenate([rows_of(offsets_of(counts)), np.full(n_border, -1)])
    station = np.concatenate([*divided.stations, np.zeros(n_border)])
    n = len(latitude) - n_border
    on_boundaries = np.concatenate([points_at(latitudes.polylines, latitude[:n], station[:n]), border_nodes.points])
    ring_edges = np.concatenate([_ring_edges(counts, latitudes.polylines.closed), border_nodes.edges()])
    is_open_strip = find_open_strips(latitudes, border_nodes.borders, border_nodes.stations)
    strips = {band: strip for band, strip in divided.strips.items() if strip.closed or is_open_strip[band]}
    strip_faces = _faces_of_strips(strips, counts, pattern)
    longest = longest_link(latitudes.spacing, edge_length)
    bad = faces_with_long_links(strip_faces, on_boundaries, ring_edges, longest)
    pockets = _Pockets(latitudes, divided, border_nodes, on_boundaries, ring_edges, edge_length)
    nodes, faces = pockets.fill(strip_faces, bad)
    if pattern.has_diagonals:
        faces = _with_better_valences(nodes, latitude, faces, ring_edges, longest)
    normals = node_normals(latitudes, latitude, station, faces, len(nodes))
    faces = repair_inverted_faces(latitudes.surface, nodes, normals, faces, ring_edges)
    inverted = find_inverted_triangles(latitudes.surface, nodes, faces)
    if pattern.count_multiple > 1:  # A ring must keep its even number of nodes.
        on_free_border = np.zeros(len(nodes), bool)
        on_free_border[np.concatenate([np.zeros(0, np.int64), *border_nodes.nodes])] = True
        inverted = inverted[on_free_border[inverted].any(1)]
    if not pattern.has_diagonals:
        faces = pair_triangles(faces, nodes, ring_edges, leave_few=pattern.even_cells)
    return BandFilling(divided, border_nodes, nodes, latitude, station, faces, inverted)


def longest_link(spacing: float, edge_length: float) -> float:
    """Longest link between two rings: of a triangle whose apex lies well beyond its base.

    Parameters
    ----------
    spacing, edge_length : float

    Returns
    -------
    float
        0.97 √(spacing² + (1.25 edge_length)²).
    """
    return _STRETCH * math.sqrt(spacing**2 + (_LEAN * edge_length) ** 2)


def _ring_edges(counts: Ints, closed: Bools) -> Ints:
    """(N, 2) the edges along the polylines, the lesser node first."""
    offsets = offsets_of(counts)
    after = next_in_loop(offsets)
    edges: Ints = np.sort(np.c_[np.arange(len(after)), after], axis=1)
    return np.delete(edges, offsets[1:][~closed] - 1, axis=0)


def _faces_of_strips(strips: dict[int, Strip], counts: Ints, pattern: Pattern) -> BandFaces:
    first = offsets_of(counts)
    parts = []
    for band, strip in each(strips.items()):
        parent = np.arange(first[strip.parent], first[strip.parent + 1])
        child = np.arange(first[strip.child], first[strip.child + 1])
        corners = faces_of_strip(strip, parent, child, has_diagonals=pattern.has_diagonals)
        parts.append(BandFaces(corners, np.full(len(corners), band)))
    return BandFaces.concatenate(parts)


@dataclass(frozen=True, eq=False)
class _Pockets:
    """What the fillings of bands are made of; as of `fill_all_bands`, with the places of all nodes on boundaries."""

    latitudes: Latitudes
    divided: DividedPolylines
    border_nodes: FreeBorderNodes
    on_boundaries: Floats
    ring_edges: Ints
    edge_length: float

    def fill(self, strips: BandFaces, bad: Bools) -> tuple[Floats, BandFaces]:
        """All nodes, Steiner vertices among them, and the faces of strips, with fillings in the place of bad ones.

        Bands without a strip are filled around their boundaries, and as a whole where that leaves a gap; those of bad
        faces around these, and further around the whole band where the stretch to be replaced goes on.
        """
        is_filled = np.ones(len(self.latitudes.bands), bool)
        is_filled[np.setdiff1d(strips.band, strips.band[bad])] = False
        if not is_filled.any():
            return self.on_boundaries, strips
        existing = np.concatenate([self.ring_edges, strips.where(~is_filled[strips.band]).edges()])
        bands = np.flatnonzero(is_filled)
        alone, with_strip = np.setdiff1d(bands, strips.band), np.intersect1d(bands, strips.band)
        whole = self._fill(alone, existing, [], self._nodes_of(alone))
        if len(whole.partial) > 0:
            whole = self._fill(alone, existing, [], None)
        at_bad = np.unique(strips.corners[bad])
        near: Optional[Ints] = at_bad[at_bad != NO_CORNER]
        while True:
            part = self._fill(with_strip, existing, [whole], near)
            nodes, filled = self._improved([whole, part], existing)
            faces, lacking = splice(strips, bad, filled, self.ring_edges, part.partial)
            if near is None or len(lacking) == 0:
                return nodes, faces
            near = self._further(near, lacking)

    def _nodes_of(self, bands: Ints) -> Ints:
        """The nodes on the boundaries of some bands, and on all free borders."""
        all_bands, counts = self.latitudes.bands, self.divided.counts
        polyline = all_bands.polyline[np.isin(rows_of(all_bands.offsets), bands)]
        on_polylines = ranges(offsets_of(counts)[polyline], counts[polyline])
        return np.unique(np.concatenate([on_polylines, np.arange(counts.sum(), len(self.on_boundaries))]))

    def _further(self, near: Ints, bands: Ints) -> Optional[Ints]:
        """The same nodes and all those of some bands; None, for all of the surface, where these are among them."""
        own = self._nodes_of(bands)
        return None if np.isin(own, near).all() else np.union1d(near, own)

    def _fill(self, bands: Ints, existing: Ints, done: list[Filling], near: Optional[Ints]) -> Filling:
        """Fill bands around some nodes or as a whole, where others are filled already."""
        if len(bands) == 0:
            nothing = np.zeros(0, np.int64)
            return Filling(np.zeros((0, 3), np.int64), nothing, np.zeros((0, 3)), nothing)
        edges = [BandFaces(triangles_as_faces(part.triangles), part.band).edges() for part in done]
        n_steiner = sum(len(part.steiner_points) for part in done)
        return fill_bands(
            self.latitudes,
            self.divided.stations,
            self.border_nodes,
            len(self.on_boundaries) + n_steiner,
            bands,
            np.concatenate([existing, *edges]),
            self.edge_length,
            near=None if near is None else self.on_boundaries[near],
            reach=_REACH * max(self.edge_length, self.latitudes.spacing),
        )

    def _improved(self, fillings: list[Filling], existing: Ints) -> tuple[Floats, BandFaces]:
        """All nodes and the faces of fillings, their edges turned to better ones."""
        nodes = np.concatenate([self.on_boundaries, *(part.steiner_points for part in fillings)])
        keys = np.unique(existing[:, 0] * np.int64(len(nodes)) + existing[:, 1])
        triangles = improve_triangles(nodes, np.concatenate([part.triangles for part in fillings]), keys)
        return nodes, BandFaces(triangles_as_faces(triangles), np.concatenate([part.band for part in fillings]))


def _with_better_valences(
    nodes: Floats, latitude: Ints, faces: BandFaces, ring_edges: Ints, longest: float
) -> BandFaces:
    """The same faces after valence optimisation."""
    of_node = np.concatenate([latitude, np.full(len(nodes) - len(latitude), -1)])
    is_border = np.zeros(len(nodes), bool)
    is_border[naked_edges(faces.corners[:, :3])] = True
    triangles = optimise_valences(nodes, of_node, is_border, faces.corners[:, :3], ring_edges, longest)
    return BandFaces(triangles_as_faces(triangles), faces.band)


def assemble(latitudes: Latitudes, filling: BandFilling, pattern: Pattern, edge_length: float) -> Lattice:
    """The lattice of the faces of all bands; Steiner vertices without a face are left out.

    Parameters
    ----------
    latitudes : Latitudes
    filling : BandFilling
    pattern : Pattern
    edge_length : float
        Wanted length of the edges.
    """
    latitude = filling.latitude
    corners, nodes = _without_unused(filling.faces.corners, filling.nodes, len(latitude))
    corners = corners[np.lexsort(np.sort(corners, axis=1).T)]
    n_steiner = len(nodes) - len(latitude)
    node_latitude = np.concatenate([latitude, np.full(n_steiner, -1, np.int64)])
    edges = BandFaces(corners, filling.faces.band).edges()
    return Lattice(
        latitudes=latitudes,
        nodes=nodes,
        face_offsets=offsets_of((corners != NO_CORNER).sum(1)),
        face_nodes=corners[corners != NO_CORNER],
        edges=edges,
        edge_family=_edge_families(latitudes, filling, nodes, edges, node_latitude, edge_length),
        node_latitude=node_latitude,
        node_station=np.concatenate([filling.station, np.zeros(n_steiner)]),
        pattern=pattern.name,
        edge_length=edge_length,
    )


def _without_unused(corners: Ints, nodes: Floats, n_boundary: int) -> tuple[Ints, Floats]:
    """Corners and nodes without the Steiner vertices that no face has."""
    used = np.zeros(len(nodes) + 1, bool)
    used[:n_boundary] = True
    used[corners] = True
    used[-1] = False  # where the missing corner of a triangle points
    number = np.where(used, np.cumsum(used) - 1, NO_CORNER)
    return number[corners], nodes[used[:-1]]


def _edge_families(
    latitudes: Latitudes, filling: BandFilling, nodes: Floats, edges: Ints, node_latitude: Ints, edge_length: float
) -> Ints:
    """Family of each edge; one that joins a child to a parent but is too long for a link is a pocket edge."""
    family = _families_by_polyline(latitudes, edges, node_latitude)
    n_border = len(filling.border_nodes.points)
    first_border = len(filling.latitude) - n_border
    on_border = (edges >= first_border) & (edges < first_border + n_border)
    family[on_border.any(1) & (on_border | (node_latitude[edges] >= 0)).all(1)] = LONGITUDINAL
    length = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
    too_long = length > longest_link(latitudes.spacing, edge_length)
    family[too_long & (family == LONGITUDINAL)] = POCKET
    family[are_among(edges[:, 0], edges[:, 1], filling.border_nodes.edges())] = LONGITUDINAL
    return family


def _families_by_polyline(latitudes: Latitudes, edges: Ints, node_latitude: Ints) -> Ints:
    """Family of each edge by the polylines of its ends alone."""
    count = np.bincount(node_latitude[node_latitude >= 0], minlength=len(latitudes))
    first = np.cumsum(count) - count
    a, b = edges.T
    p, q = node_latitude[a], node_latitude[b]
    same = (p == q) & (p >= 0)
    gap = b - a
    ring = same & ((gap == 1) | ((a == first[p]) & (gap == count[p] - 1) & latitudes.polylines.closed[p]))
    n = len(latitudes)
    parents = latitudes.parents
    related = np.concatenate([parents[:, 0] * n + parents[:, 1], parents[:, 1] * n + parents[:, 0]])
    joins = np.isin(np.where((p >= 0) & (q >= 0), p * n + q, -1), related)
    family: Ints = np.where(ring, LATITUDINAL, np.where(joins, LONGITUDINAL, POCKET))
    return family
