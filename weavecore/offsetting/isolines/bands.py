"""Bands: what is left of the surface when it is cut along all polylines, and with them the parents of each polyline.

Levels cut a face into pieces; pieces that share a part of an edge belong to the same band.  The *elements* that are
joined are the regions of nodes and, where an edge is crossed more than once, its parts between two crossings::

      deep  o------x------x------o  shallow        element r: region of the deep node
             r       c1     c2     s               element n_regions + c: the part of the edge beyond crossing c
               (n + c1)                            element s: region of the shallow node

A piece needs no element of its own, since it always touches one.

Work: linear in the nodes, edges and crossings.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected, offsets_of, ranges, rows_of
from weavecore.model.latitudes import Bands
from weavecore.offsetting.isolines.crossings import NO_CROSSING, Crossings, Loops
from weavecore.offsetting.isolines.cut_mesh import CutMesh
from weavecore.offsetting.isolines.simplify import LevelRegions
from weavecore.offsetting.spacing import LevelSchedule


class _BandLabels:
    """Band of every node and of every part of an edge.

    Attributes
    ----------
    count : int
        Number of bands.
    node_band : (n,) int64
        Band of each node.
    above, below : (N,) int64
        Band on the deeper and on the shallower side of each crossing.
    enters : (N,) bool
        Whether the polyline enters a face there.
    """

    def __init__(self, regions: LevelRegions, crossings: Crossings) -> None:
        part = regions.count + np.arange(len(crossings))
        is_last = crossings.level == regions.band[crossings.deep]
        is_first = crossings.level == regions.band[crossings.shallow] + 1
        above = np.where(is_last, regions.label[crossings.deep], part)
        below = np.where(is_first, regions.label[crossings.shallow], part - 1)
        self.enters: Bools = crossings.after != NO_CROSSING
        onward = crossings.after[self.enters]
        a = np.concatenate([above[self.enters], below[self.enters]])
        b = np.concatenate([above[onward], below[onward]])
        # Nodes of one region are joined already; only parts of edges need joining.
        joins = (a >= regions.count) | (b >= regions.count)
        _, label = connected(a[joins], b[joins], regions.count + len(crossings))
        used = np.concatenate([np.ones(regions.count, bool), ~is_last])
        name = np.full(int(label.max()) + 1, -1, np.int64)
        named = np.unique(label[used])
        self.count = len(named)
        name[named] = np.arange(self.count)
        self.node_band: Ints = name[label[regions.label]]
        self.above: Ints = name[label[above]]
        self.below: Ints = name[label[below]]
        self.is_last_on_edge: Bools = is_last

    def euler(self, mesh: CutMesh, regions: LevelRegions, open_starts: Ints) -> Ints:
        """Euler characteristic of each band: nodes - edges + pieces, and 1 for each side that is an open polyline.

        Parameters
        ----------
        mesh : CutMesh
        regions : LevelRegions
        open_starts : (k,) int64
            First crossings of the open polylines; closed ones count for 0.

        Returns
        -------
        (count,) int64
        """

        def tally(bands: Ints) -> Ints:
            return np.bincount(bands, minlength=self.count)

        a, b = self.node_band[mesh.tail[mesh.edges]], self.node_band[mesh.head[mesh.edges]]
        edges = tally(a) + tally(b[a != b]) + tally(self.above[~self.is_last_on_edge])
        corners = mesh.faces[np.arange(len(mesh.faces)), np.argmin(regions.band[mesh.faces], axis=1)]
        pieces = tally(self.node_band[corners]) + tally(self.above[self.enters])
        sides = tally(self.above[open_starts]) + tally(self.below[open_starts])
        euler: Ints = tally(self.node_band) - edges + pieces + sides
        return euler

    def depths(self, distance: Floats, reached: Floats) -> Floats:
        """Largest distance in each band: that of its deepest node, or of its children if that is more.

        Parameters
        ----------
        distance : (n,) float64
            Of the nodes.
        reached : (N,) float64
            Of the crossings.

        Returns
        -------
        (count,) float64
        """
        depth = np.zeros(self.count)
        np.maximum.at(depth, self.node_band, distance)
        np.maximum.at(depth, self.below, reached)
        return depth


def find_bands(
    mesh: CutMesh, regions: LevelRegions, crossings: Crossings, loops: Loops, *, schedule: LevelSchedule
) -> Bands:
    """Find the bands, ordered by their first parent.

    Parameters
    ----------
    mesh : CutMesh
    regions : LevelRegions
    crossings : Crossings
    loops : Loops
        Polylines from generation 1; those of generation 0 come before them, in the order of ``mesh.origins``.
    schedule : LevelSchedule

    Returns
    -------
    Bands
    """
    labels = _BandLabels(regions, crossings)
    first = loops.order[loops.offsets[:-1]]
    child = len(mesh.origins) + np.arange(len(first))
    polyline = np.concatenate([mesh.side_polyline, child, child])
    band = np.concatenate([labels.node_band[mesh.side_node], labels.above[first], labels.below[first]])
    is_parent = np.arange(len(polyline)) < len(mesh.side_polyline) + len(first)
    is_left = is_parent.copy()
    is_left[: len(mesh.side_polyline)] = mesh.side_is_left
    reached = schedule.distance_of(crossings.level.astype(np.float64))
    euler, depth = labels.euler(mesh, regions, first[~loops.closed]), labels.depths(mesh.distance, reached)
    return order_bands(polyline, band, is_parent, is_left, euler, depth)


def order_bands(polyline: Ints, band: Ints, is_parent: Bools, is_left: Bools, euler: Ints, depth: Floats) -> Bands:
    """Order bands by their first parent.

    Parameters
    ----------
    polyline, band : (s,) int64
        Polyline and band of each side, in any order.
    is_parent, is_left : (s,) bool
        Whether the polyline is a parent of the band, and whether the band lies on its left.
    euler : (n,) int64
        Euler characteristic of each band.
    depth : (n,) float64
        Largest distance in each band.

    Returns
    -------
    Bands
    """
    earliest = np.full(len(euler), len(polyline))
    np.minimum.at(earliest, band[is_parent], np.flatnonzero(is_parent))
    rank = np.argsort(earliest, kind="stable")
    place = np.empty(len(euler), np.int64)
    place[rank] = np.arange(len(euler))
    order = np.lexsort((~is_left, polyline, ~is_parent, place[band]))
    return Bands(
        offsets=offsets_of(np.bincount(band, minlength=len(euler))[rank]),
        polyline=polyline[order],
        is_parent=is_parent[order],
        is_left=is_left[order],
        euler=euler[rank],
        depth=depth[rank],
    )


def find_parents(bands: Bands) -> Ints:
    """Find all pairs of a parent and a child around one band.

    Parameters
    ----------
    bands : Bands

    Returns
    -------
    (E, 2) int64
        Sorted.
    """
    band = rows_of(bands.offsets)
    parents, children = np.flatnonzero(bands.is_parent), np.flatnonzero(~bands.is_parent)
    per_band = np.bincount(band[parents], minlength=len(bands))
    n_parents = per_band[band[children]]
    parent = parents[ranges(offsets_of(per_band)[:-1][band[children]], n_parents)]
    pairs = np.c_[bands.polyline[parent], np.repeat(bands.polyline[children], n_parents)]
    unique: Ints = np.unique(pairs.reshape(-1, 2), axis=0)
    return unique
