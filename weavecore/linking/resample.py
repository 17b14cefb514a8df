"""Division: how many nodes each polyline gets, and where along it they lie (Yan et al. 2016, §5).

A *station* is an arc length from the first point of a polyline.  The *index* of a place on
a divided polyline counts nodes: 2.5 lies halfway between nodes 2 and 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.linking.patterns import Pattern
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines

FEWEST_NODES = 3
CORNER_TURN = np.radians(40.0)
_LEAST_EDGE = 0.3
"""Corners of a path keep this part of an edge from its ends and from each other, or are no nodes."""
_MOST_CORNERS = 3
"""So many corners are more than a path of as few edges keeps."""
_YIELDING = 2
"""How many nodes on either side of one that is moved give way."""


def count_nodes(latitudes: Latitudes, edge_length: float, pattern: Pattern, is_tongue: Bools) -> Ints:
    """Number of nodes (P,) of each polyline, so that its edges come nearest to ``edge_length``.

    An open one has an edge at least, and one more where it is a tongue (P,), that is where it alone cuts off a
    stretch of border: as a single chord it might lie beyond it.
    """
    step = pattern.count_step
    fewest = -(-FEWEST_NODES // step) * step
    ideal = latitudes.polylines.lengths / edge_length
    edges = np.maximum(np.rint(ideal / step).astype(np.int64) * step, fewest)
    is_open = ~latitudes.polylines.closed
    # With an odd number of edges an open polyline has an even number of nodes, as rings have.
    step = 2 if pattern.in_pairs else 1
    least = 1 + step * is_tongue
    edges[is_open] = np.maximum(np.rint((ideal - 1.0) / step).astype(np.int64) * step + 1, least)[is_open]
    if pattern.count_slack > 1.0:
        for parent, child in ring_pairs(latitudes):
            if max(edges[parent] / ideal[child], ideal[child] / edges[parent]) <= pattern.count_slack:
                edges[child] = edges[parent]
    counts: Ints = edges + is_open
    return counts


def ring_pairs(latitudes: Latitudes) -> list[tuple[int, int]]:
    """Parent and child of every band that is a plain ring or strip between the two, parents first."""
    bands = latitudes.bands
    first = bands.offsets[:-1]
    is_open = ~latitudes.polylines.closed[bands.polyline[first]]
    plain = np.flatnonzero((np.diff(bands.offsets) == 2) & (bands.euler == is_open))
    plain = plain[bands.is_parent[first[plain]] & ~bands.is_parent[first[plain] + 1]]
    pairs = zip(bands.polyline[first[plain]].tolist(), bands.polyline[first[plain] + 1].tolist())
    return sorted(pairs, key=lambda pair: (pair[1], pair[0]))


def divide_border(points: Floats, stations: Floats, length: float, count: int) -> Floats:
    """Stations (count,) of the nodes of a border: a node at each corner, equal arc lengths between.

    Where there is no corner the first node lies at the sharpest turn, so that the division
    depends on the shape and not on where the polyline begins.
    """
    turn = turns(points)
    corners = np.flatnonzero(turn > CORNER_TURN)
    if len(corners) == 0 or len(corners) > count:
        start = int(np.argmax(turn > turn.max() - 1e-9))
        return np.sort((stations[start] + np.arange(count) * (length / count)) % length)
    runs = np.diff(np.append(stations[corners], stations[corners[0]] + length))
    parts = _shared_out(runs, count)
    nodes = [s + np.arange(n) * (run / n) for s, run, n in zip(stations[corners], runs, parts)]
    return np.sort(np.concatenate(nodes) % length)


def divide_path(points: Floats, stations: Floats, length: float, count: int) -> Floats:
    """Stations (k,) of the nodes of an open path: its ends, its corners, and equal arc lengths between.

    ``count`` is the number of edges; corners make it more, where it is so low that they would be lost,
    unless there are many, or they lie hardly an edge off the ends.
    """
    edge = length / count
    turn = turns(points)[1:-1]
    corners = _apart(stations[1:-1][turn > CORNER_TURN], turn[turn > CORNER_TURN], length, _LEAST_EDGE * edge)
    if len(corners) == 0 or len(corners) >= max(count, _MOST_CORNERS):
        return np.linspace(0.0, length, count + 1)
    starts = np.concatenate([[0.0], corners])
    runs = np.diff(np.append(starts, length))
    parts = _shared_out(runs, max(count, len(runs)))
    nodes = [s + np.arange(n) * (run / n) for s, run, n in zip(starts, runs, parts)]
    return np.append(np.concatenate(nodes), length)


def _apart(corners: Floats, turn: Floats, length: float, least: float) -> Floats:
    """Those of some stations on a path that are not too near to its ends or to one that turns more."""
    kept = [0.0, length]
    for k in np.argsort(-turn, kind="stable").tolist():
        if np.abs(corners[k] - kept).min() >= least:
            kept.append(float(corners[k]))
    return np.sort(kept)[1:-1]


def _shared_out(runs: Floats, count: int) -> Ints:
    """Whole numbers of edges, one at least, in the proportion of the runs and ``count`` in all."""
    parts = np.maximum(np.floor(runs * (count / runs.sum())).astype(np.int64), 1)
    while parts.sum() < count:
        parts[np.argmax(runs / parts)] += 1
    while parts.sum() > count:
        able = np.where(parts > 1, runs / np.maximum(parts - 1, 1), np.inf)
        parts[np.argmin(able)] -= 1
    shared: Ints = parts
    return shared


def turns(points: Floats) -> Floats:
    """Angle (n,) by which a closed polyline turns at each of its points."""
    ahead = np.roll(points, -1, axis=0) - points
    behind = np.roll(ahead, 1, axis=0)
    cross = np.linalg.norm(np.cross(behind, ahead), axis=1)
    angles: Floats = np.arctan2(cross, (behind * ahead).sum(1)).astype(np.float64)
    return angles


def divide_evenly(length: float, count: int, phase: float, spikes: Optional[Floats] = None) -> Floats:
    """Stations (count,) at equal arc length; the first lies ``phase`` edges after the start.

    The nodes nearest to ``spikes``, the sharpest first, are moved onto them, and those
    beside them give way; so the first station may be less than 0 and the last beyond the end.
    """
    edge = length / count
    steps: Floats = np.arange(count, dtype=np.float64) + phase % 1.0
    if spikes is not None and len(spikes):
        steps += _shifts_onto(steps, spikes / edge)
    return steps * edge


def _shifts_onto(steps: Floats, spikes: Floats) -> Floats:
    """How far (n,) each node moves, in edges, so that each spike gets a node; it fades out on either side."""
    n = len(steps)
    fixed: dict[int, float] = {}
    for spike in spikes.tolist():
        node = int(np.rint(spike - steps[0]))
        if all(min((node - k) % n, (k - node) % n) > 1 for k in fixed):
            fixed[node % n] = spike - steps[0] - node
    nodes = np.array(sorted(fixed), np.int64)
    apart = np.abs(np.arange(n)[:, None] - nodes)
    free = np.flatnonzero(np.minimum(apart, n - apart).min(1) > _YIELDING)
    known = np.concatenate([nodes, free])
    shift = np.concatenate([[fixed[k] for k in nodes.tolist()], np.zeros(len(free))])
    shifts: Floats = np.interp(np.arange(n), known, shift, period=n)
    return shifts


def index_at(nodes: Floats, length: float, station: Floats, *, closed: bool = True) -> Floats:
    """Index of stations on a polyline whose nodes lie at the rising stations ``nodes``.

    On a closed one stations may run on beyond the end, where the next turn begins.
    """
    n = len(nodes)
    if not closed:
        return np.interp(station, nodes, np.arange(n, dtype=np.float64))
    turn = np.floor(station / length)
    known = np.concatenate([[nodes[-1] - length], nodes, [nodes[0] + length]])
    index: Floats = np.interp(station - turn * length, known, np.arange(-1.0, n + 1)) + turn * n
    return index


def points_at(polylines: Polylines, polyline: Ints, station: Floats) -> Floats:
    """Points (n, 3) at stations along polylines."""
    start = segments_at(polylines, polyline, station)
    length = polylines.segment_lengths[start]
    along = station - polylines.stations[start]
    part = np.divide(along, length, out=np.zeros_like(along), where=length > 0)[:, None]
    ends = polylines.offsets[polyline + 1] - 1
    after = np.where(start == ends, polylines.offsets[polyline], start + 1)
    points: Floats = polylines.points[start] * (1 - part) + polylines.points[after] * part
    return points


def segments_at(polylines: Polylines, polyline: Ints, station: Floats) -> Ints:
    """First point (n,) of the segment in which each station lies."""
    # Stations of all polylines end to end make one rising row to search in.
    base = np.concatenate([[0.0], np.cumsum(polylines.lengths)])
    row = base[polylines.owner] + polylines.stations
    found = np.searchsorted(row, base[polyline] + station, side="right") - 1
    start: Ints = np.clip(found, polylines.offsets[polyline], polylines.offsets[polyline + 1] - 1)
    return start


# ----------------------------------------------------------------------
# Where the nodes of an open polyline lie: one at either end, the others at equal arc lengths between.
#
# From the end to the next node it may be a whole edge or half of one: rows that begin alike in turns make
# even triangles, cut in half along the selvedge.

_STRAIN_COST = 4.0
"""Of each edge, times the square of its strain: by which part of the length aimed at it is longer or shorter."""
_FEWEST_TO_SHIFT = 3
"""Polylines of fewer edges are divided evenly."""
_NEAR_SPIKE = 0.5
"""A node is moved onto a spike by no more than this part of an edge."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to divide an open polyline: stations (k,) of its nodes, its ends among them, and what it costs."""

    stations: Floats
    cost: float


def divide_open(length: float, n_edges: int, spikes: Optional[Floats]) -> Floats:
    """Stations (n + 1,) at equal arc lengths; nodes nearest to spikes are moved onto them."""
    return _onto_spikes(np.linspace(0.0, length, n_edges + 1), spikes)


def divide_openly(length: float, n_edges: int, spikes: Optional[Floats], pattern: Pattern) -> list[Way]:
    """The ways to divide a polyline that has about so many edges: evenly, or with a half edge at one end or at both."""
    ways = [Way(divide_open(length, n_edges, spikes), 0.0)]
    if not pattern.has_diagonals:
        return ways
    for first, last in ((0.5, 0.5), (0.5, 1.0), (1.0, 0.5)):
        whole = int(np.rint(n_edges - first - last))
        if whole < 0 or n_edges < _FEWEST_TO_SHIFT:
            continue
        edge = length / (first + whole + last)
        stations = np.concatenate([[0.0], (first + np.arange(whole + 1)) * edge, [length]])
        strain = edge * n_edges / length - 1.0
        ways.append(Way(_onto_spikes(stations, spikes), _STRAIN_COST * n_edges * strain**2))
    return ways


def _onto_spikes(stations: Floats, spikes: Optional[Floats]) -> Floats:
    """The stations with inner nodes moved onto spikes that are near, the sharpest first."""
    moved = stations.copy()
    for spike in [] if spikes is None else spikes.tolist():
        node = int(np.argmin(np.abs(stations - spike)))
        if 0 < node < len(stations) - 1 and moved[node] == stations[node]:
            gap = min(stations[node] - stations[node - 1], stations[node + 1] - stations[node])
            if abs(spike - stations[node]) <= _NEAR_SPIKE * gap:
                moved[node] = spike
    return moved


# ----------------------------------------------------------------------
# Samples: places along the polylines at equal arc length, and the spikes among them.

SAMPLES_PER_NODE = 8

SPIKE = 0.72
"""A polyline has a spike where an edge's length of it would become shorter than this part as a chord."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Places along polylines, polyline after polyline.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline, `SAMPLES_PER_NODE` a node, the first at station 0; of an open one the last at its end.
    owner : (M,) int64
        Polyline of each sample.
    step : (P,) float64
        Arc length from one to the next.
    points : (M, 3) float64
    closed : (P,) bool
    """

    offsets: Ints
    owner: Ints
    step: Floats
    points: Floats
    closed: Bools

    def beside(self, samples: Ints, shift: int) -> Ints:
        """The samples so many steps further along the same polylines; not beyond the ends of open ones."""
        first = self.offsets[self.owner[samples]]
        count = self.offsets[self.owner[samples] + 1] - first
        place = samples - first + shift
        beside: Ints = first + np.where(self.closed[self.owner[samples]], place % count, np.clip(place, 0, count - 1))
        return beside


def sample_polylines(latitudes: Latitudes, counts: Ints) -> Samples:
    """Sample every polyline according to the number of its nodes."""
    offsets = offsets_of(counts * SAMPLES_PER_NODE)
    owner = rows_of(offsets)
    closed = latitudes.polylines.closed
    step: Floats = latitudes.polylines.lengths / (np.diff(offsets) - ~closed)
    station = (np.arange(len(owner)) - offsets[owner]) * step[owner]
    return Samples(offsets, owner, step, points_at(latitudes.polylines, owner, station), closed)


def find_spikes(samples: Samples) -> dict[int, Floats]:
    """Stations of the spikes of each polyline that has any, the sharpest first.

    Divided without regard to them, a ring would cut off its spikes, and with them what lies
    between the ring and its children.
    """
    here = np.arange(len(samples.owner))
    half = SAMPLES_PER_NODE // 2
    chord = samples.points[samples.beside(here, half)] - samples.points[samples.beside(here, -half)]
    ratio = np.linalg.norm(chord, axis=1) / (2 * half * samples.step[samples.owner])
    count, rank = np.diff(samples.offsets)[samples.owner], here - samples.offsets[samples.owner]
    ratio[~samples.closed[samples.owner] & ((rank < half) | (rank >= count - half))] = 1.0
    sharp = np.flatnonzero(ratio < SPIKE)
    for shift in range(1, half + 1):
        before, behind = ratio[samples.beside(sharp, -shift)], ratio[samples.beside(sharp, shift)]
        sharp = sharp[(ratio[sharp] < before) & (ratio[sharp] <= behind)]
    sharp = sharp[np.lexsort((sharp, ratio[sharp], samples.owner[sharp]))]
    station = (sharp - samples.offsets[samples.owner[sharp]]) * samples.step[samples.owner[sharp]]
    return {int(p): station[samples.owner[sharp] == p] for p in np.unique(samples.owner[sharp])}
