"""How many nodes each polyline gets (Yan et al. 2016, §5: the first question of the links).

A polyline of length L gets round(L / edge length) edges, rounded to the multiple that the pattern needs:

    closed:  nodes = edges                at least 3
    open:    nodes = edges + 1            at least 1 edge, 2 where the polyline alone cuts off a stretch of border

In patterns of quads a child keeps the count of its parent as long as its edges stay within a factor
(`Pattern.count_tolerance`) of the wanted length, so that rods across the rings need not end.

Time is linear in the number of polylines.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints
from weavecore.linking.patterns import Pattern
from weavecore.model.latitudes import Latitudes

FEWEST_NODES = 3
"""Nodes of a closed polyline or border: fewer make no polygon."""


def count_nodes(latitudes: Latitudes, edge_length: float, pattern: Pattern, is_border_cap: Bools) -> Ints:
    """Number of nodes of each polyline, chosen so that its edges come nearest to ``edge_length``.

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float
        In the unit of the surface.
    pattern : Pattern
    is_border_cap : (P,) bool
        Open polylines that alone cut off a stretch of border (`free_borders.find_border_caps`).  They get one
        edge more than others: as a single chord one might lie outside that border.

    Returns
    -------
    (P,) int64
    """
    multiple = pattern.count_multiple
    fewest = -(-FEWEST_NODES // multiple) * multiple
    ideal = latitudes.polylines.lengths / edge_length
    edges = np.maximum(np.rint(ideal / multiple).astype(np.int64) * multiple, fewest)
    is_open = ~latitudes.polylines.closed
    # With an odd number of edges an open polyline has an even number of nodes, as rings have.
    multiple = 2 if pattern.even_cells else 1
    least = 1 + multiple * is_border_cap
    edges[is_open] = np.maximum(np.rint((ideal - 1.0) / multiple).astype(np.int64) * multiple + 1, least)[is_open]
    if pattern.count_tolerance > 1.0:
        for parent, child in _plain_pairs(latitudes):
            if max(edges[parent] / ideal[child], ideal[child] / edges[parent]) <= pattern.count_tolerance:
                edges[child] = edges[parent]
    counts: Ints = edges + is_open
    return counts


def _plain_pairs(latitudes: Latitudes) -> list[tuple[int, int]]:
    """Parent and child of every band that is an annulus or a strip between the two; parents first."""
    bands = latitudes.bands
    first = bands.offsets[:-1]
    is_open = ~latitudes.polylines.closed[bands.polyline[first]]
    plain = np.flatnonzero((np.diff(bands.offsets) == 2) & (bands.euler == is_open))
    plain = plain[bands.is_parent[first[plain]] & ~bands.is_parent[first[plain] + 1]]
    pairs = zip(bands.polyline[first[plain]].tolist(), bands.polyline[first[plain] + 1].tolist())
    return sorted(pairs, key=lambda pair: (pair[1], pair[0]))
