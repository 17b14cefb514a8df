"""How many nodes each polyline gets (Yan et al. 2016, §5: the first question of the links).

A polyline of length L gets round(L / edge length) edges, rounded to the multiple that the pattern needs:

    closed:  nodes = edges                at least 3
    open:    nodes = edges + 1            at least 1 edge, 2 where the polyline alone cuts off a stretch of border

Of a closed border each run between two corners that is shorter than an edge counts as one edge.

Where the pattern allows it (`Pattern.count_tolerance`), the counts of polylines that follow one another are chosen
together, so that few rods across the rings end: see `ring_counts`.

Time is linear in the number of polylines.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected, rows_of
from weavecore.linking.node_placement import edges_with_corners
from weavecore.linking.patterns import Pattern
from weavecore.linking.ring_counts import choose_counts
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
    ideal, for_corners = _edges_of_polylines(latitudes, edge_length)
    fewest = -(-np.maximum(for_corners, FEWEST_NODES) // multiple) * multiple
    edges = np.maximum(np.rint(ideal / multiple).astype(np.int64) * multiple, fewest)
    is_open = ~latitudes.polylines.closed
    # With an odd number of edges an open polyline has an even number of nodes, as rings have.
    multiple = 2 if pattern.even_cells else 1
    least = 1 + multiple * is_border_cap
    edges[is_open] = np.maximum(np.rint((ideal - 1.0) / multiple).astype(np.int64) * multiple + 1, least)[is_open]
    if pattern.count_tolerance > 1.0:
        edges = _chosen_together(latitudes, edges, ideal, pattern, np.where(is_open, least, fewest))
    counts: Ints = edges + is_open
    return counts


def _edges_of_polylines(latitudes: Latitudes, edge_length: float) -> tuple[Floats, Ints]:
    """(P,) length of each polyline in edges, and (P,) fewest edges that closed borders need for their corners."""
    polylines = latitudes.polylines
    ideal, least = polylines.lengths / edge_length, np.zeros(len(latitudes), np.int64)
    for p in np.flatnonzero(polylines.closed & (latitudes.generation == 0)).tolist():
        part = slice(polylines.offsets[p], polylines.offsets[p + 1])
        ideal[p], least[p] = edges_with_corners(
            polylines.points[part], polylines.stations[part], float(polylines.lengths[p]), edge_length
        )
    return ideal, least


def _chosen_together(latitudes: Latitudes, edges: Ints, ideal: Floats, pattern: Pattern, least: Ints) -> Ints:
    """The numbers of edges with those of polylines that hang together by plain bands chosen by `choose_counts`."""
    is_open = ~latitudes.polylines.closed
    pairs = np.array(_plain_pairs(latitudes), np.int64).reshape(-1, 2)
    branches = _are_at_branches(latitudes)
    edges = edges.copy()
    for members in _trees(len(latitudes), pairs):
        in_twos = bool(is_open[members[0]]) and pattern.even_cells
        step = 2 if in_twos else 1 if is_open[members[0]] else pattern.count_multiple
        chosen = choose_counts(
            np.maximum(ideal[members], least[members]),
            latitudes.generation[members],
            np.searchsorted(members, pairs[np.isin(pairs[:, 1], members)]),
            branches[members],
            step=step,
            odd=int(in_twos),
            slack=pattern.count_tolerance,
            jump=pattern.jump_cost,
        )
        edges[members] = np.maximum(chosen, least[members])
    return edges


def _are_at_branches(latitudes: Latitudes) -> Bools:
    """(P,) whether a polyline lies at a band with three sides or more."""
    bands = latitudes.bands
    found = np.zeros(len(latitudes), bool)
    found[bands.polyline[(np.diff(bands.offsets) > 2)[rows_of(bands.offsets)]]] = True
    return found


def _trees(n: int, pairs: Ints) -> list[Ints]:
    """The polylines that hang together by pairs, two at least, each rising."""
    _, label = connected(pairs[:, 0], pairs[:, 1], n)
    return [np.flatnonzero(label == k) for k in np.unique(label[pairs[:, 0]])]


def _plain_pairs(latitudes: Latitudes) -> list[tuple[int, int]]:
    """Parent and child of every band that is an annulus or a strip between the two; parents first."""
    bands = latitudes.bands
    first = bands.offsets[:-1]
    is_open = ~latitudes.polylines.closed[bands.polyline[first]]
    plain = np.flatnonzero((np.diff(bands.offsets) == 2) & (bands.euler == is_open))
    plain = plain[bands.is_parent[first[plain]] & ~bands.is_parent[first[plain] + 1]]
    pairs = zip(bands.polyline[first[plain]].tolist(), bands.polyline[first[plain] + 1].tolist())
    return sorted(pairs, key=lambda pair: (pair[1], pair[0]))
