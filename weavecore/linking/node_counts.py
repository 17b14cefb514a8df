"""How many nodes each polyline gets (Yan et al. 2016, §5: the first question of the links).

A polyline of length L gets round(L / edge length) edges, rounded to the multiple that the pattern needs:

    closed:  nodes = edges                at least 3
    open:    nodes = edges + 1            at least 1 edge, 2 where the polyline alone cuts off a stretch of border

Where the pattern allows it (`Pattern.count_tolerance`), the counts of polylines that follow one another are chosen
together, so that few rods across the rings end: see `ring_counts`.

Time is linear in the number of polylines.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.linking.patterns import Pattern
from weavecore.linking.ring_counts import choose_counts
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines

FEWEST_NODES = 3
"""Nodes of a closed polyline or border: fewer make no polygon."""

_DENSITIES = tuple(k / 20 for k in range(15, 26))
"""Edges at splits and merges over those of the edge length asked for: steps of a twentieth within `count_tolerance`."""

_LESS = 1e-6
"""By how many rods that end a density must be better: rounding errors must not decide between equal ones."""

_NEAR = 1.35
"""Spacings from a ring: what is further away lies along a pocket.  Neighbours are one spacing apart, but at corners."""


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
        edges = _chosen_together(latitudes, edges, ideal, pattern, np.where(is_open, least, fewest))
    counts: Ints = edges + is_open
    return counts


def _chosen_together(latitudes: Latitudes, edges: Ints, ideal: Floats, pattern: Pattern, least: Ints) -> Ints:
    """The numbers of edges with those of polylines that hang together by plain bands chosen by `choose_counts`.

    Where rings split or merge all sides get counts of one density, for only then do rods go on from side to side.  The
    density with which the fewest rods end is taken for the whole surface.
    """
    pairs = np.array(_plain_pairs(latitudes), np.int64).reshape(-1, 2)
    side, scale = branch_targets(latitudes)
    best, least_cost = edges, np.inf
    for density in _DENSITIES if len(side) else (1.0,):
        chosen, cost = edges.copy(), 0.0
        for members in _trees(len(latitudes), pairs):
            is_open = not latitudes.polylines.closed[members[0]]
            in_twos = is_open and pattern.even_cells
            at = np.isin(side, members)
            counts, ends = choose_counts(
                np.maximum(ideal[members], least[members]),
                latitudes.generation[members],
                np.searchsorted(members, pairs[np.isin(pairs[:, 1], members)]),
                np.searchsorted(members, side[at]),
                density * scale[at] * ideal[side[at]],
                step=2 if in_twos else 1 if is_open else pattern.count_multiple,
                odd=int(in_twos),
                slack=pattern.count_tolerance,
                jump=pattern.jump_cost,
            )
            chosen[members] = np.maximum(counts, least[members])
            cost += ends
        if cost < least_cost - _LESS:
            best, least_cost = chosen, cost
    return best


def branch_targets(latitudes: Latitudes) -> tuple[Ints, Floats]:
    """Where rings split or merge: each side, and the factor by which its count fits those of the other sides.

    In a split the parent runs along its children, but for the stretches that lie along a pocket between them.  Rods
    go on from parent to child where the rest has as many edges as the children together::

        n_parent · M / L_parent = Σ n_child,       M: the length of the parent that is near a child

    Half of the difference, as a ratio, goes to each side.

    Returns
    -------
    side : (k,) int64
        Polylines, once for each band with three sides or more.
    scale : (k,) float64
        Factor on the number of edges.
    """
    bands, lines = latitudes.bands, latitudes.polylines
    near = _NEAR * latitudes.spacing
    sides, scales = [np.zeros(0, np.int64)], [np.zeros(0)]
    for b in np.flatnonzero(np.diff(bands.offsets) > 2).tolist():
        part = slice(bands.offsets[b], bands.offsets[b + 1])
        polyline, is_parent = bands.polyline[part], bands.is_parent[part]
        scale = np.ones(len(polyline))
        if is_parent.any() and not is_parent.all():
            along = [_length_near(lines, polyline[is_parent == way], polyline[is_parent != way], near) for way in (1, 0)]
            if min(along) > 0.0:
                ratio = np.sqrt(along[1] / along[0])
                scale = np.where(is_parent, ratio, 1.0 / ratio)
        sides.append(polyline)
        scales.append(scale)
    return np.concatenate(sides), np.concatenate(scales)


def _length_near(lines: Polylines, these: Ints, others: Ints, near: float) -> float:
    """Length of the segments of some polylines that begin near others."""
    tree = cKDTree(np.concatenate([lines.polyline(p) for p in others.tolist()]))
    length = 0.0
    for p in these.tolist():
        points = lines.polyline(p)
        step = np.linalg.norm(np.roll(points, -1, 0) - points, axis=1)
        length += float(step[tree.query(points)[0] <= near].sum())
    return length


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
