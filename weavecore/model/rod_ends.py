r"""Which rod ends at a node where the number of edges is odd: a long one rather than a short one.

At a node with an odd number of edges one rod ends, however the edges are paired::

        \   /              \   /
         \ /                \ /        the rod from below is short: it goes on to the left, turning a little,
    ------o------        ------o------    and the rod that came from there ends in its place
          |                    |
          |  short             |  goes on

So at every node of a short rod all pairings of its darts are compared, while the other nodes stay as they are: the best
has the fewest short rods, then the fewest last resorts, then the fewest ends, then the least turn.  It is taken unless
it is better by the turn alone.  This is repeated until no node changes (coordinate descent): a few rounds over the K
nodes of short rods, O(K) for a bounded number of edges at a node.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.matching import ALONE

FEWEST_JOINTS = 4
"""A rod with fewer joints is *short*: it holds little and is hard to keep in place."""

_MOST_ROUNDS = 8
"""Rounds over the nodes of short rods: four are enough on all samples."""

_MOST_DARTS = 9
"""Darts of a node up to which all pairings are tried: 2,620 of nine, were all allowed."""

USUAL, LAST_RESORT, RING = 0, 1, 2
"""Kinds of pairs: of two links; of a link and an edge of a ring; of two edges of a ring, which is opened there only
where it is long on both sides."""

_OPENED_RING = 2
"""How many last resorts an opened ring counts as."""

_LONG = 8
"""Joints that a ring has at least on both sides of a node where it is opened, so that its pieces are long rods."""

_Pairing = tuple[tuple[int, int], ...]
"""Pairs of darts of one node, without a common dart."""

_Pairs = dict[tuple[int, int], tuple[int, float]]
"""Kind and turn of each pair of darts of one node that a rod may follow."""


class _Chains:
    """Rods as partners of darts: a dart leaves its node, and its partner leaves the same node on the other side."""

    def __init__(self, partner: Ints) -> None:
        self.partner: list[int] = partner.tolist()

    def reach(self, dart: int) -> int:
        """How many nodes a rod passes beyond the tail of a dart, counted up to `FEWEST_JOINTS`."""
        count = 1
        while count < FEWEST_JOINTS:
            onward = self.partner[dart ^ 1]
            if onward == ALONE:
                break
            count, dart = count + 1, onward
        return count

    def short_ends(self) -> list[int]:
        """The darts with which rods of fewer joints end, each rod twice."""
        ends = np.flatnonzero(np.array(self.partner) == ALONE).tolist()
        return [dart for dart in ends if self.reach(dart) + 1 < FEWEST_JOINTS]

    def darts_from(self, dart: int) -> list[int]:
        """The darts of a rod from one with which it ends."""
        darts = [dart]
        while self.partner[darts[-1] ^ 1] != ALONE:
            darts.append(self.partner[darts[-1] ^ 1])
        return darts

    def is_long(self, dart: int) -> bool:
        """Whether a rod goes on for `_LONG` joints at least beyond the tail of a dart."""
        for _ in range(_LONG):
            if dart == ALONE:
                return False
            dart = self.partner[dart ^ 1]
        return True

    def pair(self, darts: list[int], pairing: _Pairing) -> None:
        """Pair some darts of one node anew; those in no pair end there."""
        for dart in darts:
            self.partner[dart] = ALONE
        for one, other in pairing:
            self.partner[one], self.partner[other] = other, one


def lengthen_short_rods(partner: Ints, tail: Ints, one: Ints, other: Ints, turn: Floats, kind: Ints) -> Ints:
    """Pair the darts anew so that fewer rods have less than `FEWEST_JOINTS` joints.

    Parameters
    ----------
    partner : (D,) int64
        The dart that each dart is paired with at the node that it leaves, or -1; the reverse of dart d is ``d ^ 1``.
    tail : (D,) int64
        The node that each dart leaves.
    one, other : (k,) int64
        Pairs of darts of one node that a rod may follow.
    turn : (k,) float64
        Angle in radians by which it turns there.
    kind : (k,) int64
        `USUAL`, `LAST_RESORT` or `RING`.

    Returns
    -------
    (D,) int64
        Partners as of ``partner``.
    """
    order = np.argsort(tail[one], kind="stable")
    rows = np.searchsorted(tail[one][order], np.arange(int(tail.max(initial=-1)) + 2)).tolist()
    chains = _Chains(partner)

    def pairs_at(node: int) -> _Pairs:
        """The pairs of darts of a node."""
        some = order[rows[node] : rows[node + 1]]
        ends = zip(one[some].tolist(), other[some].tolist())
        return dict(zip(ends, zip(kind[some].tolist(), turn[some].tolist())))

    for _ in range(_MOST_ROUNDS):
        ends = [dart for end in chains.short_ends() for dart in chains.darts_from(end)]
        changed = [_pair_best(chains, pairs_at(node)) for node in np.unique(tail[ends]).tolist()] if ends else []
        if not any(changed):
            break
    return np.array(chains.partner, np.int64)


def count_short_rods(partner: Ints) -> tuple[int, int]:
    """How many open rods are short, and how many open rods there are.

    Parameters
    ----------
    partner : (D,) int64
        As of `lengthen_short_rods`.

    Returns
    -------
    n_short, n_open : int
    """
    return len(_Chains(partner).short_ends()) // 2, int(np.count_nonzero(partner == ALONE)) // 2


def _pair_best(chains: _Chains, pairs: _Pairs) -> bool:
    """Pair the darts of a node in the best way, and return whether that is another one."""
    rings = [pair for pair, (kind, _) in pairs.items() if kind == RING and chains.partner[pair[0]] == pair[1]]
    held = {dart for pair in rings if not (chains.is_long(pair[0]) and chains.is_long(pair[1])) for dart in pair}
    pairs = {pair: of for pair, of in pairs.items() if not held.intersection(pair)}
    # Darts that go straight across at a crossing are in none of the pairs.
    darts = sorted({dart for pair in pairs for dart in pair})
    if not 1 < len(darts) <= _MOST_DARTS:
        return False
    now = tuple(pair for pair in pairs if chains.partner[pair[0]] == pair[1])
    chains.pair(darts, ())
    reach = {dart: chains.reach(dart) for dart in darts}
    opened = {pair for pair in rings if pair in pairs}
    best, least = _best_pairing(darts, pairs, reach, opened)
    is_better = least[:3] < _cost(now, pairs, reach, opened)[:3]
    chains.pair(darts, best if is_better else now)
    return is_better


_Cost = tuple[int, int, int, float]
"""Short rods, last resorts, ends (pairs, negated) and turn of a pairing."""


def _cost(pairing: _Pairing, pairs: _Pairs, reach: dict[int, int], opened: set[tuple[int, int]]) -> _Cost:
    """The cost of a pairing of darts beyond which rods pass ``reach`` nodes; ``opened`` are pairs that it gives up."""
    paired = {dart for pair in pairing for dart in pair}
    short = sum(reach[a] + reach[b] + 1 < FEWEST_JOINTS for a, b in pairing)
    short += sum(count + 1 < FEWEST_JOINTS for dart, count in reach.items() if dart not in paired)
    last = sum(pairs[pair][0] == LAST_RESORT for pair in pairing) + _OPENED_RING * len(opened.difference(pairing))
    return short, last, -len(pairing), round(sum(pairs[pair][1] for pair in pairing), 6)


def _best_pairing(
    darts: list[int], pairs: _Pairs, reach: dict[int, int], opened: set[tuple[int, int]]
) -> tuple[_Pairing, _Cost]:
    """The pairing of least cost among all sets of pairs without a common dart; the first of several.

    Depth first: the first dart stays alone, or goes with each of those after it.  Short rods only become more.
    """
    best: list[tuple[_Pairing, _Cost]] = []

    def search(rest: list[int], pairing: _Pairing, short: int, last: int, turn: float) -> None:
        if best and short > best[0][1][0]:
            return
        if not rest:
            cost = (short, last, -len(pairing), round(turn, 6))
            if not best or cost < best[0][1]:
                best[:] = [(pairing, cost)]
            return
        first, others = rest[0], rest[1:]
        search(others, pairing, short + (reach[first] + 1 < FEWEST_JOINTS), last, turn)
        for k, other in enumerate(others):
            pair = (first, other) if (first, other) in pairs else (other, first)
            if pair in pairs:
                kind, angle = pairs[pair]
                more = (kind == LAST_RESORT) - _OPENED_RING * (pair in opened)
                is_short = reach[first] + reach[other] + 1 < FEWEST_JOINTS
                search(others[:k] + others[k + 1 :], (*pairing, pair), short + is_short, last + more, turn + angle)

    search(darts, (), 0, _OPENED_RING * len(opened), 0.0)
    return best[0]
