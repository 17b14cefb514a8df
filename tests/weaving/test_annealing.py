"""Conflicts of a plain weave move to where they cancel."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.weaving.annealing import Steps, anneal_sides
from woven_rods import woven_sample

N = 9


def rods(*nodes: list[int]) -> tuple[Steps, np.ndarray]:
    """Open rods through joints 0, 1, 2…, each joint passed by two rods or more, and the joint of each visit."""
    joint = np.array([node for rod in nodes for node in rod])
    order = np.argsort(joint, kind="stable")
    ends = np.cumsum([len(rod) for rod in nodes]) - 1
    before = np.setdiff1d(np.arange(len(joint)), ends)
    return Steps(np.r_[0, np.cumsum(np.bincount(joint))], order, before, before + 1), joint


def stacked(steps: Steps) -> np.ndarray:
    """Sides where the first visit of each joint is outermost and the last innermost."""
    side = np.zeros(len(steps.visit), np.int64)
    side[steps.visit[steps.offsets[:-1]]], side[steps.visit[steps.offsets[1:] - 1]] = 1, -1
    return side


def conflicts(steps: Steps, side: np.ndarray) -> int:
    return int((side[steps.before] * side[steps.after] > 0).sum())


def random_rods(seed: int) -> tuple[Steps, np.ndarray]:
    """Two rods through all joints in some order, and short ones, so that some joints have three or more."""
    draw = np.random.default_rng(seed)
    counts = [N, N, 4, 4, 3]
    return rods(*(draw.permutation(N)[:count].tolist() for count in counts))


def fewest_by_trying_all(steps: Steps, joint: np.ndarray) -> int:
    """The fewest conflicts over all choices of an outermost and an innermost rod at each joint."""
    visits = [steps.visit[steps.offsets[j] : steps.offsets[j + 1]].tolist() for j in range(N)]
    states = [[(top, bottom) for top in here for bottom in here if top != bottom] for here in visits]
    least = conflicts(steps, stacked(steps))

    def place(j: int, side: np.ndarray, cost: int) -> None:
        nonlocal least
        if cost >= least:
            return
        if j == N:
            least = cost
            return
        settled = (joint[steps.before] <= j) & (joint[steps.after] <= j)
        for top, bottom in states[j]:
            side[top], side[bottom] = 1, -1
            place(j + 1, side, int((side[steps.before] * side[steps.after] > 0)[settled].sum()))
            side[top] = side[bottom] = 0

    place(0, np.zeros(len(joint), np.int64), 0)
    return least


@pytest.mark.parametrize("seed", range(4))
def test_as_few_conflicts_are_left_as_there_can_be(seed: int) -> None:
    steps, joint = random_rods(seed)
    start = stacked(steps)
    found = anneal_sides(steps, start)
    assert conflicts(steps, found) == fewest_by_trying_all(steps, joint) < conflicts(steps, start)


@pytest.mark.parametrize("seed", range(4))
def test_each_joint_has_one_outermost_and_one_innermost_rod(seed: int) -> None:
    steps, joint = random_rods(seed)
    side = anneal_sides(steps, stacked(steps))
    assert (np.bincount(joint[side == 1], minlength=N) == 1).all()
    assert (np.bincount(joint[side == -1], minlength=N) == 1).all()


def test_joints_without_a_conflict_near_them_lie_as_before() -> None:
    # Two rods far from each other, each crossed by short ones; the first begins with a conflict that turns away.
    steps, _ = rods([0, 1, 2], [3, 4, 5], [0, 6], [1, 6], [2, 6], [3, 7], [4, 7], [5, 7])
    start = stacked(steps)
    start[[4, 12]] *= -1
    found = anneal_sides(steps, start)
    assert conflicts(steps, found) < conflicts(steps, start)
    settled = anneal_sides(steps, found)
    assert np.array_equal(settled, found)


def test_a_sample_with_pockets_keeps_few_conflicts() -> None:
    weave = woven_sample("narrow_neck", "plain")
    assert 0 < len(weave.conflicts) <= 0.02 * len(weave.strands.nodes)
