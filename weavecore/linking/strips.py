"""Step one (Yan et al. 2016, §5): rings are divided and bound to their parents, generation by generation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.linking.patterns import Pattern
from weavecore.linking.resample import (
    SAMPLES_PER_NODE,
    Samples,
    divide_border,
    divide_evenly,
    divide_open,
    divide_openly,
    divide_path,
    find_spikes,
    index_at,
    points_at,
    sample_polylines,
)
from weavecore.linking.strip_dp import (
    choose_open_tips,
    choose_tips,
    feet_of_nodes,
    nearest_tips,
    raise_feet,
    unroll_feet,
)
from weavecore.model.latitudes import Bands, Latitudes

_DIVISIONS = 8
_SMALL = 12
"""Children of up to so many nodes may be too small to have feet all around their parents."""
_LINKS_OF_SIX = 4
"""Links of an inner node to the rings on both sides when it has six edges in all."""


@dataclass(frozen=True, eq=False)
class Zip:
    """The links of one plain band.

    Parameters
    ----------
    parent, child : int
        Polylines.
    is_left : bool
        Whether the band lies on the left of the parent; if not, node ``i`` of the zip is
        node ``-i`` of the parent, or the last but ``i`` of an open one.
    tips : (n,) int64
        For each edge of the parent the node of the child over it, unrolled.
    closed : bool
        Whether the two are closed; if not, the last edge of either is one that closes it, and is none.
    """

    parent: int
    child: int
    is_left: bool
    tips: Ints
    closed: bool = True


@dataclass(frozen=True, eq=False)
class Rings:
    """Divided polylines, open ones among them, and the zips between them.

    Parameters
    ----------
    nodes : list of (n,) float64
        Rising stations of the nodes of each polyline.
    zips : dict
        By band.
    spikes : dict
        By polyline: stations of its spikes, where it has any.
    """

    nodes: list[Floats]
    zips: dict[int, Zip]
    spikes: dict[int, Floats]

    @property
    def counts(self) -> Ints:
        """(P,) number of nodes of each polyline."""
        return np.array([len(stations) for stations in self.nodes], np.int64)

    def with_nodes(self, nodes: list[Floats]) -> Rings:
        """The same with other nodes, without the zips of polylines that have more or less of them."""
        same = [len(old) == len(new) for old, new in zip(self.nodes, nodes)]
        zips = {band: z for band, z in self.zips.items() if same[z.parent] and same[z.child]}
        return Rings(nodes, zips, self.spikes)


def link_rings(latitudes: Latitudes, counts: Ints, pattern: Pattern, strips: Bools) -> Rings:
    """Divide the polylines in the order of their generations and zip the plain bands.

    Parameters
    ----------
    latitudes : Latitudes
    counts : (P,) int64
        Number of nodes of each polyline.
    pattern : Pattern
    strips : (B,) bool
        Bands between open polylines that are zipped.
    """
    return _RingLinker(latitudes, counts, pattern, strips).run()


class _RingLinker:
    """The work of `link_rings`, polyline after polyline."""

    def __init__(self, latitudes: Latitudes, counts: Ints, pattern: Pattern, strips: Bools) -> None:
        self._latitudes = latitudes
        self._counts = counts
        self._strips = strips
        samples = sample_polylines(latitudes, counts)
        self._feet = find_feet(latitudes, samples)
        self._spikes = find_spikes(samples)
        self._pattern = pattern
        self._plain = _plain_bands(latitudes)
        self._links_above: dict[int, Ints] = {}
        self._nodes: list[Floats] = []
        self._zips: dict[int, Zip] = {}

    def run(self) -> Rings:
        latitudes, polylines = self._latitudes, self._latitudes.polylines
        bands = latitudes.bands
        band_above = np.full(len(latitudes), -1, np.int64)
        band_above[bands.polyline[~bands.is_parent]] = rows_of(bands.offsets)[~bands.is_parent]
        for p in range(len(latitudes)):
            length, count = float(polylines.lengths[p]), int(self._counts[p])
            if latitudes.generation[p] == 0:
                part = slice(polylines.offsets[p], polylines.offsets[p + 1])
                points, known = polylines.points[part], polylines.stations[part]
                if polylines.closed[p]:
                    stations = divide_border(points, known, length, count)
                else:
                    stations = divide_path(points, known, length, count - 1)
            elif not polylines.closed[p]:
                stations = self._divide_open_child(p, int(band_above[p]))
            else:
                stations = self._divide_child(p, int(band_above[p]))
            self._nodes.append(stations)
        return Rings(self._nodes, self._zips, self._spikes)

    def _divide_child(self, p: int, band: int) -> Floats:
        """Stations of the nodes of a child; zips its band if that is a plain one."""
        count, length = int(self._counts[p]), float(self._latitudes.polylines.lengths[p])
        index = self._foot_indices(p)
        phase = _harmonic_phase(index, self._pattern)
        spikes = self._spikes.get(p)
        parent, is_left = self._parent_of(band)
        n = int(self._counts[parent])
        divisions = np.array([divide_evenly(length, count, phase + k / _DIVISIONS, spikes) for k in range(_DIVISIONS)])
        best, tips = 0, None
        if self._plain[band]:
            best, tips = self._find_tips(parent, is_left, p, unroll_feet(index, n), divisions)
        if tips is None:
            return _rolled(divisions[best], length)[0]
        stations, shift = _rolled(divisions[best], length)
        tips = tips + shift
        self._links_above[p] = np.bincount(tips % count, minlength=count) + 1
        if _has_no_double_link(tips, count):
            self._zips[band] = Zip(parent, p, is_left, tips)
        return stations

    def _divide_open_child(self, p: int, band: int) -> Floats:
        """Stations of the nodes of an open child; zips its band if that is a plain strip."""
        length, n_edges = float(self._latitudes.polylines.lengths[p]), int(self._counts[p]) - 1
        if not self._strips[band]:
            return divide_open(length, n_edges, self._spikes.get(p))
        parent, is_left = self._parent_of(band)
        n = len(self._nodes[parent])
        index = self._foot_indices(p)
        rising = raise_feet(index if is_left else index + (n - 1))
        ways = divide_openly(length, n_edges, self._spikes.get(p), self._pattern)
        if rising is None:
            return ways[0].stations
        known = np.linspace(0.0, length, len(rising))
        wanted = self._wanted_steps(parent, is_left)
        best, least, tips = ways[0], np.inf, None
        for way in ways:
            feet = np.interp(way.stations, known, rising)
            feet[0], feet[-1] = 0.0, n - 1.0
            pattern = self._pattern
            found = choose_open_tips(feet[None], n, sits=pattern.child_sits, wanted=wanted, in_pairs=pattern.in_pairs)
            if found.tips is not None and found.cost + way.cost < least:
                best, least, tips = way, found.cost + way.cost, found.tips
        if tips is not None:
            self._links_above[p] = np.bincount(tips[:-1], minlength=len(best.stations)) + 1
            self._zips[band] = Zip(parent, p, is_left, tips, closed=False)
        return best.stations

    def _find_tips(
        self, parent: int, is_left: bool, child: int, rising: Optional[Floats], divisions: Floats
    ) -> tuple[int, Optional[Ints]]:
        """The best division of a child, and the tips of its zip if there is one."""
        polylines = self._latitudes.polylines
        if rising is not None:
            feet = feet_of_nodes(rising, divisions, float(polylines.lengths[child]))
            wanted = self._wanted_steps(parent, is_left)
            pattern = self._pattern
            return choose_tips(feet, len(wanted), sits=pattern.child_sits, wanted=wanted, in_pairs=pattern.in_pairs)
        if divisions.shape[1] > _SMALL:
            return 0, None

        def places(p: int, stations: Floats) -> Floats:
            return points_at(polylines, np.full(len(stations), p), stations % float(polylines.lengths[p]))

        ring = places(parent, self._nodes[parent])
        ring = ring if is_left else np.roll(ring[::-1], 1, axis=0)
        ways = [nearest_tips(ring, places(child, stations)) for stations in divisions]
        best = int(np.argmin([np.inf if tips is None else cost for cost, tips in ways]))
        return best, ways[best][1]

    def _parent_of(self, band: int) -> tuple[int, bool]:
        bands = self._latitudes.bands
        side = bands.offsets[band]
        return int(bands.polyline[side]), bool(bands.is_left[side])

    def _wanted_steps(self, parent: int, is_left: bool) -> Ints:
        """How far the tip should advance at each node of the parent; one step where the links above are not known."""
        if parent not in self._links_above or not self._pattern.has_diagonals:
            return np.ones(len(self._nodes[parent]), np.int64)
        links = self._links_above[parent]
        if is_left or not self._latitudes.polylines.closed[parent]:
            own = links if is_left else links[::-1]
        else:
            own = np.roll(links[::-1], 1)
        wanted: Ints = np.clip(_LINKS_OF_SIX - own - 1, 0, 2)
        return wanted

    def _foot_indices(self, p: int) -> Floats:
        """Index of each sample's foot among the nodes of its parent, rising along the child."""
        feet = self._feet
        part = slice(feet.offsets[p], feet.offsets[p + 1])
        parent, station, against = feet.parent[part], feet.station[part], feet.is_against[part]
        index = np.empty(len(parent))
        for q in np.unique(parent).tolist():
            here = parent == q
            lines = self._latitudes.polylines
            index[here] = index_at(self._nodes[q], float(lines.lengths[q]), station[here], closed=bool(lines.closed[q]))
        return np.where(against, -index, index)


def _plain_bands(latitudes: Latitudes) -> Bools:
    """Bands between one closed parent and one closed child, with no handle."""
    bands = latitudes.bands
    n_parents = np.bincount(rows_of(bands.offsets)[bands.is_parent], minlength=len(bands))
    closed = latitudes.polylines.closed[bands.polyline[bands.offsets[:-1]]]
    plain: Bools = (np.diff(bands.offsets) == 2) & (bands.euler == 0) & (n_parents == 1) & closed
    return plain


def _harmonic_phase(index: Floats, pattern: Pattern) -> float:
    """The turn, in edges, that brings most nodes to where the pattern wants them.

    With ``index`` the feet's indices, a node of the child is well placed where ``index -
    child_sits`` is whole.  As the index rises by about one from node to node, the sum of
    the cosines of the misfit is one harmonic of the turn, and its peak is known outright.
    """
    misfit = np.exp(2j * np.pi * (index - pattern.child_sits)).reshape(-1, SAMPLES_PER_NODE)
    turn = np.exp(-2j * np.pi * np.arange(SAMPLES_PER_NODE) / SAMPLES_PER_NODE)
    return float(-np.angle((misfit * turn).sum()) / (2 * np.pi))


def _rolled(stations: Floats, length: float) -> tuple[Floats, int]:
    """The same places with stations from 0 to the length, rising, and how much higher a node's number becomes."""
    shift = int((stations >= length).sum()) - int((stations < 0).sum())
    return np.sort(stations % length), shift


def _has_no_double_link(tips: Ints, count: int) -> bool:
    """Whether no node is linked twice with the same node: rings of few nodes might be."""
    n = len(tips)
    before = np.append(tips[-1] - count, tips[:-1])
    i = np.repeat(np.arange(n), tips - before + 1)
    within = np.arange(len(i)) - np.repeat(np.cumsum(tips - before + 1) - (tips - before + 1), tips - before + 1)
    links = i * count + (before[i] + within) % count
    return len(np.unique(links)) == len(links)


# ----------------------------------------------------------------------
# Feet: for places along every child, the nearest places on its parents.
#
# A sample's *foot* is the place nearest to it on the parents of the same band.  Others are
# never asked, so that a sheet of the surface that lies close in space does not matter unless it
# belongs to the very same ring.


@dataclass(frozen=True, eq=False)
class Feet:
    """Samples of all polylines and where they stand on the parents.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline.
    parent : (M,) int64
        The polyline on which each sample stands, -1 for generation 0.
    station : (M,) float64
        Where on it.
    is_against : (M,) bool
        Whether that parent runs the other way, as the far side of a cut does.
    """

    offsets: Ints
    parent: Ints
    station: Floats
    is_against: Bools


def find_feet(latitudes: Latitudes, samples: Samples) -> Feet:
    """The foot of every sample of every child."""
    bands, owner, points = latitudes.bands, samples.owner, samples.points
    parent = np.full(len(owner), -1, np.int64)
    foot = np.zeros(len(owner))
    is_against = np.zeros(len(owner), bool)
    band = rows_of(bands.offsets)
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    above = np.flatnonzero(bands.is_parent & has_child[band])
    below = np.flatnonzero(~bands.is_parent)
    if len(below):
        side, source = _gather(samples, bands, above)
        child_side, child = _gather(samples, bands, below)
        # A fourth coordinate keeps the bands apart, so that one search serves them all.
        size = 4.0 * latitudes.surface.size
        tree = cKDTree(np.c_[points[source], size * band[side]])
        _, nearest = tree.query(np.c_[points[child], size * band[child_side]])
        at = source[nearest]
        parent[child] = owner[at]
        is_against[child] = ~bands.is_left[side[nearest]]
        foot[child] = _project(points[child], at, samples)
    return Feet(samples.offsets, parent, foot, is_against)


def _gather(samples: Samples, bands: Bands, sides: Ints) -> tuple[Ints, Ints]:
    """For the samples of the polylines of these sides: the side, and the sample."""
    polyline = bands.polyline[sides]
    counts = np.diff(samples.offsets)[polyline]
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(sides, counts), np.repeat(samples.offsets[polyline], counts) + within


def _project(points: Floats, at: Ints, samples: Samples) -> Floats:
    """Station of the nearest place on the two segments beside the nearest sample."""
    rank = at - samples.offsets[samples.owner[at]]
    best = np.full(len(at), np.inf)
    station = np.zeros(len(at))
    for shift in (0, -1):
        start = samples.points[samples.beside(at, shift)]
        along = samples.points[samples.beside(at, shift + 1)] - start
        square = np.maximum((along * along).sum(1), np.finfo(float).tiny)
        part = np.clip(((points - start) * along).sum(1) / square, 0.0, 1.0)
        gap = ((points - start - along * part[:, None]) ** 2).sum(1)
        nearer = gap < best
        best[nearer] = gap[nearer]
        station[nearer] = ((rank + shift + part) * samples.step[samples.owner[at]])[nearer]
    return station
