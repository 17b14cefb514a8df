"""Which strands meet at which nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, next_in_loop, offsets_of, rows_of
from weavecore.model.strands import Strands


@dataclass(frozen=True, eq=False)
class Meetings:
    """The nodes that two or more rods pass, their visits in the order of the strands.

    Parameters
    ----------
    node : (J,) int64
    offsets : (J+1,) int64
    visit : (…,) int64
        Entries of ``strands.nodes``.
    joint_of_visit : (M,) int64
        For every visit its joint, or -1.
    """

    node: Ints
    offsets: Ints
    visit: Ints
    joint_of_visit: Ints

    @property
    def counts(self) -> Ints:
        """(J,) rods at each joint."""
        return np.diff(self.offsets)


def find_meetings(strands: Strands) -> Meetings:
    """Gather the visits by their nodes."""
    order = np.argsort(strands.nodes, kind="stable")
    node, first, count = np.unique(strands.nodes[order], return_index=True, return_counts=True)
    shared = count > 1
    offsets = offsets_of(count[shared])
    within = np.arange(offsets[-1]) - offsets[rows_of(offsets)]
    visit = order[np.repeat(first[shared], count[shared]) + within]
    joint = np.full(len(strands.nodes), -1, np.int64)
    joint[visit] = rows_of(offsets)
    return Meetings(node[shared], offsets, visit, joint)


def steps_along(strands: Strands) -> tuple[Ints, Ints]:
    """Pairs of visits that follow each other along a strand, the closing step of rings included."""
    after = next_in_loop(strands.offsets)
    start = np.flatnonzero(_goes_on(strands, after))
    return start, after[start]


def _goes_on(strands: Strands, after: Ints) -> Bools:
    goes_on: Bools = strands.closed[rows_of(strands.offsets)] | (after > np.arange(len(after)))
    return goes_on
