"""Steps are what two people can do at once, and machines get every mark."""

from __future__ import annotations

from collections import Counter

import numpy as np

from fabricated import SHELL, made, table
from weavecore.fabricating.steps import MOST_TIES


def test_long_rods_with_many_ties_are_set_in_several_steps_one_after_the_other() -> None:
    folder = made(SHELL, "kagome")
    sequence, joints = table(folder, "sequence"), table(folder, "joints")
    per_rod = Counter(sequence["rod"])
    assert max(per_rod.values()) >= 2
    ties = dict(zip(joints["joint_id"], joints.floats("ties").tolist()))
    for row, stated in zip(sequence.lists("joints_to_tie"), sequence.floats("ties").tolist()):
        assert sum(ties[joint] for joint in row) == stated
        assert stated <= MOST_TIES or len(row) == 1
    rows = list(zip(sequence["step"], sequence["rod"], sequence["action"], sequence.lists("after")))
    for (before, rod, _, _), (_, other, action, after) in zip(rows, rows[1:]):
        assert (action == "go on") == (rod == other)
        assert action != "go on" or after == [before]


def test_a_rod_of_several_pieces_is_set_piece_by_piece() -> None:
    folder = made(SHELL)
    sequence, pieces = table(folder, "sequence"), table(folder, "pieces")
    length: dict[str, float] = {}
    for piece, low, high in zip(sequence["piece"], sequence.floats("from"), sequence.floats("to")):
        length[piece] = length.get(piece, 0.0) + high - low
    assert length.keys() == set(pieces["piece_id"])
    cuts = dict(zip(pieces["piece_id"], pieces.floats("cut_length")))
    assert all(abs(length[piece] - cuts[piece]) < 0.01 for piece in cuts)


def test_ties_of_a_step_lie_on_its_stretch() -> None:
    folder = made("hemisphere", "kagome")
    sequence, marks = table(folder, "sequence"), table(folder, "marks")
    at: dict[tuple[str, str], list[float]] = {}
    for piece, joint, place in zip(marks["piece_id"], marks["joint_id"], marks.floats("from_start").tolist()):
        at.setdefault((piece, joint), []).append(place)
    rows = zip(sequence["piece"], sequence.floats("from"), sequence.floats("to"), sequence.lists("joints_to_tie"))
    for piece, low, high, row in rows:
        for joint in row:
            assert low - 0.01 <= max(at[piece, joint]) <= high + 0.01


def test_machines_get_every_mark_bar_by_bar_in_the_order_of_cutting() -> None:
    folder = made(SHELL)
    machine, marks, nesting = table(folder, "machine"), table(folder, "marks"), table(folder, "nesting")
    assert list(machine.columns) == ["piece", "millimetres", "code", "flag"]
    order = list(dict.fromkeys(machine["piece"]))
    assert order == [piece for row in nesting.lists("pieces") for piece in row]
    rows = list(zip(machine["piece"], machine["millimetres"], machine["code"], machine["flag"]))
    drawn = {row[:3] for row in rows if row[3] in {"over", "under", "between", "alone"}}
    assert drawn == set(zip(marks["piece_id"], marks["from_start"], marks["code"]))
    flags = Counter(row[3] for row in rows)
    assert flags["start"] == flags["cut"] == len(order)
    place = machine.floats("millimetres")
    starts = [k for k, row in enumerate(rows) if row[3] == "start"]
    assert all((np.diff(place[a:b]) >= 0).all() for a, b in zip(starts, [*starts[1:], len(rows)]))
