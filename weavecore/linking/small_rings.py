r"""Rings too small to be bent: left out of the lattice, so that rods cross in the middle of a pocket instead.

A ring of n edges around a pocket turns by about 2π/n at each node.  One that turns by more than `MOST_TURN` would be
broken at every node into rods of one edge::

        \   |   /                \   |   /
         o──o──o                  \  |  /
       ──o  ○  o──      →       ───\─┼─/───      the rods of the ring around it meet in the pocket
         o──o──o                  /  |  \
        /   |   \                /   |   \

Rings are left out from the last ones outwards, two at most one behind the other: each has a pocket, a disc, on one side
and other rings or borders on the other.  The bands on its two sides become one, whose Euler characteristic is the sum
of theirs.  O(S) for S sides of bands, for each ring that is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, offsets_of, rows_of
from weavecore.model.latitudes import Bands, Latitudes
from weavecore.model.lattice import Lattice
from weavecore.model.polylines import Polylines
from weavecore.model.rod_pairing import MOST_TURN

FEWEST_EDGES = 2.0 * np.pi / MOST_TURN
"""Edges of a ring that turns by the most that a rod may turn at each of its nodes."""

_MOST_BEHIND_ANOTHER = 2
"""Rings around one pocket: with edges of a spacing a flat disc has two of fewer than eight edges at most."""


@dataclass(frozen=True, eq=False)
class KeptLatitudes:
    """The latitudes that are linked, and their numbers among all.

    Parameters
    ----------
    latitudes : Latitudes
    polyline : (P,) int64
        Number of each of these polylines among those of ``whole``.
    whole : Latitudes
    """

    latitudes: Latitudes
    polyline: Ints
    whole: Latitudes

    def restore(self, lattice: Lattice) -> Lattice:
        """The lattice with the numbers of all latitudes."""
        if len(self.polyline) == len(self.whole):
            return lattice
        latitude = lattice.node_latitude
        return replace(lattice, latitudes=self.whole, node_latitude=np.where(latitude < 0, -1, self.polyline[latitude]))


def leave_out_small_rings(latitudes: Latitudes, edge_length: float, *, fewest: float = FEWEST_EDGES) -> KeptLatitudes:
    """Leave out the rings around pockets that have few edges.

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float
        Wanted length of the edges, in the unit of the surface.
    fewest : float
        Edges of a ring that is kept.

    Returns
    -------
    KeptLatitudes
    """
    is_small = latitudes.polylines.closed & (latitudes.polylines.lengths < fewest * edge_length)
    is_small &= latitudes.generation > 0
    keep = np.ones(len(latitudes), bool)
    bands = latitudes.bands
    for _ in range(_MOST_BEHIND_ANOTHER):
        out = _rings_around_discs(bands, is_small & keep)
        keep[out] = False
        for p in out.tolist():
            bands = _without(bands, p)
    return KeptLatitudes(_kept(latitudes, bands, keep), np.flatnonzero(keep), latitudes)


def _rings_around_discs(bands: Bands, is_small: Bools) -> Ints:
    """The small rings beyond which there is a disc and no other polyline."""
    first = bands.offsets[:-1]
    is_disc = (np.diff(bands.offsets) == 1) & (bands.euler == 1)
    side = first[is_disc]
    rings = bands.polyline[side[bands.is_parent[side]]]
    return np.unique(rings[is_small[rings]])


def _without(bands: Bands, p: int) -> Bands:
    """The bands with the two on the sides of polyline ``p`` made one."""
    band = rows_of(bands.offsets)
    inner, outer = (int(band[(bands.polyline == p) & (bands.is_parent == side)][0]) for side in (True, False))
    side, kept = bands.polyline != p, np.arange(len(bands)) != inner
    euler, depth = bands.euler.copy(), bands.depth.copy()
    euler[outer] += euler[inner]
    depth[outer] = max(depth[outer], depth[inner])
    counts = np.bincount(band[side], minlength=len(bands))[kept]
    return Bands(
        offsets_of(counts), bands.polyline[side], bands.is_parent[side], bands.is_left[side], euler[kept], depth[kept]
    )


def _kept(latitudes: Latitudes, bands: Bands, keep: Bools) -> Latitudes:
    """The latitudes of a part of the polylines."""
    if keep.all():
        return latitudes
    number = np.cumsum(keep) - 1
    lines = latitudes.polylines
    point = keep[rows_of(lines.offsets)]
    return replace(
        latitudes,
        polylines=Polylines(
            lines.points[point],
            offsets_of(lines.counts[keep]),
            lines.closed[keep],
            lines.face[point],
            lines.barycentric[point],
        ),
        generation=latitudes.generation[keep],
        distance=latitudes.distance[keep],
        parents=number[latitudes.parents[keep[latitudes.parents].all(axis=1)]],
        bands=replace(bands, polyline=number[bands.polyline]),
    )
