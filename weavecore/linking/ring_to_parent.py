"""Step one (Yan et al. 2016, §5): each ring is divided and joined to its parent, generation by generation.

Polylines are taken in the order of their generations, so a parent is divided before its children:

1. The samples of the child are projected to the parent (`parent_projections`) and their node indices unwrapped.
2. The first harmonic of these indices gives the phase at which most nodes of the child lie where the pattern wants
   them: over the middle of a parent's edge (triangles) or in line with a node (quads).
3. Eight divisions of the child, an eighth of an edge apart, are offered to `strip_triangulation`, which takes the
   cheapest together with the links of the strip between the two.

A *strip* is a band between one parent and one child: an annulus between two closed polylines, or a piece between
two open ones.  Other bands have no strip; `pocket_filling` fills them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.elementary import arctangents, sines_and_cosines
from weavecore.linking.arc_length import index_at, points_at
from weavecore.linking.node_placement import (
    divide_closed_border,
    divide_open_border,
    divide_open_polyline,
    divide_ring,
    open_divisions,
)
from weavecore.linking.parent_projections import SAMPLES_PER_NODE, find_cusps, project_to_parents, sample_polylines
from weavecore.linking.patterns import Pattern
from weavecore.linking.strip_triangulation import (
    interpolate_projections,
    triangulate_annulus,
    triangulate_open_strip,
    triangulate_small_child,
    unwrap_closed,
    unwrap_open,
)
from weavecore.model.latitudes import Latitudes
from weavecore.polling import each

_DIVISIONS = 8
"""Divisions of a child that are tried, turned by equal parts of an edge."""
_MOST_NODES_OF_SMALL = 12
"""Children of at most so many nodes may have projections that miss a part of their parents."""
_LINKS_OF_SIX = 4
"""Links of an inner node to the rings on both sides when it has six edges in all; two run along its ring."""


@dataclass(frozen=True, eq=False)
class Strip:
    """The links between a parent and its only child.

    Parameters
    ----------
    parent, child : int
        Polylines.
    is_left : bool
        Whether the band lies on the left of the parent.  If not, node ``i`` of the strip is
        node ``-i`` of the parent, or the last but ``i`` of an open one.
    apexes : (n,) int64
        For each edge of the parent the node of the child that is the apex of its triangle, unwrapped (see
        `strip_triangulation`).
    closed : bool
        Whether the two are closed.  If not, the last edge of either only closes it for the computation.
    """

    parent: int
    child: int
    is_left: bool
    apexes: Ints
    closed: bool = True


@dataclass(frozen=True, eq=False)
class DividedPolylines:
    """Divided polylines, closed and open, and the strips between them.

    Parameters
    ----------
    stations : list of (n,) float64
        Rising stations of the nodes of each polyline.
    strips : dict
        By band.
    cusps : dict
        By polyline: stations of its cusps, where it has any.
    """

    stations: list[Floats]
    strips: dict[int, Strip]
    cusps: dict[int, Floats]

    @property
    def counts(self) -> Ints:
        """(P,) number of nodes of each polyline."""
        return np.array([len(stations) for stations in self.stations], np.int64)

    def with_stations(self, stations: list[Floats]) -> DividedPolylines:
        """The same with other stations, without the strips of polylines whose number of nodes changes.

        Parameters
        ----------
        stations : list of (n,) float64
        """
        same = [len(old) == len(new) for old, new in zip(self.stations, stations)]
        strips = {band: s for band, s in self.strips.items() if same[s.parent] and same[s.child]}
        return DividedPolylines(stations, strips, self.cusps)


def join_rings_to_parents(
    latitudes: Latitudes, counts: Ints, pattern: Pattern, is_open_strip: Bools
) -> DividedPolylines:
    """Divide the polylines in the order of their generations and triangulate the strips between them.

    Parameters
    ----------
    latitudes : Latitudes
    counts : (P,) int64
        Number of nodes of each polyline.
    pattern : Pattern
    is_open_strip : (B,) bool
        Bands between two open polylines that become strips.
    """
    return _Joiner(latitudes, counts, pattern, is_open_strip).run()


class _Joiner:
    """The work of `join_rings_to_parents`, polyline after polyline."""

    def __init__(self, latitudes: Latitudes, counts: Ints, pattern: Pattern, is_open_strip: Bools) -> None:
        self._latitudes = latitudes
        self._counts = counts
        self._is_open_strip = is_open_strip
        samples = sample_polylines(latitudes, counts)
        self._projections = project_to_parents(latitudes, samples)
        self._cusps = find_cusps(samples)
        self._pattern = pattern
        self._is_annulus = _find_annuli(latitudes)
        self._parent_links: dict[int, Ints] = {}
        self._stations: list[Floats] = []
        self._strips: dict[int, Strip] = {}

    def run(self) -> DividedPolylines:
        latitudes, polylines = self._latitudes, self._latitudes.polylines
        bands = latitudes.bands
        parent_band = np.full(len(latitudes), -1, np.int64)
        parent_band[bands.polyline[~bands.is_parent]] = rows_of(bands.offsets)[~bands.is_parent]
        for p in each(range(len(latitudes))):
            if latitudes.generation[p] == 0:
                stations = self._divide_origin(p)
            elif polylines.closed[p]:
                stations = self._divide_ring(p, int(parent_band[p]))
            else:
                stations = self._divide_open_child(p, int(parent_band[p]))
            self._stations.append(stations)
        return DividedPolylines(self._stations, self._strips, self._cusps)

    def _divide_origin(self, p: int) -> Floats:
        """Stations of the nodes of a polyline of generation 0."""
        polylines = self._latitudes.polylines
        length, count = float(polylines.lengths[p]), int(self._counts[p])
        part = slice(polylines.offsets[p], polylines.offsets[p + 1])
        points, known = polylines.points[part], polylines.stations[part]
        if polylines.closed[p]:
            return divide_closed_border(points, known, length, count)
        return divide_open_border(points, known, length, count - 1)

    def _divide_ring(self, p: int, band: int) -> Floats:
        """Stations of the nodes of a closed child; triangulates its band if that is an annulus."""
        count, length = int(self._counts[p]), float(self._latitudes.polylines.lengths[p])
        index = self._projected_indices(p)
        phase = _harmonic_phase(index, self._pattern)
        cusps = self._cusps.get(p)
        parent, is_left = self._parent_of(band)
        n = int(self._counts[parent])
        divisions = np.array([divide_ring(length, count, phase + k / _DIVISIONS, cusps) for k in range(_DIVISIONS)])
        best, apexes = 0, None
        if self._is_annulus[band]:
            best, apexes = self._triangulate(parent, is_left, p, unwrap_closed(index, n), divisions)
        if apexes is None:
            return _wrapped(divisions[best], length)[0]
        stations, shift = _wrapped(divisions[best], length)
        apexes = apexes + shift
        self._parent_links[p] = np.bincount(apexes % count, minlength=count) + 1
        if _has_no_double_link(apexes, count):
            self._strips[band] = Strip(parent, p, is_left, apexes)
        return stations

    def _triangulate(
        self, parent: int, is_left: bool, child: int, unwrapped: Optional[Floats], divisions: Floats
    ) -> tuple[int, Optional[Ints]]:
        """The best division of a closed child, and the apexes of its annulus if they go around it once."""
        polylines, pattern = self._latitudes.polylines, self._pattern
        if unwrapped is not None:
            return triangulate_annulus(
                interpolate_projections(unwrapped, divisions, float(polylines.lengths[child])),
                len(self._stations[parent]),
                child_phase=pattern.child_phase,
                target_advance=self._target_advances(parent, is_left),
                even_cells=pattern.even_cells,
            )
        if divisions.shape[1] > _MOST_NODES_OF_SMALL:
            return 0, None

        def points(p: int, stations: Floats) -> Floats:
            return points_at(polylines, np.full(len(stations), p), stations % float(polylines.lengths[p]))

        ring = points(parent, self._stations[parent])
        ring = ring if is_left else np.roll(ring[::-1], 1, axis=0)
        tried = [triangulate_small_child(ring, points(child, stations)) for stations in divisions]
        best = int(np.argmin([np.inf if apexes is None else cost for cost, apexes in tried]))
        return best, tried[best][1]

    def _divide_open_child(self, p: int, band: int) -> Floats:
        """Stations of the nodes of an open child; triangulates its band if that is a strip."""
        length, n_edges = float(self._latitudes.polylines.lengths[p]), int(self._counts[p]) - 1
        if not self._is_open_strip[band]:
            return divide_open_polyline(length, n_edges, self._cusps.get(p))
        pattern = self._pattern
        parent, is_left = self._parent_of(band)
        n = len(self._stations[parent])
        index = self._projected_indices(p)
        unwrapped = unwrap_open(index if is_left else index + (n - 1))
        divisions = open_divisions(length, n_edges, self._cusps.get(p), pattern)
        if unwrapped is None:
            return divisions[0].stations
        known = np.linspace(0.0, length, len(unwrapped))
        target = self._target_advances(parent, is_left)
        best, least, apexes = divisions[0], np.inf, None
        for division in each(divisions):
            projections = np.interp(division.stations, known, unwrapped)
            projections[0], projections[-1] = 0.0, n - 1.0
            cost, found = triangulate_open_strip(
                projections,
                n,
                child_phase=pattern.child_phase,
                target_advance=target,
                even_cells=pattern.even_cells,
            )
            if found is not None and cost + division.cost < least:
                best, least, apexes = division, cost + division.cost, found
        if apexes is not None:
            self._parent_links[p] = np.bincount(apexes[:-1], minlength=len(best.stations)) + 1
            self._strips[band] = Strip(parent, p, is_left, apexes, closed=False)
        return best.stations

    def _parent_of(self, band: int) -> tuple[int, bool]:
        """The first parent of a band, and whether the band lies on its left."""
        bands = self._latitudes.bands
        side = bands.offsets[band]
        return int(bands.polyline[side]), bool(bands.is_left[side])

    def _target_advances(self, parent: int, is_left: bool) -> Ints:
        """By how many nodes the apex should advance at each node of the parent, so that it gets six edges.

        One where the links of the parent to its own parent are not known, and in patterns of quads.
        """
        if parent not in self._parent_links or not self._pattern.has_diagonals:
            return np.ones(len(self._stations[parent]), np.int64)
        links = self._parent_links[parent]
        if is_left or not self._latitudes.polylines.closed[parent]:
            own = links if is_left else links[::-1]
        else:
            own = np.roll(links[::-1], 1)
        target: Ints = np.clip(_LINKS_OF_SIX - own - 1, 0, 2)
        return target

    def _projected_indices(self, p: int) -> Floats:
        """Node index on its parent of the projection of each sample of a child, rising along the child."""
        projections = self._projections
        part = slice(projections.offsets[p], projections.offsets[p + 1])
        parent, station = projections.parent[part], projections.station[part]
        index = np.empty(len(parent))
        for q in np.unique(parent).tolist():
            here = parent == q
            lines = self._latitudes.polylines
            length, closed = float(lines.lengths[q]), bool(lines.closed[q])
            index[here] = index_at(self._stations[q], length, station[here], closed=closed)
        return np.where(projections.is_reversed[part], -index, index)


def _find_annuli(latitudes: Latitudes) -> Bools:
    """(B,) bands between one closed parent and one closed child, without a handle."""
    bands = latitudes.bands
    n_parents = np.bincount(rows_of(bands.offsets)[bands.is_parent], minlength=len(bands))
    closed = latitudes.polylines.closed[bands.polyline[bands.offsets[:-1]]]
    annulus: Bools = (np.diff(bands.offsets) == 2) & (bands.euler == 0) & (n_parents == 1) & closed
    return annulus


def _harmonic_phase(index: Floats, pattern: Pattern) -> float:
    """The phase, in edges, at which most nodes of a child lie where the pattern wants them.

    A node at index x of its parent is well placed where x - child_phase is an integer.  Along the child x rises by
    about one from node to node, so the sum of cos 2π(x - child_phase) over the nodes is one harmonic of the phase,
    and its peak has a closed form.

    Parameters
    ----------
    index : (SAMPLES_PER_NODE · m,) float64
        Of the projections of the samples.
    pattern : Pattern
    """
    misfit = (index - pattern.child_phase).reshape(-1, SAMPLES_PER_NODE) - np.arange(
        SAMPLES_PER_NODE
    ) / SAMPLES_PER_NODE
    sine, cosine = sines_and_cosines(2 * np.pi * (misfit - np.floor(misfit)))
    return float(-arctangents(sine.sum(), cosine.sum()) / (2 * np.pi))


def _wrapped(stations: Floats, length: float) -> tuple[Floats, int]:
    """The same places as rising stations from 0 to the length, and by how much the nodes' numbers rise."""
    shift = int((stations >= length).sum()) - int((stations < 0).sum())
    return np.sort(stations % length), shift


def _has_no_double_link(apexes: Ints, count: int) -> bool:
    """Whether no two nodes are linked twice, as they might be on rings of few nodes."""
    n = len(apexes)
    before = np.append(apexes[-1] - count, apexes[:-1])
    n_links = apexes - before + 1
    i = np.repeat(np.arange(n), n_links)
    within = np.arange(len(i)) - np.repeat(np.cumsum(n_links) - n_links, n_links)
    links = i * count + (before[i] + within) % count
    return len(np.unique(links)) == len(links)
