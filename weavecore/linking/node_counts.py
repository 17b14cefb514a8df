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

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.linking.node_placement import edges_with_corners
from weavecore.linking.patterns import Pattern
from weavecore.linking.ring_counts import Balance, choose_counts
from weavecore.model.latitudes import Latitudes

FEWEST_NODES = 3
"""Nodes of a closed polyline or border: fewer make no polygon."""

_FACING = 1.4
"""Spacings from a child beyond which a parent faces itself or another parent across a neck."""


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
    """Numbers of edges (P,), of polylines that bands connect as `choose_counts` finds them, of the others as given."""
    is_open = ~latitudes.polylines.closed
    bands, branches = _balances(latitudes, across_splits=pattern.balances_splits)
    edges = edges.copy()
    for members in _trees(len(latitudes), bands):
        in_twos = bool(is_open[members[0]]) and pattern.even_cells
        step = 2 if in_twos else 1 if is_open[members[0]] else pattern.count_multiple
        chosen = choose_counts(
            np.maximum(ideal[members], least[members]),
            latitudes.generation[members],
            [
                replace(band, polyline=np.searchsorted(members, band.polyline))
                for band in bands
                if band.polyline[0] in members
            ],
            branches[members],
            step=step,
            remainder=int(in_twos),
            slack=pattern.count_tolerance,
            jump=pattern.jump_cost,
        )
        edges[members] = np.maximum(chosen, least[members])
    return edges


def _trees(n: int, bands: list[Balance]) -> list[Ints]:
    """The polylines that bands connect, in rising order: one array for each two or more."""
    one = np.array([p for band in bands for p in band.polyline[:-1].tolist()], np.int64)
    other = np.array([p for band in bands for p in band.polyline[1:].tolist()], np.int64)
    _, label = connected(one, other, n)
    return [np.flatnonzero(label == k) for k in np.unique(label[one])]


def _balances(latitudes: Latitudes, *, across_splits: bool) -> tuple[list[Balance], Bools]:
    """The bands whose counts are to be in balance, and (P,) whether a polyline lies at another of three or more sides.

    In balance are the annuli and strips between a parent and a child.  With ``across_splits`` so are the bands of
    closed polylines in which rings split or merge, but for those that would close a cycle; bands of the first
    generations come first.
    """
    bands, closed = latitudes.bands, latitudes.polylines.closed
    branches = np.zeros(len(latitudes), bool)
    group = np.arange(len(latitudes))
    found = []
    sides = [np.arange(bands.offsets[b], bands.offsets[b + 1]) for b in range(len(bands))]
    for b in sorted(range(len(bands)), key=lambda b: sorted(latitudes.generation[bands.polyline[sides[b]]].tolist())):
        polyline, is_parent = bands.polyline[sides[b]], bands.is_parent[sides[b]]
        is_plain = len(polyline) == 2 and bool(bands.euler[b] == ~closed[polyline[0]])
        groups = np.unique(group[polyline])
        is_tree = len(groups) == len(polyline) and 0 < is_parent.sum() < len(polyline)
        if is_tree and (is_plain or (across_splits and closed[polyline].all())):
            across = np.zeros(len(polyline)) if is_plain else _parts_across(latitudes, polyline, is_parent)
            found.append(Balance(polyline, np.where(is_parent, 1, -1), across))
            group[np.isin(group, groups)] = groups[0]
        elif len(polyline) > 2:
            branches[polyline] = True
    return found, branches


def _parts_across(latitudes: Latitudes, polyline: Ints, is_parent: Bools) -> Floats:
    """For each side (k,) of a band that is a parent, the part of its length that lies too far from any child."""
    lines = latitudes.polylines
    reach = _FACING * latitudes.spacing
    children = cKDTree(np.concatenate([lines.polyline(int(p)) for p in polyline[~is_parent]]))
    across = np.zeros(len(polyline))
    for k in np.flatnonzero(is_parent).tolist():
        points = lines.polyline(int(polyline[k]))
        size = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        is_far = children.query(points)[0] > reach
        across[k] = float((size * (is_far + np.roll(is_far, -1)) / 2.0).sum() / size.sum())
    return across
