"""Where a front is offset from: its vertices, resampled, and the direction in which each leaves.

A front runs with what is not yet covered on its left, so the offset direction is n × t: the
surface's normal times the way the polyline runs (Yan et al. 2016, §4.1, where the order of the indices
is c and the direction c × n of a border that runs the other way).  Where a front turns left its
sides draw together, where it turns right they draw apart: there one vertex has a fan of children.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cycles import order_cycles
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.unfolding import FEWEST, SHARPEST_FAN, find_turns
from weavecore.offsetting.seeds import Corners, find_sector

SMOOTH = 0.2
"""Radians: a turn to the right by more has a fan; one to the left has no child, for those of its neighbours cross."""

FAN_ANGLE = 0.1
_OFF_THE_CORNER = 1e-6
_CROWDED, _SPARSE = 0.6, 1.3
_LEAST_STEPS = 40
"""A round front has at least so many vertices, however small it is: each turns by less than `SMOOTH`."""


@dataclass(frozen=True, eq=False)
class Seeds:
    """Where rays start: in the order of the polylines, polyline after polyline.

    Parameters
    ----------
    offsets : (C+1,) int64
    halfedge : (n,) int64
    px, py, ux, uy : (n,) float64
        Place and unit direction in the frame of the halfedge.
    stretch : (n,) float64
        How much longer than the spacing the step is: where a front turns left, so that the
        distance from both its sides is right.
    """

    offsets: Ints
    halfedge: Ints
    px: Floats
    py: Floats
    ux: Floats
    uy: Floats
    stretch: Floats

    @property
    def owner(self) -> Ints:
        """(n,) the polyline of each seed."""
        return rows_of(self.offsets)


def seed_walls(ground: Ground, *, step: float) -> Seeds:
    """Seeds along the borders and both sides of the cuts, at most ``step`` apart."""
    frames = ground.frames
    wall = np.flatnonzero(frames.twin == NO_TWIN)
    corners = Corners(frames, wall)
    after = np.empty(len(wall), np.int64)
    after[corners.before] = np.arange(len(wall))
    order, offsets = order_cycles(after)
    halfedge, total = wall[order], corners.total[order]
    turn = np.pi - total
    length = frames.length[halfedge]
    n_edge = np.ceil(length / step * 0.999).astype(np.int64) - 1
    n_corner = _rays_at(turn)
    n_edge[n_corner == 0] = np.maximum(n_edge, 1)[n_corner == 0]
    counts = n_corner + n_edge
    row = rows_of(offsets_of(counts))
    rank = np.arange(len(row)) - offsets_of(counts)[row]
    at_corner = rank < n_corner[row]
    angle = np.full(len(row), np.pi / 2)
    fan = np.divide(rank, n_corner[row] - 1, out=np.full(len(row), 0.5), where=n_corner[row] > 1)
    angle[at_corner] = (total[row] - np.pi / 2 - (total[row] - np.pi) * fan)[at_corner]
    along = (rank - n_corner[row] + 1) / (n_edge[row] + 1) * length[row]
    h, px, ux, uy = halfedge[row], along, np.cos(angle), np.sin(angle)
    c = np.flatnonzero(at_corner)
    h[c], left = find_sector(frames, h[c], angle[c])
    px[c], ux[c], uy[c] = _OFF_THE_CORNER * frames.length[h[c]], np.cos(left), np.sin(left)
    curve = rows_of(offsets)[row]
    per_curve = offsets_of(np.bincount(curve, minlength=len(offsets) - 1))
    stretch = np.where(at_corner, _stretch(turn[row]), 1.0)
    return Seeds(per_curve, h, px, np.zeros(len(h)), ux, uy, stretch)


def _rays_at(turn: Floats) -> Ints:
    """How many rays leave a vertex that turns left by so much."""
    fan = np.ceil(-turn / FAN_ANGLE).astype(np.int64) + 1
    return np.where(turn < -SMOOTH, fan, np.where(turn > SMOOTH, 0, 1))


def _stretch(turn: Floats) -> Floats:
    longer: Floats = 1.0 / np.cos(np.clip(turn, 0.0, SMOOTH) / 2)
    return longer


def _thinned(total: Floats, curves: Curves, vertex: Ints, least: Floats) -> Ints:
    """The vertices without those that crowd: of each run of short gaps every other one goes, until none is short.

    Those beside a corner go before it does.
    """
    offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
    near = _gaps(total, curves, vertex, offsets) < least[curves.owner[vertex]]
    after, is_corner = next_in_loop(offsets), curves.is_corner[vertex]
    beside = near & is_corner[after]
    beside[after[near & is_corner]] = True
    vertex = vertex[~beside | is_corner]
    while True:
        offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
        gap = _gaps(total, curves, vertex, offsets)
        before = np.empty(len(vertex))
        before[next_in_loop(offsets)] = gap
        short = (before < least[curves.owner[vertex]]) & (np.diff(offsets)[curves.owner[vertex]] > FEWEST)
        row = np.arange(len(vertex))
        # The first of a curve begins a run whatever lies before it.
        is_head = ~short
        is_head[offsets[:-1][np.diff(offsets) > 0]] = True
        run = row - np.maximum.accumulate(np.where(is_head, row, 0))
        goes = short & (run % 2 == 1)
        last = offsets[1:][np.diff(offsets) > 0] - 1
        first = offsets[:-1][np.diff(offsets) > 0]
        goes[last] |= short[first] & ~goes[last - 1]
        if not goes.any():
            return vertex
        vertex = vertex[~goes]


def seed_curves(ground: Ground, curves: Curves, *, step: float) -> Seeds:
    """Seeds along fronts: at their vertices where these are neither crowded nor far apart (§4.2)."""
    segment, part, offsets = _resample(curves, step)
    face = curves.face[segment]
    weights = curves.start[segment] * (1 - part)[:, None] + curves.end[segment] * part[:, None]
    turn, heading = find_turns(ground, face, ground.points(face, weights), offsets)
    count = np.where(turn < -SHARPEST_FAN, 0, _rays_at(turn))
    row = rows_of(offsets_of(count))
    rank = np.arange(len(row)) - offsets_of(count)[row]
    share = np.divide(rank, count[row] - 1, out=np.full(len(row), 0.5), where=count[row] > 1)
    angle = heading[row] + turn[row] * share + np.pi / 2
    xy = ground.flat(face, weights)[row]
    curve = rows_of(offsets)[row]
    return Seeds(
        offsets_of(np.bincount(curve, minlength=len(curves))),
        3 * face[row],
        xy[:, 0],
        xy[:, 1],
        np.cos(angle),
        np.sin(angle),
        _stretch(turn[row]),
    )


def _resample(curves: Curves, step: float) -> tuple[Ints, Floats, Ints]:
    """Segments (n,), places on them (n,) in 0 to 1, and offsets (C+1,) of the resampled polylines."""
    vertex = np.flatnonzero(curves.is_vertex)
    total = np.concatenate([[0.0], np.cumsum(curves.lengths)])
    around = total[curves.offsets[1:]] - total[curves.offsets[:-1]]
    wanted = np.minimum(step, around / _LEAST_STEPS)
    kept = _thinned(total, curves, vertex, _CROWDED * wanted)
    offsets = offsets_of(np.bincount(curves.owner[kept], minlength=len(curves)))
    gaps = _gaps(total, curves, kept, offsets)
    parts = gaps / wanted[curves.owner[kept]]
    n_parts = np.where(parts > _SPARSE, np.ceil(parts), 1).astype(np.int64)
    # Corners may have no child, but what lies between two of them has one.
    n_parts[curves.is_corner[kept] & curves.is_corner[kept[next_in_loop(offsets)]] & (n_parts == 1)] = 2
    offsets = offsets_of(n_parts)
    row = rows_of(offsets)
    rank = np.arange(len(row)) - offsets[row]
    owner = curves.owner[kept[row]]
    station = total[kept[row]] + gaps[row] * rank / n_parts[row]
    station = np.where(station >= total[curves.offsets[owner + 1]], station - around[owner], station)
    segment = np.searchsorted(total, station, side="right") - 1
    segment[rank == 0] = kept[row[rank == 0]]
    segment = np.clip(segment, curves.offsets[owner], curves.offsets[owner + 1] - 1)
    length = curves.lengths[segment]
    part = np.divide(station - total[segment], length, out=np.zeros(len(row)), where=length > 0)
    part = np.where(rank == 0, 0.0, np.clip(part, 0.0, 1.0))
    return segment, part, offsets_of(np.bincount(owner, minlength=len(curves)))


def _gaps(total: Floats, curves: Curves, vertex: Ints, offsets: Ints) -> Floats:
    """Arc length from each vertex to the next of the same curve."""
    after = vertex[next_in_loop(offsets)]
    around = total[curves.offsets[1:]] - total[curves.offsets[:-1]]
    gap = total[after] - total[vertex]
    gaps: Floats = np.where(after <= vertex, gap + around[curves.owner[vertex]], gap)
    return gaps
