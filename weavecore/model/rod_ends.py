r"""Which rod ends at a node where the number of edges is odd: a long one rather than a short one.

At a node with an odd number of edges one rod ends, however the edges are paired::

        \   /              \   /
         \ /                \ /        the rod from below is short: it goes on to the left, turning a little,
    ------o------        ------o------    and the rod that came from there ends in its place
          |                    |
          |  short             |  goes on

So at every node where a short rod ends the darts are paired anew, so that there are the fewest short rods, then the
fewest pairs that are a last resort, then the fewest ends, then the least turn.  The best pairing of one node is found
by trial of all, while the other nodes stay as they are; it is taken unless it is better by the turns alone.  Nodes take
turns until none changes: a few rounds over the K nodes at which short rods end, O(K) for a bounded number of edges.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.matching import ALONE

FEWEST_JOINTS = 4
"""A rod with fewer joints holds little and is hard to keep in place."""

_MOST_ROUNDS = 8
"""Rounds over the nodes at which short rods end: three are enough on all samples."""

_MOST_DARTS = 9
"""Darts of a node up to which all pairings are tried: 2,620 of nine, were all allowed."""

_Pairing = tuple[tuple[int, int], ...]


class _Chains:
    """Rods as partners of darts: a dart leaves its node, and its partner leaves the same node on the other side."""

    def __init__(self, partner: Ints) -> None:
        self.partner = partner.tolist()

    def reach(self, dart: int) -> int:
        """How many nodes a rod passes beyond the tail of a dart, counted up to `FEWEST_JOINTS`."""
        count = 1
        while count < FEWEST_JOINTS:
            onward = self.partner[dart ^ 1]
            if onward == ALONE:
                break
            count, dart = count + 1, onward
        return count

    def pair(self, darts: list[int], pairing: _Pairing) -> None:
        """Pair some darts of one node anew; those in no pair end there."""
        for dart in darts:
            self.partner[dart] = ALONE
        for one, other in pairing:
            self.partner[one], self.partner[other] = other, one


def lengthen_short_rods(partner: Ints, tail: Ints, one: Ints, other: Ints, turn: Floats, last_resort: Bools) -> Ints:
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
        By how much it turns there.
    last_resort : (k,) bool
        Pairs that are made only for the sake of a short rod.

    Returns
    -------
    (D,) int64
    """
    pairs: defaultdict[int, dict[tuple[int, int], tuple[int, float]]] = defaultdict(dict)
    for node, a, b, t, last in zip(
        tail[one].tolist(), one.tolist(), other.tolist(), turn.tolist(), last_resort.tolist()
    ):
        pairs[node][a, b] = (int(last), t)
    chains = _Chains(partner)
    for _ in range(_MOST_ROUNDS):
        ends = [
            dart
            for dart, onward in enumerate(chains.partner)
            if onward == ALONE and chains.reach(dart) < FEWEST_JOINTS - 1
        ]
        changed = False
        for node in np.unique(tail[ends]).tolist() if ends else []:
            changed |= _pair_best(chains, pairs[node])
        if not changed:
            break
    return np.array(chains.partner, np.int64)


def count_short_rods(partner: Ints) -> tuple[int, int]:
    """How many open rods have less than `FEWEST_JOINTS` joints, and how many there are.

    Parameters
    ----------
    partner : (D,) int64
        As of `lengthen_short_rods`.
    """
    chains = _Chains(partner)
    ends = np.flatnonzero(partner == ALONE).tolist()
    short = sum(chains.reach(dart) + 1 < FEWEST_JOINTS for dart in ends)
    return short // 2, len(ends) // 2


def _pair_best(chains: _Chains, pairs: dict[tuple[int, int], tuple[int, float]]) -> bool:
    """Pair the darts of a node so that their sum is least; whether that changes anything."""
    darts = sorted({dart for pair in pairs for dart in pair})
    # A dart that goes straight across is in none of the pairs.
    if not 1 < len(darts) <= _MOST_DARTS:
        return False
    now = tuple((a, b) for a, b in pairs if chains.partner[a] == b)
    chains.pair(darts, ())
    reach = {dart: chains.reach(dart) for dart in darts}

    def cost(pairing: _Pairing) -> tuple[int, int, int, float]:
        joints = dict(reach)
        for a, b in pairing:
            joints[a] = reach[a] + reach[b]
            del joints[b]
        short = sum(count + 1 < FEWEST_JOINTS for count in joints.values())
        last = sum(pairs[pair][0] for pair in pairing)
        return short, last, -len(pairing), round(sum(pairs[pair][1] for pair in pairing), 6)

    best = min(_pairings(darts, pairs), key=cost)
    is_better = cost(best)[:3] < cost(now)[:3]
    chains.pair(darts, best if is_better else now)
    return is_better


def _pairings(darts: list[int], pairs: dict[tuple[int, int], tuple[int, float]]) -> Iterator[_Pairing]:
    """All sets of pairs without a common dart."""
    if not darts:
        yield ()
        return
    first, rest = darts[0], darts[1:]
    yield from _pairings(rest, pairs)
    for k, other in enumerate(rest):
        pair = (first, other) if (first, other) in pairs else (other, first)
        if pair in pairs:
            for more in _pairings(rest[:k] + rest[k + 1 :], pairs):
                yield (pair, *more)
