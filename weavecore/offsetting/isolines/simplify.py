r"""Topological simplification: which levels lie below each node, without islets, specks and necks too narrow to weave.

A *region* is a connected set of nodes with the same number of levels below them; the regions and their neighbours are
the contour tree (Reeb graph) of the sampled distance.  Three kinds of its features are removed:

* *pits*: a distance has no minimum but its origins, so a region with no lower neighbour and no origin is an artefact of
  sampling; it is raised to its lowest neighbour.
* *caps*: a region that rises less than `MIN_CAP_RISE` above its level, with no higher neighbour, is lowered beneath it
  (pruning by persistence, Edelsbrunner, Letscher and Zomorodian 2002).
* *narrow ridges and saddles*: where fronts meet head-on the distance has a saddle.  Level with it two polylines
  touch, or one pinches itself; a little above, both run side by side along the cut locus, as they do at the tip of a
  tongue between two fronts that converge.  Nodes of the cut locus that rise less than `MIN_CUT_LOCUS_RISE` above a
  level are lowered beneath it, and so are saddles near a level.

      side view across a ridge         level ------.---^---.------   rise < MIN_CUT_LOCUS_RISE: lowered
                                                 /         \

Work: linear in the edges, once for each level of nested pits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.offsetting.isolines.cut_mesh import CutMesh
from weavecore.offsetting.spacing import LevelSchedule
from weavecore.tolerances import MIN_CAP_RISE, MIN_CUT_LOCUS_RISE


@dataclass(frozen=True, eq=False)
class LevelRegions:
    """Nodes grouped by the number of levels below them.

    Parameters
    ----------
    band : (n,) int64
        Number of levels at or below each node.
    label : (n,) int64
        Region of each node.
    count : int
    distance : (n,) float64
        The simplified distance.
    """

    band: Ints
    label: Ints
    count: int
    distance: Floats


def group_by_level(mesh: CutMesh, *, schedule: LevelSchedule) -> LevelRegions:
    """Group the nodes into regions, simplified.

    Parameters
    ----------
    mesh : CutMesh
    schedule : LevelSchedule

    Returns
    -------
    LevelRegions
        Every region has a lower neighbour or holds an origin, so that each polyline has a parent; each without a
        higher neighbour rises at least `MIN_CAP_RISE` spacings above its level.
    """
    distance = _without_narrow_ridges(mesh, schedule=schedule)
    band = schedule.levels_below(distance)
    tail, head = mesh.tail[mesh.edges], mesh.head[mesh.edges]
    falls = band[tail] != band[head]
    count, label = connected(tail[~falls], head[~falls], mesh.n_nodes)
    graph = _RegionGraph(band, label, count, tail[falls], head[falls])
    region_band, merged = graph.level(schedule.level_index(distance), mesh.distance == 0.0)
    simplified = region_band[label]
    moved = simplified != band
    level = simplified[moved].astype(np.float64)
    distance[moved] = np.clip(distance[moved], schedule.distance_of(level), schedule.distance_of(level + 1.0))
    return LevelRegions(simplified, merged[label], int(merged.max()) + 1, distance)


class _RegionGraph:
    """LevelRegions and which of them touch."""

    def __init__(self, band: Ints, label: Ints, count: int, tail: Ints, head: Ints) -> None:
        self.node_label = label
        self.band = np.empty(count, np.int64)
        self.band[label] = band
        ends = label[np.concatenate([tail, head])], label[np.concatenate([head, tail])]
        pairs = np.unique(ends[0] * np.int64(count) + ends[1])
        self.a, self.b = pairs // count, pairs % count

    def level(self, height: Floats, on_origin: Bools) -> tuple[Ints, Ints]:
        """Raise pits, then lower caps; gives the band and the merged region of each region."""
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
        return connected(self.a[same], self.b[same], len(self.band))[1]

    def _raise_pits(self, merged: Ints, has_origin: Bools) -> bool:
        """Raise each pit to its lowest neighbour; whether there was one."""
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
        shallow = is_cap[merged] & (self.band > 0) & (summit[merged] < self.band + MIN_CAP_RISE)
        self.band[shallow] -= 1


_STEEP_RIDGE = 0.4
"""A cut locus along which the distance rises more steeply than this makes a corner of a level, not a narrow tongue: the
two fronts meet at less than 130 degrees (2 acos 0.4)."""


def _without_narrow_ridges(mesh: CutMesh, *, schedule: LevelSchedule) -> Floats:
    """Lower narrow ridges and saddles near a level to `MIN_CUT_LOCUS_RISE` spacings below it.

    Parameters
    ----------
    mesh : CutMesh
    schedule : LevelSchedule

    Returns
    -------
    (n,) float64
        The distance of each node.
    """
    height = schedule.level_index(mesh.distance)
    level = np.round(height)
    above = height - level
    is_near = (np.abs(above) < MIN_CUT_LOCUS_RISE) & (level > 0)
    is_narrow = is_near & (above >= 0) & (mesh.ridge_slope < _STEEP_RIDGE)
    # What lies beside a narrow ridge, yet beyond the level, would be left as a splinter.
    is_low = is_narrow.copy()
    is_low[mesh.head[is_narrow[mesh.tail]]] = True
    is_low &= is_near & (above >= 0)
    # The ends of an edge with a cut locus node on it are no saddles: what looks like one is the edge across the ridge.
    ridge = mesh.edge_of[:, 0] != mesh.edge_of[:, 1]
    is_near[mesh.edge_of[ridge].ravel()] = False
    near = np.flatnonzero(is_near)
    is_low[near] |= _are_saddles(mesh, near)
    distance = mesh.distance.copy()
    distance[is_low] = schedule.distance_of(level[is_low] - MIN_CUT_LOCUS_RISE)
    return distance


def _are_saddles(mesh: CutMesh, nodes: Ints) -> Bools:
    """Whether the ring of neighbours of each node rises above it in two places or more.

    Of equal distances the one with the greater number counts as higher.  At a border the half ring is reflected.
    """
    place = np.full(mesh.n_nodes, -1, np.int64)
    place[nodes] = np.arange(len(nodes))
    corner = np.flatnonzero(place[mesh.faces.ravel()] >= 0)
    face, k = corner // 3, corner % 3
    own = mesh.faces[face, k]

    def rises(other: Ints) -> Bools:
        difference = mesh.distance[other] - mesh.distance[own]
        return np.asarray((difference > 0) | ((difference == 0) & (other > own)))

    turns = rises(mesh.faces[face, (k + 1) % 3]) != rises(mesh.faces[face, (k + 2) % 3])
    n_turns = np.bincount(place[own[turns]], minlength=len(nodes)) * np.where(mesh.on_border()[nodes], 2, 1)
    return np.asarray(n_turns >= 4)
