"""Necks and tongues too narrow to weave.

Where fronts meet head-on, the distance has a saddle: level with it, two polylines touch or
one pinches itself; a little above, both run side by side along the ridge, as they do at the tip of a
tongue between two fronts that converge.  The nodes of the ridge that rise hardly above
a level are lowered beneath it, and so are saddles: then what faces there keeps a gap.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.ladder import Ladder
from weavecore.offsetting.sheet import Sheet
from weavecore.tolerances import LEAST_NECK

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
