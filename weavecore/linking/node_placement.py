"""Where along a polyline its nodes lie (Yan et al. 2016, §5).

Nodes lie at equal arc lengths, but for

* corners of a border, which become nodes, each run between two corners being divided evenly; of corners nearer to each
  other than half an edge the sharper ones do;
* cusps of a latitude (`parent_projections.find_cusps`), onto which the nearest nodes are moved while
  their neighbours follow part of the way;
* the ends of an open latitude, where the first and last edge may be half as long:

      even            |----o----o----o----|
      half at start   |--o----o----o----|        rows that begin alternately with a whole and a half edge make
      half at end     |----o----o----o--|        equilateral triangles, cut in half along the free border
      half at both    |--o----o----o--|

A *station* is an arc length from the first point of a polyline.  Time is linear in the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.elementary import arctangents
from weavecore.linking.patterns import Pattern

_SHARE_DIGITS = 9
"""Digits to which the lengths of the runs between corners are compared, as parts of the whole."""

CORNER_TURN = np.radians(40.0)
"""A border has a corner where it turns by more: the smallest turn that shows as a corner in a woven border, and
well above the turn from edge to edge of any circle that is meshed with a dozen edges or more."""
_LEAST_EDGE = 0.3
"""Part of an edge length that corners of an open border keep from its ends and from each other to become nodes."""
_LEAST_RUN = 0.5
"""The same of a closed border, and of an open one with as many corners as edges: a run between corners that is half an
edge long is rounded to one edge, a shorter one to none."""
_SHORT_RUN = 1.5
"""Edges: with 1.4 times fewer, as `Pattern.count_tolerance` allows, shorter runs would take edges from longer ones."""
_MOST_CORNERS = 3
"""Corners that an open border of very few edges keeps at `_LEAST_EDGE`."""
_TURN_DIGITS = 6
"""Digits of radians to which turns are compared, so that of equal corners the first is taken."""
_SPREAD = 2
"""Nodes on either side of one that is moved to a cusp over which the move fades out."""
_HALF_EDGE_COST = 4.0
"""Cost of each edge, times the square of its strain, where half edges at the ends change the edge length; on the
scale of the costs of `strip_triangulation`."""
_FEWEST_EDGES_TO_SHIFT = 3
"""Open polylines of fewer edges are divided evenly: a half edge would be a large part of them."""
_CUSP_REACH = 0.5
"""Part of an edge by which a node of an open polyline is moved to a cusp at most."""


@dataclass(frozen=True, eq=False)
class Division:
    """One way to divide an open polyline.

    Parameters
    ----------
    stations : (k,) float64
        Rising; both ends are nodes.
    cost : float
        On the scale of the costs of `strip_triangulation`.
    """

    stations: Floats
    cost: float


def divide_closed_border(points: Floats, stations: Floats, length: float, count: int) -> Floats:
    """Stations of the nodes of a closed border: a node at each corner, equal arc lengths between.

    Where there is no corner the first node lies at the sharpest turn, so that the division
    depends on the shape and not on where the polyline begins.

    Parameters
    ----------
    points : (n, 3) float64
    stations : (n,) float64
        Of the points.
    length : float
        Of the border.
    count : int
        Number of nodes.

    Returns
    -------
    (count,) float64
        Rising, from 0 to below ``length``.
    """
    corners = _corners_of_loop(points, stations, length, _LEAST_RUN * length / count)
    least = length / count
    while len(corners) > count:
        corners = _corners_of_loop(points, stations, length, least)
        least *= 2.0
    if len(corners) == 0:
        turn = turning_angles(points)
        start = int(np.argmax(turn > turn.max() - 1e-9))
        return np.sort((stations[start] + np.arange(count) * (length / count)) % length)
    runs = np.diff(np.append(corners, corners[0] + length))
    parts = _apportion(runs, count)
    nodes = [s + np.arange(n) * (run / n) for s, run, n in zip(corners, runs, parts)]
    return np.sort(np.concatenate(nodes) % length)


def edges_with_corners(points: Floats, stations: Floats, length: float, edge_length: float) -> tuple[float, int]:
    """How many edges a closed border needs for its corners.

    Parameters
    ----------
    points : (n, 3) float64
    stations : (n,) float64
        Of the points.
    length : float
        Of the border.
    edge_length : float
        Wanted length of the edges.

    Returns
    -------
    ideal : float
        Length of the border in edges, runs between corners that are shorter than an edge counted as one.
    least : int
        Fewest edges with which the longer runs keep theirs: 0 where no run is short.
    """
    corners = _corners_of_loop(points, stations, length, _LEAST_RUN * edge_length)
    if len(corners) == 0:
        return length / edge_length, 0
    runs = np.diff(np.append(corners, corners[0] + length)) / edge_length
    is_short = bool((runs < _SHORT_RUN).any())
    return float(np.maximum(runs, 1.0).sum()), int(np.maximum(np.rint(runs), 1.0).sum()) if is_short else 0


def divide_open_border(points: Floats, stations: Floats, length: float, count: int) -> Floats:
    """Stations of the nodes of an open stretch of border: its ends, its corners, and equal arc lengths between.

    Parameters
    ----------
    points : (n, 3) float64
    stations : (n,) float64
        Of the points.
    length : float
    count : int
        Number of edges.  Corners raise it where it is so low that they would be lost, or that other runs would lose
        edges to short ones, unless they lie very near to the ends or to each other.

    Returns
    -------
    (k,) float64
        Rising, from 0 to ``length``.
    """
    edge = length / count
    turn = turning_angles(points)[1:-1]
    is_corner = turn > CORNER_TURN
    corners = _separated(stations[1:-1][is_corner], turn[is_corner], length, _LEAST_EDGE * edge)
    if len(corners) >= max(count, _MOST_CORNERS):
        corners = _separated(stations[1:-1][is_corner], turn[is_corner], length, _LEAST_RUN * edge)
    if len(corners) == 0:
        return np.linspace(0.0, length, count + 1)
    starts = np.concatenate([[0.0], corners])
    runs = np.diff(np.append(starts, length))
    parts = _apportion(runs, max(count, int(np.maximum(np.rint(runs / edge), 1.0).sum())))
    nodes = [s + np.arange(n) * (run / n) for s, run, n in zip(starts, runs, parts)]
    return np.append(np.concatenate(nodes), length)


def divide_ring(length: float, count: int, phase: float, cusps: Optional[Floats] = None) -> Floats:
    """Stations of the nodes of a closed latitude, at equal arc lengths.

    Parameters
    ----------
    length : float
    count : int
    phase : float
        How many edges after the start the first node lies.
    cusps : (k,) float64, optional
        Stations, the sharpest first.  The nodes nearest to them are moved onto them.

    Returns
    -------
    (count,) float64
        Rising by less than ``length`` in all.  With cusps the first may be below 0 and the last above ``length``.
    """
    edge = length / count
    steps: Floats = np.arange(count, dtype=np.float64) + phase % 1.0
    if cusps is not None and len(cusps):
        steps += _shifts_to_cusps(steps, cusps / edge)
    return steps * edge


def divide_open_polyline(length: float, n_edges: int, cusps: Optional[Floats]) -> Floats:
    """Stations (n_edges + 1,) at equal arc lengths; nodes nearest to cusps are moved onto them.

    Parameters
    ----------
    length : float
    n_edges : int
    cusps : (k,) float64, optional
        Stations, the sharpest first.
    """
    return _moved_to_cusps(np.linspace(0.0, length, n_edges + 1), cusps)


def open_divisions(length: float, n_edges: int, cusps: Optional[Floats], pattern: Pattern) -> list[Division]:
    """Ways to divide an open polyline into about ``n_edges``: evenly, or with a half edge at one end or both.

    Parameters
    ----------
    length : float
    n_edges : int
    cusps : (k,) float64, optional
        Stations, the sharpest first.
    pattern : Pattern
        Only patterns of triangles use half edges.
    """
    divisions = [Division(divide_open_polyline(length, n_edges, cusps), 0.0)]
    if not pattern.has_diagonals:
        return divisions
    for first, last in ((0.5, 0.5), (0.5, 1.0), (1.0, 0.5)):
        whole = int(np.rint(n_edges - first - last))
        if whole < 0 or n_edges < _FEWEST_EDGES_TO_SHIFT:
            continue
        edge = length / (first + whole + last)
        stations = np.concatenate([[0.0], (first + np.arange(whole + 1)) * edge, [length]])
        strain = edge * n_edges / length - 1.0
        divisions.append(Division(_moved_to_cusps(stations, cusps), _HALF_EDGE_COST * n_edges * strain**2))
    return divisions


def turning_angles(points: Floats) -> Floats:
    """Angle by which a closed polyline turns at each of its points.

    Parameters
    ----------
    points : (n, 3) float64
        The first point is not repeated.

    Returns
    -------
    (n,) float64
        Radians, 0 to π.
    """
    ahead = np.roll(points, -1, axis=0) - points
    behind = np.roll(ahead, 1, axis=0)
    cross = np.linalg.norm(np.cross(behind, ahead), axis=1)
    return arctangents(cross, (behind * ahead).sum(1))


def _corners_of_loop(points: Floats, stations: Floats, length: float, least: float) -> Floats:
    """Stations (k,), rising, of the corners of a closed border that keep a distance; sharper corners go first."""
    turn = turning_angles(points)
    at = np.flatnonzero(turn > CORNER_TURN)
    corners, kept = stations[at], np.zeros(0)
    for k in np.argsort(-np.round(turn[at], _TURN_DIGITS), kind="stable").tolist():
        apart = np.abs(corners[k] - kept)
        if np.minimum(apart, length - apart).min(initial=length) >= least:
            kept = np.append(kept, corners[k])
    return np.sort(kept)


def _separated(corners: Floats, turn: Floats, length: float, least: float) -> Floats:
    """Those of some stations that keep a distance from the ends and from each other; sharper corners go first."""
    kept = [0.0, length]
    for k in np.argsort(-turn, kind="stable").tolist():
        if np.abs(corners[k] - kept).min() >= least:
            kept.append(float(corners[k]))
    return np.sort(kept)[1:-1]


def _apportion(runs: Floats, count: int) -> Ints:
    """Whole numbers of edges, at least one each, proportional to the lengths ``runs`` and ``count`` in all."""
    # Runs of one length must not be told apart by rounding.
    runs = np.round(runs / runs.sum(), _SHARE_DIGITS)
    parts = np.maximum(np.floor(runs * (count / runs.sum()) + 1e-9).astype(np.int64), 1)
    while parts.sum() < count:
        parts[np.argmax(runs / parts)] += 1
    while parts.sum() > count:
        able = np.where(parts > 1, runs / np.maximum(parts - 1, 1), np.inf)
        parts[np.argmin(able)] -= 1
    apportioned: Ints = parts
    return apportioned


def _shifts_to_cusps(steps: Floats, cusps: Floats) -> Floats:
    """Shift (n,) of each node, in edges, that puts a node on each cusp; it fades out on either side."""
    n = len(steps)
    fixed: dict[int, float] = {}
    for cusp in cusps.tolist():
        node = int(np.rint(cusp - steps[0]))
        if all(min((node - k) % n, (k - node) % n) > 1 for k in fixed):
            fixed[node % n] = cusp - steps[0] - node
    nodes = np.array(sorted(fixed), np.int64)
    apart = np.abs(np.arange(n)[:, None] - nodes)
    free = np.flatnonzero(np.minimum(apart, n - apart).min(1) > _SPREAD)
    known = np.concatenate([nodes, free])
    shift = np.concatenate([[fixed[k] for k in nodes.tolist()], np.zeros(len(free))])
    shifts: Floats = np.interp(np.arange(n), known, shift, period=n)
    return shifts


def _moved_to_cusps(stations: Floats, cusps: Optional[Floats]) -> Floats:
    """The stations with inner nodes moved onto cusps that are near, the sharpest first."""
    moved = stations.copy()
    for cusp in [] if cusps is None else cusps.tolist():
        node = int(np.argmin(np.abs(stations - cusp)))
        if 0 < node < len(stations) - 1 and moved[node] == stations[node]:
            gap = min(stations[node] - stations[node - 1], stations[node + 1] - stations[node])
            if abs(cusp - stations[node]) <= _CUSP_REACH * gap:
                moved[node] = cusp
    return moved
