"""The bands: what is left of the surface when it is cut along all polylines.

Each face is cut into pieces by the levels that pass through it; pieces that share a part of
an edge belong to the same band.  The *elements* that are grouped are the regions of nodes and,
where an edge is crossed more than once, its parts between two crossings: element ``n_regions + c``
lies beyond crossing ``c``.  A piece needs no element of its own: it always touches one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.model.latitudes import Bands
from weavecore.offsetting.isolines.crossings import NO_CROSSING, Crossings, Loops
from weavecore.offsetting.isolines.cut_mesh import Sheet
from weavecore.offsetting.isolines.simplify import Regions
from weavecore.offsetting.spacing import Ladder


class Pieces:
    """The band of every node and of every part of an edge.

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

    def __init__(self, regions: Regions, crossings: Crossings) -> None:
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
        n = regions.count + len(crossings)
        links = coo_matrix((np.ones(int(joins.sum()), np.int8), (a[joins], b[joins])), shape=(n, n))
        _, label = connected_components(links, directed=False)
        used = np.concatenate([np.ones(regions.count, bool), ~is_last])
        name = np.full(int(label.max()) + 1, -1, np.int64)
        named = np.unique(label[used])
        self.count = len(named)
        name[named] = np.arange(self.count)
        self.node_band: Ints = name[label[regions.label]]
        self.above: Ints = name[label[above]]
        self.below: Ints = name[label[below]]
        self.is_last_on_edge: Bools = is_last

    def euler(self, sheet: Sheet, regions: Regions, open_starts: Ints) -> Ints:
        """Euler characteristic of each band: its open cells, and 1 for each side that is an open polyline.

        Closed ones count for 0.  ``open_starts`` are the first crossings of the open polylines.
        """

        def tally(bands: Ints) -> Ints:
            return np.bincount(bands, minlength=self.count)

        a, b = self.node_band[sheet.tail[sheet.edges]], self.node_band[sheet.head[sheet.edges]]
        edges = tally(a) + tally(b[a != b]) + tally(self.above[~self.is_last_on_edge])
        corners = sheet.faces[np.arange(len(sheet.faces)), np.argmin(regions.band[sheet.faces], axis=1)]
        pieces = tally(self.node_band[corners]) + tally(self.above[self.enters])
        sides = tally(self.above[open_starts]) + tally(self.below[open_starts])
        euler: Ints = tally(self.node_band) - edges + pieces + sides
        return euler

    def depths(self, distance: Floats, reached: Floats) -> Floats:
        """Largest distance in each band: that of its deepest node, or of its children if that is more."""
        depth = np.zeros(self.count)
        np.maximum.at(depth, self.node_band, distance)
        np.maximum.at(depth, self.below, reached)
        return depth


def find_bands(sheet: Sheet, regions: Regions, crossings: Crossings, loops: Loops, *, ladder: Ladder) -> Bands:
    """The bands, by their first parent.

    Parameters
    ----------
    loops : Loops
        The polylines from generation 1; those of generation 0 come before them, in the
        order of ``sheet.origins``.
    """
    pieces = Pieces(regions, crossings)
    first = loops.order[loops.offsets[:-1]]
    child = len(sheet.origins) + np.arange(len(first))
    polyline = np.concatenate([sheet.side_polyline, child, child])
    band = np.concatenate([pieces.node_band[sheet.side_node], pieces.above[first], pieces.below[first]])
    is_parent = np.arange(len(polyline)) < len(sheet.side_polyline) + len(first)
    is_left = is_parent.copy()
    is_left[: len(sheet.side_polyline)] = sheet.side_is_left
    reached = ladder.distance(crossings.level.astype(np.float64))
    euler, depth = pieces.euler(sheet, regions, first[~loops.closed]), pieces.depths(sheet.distance, reached)
    return order_bands(polyline, band, is_parent, is_left, euler, depth)


def order_bands(polyline: Ints, band: Ints, is_parent: Bools, is_left: Bools, euler: Ints, depth: Floats) -> Bands:
    """Bands by their first parent, from sides in any order: the polyline and the band of each, and what it is."""
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
    """(E, 2) all pairs (parent, child) that share a band, sorted."""
    band = rows_of(bands.offsets)
    parents, children = np.flatnonzero(bands.is_parent), np.flatnonzero(~bands.is_parent)
    per_band = np.bincount(band[parents], minlength=len(bands))
    n_parents = per_band[band[children]]
    at = np.repeat(offsets_of(per_band)[:-1][band[children]], n_parents)
    within = np.arange(len(at)) - np.repeat(offsets_of(n_parents)[:-1], n_parents)
    pairs = np.c_[bands.polyline[parents[at + within]], np.repeat(bands.polyline[children], n_parents)]
    unique: Ints = np.unique(pairs.reshape(-1, 2), axis=0)
    return unique
