"""Sampling of a curve on a mesh: simplified to the points that define its shape, then divided to about the edges
below it.

1.  The curve is cleaned of repeated points, and projected onto the mesh. 2.  It is simplified (Douglas and Peucker
1973) to a part of the edges below it, and to a part of the distance at which it comes
   back to itself, so that neighbouring stretches keep their order.
3. Its segments are halved until they are no longer than the edges below them.  Kinks and ends are kept exactly.

Work: that of the closest faces, and n log n for n points, apart from the worst case of the simplification (n²).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from weavecore.errors import BadCurve, NonFinite, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import FaceFinder

_EXTENT = 0.1
"""Of a curve's extent: counts as an edge where the edges below it are longer, so that a small curve on large faces
keeps its shape."""

_SLACK_OF_ROOM = 0.1
"""Of the distance to where a curve comes back to itself: the accuracy of its shape there, so that nothing crosses."""

_MAX_ROUNDS = 4  # of simplification: the room beside a curve changes with its points, but hardly after the second round
_KINK = np.radians(30)  # from here a turn is a kink, which stays in place
_SHARP = np.radians(120)  # from here a kink's own sides lie beside one another
_SHORTEST = 0.1  # of the least height of a face below it: a shorter curve has no edge of its own

_FAR_OF_EDGE, _FAR, _FAR_BETWEEN = 0.25, 0.02, 0.1
"""How far the points of a curve may lie off the mesh, as parts of the edge there or of the mesh's size (the greater
counts), and how far the chords between them, as a part of its size: more is a wrong unit or another surface."""

MAX_POINTS = 20_000
"""A curve that needs more points than this to keep its shape is refused: it is embedded point by point."""

_NEARLY_CLOSED = 1e-3
"""Of a curve's length: a curve is closed if its ends are nearer to one another."""

_MAX_DIVISIONS = 30
_ROUNDING = 1e-12  # of the length of a curve
_SAFE_FACTOR = 1e6  # coordinates so many times greater can be squared, so lengths of the curve do not overflow

_NEIGHBOURS = 16
"""Nearest points that are searched to find where a curve comes back to itself."""


@dataclass(frozen=True, eq=False)
class CurveOnMesh:
    """A curve as points on a mesh.

    Parameters
    ----------
    places : (n, 3) float64
        On the mesh.
    face : (n,) int64
        The face that each lies on.
    is_closed : bool
    is_exact : (n,) bool
        Whether a place may not be moved: a kink, or an end.
    room : (n,) float64
        Distance to where the curve comes back to itself; infinite where it does not.
    edge : (n,) float64
        Mean edge of the face below each point.
    height : (n,) float64
        Least height of that face.
    """

    places: Floats
    face: Ints
    is_closed: bool
    is_exact: Bools
    room: Floats
    edge: Floats
    height: Floats

    def take(self, rows: Ints) -> CurveOnMesh:
        """Some of the points."""
        kept = (self.is_exact[rows], self.room[rows], self.edge[rows], self.height[rows])
        return CurveOnMesh(self.places[rows], self.face[rows], self.is_closed, *kept)


class _MeshBelow:
    """The mesh on which a curve lies."""

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        self._finder = FaceFinder(vertices, faces)
        corners = vertices[faces]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        self.mean_side = sides.mean(1)
        self.height = area / sides.max(1)
        self.size = float(np.linalg.norm(np.ptp(vertices, axis=0)))

    def below(self, points: Floats) -> tuple[Ints, Floats, Floats]:
        """Face below each point, place on it and distance from it.

        Parameters
        ----------
        points : (n, 3) float64

        Returns
        -------
        face : (n,) int64
        place : (n, 3) float64
        distance : (n,) float64
        """
        face, place = self._finder.find(points)
        return face, place, np.linalg.norm(points - place, axis=1)

    def side_at(self, points: Floats) -> Floats:
        """Mean side of the face below each point."""
        side: Floats = self.mean_side[self.below(points)[0]]
        return side


def curve_on_mesh(
    vertices: Floats, faces: Ints, curve: Floats, *, tolerance: float, slack: float, least: float
) -> CurveOnMesh:
    """Sample a curve on the mesh that it lies on or near.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    curve : (n, 3) float64
        Points along it; a closed one comes back to its first.
    tolerance : float
        In the unit of the vertices.
    slack : float
        Accuracy of its shape, as a part of the edges below it or of a tenth of its extent.
    least : float
        The same where it comes back to itself, however near.

    Returns
    -------
    CurveOnMesh

    Raises
    ------
    BadCurve
        If it is too far off, or too short.
    NonFinite, TooMuchWork
    """
    points, is_closed = _cleaned(curve, tolerance)
    mesh = _MeshBelow(vertices, faces)
    face, place, gap = mesh.below(points)
    side = mesh.mean_side[face]
    _refuse_far(points, gap, np.maximum(_FAR_OF_EDGE * side, max(tolerance, _FAR * mesh.size)))
    is_new = np.append(True, (place[1:] != place[:-1]).any(1))
    points, side, face = place[is_new], side[is_new], face[is_new]
    start, end = segments_of(points, is_closed)
    length = float(np.linalg.norm(end - start, axis=1).sum())
    if length <= _SHORTEST * mesh.height[face].min():
        raise BadCurve(
            f"A curve of the length {length:.4g} is too short for a mesh with edges of {side.min():.4g}",
            remedy="Give a longer one, or a finer mesh.",
        )
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    unit = np.minimum(side, _EXTENT * extent)
    line, is_exact, room = _shape_points(points, is_closed, slack * unit, least * unit, mesh)
    below, place, gap = mesh.below(line)
    _refuse_far(line, gap, np.full(len(line), max(tolerance, _FAR_BETWEEN * mesh.size)))
    return CurveOnMesh(place, below, is_closed, is_exact, room, mesh.mean_side[below], mesh.height[below])


def _shape_points(
    points: Floats, is_closed: bool, slack: Floats, least: Floats, mesh: _MeshBelow
) -> tuple[Floats, Bools, Floats]:
    """Points that define the shape of a curve, whether each must stay in place, and the room beside it."""
    for _ in range(_MAX_ROUNDS):
        kept = _simplified(points, is_closed, slack)
        line, given = _divided(points[kept], is_closed, mesh.side_at)
        room = _room_beside(line, is_closed)
        rough = _SLACK_OF_ROOM * room
        # What a stretch has beside it bounds how far its own points may lie off what is left of it.
        owner = np.maximum.accumulate(np.where(given >= 0, given, 0))
        allowed = np.full(len(kept), np.inf)
        np.minimum.at(allowed, owner, rough)
        np.minimum.at(allowed, (owner + 1) % len(kept), rough)
        span = np.searchsorted(kept, np.arange(len(points)), side="right") - 1
        wanted = np.maximum(np.minimum(allowed[span], allowed[(span + 1) % len(kept)]), least)
        if not (wanted < slack).any():
            break
        slack = np.minimum(slack, wanted)
    is_given, turn = given >= 0, _turns(points[kept], is_closed)
    is_exact = np.zeros(len(line), bool)
    is_exact[is_given] = _with_ends(turn > _KINK, is_closed)
    room[np.flatnonzero(is_given)[turn > _SHARP]] = 0.0  # both sides come together there
    return line, is_exact, room


def _refuse_far(points: Floats, gap: Floats, most: Floats) -> None:
    worst = int(np.argmax(gap - most))
    if gap[worst] > most[worst]:
        x, y, z = points[worst].tolist()
        raise BadCurve(
            f"The curve lies up to {gap[worst]:.4g} off the surface, near ({x:.6g}, {y:.6g}, {z:.6g})",
            remedy="Pull or project it onto the surface, or check that both have the same unit.",
        )


def _cleaned(points: Floats, tolerance: float) -> tuple[Floats, bool]:
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
            f"A curve must be an array of shape (n, 3) (got {points.shape})",
            remedy="Give its points as rows of x, y and z.",
        )
    with np.errstate(over="ignore"):
        bad = np.flatnonzero(~np.isfinite(np.square(_SAFE_FACTOR * points)).all(1))
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
    """Start and end of every segment of a curve.

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool

    Returns
    -------
    start, end : (m, 3) float64
        n segments of a closed curve, n - 1 of an open one.
    """
    return (points, np.roll(points, -1, axis=0)) if is_closed else (points[:-1], points[1:])


def _arc_lengths(points: Floats, is_closed: bool) -> Floats:
    """Length along a curve at the start of each segment, and at the end of the last.

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool

    Returns
    -------
    (m+1,) float64
    """
    start, end = segments_of(points, is_closed)
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(end - start, axis=1))])


def _simplified(points: Floats, is_closed: bool, slack: Floats) -> Ints:
    """Simplify a curve to the points that define its shape (Douglas and Peucker 1973).

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool
    slack : (n,) float64
        How far each point may lie from what is left.

    Returns
    -------
    (k,) int64
        Rising; the ends of an open curve are among them, and at least three of a closed one.

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
    """The kept points without those as near to the one before as their slack: hairpins of a trembling line."""
    last = int(kept[0]) if is_closed else int(kept[-1])
    apart = [int(kept[0])]
    for k in kept[1:].tolist():
        is_clear = all(np.linalg.norm(points[k] - points[other]) > slack[k] for other in (apart[-1], last))
        if is_clear or (k == last and not is_closed):
            apart.append(k)
    return np.array(apart, np.int64) if len(apart) > 2 else kept


def _divided(points: Floats, is_closed: bool, longest: Callable[[Floats], Floats]) -> tuple[Floats, Ints]:
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
    for _ in range(_MAX_DIVISIONS):
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


def _turns(points: Floats, is_closed: bool) -> Floats:
    """Angle by which a curve turns at each of its points.

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool

    Returns
    -------
    (n,) float64
        In radians; 0 at the ends of an open curve.
    """
    start, end = segments_of(points, is_closed)
    along = end - start
    before = np.roll(along, 1, axis=0) if is_closed else along[:-1]
    after = along if is_closed else along[1:]
    angle = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), (before * after).sum(1))
    turned: Floats = angle if is_closed else np.concatenate([[0.0], angle, [0.0]])
    return turned


def distance_from_segments(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance of points from segments.

    Parameters
    ----------
    points : (n, 3) float64
    start, end : (n, 3) or (1, 3) float64
        One segment for each point, or one for all.

    Returns
    -------
    (n,) float64
    """
    along = end - start
    square = (along * along).sum(1)
    part = np.divide(((points - start) * along).sum(1), square, out=np.zeros(len(points)), where=square > 0)
    distance: Floats = np.linalg.norm(points - start - np.clip(part, 0, 1)[:, None] * along, axis=1)
    return distance


def _room_beside(points: Floats, is_closed: bool) -> Floats:
    """Distance of each point from the nearest other stretch of the curve.

    Another stretch is one that is three times as far away along the curve as through space.

    Parameters
    ----------
    points : (n, 3) float64
    is_closed : bool

    Returns
    -------
    (n,) float64
        Infinite where none of the nearest points belongs to another stretch.
    """
    from scipy.spatial import cKDTree

    n = len(points)
    along = _arc_lengths(points, is_closed)
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
    if n > MAX_POINTS:
        raise TooMuchWork(
            f"The curve bends so often that more than {MAX_POINTS:,} points would be needed",
            remedy="Give a smoother or a shorter curve.",
        )


def _with_ends(flags: Bools, is_closed: bool) -> Bools:
    """Flags of points, with those of both ends of an open curve set.

    Parameters
    ----------
    flags : (n,) bool
    is_closed : bool

    Returns
    -------
    (n,) bool
    """
    flags = flags.copy()
    if not is_closed:
        flags[[0, -1]] = True
    return flags
