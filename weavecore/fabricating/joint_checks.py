"""What the report checks of marks, joints, axes and the sequence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from weavecore.fabricating.written_folder import Axes, Finding, Folder, ReadTable, count, statement_of, worst
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.closest import segment_distances

MARK_LIMIT, NODE_LIMIT, GAP_LIMIT = 0.1, 0.2, 0.1
_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are near each other by right."""

_JOINT_REACH = 3.0
"""Two rods that touch at a joint are nearest to each other within so many diameters of it."""


def check_marks(folder: Folder) -> Iterator[Finding]:
    """Both sides of every joint tell the same, and every mark is where its piece has it."""
    marks, rods, pieces = folder.table("marks"), folder.table("rods"), folder.table("pieces")
    rows = [k for k, other in enumerate(marks["other_rod"]) if other]
    station, other_station = marks.floats("station"), marks.floats("other_station")
    there: dict[tuple[str, str, str], list[float]] = {}
    for k in rows:
        there.setdefault((marks["joint_id"][k], marks["rod_id"][k], marks["other_rod"][k]), []).append(station[k])
    off = np.array(
        [
            min(
                (abs(at - other_station[k]) for at in there.get(_from_the_other_side(marks, k), [])),
                default=float("nan"),
            )
            for k in rows
        ]
    )
    yield worst("mark_sides_differ_mm", off, MARK_LIMIT, [marks["joint_id"][k] for k in rows])
    length = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    begin = dict(zip(pieces["piece_id"], pieces.floats("from").tolist()))
    long = np.array([length.get(rod, np.nan) for rod in marks["rod_id"]])
    off = marks.floats("from_start") + np.array([begin.get(piece, np.nan) for piece in marks["piece_id"]]) - station
    off = np.abs(off - np.round(off / long) * long)
    yield worst("mark_off_its_station_mm", off, 0.003, marks["piece_id"])


def _from_the_other_side(marks: ReadTable, k: int) -> tuple[str, str, str]:
    return marks["joint_id"][k], marks["other_rod"][k], marks["rod_id"][k]


def check_nodes(folder: Folder) -> Iterator[Finding]:
    """Every node is found again from the marks and the axes alone."""
    joints = folder.table("joints")
    names, nodes = rebuild_nodes(folder.table("marks"), folder.axes)
    found = dict(zip(names, nodes))
    told = np.stack([joints.floats(name) for name in ("x", "y", "z")], axis=1)
    rebuilt = np.array([found.get(name, np.full(3, np.nan)) for name in joints["joint_id"]]).reshape(-1, 3)
    yield worst("node_rebuilt_off_mm", np.linalg.norm(rebuilt - told, axis=1), NODE_LIMIT, joints["joint_id"])


def check_over_under(folder: Folder) -> Iterator[Finding]:
    """One rod of each pair is over, as the order at the joint says; what does not go on as it should is listed."""
    marks, joints = folder.table("marks"), folder.table("joints")
    place = dict(zip(joints["joint_id"], joints.lists("order")))
    pairs: dict[tuple[str, str, str], list[str]] = {}
    contrary = []
    for joint, rod, other, side in zip(marks["joint_id"], marks["rod_id"], marks["other_rod"], marks["over_under"]):
        if not other:
            continue
        pairs.setdefault((joint, min(rod, other), max(rod, other)), []).append(side)
        if _contradicts(place.get(joint, []), rod, other, side):
            contrary.append(joint)
    yield count("joint_without_one_over", [key[0] for key, sides in pairs.items() if set(sides) != {"over", "under"}])
    yield count("joint_order_not_as_marked", contrary)


def _contradicts(order: list[str], rod: str, other: str, side: str) -> bool:
    """Whether the order of a joint is not as a mark says; of a rod that passes it twice either place may be meant."""
    if rod not in order or other not in order:
        return True
    return order.count(rod) == order.count(other) == 1 and (order.index(rod) > order.index(other)) != (side == "over")


def check_axes(folder: Folder) -> Iterator[Finding]:
    """Rods touch where they should, and nowhere cut into each other."""
    joints, axes, diameter = folder.table("joints"), folder.axes, folder.diameter
    rods = folder.table("rods")
    segments = _Segments(axes, {rod for rod, closed in zip(rods["rod_id"], rods["closed"]) if closed == "yes"})
    thick = np.array([diameter[rod] for rod in axes.ids])
    least, pairs = segments.near_pairs(thick)
    touching: dict[tuple[str, str], list[str]] = {}
    for joint, order in zip(joints["joint_id"], joints.lists("order")):
        for one, other in zip(order, order[1:]):
            touching.setdefault((min(one, other), max(one, other)), []).append(joint)
    places = dict(zip(joints["joint_id"], np.stack([joints.floats(c) for c in ("x", "y", "z")], axis=1)))
    gaps, at = [], []
    for (one, other), names in touching.items():
        key = (axes.rod_of[one], axes.rod_of[other])
        wanted = (thick[key[0]] + thick[key[1]]) / 2
        for name in names:
            gaps.append(abs(segments.gap(key, places[name], _JOINT_REACH * wanted) - wanted))
            at.append(name)
    yield worst("axis_gap_at_joint_off_mm", np.array(gaps), GAP_LIMIT, at)
    near = [
        f"{axes.ids[a]}+{axes.ids[b]}"
        for (a, b), gap in zip(pairs, least)
        if gap < (thick[a] + thick[b]) / 2 - GAP_LIMIT
    ]
    yield count("rods_that_cut_into_each_other", near)


class _Segments:
    """The straight pieces of all axes, to be searched."""

    def __init__(self, axes: Axes, closed: set[str]) -> None:
        rod = rows_of(axes.offsets)
        self.start = np.flatnonzero(np.diff(rod) == 0)
        self.rod = rod[self.start]
        self.station = axes.station[self.start]
        self.a, self.b = axes.point[self.start], axes.point[self.start + 1]
        self.tree = cKDTree((self.a + self.b) / 2)
        self.reach = np.linalg.norm(self.b - self.a, axis=1)
        self.longest = float(self.reach.max(initial=0.0))
        self.closed = np.array([rod in closed for rod in axes.ids], bool)
        self.length = np.array([axes.station[axes.rod(k)][-1] for k in range(len(axes.ids))])

    def gap(self, rods: tuple[int, int], place: Floats, reach: float) -> float:
        """Least distance of two rods near a place."""
        near = np.array(self.tree.query_ball_point(place, reach + self.longest), np.int64)
        one, other = near[self.rod[near] == rods[0]], near[self.rod[near] == rods[1]]
        i, j = (grid.ravel() for grid in np.meshgrid(one, other, indexing="ij"))
        if rods[0] == rods[1]:
            apart = self._apart(i, j) > reach
            i, j = i[apart], j[apart]
        distance, _ = segment_distances(self.a[i], self.b[i], self.a[j], self.b[j])
        return float(distance.min(initial=np.inf))

    def near_pairs(self, thick: Floats) -> tuple[list[float], list[tuple[int, int]]]:
        """Pairs of rods that come nearer than they are thick, and how near; places beside each other on a rod apart."""
        reach = float(thick.max(initial=0.0))
        pairs = self.tree.query_pairs(reach + self.longest, output_type="ndarray").astype(np.int64)
        i, j = pairs.T
        own = (self.rod[i] == self.rod[j]) & (self._apart(i, j) < _OWN_REACH * reach)
        i, j = i[~own], j[~own]
        distance, _ = segment_distances(self.a[i], self.b[i], self.a[j], self.b[j])
        close = distance < (thick[self.rod[i]] + thick[self.rod[j]]) / 2
        key = np.sort(np.stack([self.rod[i[close]], self.rod[j[close]]], axis=1), axis=1)
        order = np.lexsort([distance[close], key[:, 1], key[:, 0]])
        unique, first = np.unique(key[order], axis=0, return_index=True)
        return distance[close][order][first].tolist(), [(a, b) for a, b in unique.tolist()]

    def _apart(self, i: Ints, j: Ints) -> Floats:
        """Length of rod between two pieces of one rod; around a ring the shorter way."""
        i, j = np.where(self.station[i] <= self.station[j], i, j), np.where(self.station[i] <= self.station[j], j, i)
        ahead = self.station[j] - self.station[i] - self.reach[i]
        behind = self.station[i] + np.where(self.closed[self.rod[i]], self.length[self.rod[i]], np.inf)
        apart: Floats = np.minimum(ahead, behind - self.station[j] - self.reach[j])
        return apart


def check_sequence(folder: Folder) -> Iterator[Finding]:
    """Each rod is set once and after what it needs; each joint is tied once, when all its rods stand."""
    sequence, rods, joints = (folder.table(name) for name in ("sequence", "rods", "joints"))
    steps = [int(step) for step in sequence["step"]]
    step_of = dict(zip(sequence["rod"], steps))
    times = Counter(sequence["rod"])
    yield count(
        "rod_not_set_once", [rod for rod in {*times, *rods["rod_id"]} if times[rod] != 1 or rod not in rods["rod_id"]]
    )
    early = [
        rod
        for rod, step, row in zip(sequence["rod"], steps, sequence.lists("after"))
        if any(int(s) >= step for s in row)
    ]
    yield count("rod_set_before_what_it_needs", early)
    generation = dict(zip(rods["rod_id"], map(int, rods["generation"])))
    rings = [rod for rod, action in zip(sequence["rod"], sequence["action"]) if action.startswith("set ")]
    falls = [b for a, b in zip(rings, rings[1:]) if generation.get(b, 0) < generation.get(a, 0)]
    yield count("ring_set_before_its_parents", falls)
    tied = [(joint, step) for step, row in zip(steps, sequence.lists("joints_to_tie")) for joint in row]
    tie_times = Counter(joint for joint, _ in tied)
    yield count("joint_not_tied_once", [j for j in {*tie_times, *joints["joint_id"]} if tie_times[j] != 1])
    stands = {
        j: max((step_of.get(rod, 0) for rod in row), default=0)
        for j, row in zip(joints["joint_id"], joints.lists("rods"))
    }
    yield count(
        "joint_tied_before_its_rods_stand", [joint for joint, step in tied if stands.get(joint, step + 1) > step]
    )


# ----------------------------------------------------------------------
# Where the nodes are, from the marks and the axes alone.
#
# At a node each rod lies its ``layer_offset`` out of the surface along one normal: p = node + offset · n.  Two rods at
# different heights tell both; a rod that is alone lies on the node.


def rebuild_nodes(marks: ReadTable, axes: Axes) -> tuple[list[str], Floats]:
    """Names of the joints and nodes that the marks tell of, sorted, and where they are (n, 3).

    A joint all rods of which lie at one height is not a number.
    """
    joints = [*marks["joint_id"], *(joint for joint, other in zip(marks["joint_id"], marks["other_rod"]) if other)]
    rods = [*marks["rod_id"], *(other for other in marks["other_rod"] if other)]
    other = marks.floats("other_station")
    stations = np.concatenate([marks.floats("station"), other[~np.isnan(other)]])
    # A joint's rods are named by several marks; each counts once.
    known = sorted(set(zip(joints, rods, stations.tolist())))
    names, group = np.unique([joint for joint, _, _ in known], return_inverse=True)
    rows = axes.rows_at([rod for _, rod, _ in known], np.array([station for _, _, station in known]))
    point, height = axes.point[rows], axes.layer_offset[rows]
    n = len(names)
    weight = np.bincount(group, minlength=n)
    mean_height = np.bincount(group, height, minlength=n) / weight
    mean_point = np.stack([np.bincount(group, point[:, k], minlength=n) / weight for k in range(3)], axis=1)
    rise = height - mean_height[group]
    spread = np.bincount(group, rise * rise, minlength=n)
    climb = np.stack([np.bincount(group, rise * point[:, k], minlength=n) for k in range(3)], axis=1)
    flat = spread < 1e-6
    normal = np.divide(climb, spread[:, None], out=np.zeros_like(climb), where=~flat[:, None])
    # Without a difference of heights the nodes are known only where the rods lie on them.
    nodes = mean_point - mean_height[:, None] * normal
    nodes[flat & (np.abs(mean_height) > 1e-6)] = np.nan
    return names.tolist(), nodes


# ----------------------------------------------------------------------
# Whether the order along the rods goes on as the weave says, and what does not is listed.
#
# A *side* is 1 where a rod lies over all others of a joint, -1 where it lies under all, 0 between and at a node that it
# passes alone.

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
