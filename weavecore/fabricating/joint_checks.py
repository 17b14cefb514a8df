"""What the report checks of marks, nodes and the order at joints.

A node is rebuilt from the marks and the axes alone.  At a node each rod lies its ``layer_offset`` h out of the surface
along one normal, p = node + h · n; with the means over the rods of the joint,

    n = Σ (h - h̄)(p - p̄) / Σ (h - h̄)²,    node = p̄ - h̄ · n      (least squares)

so two rods at different offsets give both.

The *side* of a rod at a joint is 1 where it lies over all others, -1 where it lies under all, and 0 between them or
where it passes a node alone.  Along a rod of a plain weave the sides alternate; along one of a stacked weave they stay
the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from weavecore.fabricating.csv_tables import ReadTable, read_statement
from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of
from weavecore.fabricating.written_axes import WrittenAxes
from weavecore.geometry.arrays import Floats

_MARK_LIMIT = 0.1
"""How far the two rods of a joint may put it apart along a rod, in millimetres."""

_STATION_LIMIT = 0.003
"""How far a mark may be from its station, in millimetres: three numbers rounded to a micrometre."""

_NODE_LIMIT = 0.2
"""How far a rebuilt node may be from the one in joints.csv, in millimetres, on models of metres."""

_SAME_OFFSET = 1e-6
"""Layer offsets that differ by less, in millimetres (their sum of squares in mm²), are equal: they give no normal."""

_CONFLICTS = (
    "Here a rod departs from the over-under order: some counts of rods allow no order without it. The marks show the "
    "order to weave."
)

_TWILL = "twill "

_Passes = list[tuple[float, str, int]]
"""Station, joint and side, along a rod."""


def check_joints(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check marks, nodes, and the order at joints and along rods.

    Parameters
    ----------
    folder : WrittenFolder
    """
    for check in (_check_marks, _check_nodes, _check_over_under, _check_conflicts):
        yield from check(folder)


def _check_marks(folder: WrittenFolder) -> Iterator[CheckResult]:
    """The marks of both rods of a joint agree, and every mark is at its station on its piece."""
    marks, rods, pieces = folder.table("marks"), folder.table("rods"), folder.table("pieces")
    station, other_station = marks.floats("station"), marks.floats("other_station")
    columns = (marks["joint_id"], marks["rod_id"], marks["other_rod"], station.tolist(), other_station.tolist())
    rows = [row for row in zip(*columns) if row[2]]
    there: dict[tuple[str, str, str], list[float]] = {}
    for joint, rod, other, at, _ in rows:
        there.setdefault((joint, other, rod), []).append(at)
    # Nothing to compare with is NaN, which no limit lets pass.
    off = np.array(
        [
            min((abs(at - stated) for at in there.get((joint, rod, other), ())), default=np.nan)
            for joint, rod, other, _, stated in rows
        ]
    )
    yield greatest_of("mark_sides_differ_mm", off, _MARK_LIMIT, [row[0] for row in rows])
    length = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    begin = dict(zip(pieces["piece_id"], pieces.floats("from").tolist()))
    long = np.array([length.get(rod, np.nan) for rod in marks["rod_id"]])
    off = marks.floats("from_start") + np.array([begin.get(piece, np.nan) for piece in marks["piece_id"]]) - station
    off = np.abs(off - np.round(off / long) * long)
    yield greatest_of("mark_off_its_station_mm", off, _STATION_LIMIT, marks["piece_id"])


def _check_nodes(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Every node is rebuilt from the marks and the axes alone."""
    joints = folder.table("joints")
    names, nodes = _rebuild_nodes(folder.table("marks"), folder.axes)
    found = dict(zip(names, nodes))
    stated = np.stack([joints.floats(name) for name in ("x", "y", "z")], axis=1)
    rebuilt = np.array([found.get(name, np.full(3, np.nan)) for name in joints["joint_id"]]).reshape(-1, 3)
    yield greatest_of("node_rebuilt_off_mm", np.linalg.norm(rebuilt - stated, axis=1), _NODE_LIMIT, joints["joint_id"])


def _rebuild_nodes(marks: ReadTable, axes: WrittenAxes) -> tuple[list[str], Floats]:
    """Names of the joints and nodes of all marks, sorted, and their places (n, 3).

    NaN where all rods of a joint have one layer offset other than 0.
    """
    joints = [*marks["joint_id"], *(joint for joint, other in zip(marks["joint_id"], marks["other_rod"]) if other)]
    rods = [*marks["rod_id"], *(other for other in marks["other_rod"] if other)]
    other = marks.floats("other_station")
    stations = np.concatenate([marks.floats("station"), other[~np.isnan(other)]])
    # Several marks name a rod of a joint; it counts once.
    known = sorted(set(zip(joints, rods, stations.tolist())))
    names, group = np.unique([joint for joint, _, _ in known], return_inverse=True)
    rows = axes.rows_at([rod for _, rod, _ in known], np.array([station for _, _, station in known]))
    point, offset = axes.points[rows], axes.layer_offsets[rows]
    n = len(names)
    weight = np.bincount(group, minlength=n)
    mean_offset = np.bincount(group, offset, minlength=n) / weight
    mean_point = np.stack([np.bincount(group, point[:, k], minlength=n) / weight for k in range(3)], axis=1)
    rise = offset - mean_offset[group]
    spread = np.bincount(group, rise * rise, minlength=n)
    climb = np.stack([np.bincount(group, rise * point[:, k], minlength=n) for k in range(3)], axis=1)
    is_flat = spread < _SAME_OFFSET
    normal = np.divide(climb, spread[:, None], out=np.zeros_like(climb), where=~is_flat[:, None])
    # Without a difference of offsets a node is known only where the rods lie on it.
    nodes = mean_point - mean_offset[:, None] * normal
    nodes[is_flat & (np.abs(mean_offset) > _SAME_OFFSET)] = np.nan
    return names.tolist(), nodes


def _check_over_under(folder: WrittenFolder) -> Iterator[CheckResult]:
    """One rod of each pair is over, in the order of the joint."""
    marks, joints = folder.table("marks"), folder.table("joints")
    place = dict(zip(joints["joint_id"], joints.lists("order")))
    pairs: dict[tuple[str, str, str], list[str]] = {}
    contradicting = []
    for joint, rod, other, side in zip(marks["joint_id"], marks["rod_id"], marks["other_rod"], marks["over_under"]):
        if not other:
            continue
        pairs.setdefault((joint, min(rod, other), max(rod, other)), []).append(side)
        if _contradicts(place.get(joint, []), rod, other, side):
            contradicting.append(joint)
    yield count_of(
        "joint_without_one_over", [key[0] for key, sides in pairs.items() if set(sides) != {"over", "under"}]
    )
    yield count_of("joint_order_contradicts_marks", contradicting)


def _contradicts(order: list[str], rod: str, other: str, side: str) -> bool:
    """Whether the order of a joint contradicts a mark; of a rod that passes it twice the mark may mean either pass."""
    if rod not in order or other not in order:
        return True
    return order.count(rod) == order.count(other) == 1 and (order.index(rod) > order.index(other)) != (side == "over")


def _check_conflicts(folder: WrittenFolder) -> Iterator[CheckResult]:
    """The rods that do not alternate, or change their layer, are those that joints.csv lists."""
    weave = read_statement(folder.files["marks.csv"])["weave"]
    joints, rods = folder.table("joints"), folder.table("rods")
    listed = Counter((rod, joint) for joint, row in zip(joints["joint_id"], joints.lists("conflicts")) for rod in row)
    count = float(sum(listed.values()))
    yield CheckResult("order_conflicts_listed", count, float("inf"), tuple(sorted(set(_names(listed)))), _CONFLICTS)
    if weave.startswith(_TWILL):
        over, under = (int(part) for part in weave[len(_TWILL) :].split("/"))
        yield count_of("order_conflict_not_listed", _twill_breaks(folder, set(listed), over, under))
        return
    closed = dict(zip(rods["rod_id"], rods["closed"]))
    found: Counter[tuple[str, str]] = Counter()
    for rod, passes in _sides_along_rods(folder).items():
        row = [*passes, passes[0]] if closed[rod] == "yes" else passes
        for (_, _, before), (_, joint, after) in zip(row, row[1:]):
            if before * after == (1 if weave == "plain" else -1):
                found[rod, joint] += 1
    yield count_of("order_conflict_not_listed", _names(found - listed))
    yield count_of("order_conflict_listed_wrongly", _names(listed - found))


def _twill_breaks(folder: WrittenFolder, listed: set[tuple[str, str]], over: int, under: int) -> list[str]:
    """Where a rod departs from the order of a twill though no conflict is listed.

    A ring goes over ``over`` rods and under ``under``, the rods across it the other way around; this holds from joint
    to joint of a ring and one other rod, and starts again after other joints and where a conflict is listed.
    """
    rods, joints = folder.table("rods"), folder.table("joints")
    rings = {rod for rod, family in zip(rods["rod_id"], rods["family"]) if family == "latitudinal"}
    rows = zip(joints["joint_id"], joints.lists("rods"))
    crossed = {joint for joint, row in rows if len(row) == 2 and len(rings.intersection(row)) == 1}
    broken = []
    for rod, passes in _sides_along_rods(folder).items():
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
    """Whether the sides are a part of the repeated cycle."""
    n = len(cycle)
    return any(all(side == cycle[(start + k) % n] for k, side in enumerate(sides)) for start in range(n))


def _sides_along_rods(folder: WrittenFolder) -> dict[str, _Passes]:
    """The side of every rod at all its nodes in order; a mark on two overlapping pieces counts once."""
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
