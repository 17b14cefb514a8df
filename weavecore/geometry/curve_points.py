"""Points along a curve in space: cleaned, thinned to what tells its shape, and divided again."""

from __future__ import annotations

from typing import Callable

import numpy as np

from weavecore.errors import BadCurve, NonFinite, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints

MOST_POINTS = 20_000
"""A curve that needs more points than this to keep its shape is refused."""

_NEARLY_CLOSED = 1e-3
"""A curve is closed whose ends are nearer to one another than this part of its length."""

_MOST_ROUNDS = 30
_ROUNDING = 1e-12  # of the length of a curve
_ROOM_TO_SQUARE = 1e6  # Lengths of curves with coordinates of which so many are squared do not overflow.
_NEIGHBOURS = 16
"""So many points are looked at about each to find where a curve comes back to itself."""


def clean_curve(points: Floats, tolerance: float) -> tuple[Floats, bool]:
    """A curve without repeated points, and whether it is closed; the first point of a closed one is not repeated.

    Parameters
    ----------
    points : (n, 3) float64
        A closed curve comes back to its first point, or nearly so.
    tolerance : float
        Points no further apart than this are one.

    Raises
    ------
    NonFinite, BadCurve
    """
    if points.ndim != 2 or points.shape[1] != 3:
        raise BadCurve(
            f"An array of the shape {points.shape} is no curve", remedy="Give its points as rows of x, y and z."
        )
    with np.errstate(over="ignore"):
        bad = np.flatnonzero(~np.isfinite(np.square(_ROOM_TO_SQUARE * points)).all(1))
    if len(bad):
        raise NonFinite(
            f"A curve with coordinates that are not finite or far too large, first at point {bad[0]}",
            remedy="Repair its points.",
        )
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    near = max(tolerance, _NEARLY_CLOSED * length)
    keep = np.ones(len(points), bool)
    keep[1:] = np.linalg.norm(np.diff(points, axis=0), axis=1) > _ROUNDING * length
    points = points[keep]
    if len(points) < 2 or length <= tolerance:
        raise BadCurve("A curve without length", remedy="Give two different points at least.")
    is_closed = len(points) > 3 and bool(np.linalg.norm(points[-1] - points[0]) <= near)
    return (points[:-1] if is_closed else points), is_closed


def segments_of(points: Floats, is_closed: bool) -> tuple[Floats, Floats]:
    """Start and end (m, 3) of every segment."""
    return (points, np.roll(points, -1, axis=0)) if is_closed else (points[:-1], points[1:])


def arc_lengths(points: Floats, is_closed: bool) -> Floats:
    """Length (m+1,) along the curve at the start of each segment, and at the end of the last."""
    start, end = segments_of(points, is_closed)
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(end - start, axis=1))])


def thinned(points: Floats, is_closed: bool, slack: Floats) -> Ints:
    """The points that tell the shape of a curve (Douglas and Peucker 1973).

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool
    slack : (n,) float64
        How far each point may lie from what is left.

    Returns
    -------
    (k,) int64
        Rising; the ends of an open curve are among them, and three at least of a closed one.

    Raises
    ------
    TooMuchWork
    """
    n = len(points)
    line = np.concatenate([points, points[:1]]) if is_closed else points
    give = np.concatenate([slack, slack[:1]]) if is_closed else slack
    cuts = [0, len(line) - 1]
    if is_closed:
        far = int(np.argmax(np.linalg.norm(points - points[0], axis=1)))
        off = distance_from_segments(points, points[:1], points[far : far + 1])
        off[[0, far]] = -1
        cuts += [far, int(np.argmax(off))]
    cuts = sorted(set(cuts))
    kept, stack = set(cuts), list(zip(cuts, cuts[1:]))
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        off = distance_from_segments(line[inner], line[first : first + 1], line[last : last + 1]) / give[inner]
        worst = int(np.argmax(off))
        if off[worst] > 1:
            middle = first + 1 + worst
            kept.add(middle)
            stack += [(first, middle), (middle, last)]
            _check_count(len(kept))
    found = np.array(sorted(kept), np.int64)
    return _apart(points, found[found < n], slack, is_closed)


def _apart(points: Floats, kept: Ints, slack: Floats, is_closed: bool) -> Ints:
    """The kept points without those as near to the one before as their slack: hairpins of a line that trembles."""
    last = int(kept[0]) if is_closed else int(kept[-1])
    apart = [int(kept[0])]
    for k in kept[1:].tolist():
        is_clear = all(np.linalg.norm(points[k] - points[other]) > slack[k] for other in (apart[-1], last))
        if is_clear or (k == last and not is_closed):
            apart.append(k)
    return np.array(apart, np.int64) if len(apart) > 2 else kept


def divided(points: Floats, is_closed: bool, longest: Callable[[Floats], Floats]) -> tuple[Floats, Ints]:
    """Halve the segments of a curve until each is short enough.

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool
    longest : callable
        For the middles (m, 3) of segments the longest length (m,) that is allowed there.

    Returns
    -------
    points : (k, 3) float64
    given : (k,) int64
        Which of the given points each is; -1 for a new one.

    Raises
    ------
    TooMuchWork
    """
    given = np.arange(len(points))
    active = np.ones(len(points) if is_closed else len(points) - 1, bool)
    for _ in range(_MOST_ROUNDS):
        start, end = segments_of(points, is_closed)
        rows = np.flatnonzero(active)
        middle = (start[rows] + end[rows]) / 2
        is_long = np.linalg.norm(end[rows] - start[rows], axis=1) > longest(middle)
        split = rows[is_long]
        if len(split) == 0:
            break
        _check_count(len(points) + len(split))
        points = np.insert(points, split + 1, middle[is_long], axis=0)
        given = np.insert(given, split + 1, -1)
        count = np.ones(len(active), np.int64)
        count[split] = 2
        active[:] = False
        active[split] = True
        active = np.repeat(active, count)
    return points, given


def turns(points: Floats, is_closed: bool) -> Floats:
    """Angle (n,) by which a curve turns at each of its points; 0 at the ends of an open one."""
    start, end = segments_of(points, is_closed)
    along = end - start
    before = np.roll(along, 1, axis=0) if is_closed else along[:-1]
    after = along if is_closed else along[1:]
    angle = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), (before * after).sum(1))
    turned: Floats = angle if is_closed else np.concatenate([[0.0], angle, [0.0]])
    return turned


def distance_from_segments(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance of points (n, 3) from segments, one for each point or one for all."""
    along = end - start
    square = (along * along).sum(1)
    part = np.divide(((points - start) * along).sum(1), square, out=np.zeros(len(points)), where=square > 0)
    distance: Floats = np.linalg.norm(points - start - np.clip(part, 0, 1)[:, None] * along, axis=1)
    return distance


def room_beside(points: Floats, is_closed: bool) -> Floats:
    """Distance of each point from the nearest other stretch of the curve, as far as there are any near; else infinite.

    Another stretch is what is three times as far away along the curve as through space.
    """
    from scipy.spatial import cKDTree

    n = len(points)
    along = arc_lengths(points, is_closed)
    start, end = segments_of(points, is_closed)
    near = cKDTree(points).query(points, k=min(_NEIGHBOURS, n))[1].reshape(n, -1)
    room = np.full(n, np.inf)
    for step in (0, -1):  # the segments that begin at a neighbour, and those that end there
        segment = (near + step) % n
        row, column = np.nonzero(segment < len(start))
        other = segment[row, column]
        gap = distance_from_segments(points[row], start[other], end[other])
        way = np.abs(along[row] - (along[other] + along[other + 1]) / 2) - (along[other + 1] - along[other]) / 2
        if is_closed:
            round_about = along[-1] - np.abs(along[row] - (along[other] + along[other + 1]) / 2)
            way = np.minimum(way, round_about - (along[other + 1] - along[other]) / 2)
        is_other = way > 3 * gap + _ROUNDING * along[-1]
        np.minimum.at(room, row[is_other], gap[is_other])
    return room


def _check_count(n: int) -> None:
    if n > MOST_POINTS:
        raise TooMuchWork(
            f"The curve bends so often that more than {MOST_POINTS:,} points would be needed",
            remedy="Give a smoother or a shorter curve.",
        )


def keep_ends(flags: Bools, is_closed: bool) -> Bools:
    """Flags of points, with those of both ends of an open curve set."""
    flags = flags.copy()
    if not is_closed:
        flags[[0, -1]] = True
    return flags
