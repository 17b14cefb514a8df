"""What the report checks of axes: rods touch at their joints, and clash nowhere that is not listed.

Two rods *clash* where their axes are nearer than a diameter by more than `CLASH` of it.  The straight segments between
the points of axes.csv are compared by a k-d tree of their middles; long ones are divided first.  A curve whose chord
is c long lies within κ c² / 8 of it, so pairs whose chords are farther apart than a diameter and twice that are left
out, and the nearest points of the others are found on the curves themselves.  O(n log n) for n segments.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of
from weavecore.fabricating.written_axes import WrittenAxes
from weavecore.geometry.arrays import Floats, Ints, ranks_in_rows, rows_of
from weavecore.geometry.closest import segment_distances
from weavecore.polling import each
from weavecore.tolerances import CLASH

_OWN_REACH = 4.0
"""Points of one rod less than this many diameters apart along it are near each other without touching."""

_JOINT_REACH = 3.0
"""Two rods that touch at a joint are nearest to each other within this many diameters of it."""

_SAME_CLASH = 0.01
"""Part of a diameter by which a stated and a measured distance may differ: rods are sampled at other points."""

_LONGEST_OF_MEDIAN = 2.0
"""Segments longer than so many medians are divided: the longest one decides how many pairs are compared."""

_LOOSE = 0.25
"""Part of a diameter by which rods may be apart at a joint: a tie pulls them together without bending them by more
than this over an edge, which is hundreds of diameters long."""

_PAIRS_AT_ONCE = 100_000
"""Pairs of segments that are compared at once: a bound on memory."""

_CLASHING = (
    "These rods lie nearer to each other than their diameter, mostly at joints in tight curves or at sharp crossings. "
    "They press each other aside by the rest, see clashes.csv; another spacing or the pattern kagome avoids most."
)


def check_axes(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check gaps at joints, and clashes.

    Parameters
    ----------
    folder : WrittenFolder
    """
    yield _check_gaps(folder)
    axes, diameter = folder.axes, folder.diameter
    thickness = np.array([diameter[rod] for rod in axes.ids])
    found = {
        f"{axes.ids[a]}+{axes.ids[b]}": gap / ((thickness[a] + thickness[b]) / 2)
        for (a, b), gap in zip(*_near_pairs(axes, thickness))
    }
    table = folder.table("clashes")
    stated = {}
    for one, other, gap in zip(table["rod_id"], table["other_rod"], table.floats("distance").tolist()):
        a, b = sorted((axes.rod_of[one], axes.rod_of[other]))
        stated[f"{axes.ids[a]}+{axes.ids[b]}"] = gap / ((thickness[a] + thickness[b]) / 2)
    certain = [name for name, gap in found.items() if gap < 1.0 - CLASH - _SAME_CLASH]
    clashing = tuple(sorted({*certain, *stated}))
    yield CheckResult("rods_that_clash", float(len(clashing)), 0.0, clashing, _CLASHING)
    yield count_of("clash_not_listed", [name for name in certain if name not in stated])
    off = {name: abs(found.get(name, 1.0 - CLASH) - gap) for name, gap in stated.items()}
    yield greatest_of("clash_distance_off_diameters", np.array(list(off.values())), _SAME_CLASH, list(off))


def _check_gaps(folder: WrittenFolder) -> CheckResult:
    """Rods that follow each other in the order of a joint touch there; nearer than that, they clash."""
    joints, axes, diameter = folder.table("joints"), folder.axes, folder.diameter
    marks = folder.table("marks")
    stations: dict[tuple[str, str], set[float]] = {}
    for joint, rod, at in zip(marks["joint_id"], marks["rod_id"], marks.floats("station").tolist()):
        stations.setdefault((joint, rod), set()).add(at)
    # A rod that passes a joint twice has two stations there: the nearest of their pairs counts.
    rods: list[tuple[int, int]] = []
    places: list[tuple[float, float]] = []
    contact: list[int] = []
    names: list[str] = []
    for joint, order in zip(joints["joint_id"], joints.lists("order")):
        for one, other in zip(order, order[1:]):
            tried = [
                pair
                for pair in product(stations.get((joint, one), ()), stations.get((joint, other), ()))
                if one != other or pair[0] != pair[1]
            ]
            rods += [(axes.rod_of[one], axes.rod_of[other])] * len(tried)
            places += tried
            contact += [len(names)] * len(tried)
            names += [joint] * bool(tried)
    pairs, at = np.array(rods, np.int64).reshape(-1, 2), np.array(places, np.float64).reshape(-1, 2)
    thickness = np.array([diameter[rod] for rod in axes.ids])[pairs]
    gap = np.full(len(names), np.inf)
    np.minimum.at(gap, contact, axes.gaps(pairs, at, _JOINT_REACH * thickness) / thickness.mean(1))
    return greatest_of("joint_gap_diameters", gap - 1.0, _LOOSE, names)


def _near_pairs(axes: WrittenAxes, thickness: Floats) -> tuple[list[tuple[int, int]], list[float]]:
    """Pairs of rods nearer than the mean of their diameters (R,), and how near; the nearest of each pair once."""
    reach = float(thickness.max(initial=0.0))
    rod, low, high, slack = _segments(axes)
    (a, _), (b, _) = axes.at(rod, low), axes.at(rod, high)
    length = np.linalg.norm(b - a, axis=1)
    tree = cKDTree((a + b) / 2)
    pairs = tree.query_pairs(reach + float((length + 2 * slack).max(initial=0.0)), output_type="ndarray")

    def nearer_than_thick(i: Ints, j: Ints) -> tuple[Ints, Ints]:
        """The pairs of segments that may be too near, neighbours on one rod left out."""
        apart = _apart(axes, rod, low, high, i, j)
        i, j = (k[~((rod[i] == rod[j]) & (apart < _OWN_REACH * reach))] for k in (i, j))
        distance, _ = segment_distances(a[i], b[i], a[j], b[j])
        near = distance < (thickness[rod[i]] + thickness[rod[j]]) / 2 + slack[i] + slack[j]
        return i[near], j[near]

    parts = (pairs[begin : begin + _PAIRS_AT_ONCE].T for begin in range(0, len(pairs), _PAIRS_AT_ONCE))
    found = [nearer_than_thick(*part) for part in each(parts)]
    i, j = (np.concatenate([np.zeros(0, np.int64), *columns]) for columns in (zip(*found) if found else ((), ())))
    wanted = (thickness[rod[i]] + thickness[rod[j]]) / 2
    ends = np.stack([low[i], low[j]], axis=1), np.stack([high[i], high[j]], axis=1)
    gap = axes.gaps(np.stack([rod[i], rod[j]], axis=1), (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2)
    close = gap < wanted
    key = np.sort(np.stack([rod[i[close]], rod[j[close]]], axis=1), axis=1)
    order = np.lexsort([gap[close], key[:, 1], key[:, 0]])
    unique, first = np.unique(key[order], axis=0, return_index=True)
    return [(one, other) for one, other in unique.tolist()], gap[close][order][first].tolist()


def _segments(axes: WrittenAxes) -> tuple[Ints, Floats, Floats, Floats]:
    """Segments (n,): rod, stations of both ends, and how far the curve may be from the chord."""
    a = axes.spans
    rod = rows_of(axes.offsets)[a]
    width = axes.stations[a + 1] - axes.stations[a]
    counts = np.maximum(np.ceil(width / (_LONGEST_OF_MEDIAN * np.median(width)) if len(width) else width), 1)
    counts = counts.astype(np.int64)
    part = np.repeat(width / counts, counts)
    low = np.repeat(axes.stations[a], counts) + ranks_in_rows(counts) * part
    # Twice the greater of the two curvatures: a spline may bend more between its points than at them.
    bend = np.repeat(2 * np.maximum(axes.curvatures[a], axes.curvatures[a + 1]), counts)
    return np.repeat(rod, counts), low, low + part, bend * part**2 / 8


def _apart(axes: WrittenAxes, rod: Ints, low: Floats, high: Floats, i: Ints, j: Ints) -> Floats:
    """(m,) length of rod between two segments (m,) of one rod; around a ring the shorter way."""
    first, second = np.where(low[i] <= low[j], i, j), np.where(low[i] <= low[j], j, i)
    ahead = low[second] - high[first]
    around = np.where(axes.closed[rod[i]], axes.ends[rod[i]], np.inf)
    apart: Floats = np.minimum(ahead, low[first] + around - high[second])
    return apart
