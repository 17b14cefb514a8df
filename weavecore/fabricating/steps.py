"""The sequence of construction in steps that two people can do at once: `split_steps`.

`BuildSequence` sets a rod whole.  Here a rod is set piece by piece, and a piece with many joints to tie in stretches::

    piece  ├────────┼─────────┼────────┤          a stretch ends midway between two joints that are tied
             ≤ 24 ties  ≤ 24     ≤ 24

A joint that two pieces of a rod pass, in their overlap, is tied with the later one, which is when both are there.
Linear in the marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from weavecore.fabricating.marks import Mark
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splices import Piece
from weavecore.fabricating.ties import Ties
from weavecore.model import BuildSequence
from weavecore.polling import each, each_of_many

MOST_TIES = 24
"""Ties of a step: two people set a tie in about half a minute, so a step takes some ten minutes, and what they hold by
hand until it is tied is no longer than they can reach."""

SET_RING, SET_ROD, WEAVE_IN, GO_ON = "set ring", "set rod", "weave in", "go on"
"""What is done in a step; the last of a rod that a step before has begun."""


@dataclass(frozen=True)
class Step:
    """What two people do at once.

    Parameters
    ----------
    number : int
        From 1.
    action : str
        One of `SET_RING`, `SET_ROD`, `WEAVE_IN` and `GO_ON`.
    piece : Piece
    low, high : float
        The stretch of the piece, from its start, in millimetres.
    joints : tuple of int
        Those that are tied, along the piece.
    after : tuple of int
        Numbers of the steps that have to be done before.
    """

    number: int
    action: str
    piece: Piece
    low: float
    high: float
    joints: tuple[int, ...]
    after: tuple[int, ...]


def split_steps(
    plan: RodPlan, pieces: Sequence[Piece], marks: Sequence[Mark], ties: Ties, sequence: BuildSequence
) -> list[Step]:
    """Divide the sequence into steps of one stretch of a piece each.

    Parameters
    ----------
    plan : RodPlan
    pieces : sequence of Piece
    marks : sequence of Mark
        Of these pieces.
    ties : Ties
    sequence : BuildSequence

    Returns
    -------
    list of Step
        In the order of construction.
    """
    of_rod: dict[int, list[Piece]] = {}
    for piece in pieces:
        of_rod.setdefault(piece.rod, []).append(piece)
    passes: dict[int, list[Mark]] = {}
    for mark in each_of_many(marks):
        passes.setdefault(mark.piece.rod, []).append(mark)
    steps: list[Step] = []
    last_of: list[int] = []
    for k, (rod, is_ring) in each(enumerate(zip(sequence.strand.tolist(), sequence.is_ring.tolist()))):
        action = WEAVE_IN if not is_ring else SET_RING if plan.axes.closed[rod] else SET_ROD
        after = tuple(sorted({last_of[before] for before in sequence.needed_by(k).tolist()}))
        # The last pass of a joint decides, so a later mark replaces an earlier one.
        at = {mark.joint: (mark.piece.seq, mark.at) for mark in passes.get(rod, [])}
        tied = sorted(sequence.tied_at(k).tolist(), key=lambda joint: at[joint])
        for piece in of_rod[rod]:
            own = [joint for joint in tied if at[joint][0] == piece.seq]
            for low, high, joints in _stretches(piece, [(at[joint][1], joint) for joint in own], ties):
                steps.append(Step(len(steps) + 1, action, piece, low, high, joints, after))
                action, after = GO_ON, (len(steps),)
        last_of.append(len(steps))
    return steps


def _stretches(piece: Piece, places: list[tuple[float, int]], ties: Ties) -> list[tuple[float, float, tuple[int, ...]]]:
    """Ends and joints of the stretches of a piece, as even in ties as they can be."""
    counts = [int(ties.count[joint]) for _, joint in places]
    n = max(1, -(-sum(counts) // MOST_TIES))
    groups: list[list[tuple[float, int]]] = [[]]
    held = 0
    most = -(-sum(counts) // n)
    for place, count in zip(places, counts):
        if groups[-1] and held + count > max(most, count):
            groups.append([])
            held = 0
        groups[-1].append(place)
        held += count
    bounds = [0.0, *((a[-1][0] + b[0][0]) / 2 for a, b in zip(groups, groups[1:])), piece.cut_length]
    return [(low, high, tuple(joint for _, joint in group)) for low, high, group in zip(bounds, bounds[1:], groups)]
