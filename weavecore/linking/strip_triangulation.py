"""Strip triangulation: the cheapest links between a ring and its parent (step one of Yan et al. 2016, §5).

The triangle on edge i of the parent has its *apex* a_i at a node of the child, and these determine all links: node i
of the parent is linked to all nodes of the child from a_{i-1} to a_i, which is a_i - a_{i-1} + 1 links.

      child    k-1 ────── k ────── k+1        a_{i-1} = k - 1,  a_i = k:  node i has two links;
                  ╲     ╱   ╲     ╱           with two to its own parent and two along its ring
      parent   ─────── i ────── i+1 ───       it has six edges
                edge i-1  edge i

Apexes are *unwrapped*: apex k is node k mod m of the child, and a_{i+n} = a_i + m for rings of n and m nodes.  So a
strip is a closed walk through the toroidal graph of Fuchs, Kedem and Uselton (Optimal surface reconstruction from
planar contours, CACM 20, 1977).  The cheapest one is found, of the cost

    Σ_i s(x_i) + 2 Σ_i (a_i - a_{i-1} - t_i)²,        s(x) = x² + 30 max(|x| - 0.55, 0)²

* x_i, the slant, is how far the apex lies from its place over edge i, in edges of the parent: over the middle
  (triangles) or over the first node (quads).
* t_i is the advance that gives node i of the parent six edges: less where it has more links to its own parent.  Where
  the child has fewer nodes, parent nodes with three links above are the ones to get a single link below, so irregular
  nodes are passed on from ring to ring instead of being added again.

With *even cells* every cell has an even number of sides: an apex advances by an odd number, or stays for two nodes.

A walk that is cut open at one edge and begins at a given apex is a shortest path by rows.  The cheapest closed walk is
the best over all first apexes.  The least costs from each apex of a row to each of a later row make a matrix, and two
of them, of rows that follow one another, a product in which least sums stand for sums of products (*min-plus*, Cormen
et al., Introduction to Algorithms, ch. 25).  So rows are joined two by two, all pairs and divisions at once, until one
matrix is left; its diagonal has the costs of closed walks.  The best is followed back from product to product.  (The
divide and conquer of Fuchs et al., and of Maes, On a cyclic string-to-string correction problem, IPL 35, 1990, needs
walks that do not cross without meeting; walks of even cells do.)

Rows hold the apexes within a reach of the nearest one.  With R_i the least s of row i, any walk through an apex of
slant x in row i costs at least Σ_j R_j - R_i + s(x) + 2 (m - Σ t)² / n.  Where that is more than the cost found for
every apex out of reach, the walk is the cheapest of all; else the reach grows until it is.

Time is O(n w³ d): w apexes a row (5, as a rule; twice as many states with even cells), d divisions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import poll

_IRREGULAR_COST = 2.0
"""Of a node whose links differ by one from six edges, against 1 for an apex that lies one edge off its place."""
_EVEN_SLANT = 0.55
"""Edges of the parent: a triangle whose apex is farther off leans over one end of its edge."""
_SLANT_COST = 30.0
"""Of the square of the slant beyond `_EVEN_SLANT`: a node more or less is better than a triangle that leans much."""
_REACH = 2
"""Nodes of the child on either side of the nearest among which an apex is first looked for."""
_DIGITS = 6
"""Costs are compared to so many digits where walks of equal cost would be told apart by rounding."""

_MOST_BACK = 1.0
"""Edges of the parent by which projections may run back along the child and still be unwrapped."""


def unwrap_open(index: Floats) -> Optional[Floats]:
    """Node indices of the projections of samples along an open child, made to rise.

    Parameters
    ----------
    index : (k,) float64
        On an open parent, which both ends of the child face.

    Returns
    -------
    (k,) float64 or None
        None where they run back by more than an edge.
    """
    rising: Floats = np.maximum.accumulate(index)
    return None if (rising - index).max() > _MOST_BACK else rising


def unwrap_closed(index: Floats, n_parent: int) -> Optional[Floats]:
    """Node indices of the projections of samples along a closed child, unwrapped so that they rise.

    Parameters
    ----------
    index : (k,) float64
        On a closed parent, modulo its number of nodes.
    n_parent : int
        That number.

    Returns
    -------
    (k + 1,) float64 or None
        The first comes again at the end.  None where they do not run around the parent once, or run back by
        more than an edge.
    """
    step = np.diff(np.append(index, index[0]))
    step -= n_parent * np.rint(step / n_parent)
    if abs(step.sum() - n_parent) > 0.5:
        return None
    along = index[0] + np.concatenate([[0.0], np.cumsum(step)])
    rising: Floats = np.maximum.accumulate(along)
    return None if (rising - along).max() > _MOST_BACK else rising


def interpolate_projections(unwrapped: Floats, stations: Floats, length: float) -> Floats:
    """Unwrapped node indices of the projections of nodes, for several divisions of a closed child.

    Parameters
    ----------
    unwrapped : (k + 1,) float64
        Of equally spaced samples (`unwrap_closed`), the first at station 0.
    stations : (d, m) float64
        Of the nodes in each division.
    length : float
        Of the child.

    Returns
    -------
    (d, m) float64
    """
    turn = np.floor(stations / length)
    at = (stations / length - turn) * (len(unwrapped) - 1)
    projections: Floats = np.interp(at, np.arange(len(unwrapped)), unwrapped) + turn * (unwrapped[-1] - unwrapped[0])
    return projections


def triangulate_annulus(
    projections: Floats, n_parent: int, *, child_phase: float, target_advance: Ints, even_cells: bool = False
) -> tuple[int, Optional[Ints]]:
    """The best of several divisions of a closed child, and the apexes over the parent's edges.

    Parameters
    ----------
    projections : (d, m) float64
        For each division the unwrapped node index on the parent of the projection of each node, rising.
    n_parent : int
        Number n of nodes of the parent.
    child_phase : float
        Where an apex is best: 0.5 over the middle of its edge, 0 over its first node.
    target_advance : (n,) int64
        For each node of the parent how far the apex should advance there.
    even_cells : bool
        Whether an apex that stays must stay for two nodes, and one that advances must do so by an odd number.

    Returns
    -------
    division : int
    apexes : (n,) int64 or None
        Unwrapped: apex ``k`` is node ``k % m``; edge ``i`` runs from node ``i`` to ``i + 1``.  None where no walk has
        even cells, as where one count is even and the other odd.
    """
    m = projections.shape[1]
    cut = _most_regular_edge(target_advance)
    edge = cut + np.arange(n_parent + 1)
    ideal: Floats = (edge + child_phase).astype(np.float64)
    nearest = _nearest_nodes(projections[0], n_parent, ideal[:-1])
    nearest = np.append(nearest, nearest[0] + m)
    target = target_advance[edge[1:] % n_parent]
    walk = _cheapest_walk(_Strip(projections, n_parent, ideal, nearest, target, even_cells, closed=True))
    if walk is None:
        return 0, None
    apexes = walk.apexes[:-1]
    # Edges from the cut on to the last, then those before the cut, one turn on.
    return walk.division, np.concatenate([apexes[n_parent - cut :] - m, apexes[: n_parent - cut]])


def triangulate_open_strip(
    projections: Floats, n_parent: int, *, child_phase: float, target_advance: Ints, even_cells: bool = False
) -> tuple[float, Optional[Ints]]:
    """The apexes of a strip between two open polylines, and its cost.

    Both are closed by an edge from their last node to the first, over which the strip is closed as well.

    Parameters
    ----------
    projections : (m,) float64
        Node index on the parent of the projection of each node of the child, rising from 0 to n - 1.
    n_parent, child_phase, target_advance, even_cells :
        As of `triangulate_annulus`.

    Returns
    -------
    cost : float
        Infinite where there is no walk.
    apexes : (n,) int64 or None
        The last is that of the closing edge.
    """
    m = len(projections)
    # Where an apex stands over the middle of its edge, that of the closing edge is the child's first node again.
    closing = m if child_phase > 0 else m - 1
    edge = n_parent - 1 + np.arange(n_parent + 1)
    ideal: Floats = (edge + child_phase).astype(np.float64)
    nearest = np.clip(_nearest_nodes(projections, n_parent, ideal[:-1]), m, 2 * m - 1)
    nearest[0] = closing
    nearest = np.append(nearest, closing + m)
    target = target_advance[edge[1:] % n_parent]
    walk = _cheapest_walk(_Strip(projections[None], n_parent, ideal, nearest, target, even_cells, closed=False))
    if walk is None:
        return np.inf, None
    return walk.cost, np.append(walk.apexes[1:-1] - m, closing)


def _most_regular_edge(target_advance: Ints) -> int:
    """The edge farthest from nodes where the apex should not advance by one: a choice that turns with the ring."""
    n = len(target_advance)
    odd = np.flatnonzero(target_advance != 1)
    if len(odd) == 0:
        return 0
    gap = np.diff(np.append(odd, odd[0] + n))
    widest = int(np.argmax(gap))
    return int(odd[widest] + gap[widest] // 2) % n


def _nearest_nodes(projections: Floats, n_parent: int, places: Floats) -> Ints:
    """Unwrapped node of the child whose projection is nearest to each of the rising places, less than a turn apart."""
    m = len(projections)
    turns = np.arange(-3, 4)
    unwrapped = (projections + (turns * n_parent)[:, None]).ravel()
    number = (np.arange(m) + (turns * m)[:, None]).ravel()
    # The projections begin anywhere; turns are counted from the first place.
    turn = int(np.floor((places[0] - projections[0]) / n_parent))
    within = places - turn * n_parent
    after = np.searchsorted(unwrapped, within)
    nearer = np.where(within - unwrapped[after - 1] < unwrapped[after] - within, after - 1, after)
    nearest: Ints = number[nearer] + turn * m
    return nearest


@dataclass(frozen=True, eq=False)
class _Strip:
    """What a walk is chosen for: a row for each edge of the parent from the cut on, and that edge again at the end.

    Parameters
    ----------
    projections : (d, m) float64
    n_parent : int
    ideal : (n + 1,) float64
        Node index on the parent over which the apex of each row is best.
    nearest : (n + 1,) int64
        The apex nearest to it in the first division.
    target : (n,) int64
        Wanted advance from each row to the next.
    even_cells : bool
    closed : bool
        If not, the first and last rows are closing edges: they have one apex, and any advance is free beside them.
    """

    projections: Floats
    n_parent: int
    ideal: Floats
    nearest: Ints
    target: Ints
    even_cells: bool
    closed: bool

    def slant_costs(self, apex: Ints) -> Floats:
        """Cost (n + 1, w, d) of apexes (n + 1, w) in each division; infinite where an open strip has none."""
        m = self.projections.shape[1]
        index = self.projections[:, apex % m] + self.n_parent * (apex // m)
        slant = np.moveaxis(index - self.ideal[:, None], 0, 2)
        cost: Floats = slant**2 + _SLANT_COST * np.maximum(np.abs(slant) - _EVEN_SLANT, 0.0) ** 2
        if not self.closed:
            allowed = (apex >= m) & (apex < 2 * m)
            allowed[[0, -1]] = apex[[0, -1]] == self.nearest[[0, -1], None]
            cost[~allowed] = np.inf
        return cost

    def advance_costs(self, advances: Ints) -> Floats:
        """Cost of advances (n, …) from each row to the next; infinite of those below 0."""
        target = self.target.reshape(-1, *[1] * (advances.ndim - 1))
        cost: Floats = _IRREGULAR_COST * (advances - target).astype(np.float64) ** 2
        cost[advances < 0] = np.inf
        if self.even_cells:
            cost[advances % 2 == 0] = np.inf
        if not self.closed:
            cost[[0, -1]] = np.where(np.isfinite(cost[[0, -1]]), 0.0, np.inf)
        return cost

    def stay_costs(self) -> Floats:
        """Cost (n,) of staying at each node for two nodes, together with the node before."""
        stays = _IRREGULAR_COST * self.target.astype(np.float64) ** 2
        both: Floats = stays + np.roll(stays, 1)
        return both

    def regular_excess(self) -> float:
        """Excess of the advance over its target at every node if it is the same at all."""
        return float(self.projections.shape[1] - int(self.target.sum())) / len(self.target)


@dataclass(frozen=True, eq=False)
class _Walk:
    """A closed walk: its cost, the division of the child, and the apexes (n + 1,) of all rows."""

    cost: float
    division: int
    apexes: Ints


def _cheapest_walk(strip: _Strip) -> Optional[_Walk]:
    """The cheapest closed walk of all; None where there is none."""
    reach = _REACH
    while True:
        poll()
        walk = _cheapest_within(strip, reach)
        if reach >= strip.projections.shape[1] if walk is None else _is_certain(strip, reach, walk.cost):
            return walk
        reach *= 2


def _least_costs(strip: _Strip, cost: Floats) -> tuple[Floats, Floats]:
    """Least slant cost (n + 1, d) of each row, and a lower bound (d,) for any walk in each division."""
    least = cost.min(1)
    bound = least[1:].sum(0)
    if strip.closed:
        # The sum of the squares is least where all are the same (Cauchy and Schwarz).
        bound = bound + _IRREGULAR_COST * len(strip.target) * strip.regular_excess() ** 2
    return least, bound


def _is_certain(strip: _Strip, reach: int, found: float) -> bool:
    """Whether no walk through an apex out of reach costs less than ``found``.

    The slant cost of a row rises on either side of its least, so the first apexes out of reach are the cheapest.
    """
    least, bound = _least_costs(strip, strip.slant_costs(strip.nearest[:, None] + np.arange(-reach, reach + 1)))
    beyond = strip.slant_costs(strip.nearest[:, None] + np.array([-reach - 1, reach + 1]))
    with_beyond = beyond + (bound - least)[:, None]
    return bool((with_beyond[1:] >= found).all())


def _cheapest_within(strip: _Strip, reach: int) -> Optional[_Walk]:
    """The cheapest closed walk through apexes within reach."""
    apex = strip.nearest[:, None] + np.arange(-reach, reach + 1)
    width = apex.shape[1]
    steps = _step_costs(strip, width)
    slant = np.concatenate([strip.slant_costs(apex)[1:]] * (steps.shape[1] // width), axis=1)
    total = _products(steps[..., None] + slant[:, :, None])[-1][0]
    # With even cells a closed walk may begin at an apex that stays, but an open one not.
    starts = np.arange(len(total) if strip.closed else width)
    # On symmetric bands rounding errors must not decide between equal costs.
    around = np.round(total[starts, starts], _DIGITS)
    division = int(np.argmin(around.min(axis=0)))
    start = int(np.argmin(around[:, division]))
    cost = float(around[start, division])
    if not np.isfinite(cost):
        return None
    states = _states_along(_products((steps + slant[:, :, None, division])[..., None]), start)
    return _Walk(cost, division, apex[np.arange(len(apex)), states % width])


def _step_costs(strip: _Strip, width: int) -> Floats:
    """Least cost (n, S, S) of the step from each state of a row (last axis) to each of the next, but for its slant.

    A state is a place among the ``width`` apexes of a row; with even cells there are as many more, in which the apex
    has stayed for one node and must stay for the next.
    """
    advance = np.diff(strip.nearest)[:, None, None] + np.arange(width)[:, None] - np.arange(width)
    free = strip.advance_costs(advance)
    if not strip.even_cells:
        return free
    stays = np.where(advance == 0, 0.0, np.inf)
    never = np.full_like(free, np.inf)
    from_free = np.concatenate([free, stays], axis=1)
    from_stayed = np.concatenate([stays + strip.stay_costs()[:, None, None], never], axis=1)
    return np.concatenate([from_free, from_stayed], axis=2)


def _products(costs: Floats) -> list[Floats]:
    """Min-plus products of matrices (n, S, S, d) of steps: of each, of two in a row, of four, … up to all.

    A last one without a follower stays as it is.
    """
    levels = [costs]
    while len(costs) > 1:
        first, second = costs[: len(costs) // 2 * 2 : 2], costs[1::2]
        joined = second[:, :, 0, None] + first[:, None, 0]
        for k in range(1, costs.shape[1]):
            np.minimum(joined, second[:, :, k, None] + first[:, None, k], out=joined)
        costs = np.concatenate([joined, costs[len(costs) // 2 * 2 :]])
        levels.append(costs)
    return levels


def _states_along(levels: list[Floats], start: int) -> Ints:
    """States (n + 1,) of the rows along the cheapest walk that begins and ends in one, from `_products` of d = 1."""
    states = np.array([start, start])
    for level in levels[-2::-1]:
        n_pairs = len(level) // 2
        first, second = level[: 2 * n_pairs : 2, :, :, 0], level[1::2, :, :, 0]
        pair = np.arange(n_pairs)
        middle = (second[pair, states[1 : n_pairs + 1]] + first[pair, :, states[:n_pairs]]).argmin(1)
        states = np.concatenate([np.stack([states[:n_pairs], middle], axis=1).ravel(), states[n_pairs:]])
    return states


def triangulate_small_child(parent: Floats, child: Floats) -> tuple[float, Optional[Ints]]:
    """Over each edge the nearest node, where a child is too small for projections all around its parent.

    Parameters
    ----------
    parent : (n, 3) float64
        Nodes of the parent, the band on their left.
    child : (m, 3) float64
        A few nodes, in the same direction.

    Returns
    -------
    cost : float
        Sum of the squares of the distances.
    apexes : (n,) int64 or None
        As of `triangulate_annulus`; None where they do not go around the child once.
    """
    m = len(child)
    middle = (parent + np.roll(parent, -1, axis=0)) / 2
    square = ((middle[:, None] - child[None]) ** 2).sum(2)
    nearest = square.argmin(1)
    step = np.diff(np.append(nearest, nearest[0])) % m
    apexes: Ints = nearest[0] + np.concatenate([[0], np.cumsum(step)[:-1]])
    return float(square.min(1).sum()), apexes if step.sum() == m else None
