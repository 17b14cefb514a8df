"""Whether polylines are simple and keep apart: told face by face, not by nearness in space."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.locating import HeldSegments, carriers_of
from weavecore.validating.report import Finding, count

_PAIRS_AT_ONCE = 1_000_000
_LEAST_TURN = 1e-12
"""Twice an area in barycentric coordinates below which three points are in line."""


def check_crossings(surface: SurfaceMesh, polylines: Polylines, held: HeldSegments) -> Iterator[Finding]:
    """Polylines that cross one another or themselves, and points that two of them share."""
    crossing = [held.start[i[_cross(held, i, j)]] for i, j in _pairs_in_faces(held)]
    owner = polylines.owner
    yield count("crossings", owner[np.concatenate(crossing)] if crossing else [], "polyline")
    yield count("shared_points", owner[_shared_points(surface, polylines)], "polyline")


def _pairs_in_faces(held: HeldSegments) -> Iterator[tuple[Ints, Ints]]:
    """All pairs of rows of the same face, in blocks."""
    n = len(held.face)
    last = np.searchsorted(held.face, held.face, side="right")
    partners = last - np.arange(n) - 1
    total = np.concatenate([[0], np.cumsum(partners)])
    begin = 0
    while begin < n:
        end = max(begin + 1, int(np.searchsorted(total, total[begin] + _PAIRS_AT_ONCE, side="right")) - 1)
        i = np.repeat(np.arange(begin, end), partners[begin:end])
        j = i + 1 + np.arange(len(i)) - (total[i] - total[begin])
        yield i, j
        begin = end


def _cross(held: HeldSegments, i: Ints, j: Ints) -> Ints:
    """Which of the pairs have no common point and cross inside their face."""
    a, b, c, d = held.start[i], held.end[i], held.start[j], held.end[j]
    apart = (a != c) & (a != d) & (b != c) & (b != d)
    p, q, r, s = (x[:, :2] for x in (held.at_start[i], held.at_end[i], held.at_start[j], held.at_end[j]))
    return np.flatnonzero(apart & _opposite(p, q, r, s) & _opposite(r, s, p, q))


def _opposite(p: Floats, q: Floats, r: Floats, s: Floats) -> Ints:
    """Whether ``r`` and ``s`` lie on opposite sides of the line through ``p`` and ``q``."""
    x, y = (q - p).T
    left = x * (r - p)[:, 1] - y * (r - p)[:, 0]
    right = x * (s - p)[:, 1] - y * (s - p)[:, 0]
    apart: Ints = (np.minimum(left, right) < -_LEAST_TURN) & (np.maximum(left, right) > _LEAST_TURN)
    return apart


def _shared_points(surface: SurfaceMesh, polylines: Polylines) -> Ints:
    """Points at a vertex, or at a place of an edge, where there is another point too."""
    corners, carries = carriers_of(surface, polylines)
    on_edge = np.flatnonzero(carries.sum(1) < 3)
    corners, carries = corners[on_edge], carries[on_edge]
    low = np.where(carries, corners, surface.n_vertices).min(1)
    high = np.where(carries, corners, -1).max(1)
    part = (polylines.barycentric[on_edge] * (carries & (corners == high[:, None]))).sum(1)
    order = np.lexsort((part, high, low))
    same = (np.diff(low[order]) == 0) & (np.diff(high[order]) == 0) & (np.diff(part[order]) <= _LEAST_TURN)
    shared: Ints = on_edge[np.union1d(order[:-1][same], order[1:][same])]
    return shared
