"""Fewer conflicts of a plain weave by simulated annealing (Kirkpatrick, Gelatt and Vecchi 1983).

A joint of k rods has k (k - 1) *states*: which of them is outermost and which innermost.  A step along a rod is a
conflict where the rod is outermost at both of its joints, or innermost at both; between other rods it is free.  So a
conflict can also be moved, at no cost, to a joint of three rods and disappear there, which no method that counts
joints of two rods alone can find (`plain`)::

       top    mid    top    top           top    bottom  mid    top
    ----o------o------o------o----     ----o------o------o------o----
                        conflict                        none

Joints of one colour do not follow each other along any rod, so all of them are changed at once.  Each draws a state at
random and takes it if there are d more conflicts with the probability min(1, exp(-d / T)) (Metropolis et al. 1953),
while the temperature T falls.  Random numbers come from a fixed seed: the same rods are always woven in the same way.

O(V) a sweep over all joints for V visits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Ints, rows_of
from weavecore.polling import each

_MOST_SWEEPS, _FEWEST_SWEEPS = 400, 100
_MOST_WORK = 4_000_000
"""Visits times sweeps: half a second.  Where there are more visits than 10,000 there are fewer sweeps."""

_HOT, _COLD = 0.5, 0.1
"""Temperatures at the first and the last sweep: one more conflict is kept in 14 % of trials, then in hardly any."""

_MOST_CHANGE = 4
"""By how many conflicts one joint can change: its outermost and its innermost rod have two neighbours each."""

_SEED = 2016
_NONE = -1


@dataclass(frozen=True, eq=False)
class Steps:
    """The steps along the rods between visits of joints.

    Parameters
    ----------
    offsets : (J+1,) int64
    visit : (V,) int64
        Visits at joint ``j``: ``visit[offsets[j]:offsets[j + 1]]``; a visit is a number below M.
    before, after : (k,) int64
        Visits that follow each other along a rod.
    """

    offsets: Ints
    visit: Ints
    before: Ints
    after: Ints


class _States:
    """Outermost and innermost visit of each joint, and the sides (M+1,) that follow; the last stands for no visit."""

    def __init__(self, steps: Steps, side: Ints) -> None:
        m = len(side)
        self.side = np.append(side, 0)
        self.next_ = np.full(m + 1, m, np.int64)
        self.previous = np.full(m + 1, m, np.int64)
        self.next_[steps.before], self.previous[steps.after] = steps.after, steps.before
        joint, at = rows_of(steps.offsets), side[steps.visit]
        self.top = np.empty(len(steps.offsets) - 1, np.int64)
        self.bottom = np.empty_like(self.top)
        self.top[joint[at > 0]], self.bottom[joint[at < 0]] = steps.visit[at > 0], steps.visit[at < 0]

    def conflicts(self, top: Ints, bottom: Ints) -> Ints:
        """(n,) conflicts at joints with these outermost and innermost visits."""
        above = (self.side[self.next_[top]] > 0).astype(np.int64) + (self.side[self.previous[top]] > 0)
        below = (self.side[self.next_[bottom]] < 0).astype(np.int64) + (self.side[self.previous[bottom]] < 0)
        found: Ints = above + below
        return found

    def total(self) -> int:
        """Conflicts of all joints."""
        return int((self.side * self.side[self.next_] > 0).sum())

    def change(self, joints: Ints, top: Ints, bottom: Ints) -> None:
        """Give joints other states."""
        self.side[self.top[joints]] = self.side[self.bottom[joints]] = 0
        self.top[joints], self.bottom[joints] = top, bottom
        self.side[top], self.side[bottom] = 1, -1


def anneal_sides(steps: Steps, side: Ints) -> Ints:
    """Find sides of rods at their joints with few conflicts, and no more than before.

    Parameters
    ----------
    steps : Steps
        No visit follows one of its own joint.
    side : (M,) int64
        1 for the outermost visit of each joint, -1 for the innermost, 0 for all others.

    Returns
    -------
    (M,) int64
        Sides of the same kind.  Joints lie as before where that costs nothing.
    """
    states, joint_of = _States(steps, side), np.zeros(len(side), np.int64)
    joint_of[steps.visit] = rows_of(steps.offsets)
    groups = _colour_classes(joint_of[steps.before], joint_of[steps.after], len(steps.offsets) - 1)
    start_top, start_bottom = states.top.copy(), states.bottom.copy()
    random = np.random.default_rng(_SEED)
    least, best = states.total(), (start_top, start_bottom)
    sweeps = min(max(_MOST_WORK // max(len(side), 1), _FEWEST_SWEEPS), _MOST_SWEEPS)
    for temperature in each(np.linspace(_HOT, _COLD, sweeps).tolist()):
        for joints in groups:
            _try_states(steps, states, joints, temperature, random)
        if states.total() < least:
            least, best = states.total(), (states.top.copy(), states.bottom.copy())
    states.change(np.arange(len(states.top)), *best)
    _restore_states(states, groups, start_top, start_bottom)
    return states.side[:-1]


def _try_states(steps: Steps, states: _States, joints: Ints, temperature: float, random: np.random.Generator) -> None:
    """Draw a state for each joint of one colour, and take it with the probability of Metropolis et al."""
    first, count = steps.offsets[joints], np.diff(steps.offsets)[joints]
    draw = random.random((3, len(joints)))
    upper = (draw[0] * count).astype(np.int64)
    lower = (upper + 1 + (draw[1] * (count - 1)).astype(np.int64)) % count
    top, bottom = steps.visit[first + upper], steps.visit[first + lower]
    more = states.conflicts(top, bottom) - states.conflicts(states.top[joints], states.bottom[joints])
    chance = np.array([1.0] * (_MOST_CHANGE + 1) + [math.exp(-k / temperature) for k in range(1, _MOST_CHANGE + 1)])
    kept = draw[2] < chance[more + _MOST_CHANGE]
    states.change(joints[kept], top[kept], bottom[kept])


def _restore_states(states: _States, groups: list[Ints], top: Ints, bottom: Ints) -> None:
    """Give joints the states that they had, as long as that makes no conflict."""
    while True:
        n_back = 0
        for joints in groups:
            now = states.conflicts(states.top[joints], states.bottom[joints])
            is_other = (states.top[joints] != top[joints]) | (states.bottom[joints] != bottom[joints])
            back = joints[is_other & (states.conflicts(top[joints], bottom[joints]) <= now)]
            states.change(back, top[back], bottom[back])
            n_back += len(back)
        if n_back == 0:
            return


def _colour_classes(a: Ints, b: Ints, n: int) -> list[Ints]:
    """The n joints by the colours of a greedy colouring: none are neighbours by the pairs ``a, b`` of their own."""
    around: list[list[int]] = [[] for _ in range(n)]
    for one, other in zip(a.tolist(), b.tolist()):
        around[one].append(other)
        around[other].append(one)
    colour = [_NONE] * n
    for joint, neighbours in enumerate(around):
        taken = {colour[other] for other in neighbours}
        colour[joint] = next(c for c in range(len(taken) + 1) if c not in taken)
    return [np.flatnonzero(np.array(colour) == c) for c in range(max(colour, default=_NONE) + 1)]
