"""What the report checks of marks, nodes, the order at joints, axes and the sequence.

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
from scipy.spatial import cKDTree

from weavecore.fabricating.csv_tables import ReadTable, read_statement
from weavecore.fabricating.folder_reader import CheckResult, WrittenAxes, WrittenFolder, count_of, greatest_of
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.closest import segment_distances
from weavecore.polling import each

_MARK_LIMIT = 0.1
"""How far the two rods of a joint may put it apart along a rod, in millimetres."""

_STATION_LIMIT = 0.003
"""How far a mark may be from its station, in millimetres: three numbers rounded to a micrometre."""

_NODE_LIMIT = 0.2
"""How far a rebuilt node may be from the one in joints.csv, in millimetres, on models of metres."""

_PAIRS_AT_ONCE = 100_000
"""Pairs of segments that are compared at once, between two polls."""

_GAP_LIMIT = 0.1
"""How far the gap of two axes at a joint may be from the mean of their diameters, in millimetres."""

_OWN_REACH = 4.0
"""Points of one rod less than this many diameters apart along it are near each other without touching."""

_JOINT_REACH = 3.0
"""Two rods that touch at a joint are nearest to each other within this many diameters of it."""

_SAME_OFFSET = 1e-6
"""Layer offsets that differ by less, in millimetres (their sum of squares in mm²), are equal: they give no normal."""

_TWILL = "twill "

_Passes = list[tuple[float, str, int]]
"""Station, joint and side, along a rod."""


def check_joints(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check marks, nodes, the order at joints and along rods, axes and the sequence.

    Parameters
    ----------
    folder : WrittenFolder
    """
    for check in (_check_marks, _check_nodes, _check_over_under, _check_conflicts, _check_axes, _check_sequence):
        yield from check(folder)


def _check_marks(folder: WrittenFolder) -> Iterator[CheckResult]:
    """The marks of both rods of a joint agree, and every mark is at its station on its piece."""
    marks, rods, pieces = folder.table("marks"), folder.table("rods"), folder.table("pieces")
    rows = [k for k, other in enumerate(marks["other_rod"]) if other]
    station, other_station = marks.floats("station"), marks.floats("other_station")
    there: dict[tuple[str, str, str], list[float]] = {}
    for k in rows:
        there.setdefault((marks["joint_id"][k], marks["rod_id"][k], marks["other_rod"][k]), []).append(station[k])
    off = np.array(
        [
            min(
                (abs(at - other_station[k]) for at in there.get(_seen_from_other_rod(marks, k), [])),
                default=float("nan"),
            )
            for k in rows
        ]
    )
    yield greatest_of("mark_sides_differ_mm", off, _MARK_LIMIT, [marks["joint_id"][k] for k in rows])
    length = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    begin = dict(zip(pieces["piece_id"], pieces.floats("from").tolist()))
    long = np.array([length.get(rod, np.nan) for rod in marks["rod_id"]])
    off = marks.floats("from_start") + np.array([begin.get(piece, np.nan) for piece in marks["piece_id"]]) - station
    off = np.abs(off - np.round(off / long) * long)
    yield greatest_of("mark_off_its_station_mm", off, _STATION_LIMIT, marks["piece_id"])


def _seen_from_other_rod(marks: ReadTable, k: int) -> tuple[str, str, str]:
    return marks["joint_id"][k], marks["other_rod"][k], marks["rod_id"][k]


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
    yield CheckResult("order_conflicts_listed", float(sum(listed.values())), float("inf"), _names(listed))
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


def _check_axes(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Rods touch at their joints and do not intersect elsewhere."""
    joints, axes, diameter = folder.table("joints"), folder.axes, folder.diameter
    rods = folder.table("rods")
    segments = _AxisSegments(axes, {rod for rod, closed in zip(rods["rod_id"], rods["closed"]) if closed == "yes"})
    thickness = np.array([diameter[rod] for rod in axes.ids])
    least, pairs = segments.near_pairs(thickness)
    touching: dict[tuple[str, str], list[str]] = {}
    for joint, order in zip(joints["joint_id"], joints.lists("order")):
        for one, other in zip(order, order[1:]):
            touching.setdefault((min(one, other), max(one, other)), []).append(joint)
    places = dict(zip(joints["joint_id"], np.stack([joints.floats(c) for c in ("x", "y", "z")], axis=1)))
    gaps, at = [], []
    for (one, other), names in each(touching.items()):
        key = (axes.rod_of[one], axes.rod_of[other])
        wanted = (thickness[key[0]] + thickness[key[1]]) / 2
        for name in names:
            gaps.append(abs(segments.gap(key, places[name], _JOINT_REACH * wanted) - wanted))
            at.append(name)
    yield greatest_of("axis_gap_at_joint_off_mm", np.array(gaps), _GAP_LIMIT, at)
    near = [
        f"{axes.ids[a]}+{axes.ids[b]}"
        for (a, b), gap in zip(pairs, least)
        if gap < (thickness[a] + thickness[b]) / 2 - _GAP_LIMIT
    ]
    yield count_of("rods_that_intersect", near)


def _parts_of(pairs: Ints) -> list[Ints]:
    """The pairs (n, 2) in parts that take a fraction of a second; one part at least."""
    return np.array_split(pairs, len(pairs) // _PAIRS_AT_ONCE + 1)


class _AxisSegments:
    """The straight segments (n,) between the points of all axes, in a k-d tree of their middles."""

    def __init__(self, axes: WrittenAxes, closed: set[str]) -> None:
        rod = rows_of(axes.offsets)
        self.start = np.flatnonzero(np.diff(rod) == 0)
        self.rod = rod[self.start]
        self.station = axes.stations[self.start]
        self.a, self.b = axes.points[self.start], axes.points[self.start + 1]
        self.tree = cKDTree((self.a + self.b) / 2)
        self.reach = np.linalg.norm(self.b - self.a, axis=1)
        self.longest = float(self.reach.max(initial=0.0))
        self.closed = np.array([rod in closed for rod in axes.ids], bool)
        self.length = np.array([axes.stations[axes.rod(k)][-1] for k in range(len(axes.ids))])

    def gap(self, rods: tuple[int, int], place: Floats, reach: float) -> float:
        """Least distance of two rods within ``reach`` of a place (3,)."""
        near = np.array(self.tree.query_ball_point(place, reach + self.longest), np.int64)
        one, other = near[self.rod[near] == rods[0]], near[self.rod[near] == rods[1]]
        i, j = (grid.ravel() for grid in np.meshgrid(one, other, indexing="ij"))
        if rods[0] == rods[1]:
            apart = self._apart(i, j) > reach
            i, j = i[apart], j[apart]
        distance, _ = segment_distances(self.a[i], self.b[i], self.a[j], self.b[j])
        return float(distance.min(initial=np.inf))

    def near_pairs(self, thickness: Floats) -> tuple[list[float], list[tuple[int, int]]]:
        """Pairs of rods nearer than the mean of their diameters (R,), and how near; a rod is not its own neighbour."""
        reach = float(thickness.max(initial=0.0))
        pairs = self.tree.query_pairs(reach + self.longest, output_type="ndarray").astype(np.int64)
        found = [self._close_pairs(part[:, 0], part[:, 1], thickness, reach) for part in each(_parts_of(pairs))]
        distance, i, j = (np.concatenate(part) for part in zip(*found))
        key = np.sort(np.stack([self.rod[i], self.rod[j]], axis=1), axis=1)
        order = np.lexsort([distance, key[:, 1], key[:, 0]])
        unique, first = np.unique(key[order], axis=0, return_index=True)
        return distance[order][first].tolist(), [(a, b) for a, b in unique.tolist()]

    def _close_pairs(self, i: Ints, j: Ints, thickness: Floats, reach: float) -> tuple[Floats, Ints, Ints]:
        """Those of the pairs of segments (m,) that are nearer than the mean of their diameters, and how near."""
        own = (self.rod[i] == self.rod[j]) & (self._apart(i, j) < _OWN_REACH * reach)
        i, j = i[~own], j[~own]
        distance, _ = segment_distances(self.a[i], self.b[i], self.a[j], self.b[j])
        close = distance < (thickness[self.rod[i]] + thickness[self.rod[j]]) / 2
        return distance[close], i[close], j[close]

    def _apart(self, i: Ints, j: Ints) -> Floats:
        """(m,) length of rod between two segments (m,) of one rod; around a ring the shorter way."""
        i, j = np.where(self.station[i] <= self.station[j], i, j), np.where(self.station[i] <= self.station[j], j, i)
        ahead = self.station[j] - self.station[i] - self.reach[i]
        behind = self.station[i] + np.where(self.closed[self.rod[i]], self.length[self.rod[i]], np.inf)
        apart: Floats = np.minimum(ahead, behind - self.station[j] - self.reach[j])
        return apart


def _check_sequence(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Each rod is set once and after those it needs; each joint is tied once, when all its rods are set."""
    sequence, rods, joints = (folder.table(name) for name in ("sequence", "rods", "joints"))
    steps = [int(step) for step in sequence["step"]]
    step_of = dict(zip(sequence["rod"], steps))
    times = Counter(sequence["rod"])
    yield count_of(
        "rod_not_set_once", [rod for rod in {*times, *rods["rod_id"]} if times[rod] != 1 or rod not in rods["rod_id"]]
    )
    early = [
        rod
        for rod, step, row in zip(sequence["rod"], steps, sequence.lists("after"))
        if any(int(s) >= step for s in row)
    ]
    yield count_of("rod_set_before_what_it_needs", early)
    generation = dict(zip(rods["rod_id"], map(int, rods["generation"])))
    rings = [rod for rod, action in zip(sequence["rod"], sequence["action"]) if action.startswith("set ")]
    falls = [b for a, b in zip(rings, rings[1:]) if generation.get(b, 0) < generation.get(a, 0)]
    yield count_of("ring_set_before_its_parents", falls)
    tied = [(joint, step) for step, row in zip(steps, sequence.lists("joints_to_tie")) for joint in row]
    tie_times = Counter(joint for joint, _ in tied)
    yield count_of("joint_not_tied_once", [j for j in {*tie_times, *joints["joint_id"]} if tie_times[j] != 1])
    set_in = {
        j: max((step_of.get(rod, 0) for rod in row), default=0)
        for j, row in zip(joints["joint_id"], joints.lists("rods"))
    }
    yield count_of(
        "joint_tied_before_its_rods_are_set", [joint for joint, step in tied if set_in.get(joint, step + 1) > step]
    )
