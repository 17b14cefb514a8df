r"""Which rod ends at a node where the number of edges is odd: a long one rather than a short one.

At a node with an odd number of edges one rod ends whatever is paired with what::

        \   /              \   /
         \ /                \ /        the rod from below is short: it goes on to the left, turning a little,
    ------o------        ------o------    and the rod that came from there ends in its place
          |                    |
          |  short             |  goes on

So a rod of few joints can take over the way of a longer one, as long as what remains of that is not short itself.
Rods are looked at from the shortest on; each change makes one short rod long, so the work is linear in the short rods.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.matching import ALONE

FEWEST_JOINTS = 4
"""A rod with fewer joints holds little and is hard to keep in place: it is a stub."""


class _Chains:
    """Rods as partners of darts: a dart leaves its node, and its partner leaves the same node on the other side."""

    def __init__(self, partner: Ints, tail: Ints) -> None:
        self.partner = partner.tolist()
        self.tail = tail.tolist()

    def reach(self, dart: int, most: int) -> tuple[int, int]:
        """How many nodes a rod passes from the tail of a dart along it, counted up to ``most``, and its last dart."""
        count = 1
        while True:
            count += 1
            onward = self.partner[dart ^ 1]
            if onward == ALONE or count >= most:
                return count, dart
            dart = onward

    def join(self, one: int, other: int) -> None:
        """Pair two darts of one node; what they were paired with ends there."""
        for dart in (one, other):
            if self.partner[dart] != ALONE:
                self.partner[self.partner[dart]] = ALONE
        self.partner[one], self.partner[other] = other, one


def lengthen_short_rods(partner: Ints, tail: Ints, one: Ints, other: Ints, turn: Floats) -> Ints:
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

    Returns
    -------
    (D,) int64
        Partners as before, with as many ends at each node or fewer.
    """
    ways: defaultdict[int, list[tuple[float, int]]] = defaultdict(list)
    for a, b, t in zip(one.tolist(), other.tolist(), turn.tolist()):
        ways[a].append((t, b))
        ways[b].append((t, a))
    chains = _Chains(partner, tail)
    ends = np.flatnonzero(partner == ALONE).tolist()
    lengths = {dart: chains.reach(dart, FEWEST_JOINTS)[0] for dart in ends}
    for dart in sorted((dart for dart in ends if lengths[dart] < FEWEST_JOINTS), key=lambda d: (lengths[d], d)):
        if chains.partner[dart] == ALONE and chains.reach(dart, FEWEST_JOINTS)[0] < FEWEST_JOINTS:
            onward = _way_on(chains, dart, ways[dart])
            if onward is not None:
                chains.join(dart, onward)
    return np.array(chains.partner, np.int64)


def _way_on(chains: _Chains, dart: int, ways: list[tuple[float, int]]) -> Optional[int]:
    """The dart with the least turn that a rod that ends can follow and that leaves no other rod short."""
    for _, onward in sorted(ways):
        left = chains.partner[onward]
        if left == ALONE or (left != dart and chains.reach(left, FEWEST_JOINTS)[0] >= FEWEST_JOINTS):
            return onward
    return None
