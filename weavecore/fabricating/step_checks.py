"""What the report checks of the sequence, and of what machines draw and cut.

A mark is *set* in the step whose stretch of the piece it lies on.  A joint is tied when all marks of it are set.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of
from weavecore.fabricating.steps import MOST_TIES
from weavecore.fabricating.tables import CUT, SPLICE, START

_ROUNDING = 0.002
"""Numbers are written to a micrometre: the difference of two may be off by so many millimetres."""


def check_steps(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check the sequence and machine.csv.

    Parameters
    ----------
    folder : WrittenFolder
    """
    yield from _check_order(folder)
    yield from _check_ties(folder)
    yield _check_machine(folder)


def _check_order(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Every piece is set once, along its whole length, and after the steps that it needs."""
    sequence, pieces, rods = (folder.table(name) for name in ("sequence", "pieces", "rods"))
    steps = [int(step) for step in sequence["step"]]
    stretches: dict[str, list[tuple[float, float]]] = {piece: [] for piece in pieces["piece_id"]}
    for piece, low, high in zip(sequence["piece"], sequence.floats("from").tolist(), sequence.floats("to").tolist()):
        stretches.setdefault(piece, []).append((low, high))
    cut = dict(zip(pieces["piece_id"], pieces.floats("cut_length").tolist()))
    yield count_of(
        "piece_not_set_once", [piece for piece, row in stretches.items() if not _tiles(row, cut.get(piece, np.nan))]
    )
    rows = zip(sequence["piece"], steps, sequence.lists("after"))
    yield count_of(
        "piece_set_before_what_it_needs", [piece for piece, step, row in rows if any(int(s) >= step for s in row)]
    )
    generation = dict(zip(rods["rod_id"], map(int, rods["generation"])))
    rings = [rod for rod, action in zip(sequence["rod"], sequence["action"]) if action.startswith("set ")]
    falls = [b for a, b in zip(rings, rings[1:]) if generation.get(b, 0) < generation.get(a, 0)]
    yield count_of("ring_set_before_its_parents", falls)


def _tiles(row: list[tuple[float, float]], length: float) -> bool:
    """Whether stretches follow each other from 0 to a length."""
    ends = [0.0, *(high for _, high in row)]
    begins = [*(low for low, _ in row), length]
    return all(abs(a - b) <= _ROUNDING for a, b in zip(ends, begins))


def _check_ties(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Every joint is tied once, when all its rods are there, and no step has too many ties."""
    sequence, joints, marks = (folder.table(name) for name in ("sequence", "joints", "marks"))
    steps = [int(step) for step in sequence["step"]]
    tied = [(joint, step) for step, row in zip(steps, sequence.lists("joints_to_tie")) for joint in row]
    times = Counter(joint for joint, _ in tied)
    yield count_of("joint_not_tied_once", [j for j in {*times, *joints["joint_id"]} if times[j] != 1])
    ends: dict[str, list[tuple[float, int]]] = {}
    for piece, high, step in zip(sequence["piece"], sequence.floats("to").tolist(), steps):
        ends.setdefault(piece, []).append((high, step))
    ready: dict[str, int] = {}
    for piece, joint, at in zip(marks["piece_id"], marks["joint_id"], marks.floats("from_start").tolist()):
        own = ends.get(piece, [(0.0, 0)])
        step = next((step for high, step in own if at <= high + _ROUNDING), own[-1][1])
        ready[joint] = max(ready.get(joint, 0), step)
    yield count_of(
        "joint_tied_before_its_rods_are_set", [joint for joint, step in tied if ready.get(joint, step + 1) > step]
    )
    ties = dict(zip(joints["joint_id"], joints.floats("ties").tolist()))
    counts = [sum(ties.get(joint, 0.0) for joint in row) for row in sequence.lists("joints_to_tie")]
    off = np.abs(np.array(counts) - sequence.floats("ties"))
    yield greatest_of("step_ties_off", off, 0.0, sequence["step"])
    single = np.array([len(row) <= 1 for row in sequence.lists("joints_to_tie")], bool)
    yield greatest_of("step_ties", np.where(single, 0.0, np.array(counts)), float(MOST_TIES), sequence["step"])


def _check_machine(folder: WrittenFolder) -> CheckResult:
    """What machines draw are the marks, and they cut where the pieces end."""
    machine, marks, pieces = (folder.table(name) for name in ("machine", "marks", "pieces"))
    columns = (machine["piece"], machine["code"], machine["flag"], machine.floats("millimetres").tolist())
    rows = [(piece, flag if flag == CUT else code, at) for piece, code, flag, at in zip(*columns) if flag not in _ENDS]
    ticks = {
        (piece, number): (piece, code, at)
        for piece, number, code, at in zip(
            marks["piece_id"], marks["no"], marks["code"], marks.floats("from_start").tolist()
        )
    }
    cuts = [(piece, CUT, at) for piece, at in zip(pieces["piece_id"], pieces.floats("cut_length").tolist())]
    found, wanted = sorted(rows), sorted([*ticks.values(), *cuts])
    wrong = {one[0] for one, other in zip(found, wanted) if one[:2] != other[:2] or abs(one[2] - other[2]) > _ROUNDING}
    extra = {one[0] for one in [*found[len(wanted) :], *wanted[len(found) :]]}
    return count_of("machine_row_off_its_mark", sorted(wrong | extra))


_ENDS = (START, SPLICE)
"""Flags of rows that are no marks."""
