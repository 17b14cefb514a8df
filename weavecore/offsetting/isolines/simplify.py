"""Which levels lie below each node, with the islets taken out.

A *region* is a connected set of nodes with the same number of levels below them.  The
distance from the borders has no pits: whoever walks towards the borders only ever descends.
So a region with no lower neighbour and no origin is an artefact of sampling, as is a
*cap* that rises hardly above its level where two fronts meet.  Both are levelled here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.isolines.cut_mesh import Sheet
from weavecore.offsetting.spacing import Ladder
from weavecore.tolerances import LEAST_CAP, LEAST_NECK


@dataclass(frozen=True, eq=False)
class Regions:
    """Nodes grouped by how many levels lie below them.

    Parameters
    ----------
    band : (n,) int64
        Number of levels at or below each node.
    label : (n,) int64
        Region of each node.
    count : int
    distance : (n,) float64
        The distance with necks, pits and caps levelled.
    """

    band: Ints
    label: Ints
    count: int
    distance: Floats


def group_nodes(sheet: Sheet, *, ladder: Ladder) -> Regions:
    """Group the nodes into regions and level pits and caps.

    Every region that is left has a lower neighbour or holds an origin, so that each polyline
    has a parent; each that has no higher neighbour rises `LEAST_CAP` spacings above its level.
    """
    distance = cut_necks(sheet, ladder=ladder)
    band = ladder.count_below(distance)
    tail, head = sheet.tail[sheet.edges], sheet.head[sheet.edges]
    falls = band[tail] != band[head]
    count, label = _components(tail[~falls], head[~falls], sheet.n_nodes)
    graph = _RegionGraph(band, label, count, tail[falls], head[falls])
    region_band, merged = graph.level(ladder.height(distance), sheet.distance == 0.0)
    settled = region_band[label]
    moved = settled != band
    level = settled[moved].astype(np.float64)
    distance[moved] = np.clip(distance[moved], ladder.distance(level), ladder.distance(level + 1.0))
    return Regions(settled, merged[label], int(merged.max()) + 1, distance)


class _RegionGraph:
    """Regions and which of them touch."""

    def __init__(self, band: Ints, label: Ints, count: int, tail: Ints, head: Ints) -> None:
        self.node_label = label
        self.band = np.empty(count, np.int64)
        self.band[label] = band
        ends = label[np.concatenate([tail, head])], label[np.concatenate([head, tail])]
        pairs = np.unique(ends[0] * np.int64(count) + ends[1])
        self.a, self.b = pairs // count, pairs % count

    def level(self, height: Floats, on_origin: Bools) -> tuple[Ints, Ints]:
        """Raise pits, then lower caps: band and merged region of each region."""
        count = len(self.band)
        has_origin = np.zeros(count, bool)
        has_origin[self.node_label[on_origin]] = True
        top = np.full(count, -np.inf)
        np.maximum.at(top, self.node_label, height)
        merged = np.arange(count)
        while self._raise_pits(merged, has_origin):
            merged = self._merge()
        self._lower_caps(merged, top)
        return self.band, self._merge()

    def _merge(self) -> Ints:
        same = self.band[self.a] == self.band[self.b]
        return _components(self.a[same], self.b[same], len(self.band))[1]

    def _raise_pits(self, merged: Ints, has_origin: Bools) -> bool:
        """Lift each pit to its lowest neighbour; whether there was one."""
        n = int(merged.max()) + 1
        is_pit = np.ones(n, bool)
        is_pit[merged[has_origin]] = False
        is_pit[merged[self.a[self.band[self.b] < self.band[self.a]]]] = False
        rises = is_pit[merged[self.a]] & (self.band[self.b] > self.band[self.a])
        if not rises.any():
            return False
        rim = np.full(n, np.iinfo(np.int64).max)
        np.minimum.at(rim, merged[self.a[rises]], self.band[self.b[rises]])
        lifted = is_pit[merged] & (rim[merged] < np.iinfo(np.int64).max)
        self.band[lifted] = rim[merged[lifted]]
        return True

    def _lower_caps(self, merged: Ints, top: Floats) -> None:
        n = int(merged.max()) + 1
        summit = np.full(n, -np.inf)
        np.maximum.at(summit, merged, top)
        is_cap = np.ones(n, bool)
        is_cap[merged[self.a[self.band[self.b] > self.band[self.a]]]] = False
        shallow = is_cap[merged] & (self.band > 0) & (summit[merged] < self.band + LEAST_CAP)
        self.band[shallow] -= 1


def _components(a: Ints, b: Ints, n: int) -> tuple[int, Ints]:
    links = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(n, n))
    count, label = connected_components(links, directed=False)
    return int(count), label.astype(np.int64)


# ----------------------------------------------------------------------
# Necks and tongues too narrow to weave.
#
# Where fronts meet head-on, the distance has a saddle: level with it, two polylines touch or
# one pinches itself; a little above, both run side by side along the ridge, as they do at the tip of a
# tongue between two fronts that converge.  The nodes of the ridge that rise hardly above
# a level are lowered beneath it, and so are saddles: then what faces there keeps a gap.

_STEEP = 0.4
"""A ridge that rises more steeply than this is a corner of a level, not a narrow tongue."""


def cut_necks(sheet: Sheet, *, ladder: Ladder) -> Floats:
    """(n,) the distance, with narrow ridges and saddles near a level put `LEAST_NECK` spacings below it."""
    height = ladder.height(sheet.distance)
    level = np.round(height)
    above = height - level
    is_near = (np.abs(above) < LEAST_NECK) & (level > 0)
    is_narrow = is_near & (above >= 0) & (sheet.steepness < _STEEP)
    # What lies beside a narrow ridge, yet beyond the level, would be left as a splinter.
    is_low = is_narrow.copy()
    is_low[sheet.head[is_narrow[sheet.tail]]] = True
    is_low &= is_near & (above >= 0)
    # The end of an edge that has a ridge on it is no saddle, however the mesh makes it look.
    ridge = sheet.edge_of[:, 0] != sheet.edge_of[:, 1]
    is_near[sheet.edge_of[ridge].ravel()] = False
    near = np.flatnonzero(is_near)
    is_low[near] |= _are_saddles(sheet, near)
    distance = sheet.distance.copy()
    distance[is_low] = ladder.distance(level[is_low] - LEAST_NECK)
    return distance


def _are_saddles(sheet: Sheet, nodes: Ints) -> Bools:
    """Whether the ring of neighbours of each node rises above it in two places or more.

    Equal distances are told apart by the number of the node.  At a border the ring is half a ring, and its mirror.
    """
    place = np.full(sheet.n_nodes, -1, np.int64)
    place[nodes] = np.arange(len(nodes))
    corner = np.flatnonzero(place[sheet.faces.ravel()] >= 0)
    face, k = corner // 3, corner % 3
    own = sheet.faces[face, k]

    def rises(other: Ints) -> Bools:
        difference = sheet.distance[other] - sheet.distance[own]
        return np.asarray((difference > 0) | ((difference == 0) & (other > own)))

    turns = rises(sheet.faces[face, (k + 1) % 3]) != rises(sheet.faces[face, (k + 2) % 3])
    n_turns = np.bincount(place[own[turns]], minlength=len(nodes)) * np.where(sheet.on_border()[nodes], 2, 1)
    return np.asarray(n_turns >= 4)
