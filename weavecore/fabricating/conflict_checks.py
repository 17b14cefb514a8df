"""Whether the order along the rods goes on as the weave says, and what does not is listed.

A *side* is 1 where a rod lies over all others of a joint, -1 where it lies under all, 0 between and at a node that it
passes alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from weavecore.fabricating.report_files import Finding, Folder, count, statement_of

_TWILL = "twill "

Passes = list[tuple[float, str, int]]
"""Station, joint and side, along a rod."""


def check_conflicts(folder: Folder) -> Iterator[Finding]:
    """The rods that do not alternate, or leave their layer, are those that the joints list; all of them are told."""
    weave = statement_of(folder.files["marks.csv"])["weave"]
    joints, rods = folder.table("joints"), folder.table("rods")
    listed = Counter((rod, joint) for joint, row in zip(joints["joint_id"], joints.lists("conflicts")) for rod in row)
    yield Finding("order_conflicts_listed", float(sum(listed.values())), float("inf"), _names(listed))
    if weave.startswith(_TWILL):
        over, under = (int(part) for part in weave[len(_TWILL) :].split("/"))
        yield count("order_conflict_not_listed", _twill_breaks(folder, set(listed), over, under))
        return
    closed = dict(zip(rods["rod_id"], rods["closed"]))
    found: Counter[tuple[str, str]] = Counter()
    for rod, passes in sides_along_rods(folder).items():
        row = [*passes, passes[0]] if closed[rod] == "yes" else passes
        for (_, _, before), (_, joint, after) in zip(row, row[1:]):
            if before * after == (1 if weave == "plain" else -1):
                found[rod, joint] += 1
    yield count("order_conflict_not_listed", _names(found - listed))
    yield count("order_conflict_listed_for_nothing", _names(listed - found))


def _twill_breaks(folder: Folder, listed: set[tuple[str, str]], over: int, under: int) -> list[str]:
    """Where a rod does not go over and under as a twill has it, though no conflict is listed.

    A ring goes over ``over`` rods and under ``under``, the rods across it the other way around; that holds from joint
    to joint of a ring and one other rod, and begins anew after other joints and where a conflict is listed.
    """
    rods, joints = folder.table("rods"), folder.table("joints")
    rings = {rod for rod, family in zip(rods["rod_id"], rods["family"]) if family == "latitudinal"}
    rows = zip(joints["joint_id"], joints.lists("rods"))
    crossed = {joint for joint, row in rows if len(row) == 2 and len(rings.intersection(row)) == 1}
    broken = []
    for rod, passes in sides_along_rods(folder).items():
        m, n = (over, under) if rod in rings else (under, over)
        cycle = [1] * m + [-1] * n
        stretch: list[int] = []
        for _, joint, side in passes:
            if joint not in crossed or (rod, joint) in listed:
                stretch = []
            if joint in crossed:
                stretch.append(side)
                if not _goes_in_cycles(stretch, cycle):
                    broken.append(f"{rod}@{joint}")
                    stretch = [side]
    return broken


def _goes_in_cycles(sides: list[int], cycle: list[int]) -> bool:
    """Whether the sides are a part of the cycle that goes on and on."""
    n = len(cycle)
    return any(all(side == cycle[(start + k) % n] for k, side in enumerate(sides)) for start in range(n))


def sides_along_rods(folder: Folder) -> dict[str, Passes]:
    """The side of every rod at all its nodes in order; marks that overlapping pieces have twice count once."""
    marks = folder.table("marks")
    seen: dict[str, dict[tuple[float, str], list[str]]] = {}
    columns = (marks["rod_id"], marks["station"], marks["joint_id"], marks["over_under"])
    for rod, station, joint, side in zip(*columns):
        seen.setdefault(rod, {}).setdefault((float(station), joint), []).append(side)
    return {
        rod: [(station, joint, _side(sides)) for (station, joint), sides in sorted(places.items())]
        for rod, places in seen.items()
    }


def _side(sides: list[str]) -> int:
    if set(sides) == {"over"}:
        return 1
    return -1 if set(sides) == {"under"} else 0


def _names(rows: Counter[tuple[str, str]]) -> tuple[str, ...]:
    return tuple(sorted(f"{rod}@{joint}" for rod, joint in rows.elements()))
