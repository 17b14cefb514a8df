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
from weavecore.offsetting.ladder import Ladder
from weavecore.offsetting.necks import cut_necks
from weavecore.offsetting.sheet import Sheet
from weavecore.tolerances import LEAST_CAP


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
