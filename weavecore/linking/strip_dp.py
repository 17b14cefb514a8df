"""Zipping: the links between the two rings of a plain band (step one of Yan et al. 2016, §5).

The triangle over each edge of the parent ends in one node of the child, its *tip*.  The tips rise with the edges, and
they say all: a parent's node is linked to every child from the tip of the edge before it to the tip of
the edge after it.  A tip above the middle of its edge makes an even triangle, and a node
with two links to either side has six edges.  Where the child has fewer nodes some of the parent's nodes must do
with one link; those that have three from their own parent are the ones to choose, for they have
six edges all the same.  So irregular nodes are passed on from ring to ring instead of being made anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

_IRREGULAR_COST = 2.0
_EVEN_SLANT = 0.55
_SLANT_COST = 30.0
_PAIR_COST = 2.0 * _IRREGULAR_COST
_REACH = 2
_PLACES = np.arange(-_REACH, _REACH + 1)
"""Steps from the nearest node of the child to those that a tip may be."""


def raise_feet(index: Floats) -> Optional[Floats]:
    """Indices of the feet of samples along an open child, made to rise; None where they run back by more than an edge.

    The first and the last sample stand on the ends of the parent, as the selvedge binds them.
    """
    rising: Floats = np.maximum.accumulate(index)
    return None if (rising - index).max() > 1.0 else rising


def unroll_feet(index: Floats, n_parent: int) -> Optional[Floats]:
    """Indices of the feet of samples along a child, unrolled so that they rise; the first comes again at the end.

    None where the feet do not run around the parent once, or run back by more than an edge.
    """
    step = np.diff(np.append(index, index[0]))
    step -= n_parent * np.rint(step / n_parent)
    if abs(step.sum() - n_parent) > 0.5:
        return None
    along = index[0] + np.concatenate([[0.0], np.cumsum(step)])
    rising: Floats = np.maximum.accumulate(along)
    return None if (rising - along).max() > 1.0 else rising


def feet_of_nodes(rising: Floats, stations: Floats, length: float) -> Floats:
    """Unrolled indices (d, m) of the feet of nodes, for several divisions of a child of some length.

    ``rising`` are those of equally spaced samples, the first at station 0 and again at the end.
    """
    turn = np.floor(stations / length)
    at = (stations / length - turn) * (len(rising) - 1)
    feet: Floats = np.interp(at, np.arange(len(rising)), rising) + turn * (rising[-1] - rising[0])
    return feet


def choose_open_tips(feet: Floats, n_parent: int, *, sits: float, wanted: Ints, in_pairs: bool = False) -> OpenTips:
    """The tips of a strip between two open polylines; see `choose_tips` for what is given, of one division (1, m).

    Both are closed by an edge from their last node to the first, over which the strip is closed as well.
    """
    m = feet.shape[1]
    # Where a tip stands above the middle of its edge, that of the closing edge is the child's first node again.
    closing = m if sits > 0 else m - 1
    edge = n_parent - 1 + np.arange(n_parent + 1)
    best: Floats = (edge + sits).astype(np.float64)
    base = np.clip(_nearest(feet[0], n_parent, best[:-1]), m, 2 * m - 1)
    base[0] = closing
    base = np.append(base, closing + m)
    cost, child = _slant_costs(feet, n_parent, best, base)
    real = np.zeros(len(edge), bool)
    real[1:-1] = True
    allowed = np.where(real[:, None], (child >= m) & (child < 2 * m), child == base[:, None])
    cost[~allowed] = np.inf
    step_cost = _step_costs(base, wanted[edge[1:] % n_parent], in_pairs=in_pairs)
    step_cost[[0, -1]] = np.where(np.isfinite(step_cost[[0, -1]]), 0.0, np.inf)
    total, _, offset = _cheapest_walk(cost, np.diff(base), step_cost, in_pairs=in_pairs)
    tips = base + _PLACES[offset]
    return OpenTips(total, np.append(tips[1:-1] - m, closing) if np.isfinite(total) else None)


@dataclass(frozen=True, eq=False)
class OpenTips:
    """What a strip costs and its tips (n,), the last that of the closing edge; none where there is no way."""

    cost: float
    tips: Optional[Ints]


def choose_tips(feet: Floats, n_parent: int, *, sits: float, wanted: Ints, in_pairs: bool = False) -> tuple[int, Ints]:
    """The best of several divisions of the child, and the tips over the parent's edges.

    Parameters
    ----------
    feet : (d, m) float64
        For each division the unrolled index on the parent of the foot of each of its nodes.
    n_parent : int
    sits : float
        Where a tip is at its best: 0.5 over the middle of its edge, 0 over its first node.
    wanted : (n,) int64
        For each node of the parent how far the tip should advance there.
    in_pairs : bool
        Whether a tip that stays must stay twice, and one that advances by more than one step by an odd
        number of them; rings whose counts are both even, or both odd, can be bound so.

    Returns
    -------
    division : int
    tips : (n,) int64
        Unrolled: tip ``k`` is node ``k % m``; edge ``i`` runs from node ``i`` to ``i + 1``.
    """
    m = feet.shape[1]
    start = _calmest(wanted)
    edge = start + np.arange(n_parent + 1)
    best: Floats = (edge + sits).astype(np.float64)
    base = _nearest(feet[0], n_parent, best[:-1])
    base = np.append(base, base[0] + m)
    cost, _ = _slant_costs(feet, n_parent, best, base)
    step_cost = _step_costs(base, wanted[edge[1:] % n_parent], in_pairs=in_pairs)
    _, division, offset = _cheapest_walk(cost, np.diff(base), step_cost, in_pairs=in_pairs)
    tips = (base + _PLACES[offset])[:-1]
    # Edges from the start on to the last, then those before the start, one turn on.
    return division, np.concatenate([tips[n_parent - start :] - m, tips[: n_parent - start]])


def _slant_costs(feet: Floats, n_parent: int, best: Floats, base: Ints) -> tuple[Floats, Ints]:
    """What the slants cost of the tips (n + 1, w, d) that each edge may have, and these tips (n + 1, w)."""
    m = feet.shape[1]
    child = base[:, None] + _PLACES
    slant = np.moveaxis(feet[:, child % m] + n_parent * (child // m) - best[:, None], 0, 2)
    cost: Floats = slant**2 + _SLANT_COST * np.maximum(np.abs(slant) - _EVEN_SLANT, 0.0) ** 2
    return cost, child


def _step_costs(base: Ints, wanted: Ints, *, in_pairs: bool) -> Floats:
    """What it costs (n, s) where the tips advance by so many steps at each node."""
    steps = np.arange(max(2, int(np.diff(base).max()) + 1) + 1)
    excess = steps - wanted[:, None]
    step_cost: Floats = _IRREGULAR_COST * excess.astype(np.float64) ** 2
    if in_pairs:
        step_cost[:, steps % 2 == 0] = np.inf
    return step_cost


def _calmest(wanted: Ints) -> int:
    """The edge that lies furthest from any node where the tip should not advance by one."""
    n = len(wanted)
    odd = np.flatnonzero(wanted != 1)
    if len(odd) == 0:
        return 0
    gap = np.diff(np.append(odd, odd[0] + n))
    widest = int(np.argmax(gap))
    return int(odd[widest] + gap[widest] // 2) % n


def _nearest(feet: Floats, n_parent: int, places: Floats) -> Ints:
    """Unrolled node of the child whose foot is nearest to each of the rising places, less than a turn apart."""
    m = len(feet)
    turns = np.arange(-3, 4)
    unrolled = (feet + (turns * n_parent)[:, None]).ravel()
    number = (np.arange(m) + (turns * m)[:, None]).ravel()
    # The feet begin anywhere; turns are counted from the first place.
    lap = int(np.floor((places[0] - feet[0]) / n_parent))
    middle = places - lap * n_parent
    after = np.searchsorted(unrolled, middle)
    nearer = np.where(middle - unrolled[after - 1] < unrolled[after] - middle, after - 1, after)
    nearest: Ints = number[nearer] + lap * m
    return nearest


def _cheapest_walk(cost: Floats, rise: Ints, step_cost: Floats, *, in_pairs: bool) -> tuple[float, int, Ints]:
    """The cheapest way around, its division, and at which place of its row each tip is on it (Viterbi).

    The first tip is the cheapest one, and the last is the same one turn later.

    Parameters
    ----------
    cost : (n + 1, w, d) float64
        Of each edge, place of the tip and division.
    rise : (n,) int64
        How far a tip advances that keeps its place.
    step_cost : (n, s) float64
        Of an advance by each number of steps.
    in_pairs : bool
        Whether tips may also stay twice, whatever staying once costs.
    """
    n_edges, width, _ = cost.shape
    source = np.arange(width)[None, :, None] + rise[:, None, None] - np.arange(step_cost.shape[1])
    source[(source < 0) | (source >= width)] = width  # a place that is never reached
    first = np.argmin(cost[0], axis=0)
    total = np.full((n_edges, width + 1, cost.shape[2]), np.inf)
    total[0, first, np.arange(cost.shape[2])] = 0.0
    step_cost = step_cost[:, None, :, None]
    stays = _stays(rise, width)
    for i in range(1, n_edges):
        reached = total[i - 1][source[i - 1]]
        reached += step_cost[i - 1]
        best = reached.min(axis=1)
        if in_pairs and i > 1:
            best = np.minimum(best, _after_staying(total, cost, stays, i))
        np.add(best, cost[i], out=total[i, :width])
    around = total[-1, first, np.arange(cost.shape[2])]
    division = int(np.argmin(around))
    offset = np.full(n_edges, first[division])
    i = n_edges - 1
    while i > 0:
        ways = source[i - 1, offset[i]]
        reached = total[i - 1, ways, division] + step_cost[i - 1, 0, :, 0]
        if in_pairs and i > 1 and _after_staying(total, cost, stays, i)[offset[i], division] < reached.min():
            once = stays[i - 1, offset[i]]
            offset[i - 1], offset[i - 2] = once, stays[i - 2, once]
            i -= 2
        else:
            offset[i - 1] = ways[np.argmin(reached)]
            i -= 1
    return float(around[division]), division, offset


def _stays(rise: Ints, width: int) -> Ints:
    """Place (n, w + 1) in the row before of a tip that did not advance; ``w`` is a place that is never reached."""
    place = np.arange(width + 1) + rise[:, None]
    place[:, width] = width
    stays: Ints = np.minimum(place, width)
    return stays


def _after_staying(total: Floats, cost: Floats, stays: Ints, i: int) -> Floats:
    """Cost (w, d) up to edge ``i``, without its own, where the tip has stayed from two edges before."""
    never = np.full((1, cost.shape[2]), np.inf)
    once = stays[i - 1, :-1]
    after: Floats = total[i - 2][stays[i - 2, once]] + np.concatenate([cost[i - 1], never])[once] + _PAIR_COST
    return after


def nearest_tips(parent: Floats, child: Floats) -> tuple[float, Optional[Ints]]:
    """Over each edge the nearest node, where a child is too small to have feet all around its parent.

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
    tips : (n,) int64 or None
        As of `choose_tips`; None where they do not go around the child once.
    """
    m = len(child)
    middle = (parent + np.roll(parent, -1, axis=0)) / 2
    square = ((middle[:, None] - child[None]) ** 2).sum(2)
    nearest = square.argmin(1)
    step = np.diff(np.append(nearest, nearest[0])) % m
    tips: Ints = nearest[0] + np.concatenate([[0], np.cumsum(step)[:-1]])
    return float(square.min(1).sum()), tips if step.sum() == m else None
