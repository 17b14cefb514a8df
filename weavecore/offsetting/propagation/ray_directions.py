"""Where a front is offset from: its vertices, resampled, and the direction in which each leaves.

A front runs with what is not yet covered on its left, so the offset direction is n × t: the
surface's normal times the way the polyline runs (Yan et al. 2016, §4.1, where the order of the indices
is c and the direction c × n of a border that runs the other way).  Where a front turns left its
sides draw together, where it turns right they draw apart: there one vertex has a fan of children.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.geodesics import on_halfedge
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.distance.ray_seeds import find_sector
from weavecore.offsetting.propagation.chords import FEWEST, SHARPEST_FAN, find_turns
from weavecore.offsetting.propagation.curves import Curves, Ground, next_along

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
    fronts : Curves
        The polylines.
    offsets : (C+1,) int64
    halfedge : (n,) int64
    px, py, ux, uy : (n,) float64
        Place and unit direction in the frame of the halfedge.
    stretch : (n,) float64
        How much longer than the spacing the step is: where a front turns left, so that the
        distance from both its sides is right.
    station : (n,) float64
        Arc length along all polylines, one after the other, up to the seed.
    pivot : (n,) int64
        The halfedge of a wall on which the seed lies, if it lies at its tail or at the end of an open polyline;
        else -1.
    place, angle : (n,) float64
        Where on the pivot, and the direction counter-clockwise from it.  At the end of an open polyline this may
        lead out of the surface.
    """

    fronts: Curves
    offsets: Ints
    halfedge: Ints
    px: Floats
    py: Floats
    ux: Floats
    uy: Floats
    stretch: Floats
    station: Floats
    pivot: Ints
    place: Floats
    angle: Floats

    @property
    def owner(self) -> Ints:
        """(n,) the polyline of each seed."""
        return rows_of(self.offsets)


def aim(ground: Ground, pivot: Ints, place: Floats, angle: Floats) -> tuple[Ints, Floats, Floats, Floats]:
    """Halfedge, place on it and unit direction in its frame, of rays from places on walls."""
    halfedge, left = pivot.copy(), angle.copy()
    corner = np.flatnonzero(place == 0.0)
    halfedge[corner], left[corner] = find_sector(ground.frames, pivot[corner], angle[corner])
    px = np.where(place == 0.0, _OFF_THE_CORNER * ground.frames.length[halfedge], place)
    return halfedge, px, np.cos(left), np.sin(left)


def _chain_origins(ground: Ground) -> tuple[Ints, Ints, Bools]:
    """Halfedges of the walls from which distances start, chain after chain; offsets; and which chains are closed."""
    halfedge, offsets = ground.walls.halfedges, ground.walls.offsets
    cycle = rows_of(offsets)
    if not ground.has_selvedges:
        return halfedge, offsets, np.ones(len(offsets) - 1, bool)
    begins = ~ground.is_selvedge[halfedge] & ground.is_selvedge[ground.walls.before[halfedge]]
    row = np.arange(len(halfedge))
    first = offsets[:-1].copy()
    first[cycle[begins][::-1]] = row[begins][::-1]
    turned = np.lexsort(((row - first[cycle]) % np.diff(offsets)[cycle], cycle))
    halfedge, begins = halfedge[turned], begins[turned]
    heads = begins.copy()
    heads[offsets[:-1]] = True
    kept = ~ground.is_selvedge[halfedge]
    halfedge, heads, begins = halfedge[kept], heads[kept], begins[kept]
    starts = np.flatnonzero(heads)
    return halfedge, np.append(starts, len(halfedge)).astype(np.int64), ~begins[starts]


def _origin_fronts(ground: Ground, halfedge: Ints, offsets: Ints, closed: Bools) -> Curves:
    """The chains as curves."""
    at = offsets[1:][~closed]
    zero, one = np.zeros(len(halfedge)), np.ones(len(halfedge))
    start = np.insert(on_halfedge(halfedge, zero), at, on_halfedge(halfedge, one)[at - 1], axis=0)
    end = np.insert(on_halfedge(halfedge, one), at, on_halfedge(halfedge, one)[at - 1], axis=0)
    face = np.insert(halfedge, at, halfedge[at - 1]) // 3
    is_vertex = np.ones(len(face), bool)
    offsets = offsets_of(np.diff(offsets) + ~closed)
    return Curves(offsets, closed, face, start, end, is_vertex, ~is_vertex, ground.points(face, start))


def seed_walls(ground: Ground, *, step: float) -> Seeds:
    """Seeds along the origins, on both sides of the cuts, at most ``step`` apart."""
    frames = ground.frames
    halfedge, offsets, closed = _chain_origins(ground)
    total = ground.walls.angle[halfedge]
    is_head = np.zeros(len(halfedge), bool)
    is_head[offsets[:-1][~closed]] = True
    turn = np.pi - total
    length = frames.length[halfedge]
    n_edge = np.ceil(length / step * 0.999).astype(np.int64) - 1
    n_corner = np.where(is_head, 1, _rays_at(turn))
    n_edge[n_corner == 0] = np.maximum(n_edge, 1)[n_corner == 0]
    counts = n_corner + n_edge
    row = rows_of(offsets_of(counts))
    rank = np.arange(len(row)) - offsets_of(counts)[row]
    at_corner = rank < n_corner[row]
    angle = np.full(len(row), np.pi / 2)
    fan = np.divide(rank, n_corner[row] - 1, out=np.full(len(row), 0.5), where=n_corner[row] > 1)
    fanned = at_corner & ~is_head[row]
    angle[fanned] = (total[row] - np.pi / 2 - (total[row] - np.pi) * fan)[fanned]
    along = (rank - n_corner[row] + 1) / (n_edge[row] + 1) * length[row]
    along[at_corner] = 0.0
    fronts = _origin_fronts(ground, halfedge, offsets, closed)
    travelled = np.cumsum(fronts.lengths) - fronts.lengths
    curve = rows_of(offsets)[row]
    station = travelled[row + offsets_of(~closed)[curve]] + along
    pivot = np.where(at_corner, halfedge[row], NO_TWIN)
    stretch = np.where(fanned, _stretch(turn[row]), 1.0)
    # One more at the end of each open chain, where the selvedge begins.
    per_curve = np.bincount(curve, minlength=len(offsets) - 1)
    at, last = offsets_of(per_curve)[1:][~closed], ground.walls.after[halfedge[offsets[1:][~closed] - 1]]
    h = np.insert(halfedge[row], at, last)
    along, angle = np.insert(along, at, 0.0), np.insert(angle, at, ground.walls.angle[last] - np.pi / 2)
    pivot, stretch = np.insert(pivot, at, last), np.insert(stretch, at, 1.0)
    station = np.insert(station, at, travelled[fronts.offsets[1:][~closed] - 1])
    ux, uy, px = np.cos(angle), np.sin(angle), along.copy()
    c = np.flatnonzero(pivot != NO_TWIN)
    h[c], px[c], ux[c], uy[c] = aim(ground, pivot[c], along[c], angle[c])
    per_curve = offsets_of(per_curve + ~closed)
    return Seeds(fronts, per_curve, h, px, np.zeros(len(h)), ux, uy, stretch, station, pivot, along, angle)


def _rays_at(turn: Floats) -> Ints:
    """How many rays leave a vertex that turns left by so much."""
    fan = np.ceil(-turn / FAN_ANGLE).astype(np.int64) + 1
    return np.where(turn < -SMOOTH, fan, np.where(turn > SMOOTH, 0, 1))


def _stretch(turn: Floats) -> Floats:
    longer: Floats = 1.0 / np.cos(np.clip(turn, 0.0, SMOOTH) / 2)
    return longer


def _thinned(total: Floats, curves: Curves, vertex: Ints, least: Floats) -> Ints:
    """The vertices without those that crowd: of each run of short gaps every other one goes, until none is short.

    Those beside a corner go before it does; the ends of open ones stay.
    """
    offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
    near = _gaps(total, curves, vertex, offsets) < least[curves.owner[vertex]]
    after, is_corner = next_along(offsets, curves.closed), curves.is_corner[vertex]
    near &= after != np.arange(len(after))
    beside = near & is_corner[after]
    beside[after[near & is_corner]] = True
    is_end = _are_ends(offsets, curves.closed)
    vertex = vertex[~beside | is_corner | is_end]
    while True:
        offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
        gap = _gaps(total, curves, vertex, offsets)
        before = np.empty(len(vertex))
        before[next_in_loop(offsets)] = gap
        is_end = _are_ends(offsets, curves.closed)
        filled = np.diff(offsets) > 0
        first, last = offsets[:-1][filled], offsets[1:][filled] - 1
        before[first[is_end[first]]] = np.inf
        short = (before < least[curves.owner[vertex]]) & (np.diff(offsets)[curves.owner[vertex]] > FEWEST)
        row = np.arange(len(vertex))
        # The first of a curve begins a run whatever lies before it.
        is_head = ~short
        is_head[first] = True
        run = row - np.maximum.accumulate(np.where(is_head, row, 0))
        goes = short & (run % 2 == 1)
        goes[last] |= short[first] & ~goes[last - 1]
        stuck = last[goes[last] & is_end[last]]
        goes[stuck], goes[stuck - 1] = False, True
        if not goes.any():
            return vertex
        vertex = vertex[~goes]


def _are_ends(offsets: Ints, closed: Bools) -> Bools:
    """(n,) which values of a ragged array are the first or the last of an open row."""
    is_end = np.zeros(offsets[-1], bool)
    is_open = ~closed & (np.diff(offsets) > 0)
    is_end[offsets[:-1][is_open]] = is_end[offsets[1:][is_open] - 1] = True
    return is_end


def seed_curves(ground: Ground, curves: Curves, *, step: float) -> Seeds:
    """Seeds along fronts: at their vertices where these are neither crowded nor far apart (§4.2)."""
    segment, part, station, offsets = _resample(curves, step)
    face = curves.face[segment]
    weights = curves.start[segment] * (1 - part)[:, None] + curves.end[segment] * part[:, None]
    turn, heading = find_turns(ground, face, ground.points(face, weights), offsets, curves.closed)
    count = np.where(turn < -SHARPEST_FAN, 0, _rays_at(turn))
    row = rows_of(offsets_of(count))
    rank = np.arange(len(row)) - offsets_of(count)[row]
    share = np.divide(rank, count[row] - 1, out=np.full(len(row), 0.5), where=count[row] > 1)
    angle = heading[row] + turn[row] * share + np.pi / 2
    xy = ground.flat(face, weights)[row]
    curve = rows_of(offsets)[row]
    pivot, place, off = _pivots(ground, face[row], weights[row], angle, _are_ends(offsets, curves.closed)[row])
    return Seeds(
        curves,
        offsets_of(np.bincount(curve, minlength=len(curves))),
        3 * face[row],
        xy[:, 0],
        xy[:, 1],
        np.cos(angle),
        np.sin(angle),
        _stretch(turn[row]),
        station[row],
        pivot,
        place,
        off,
    )


def _pivots(ground: Ground, face: Ints, weights: Floats, angle: Floats, is_end: Bools) -> tuple[Ints, Floats, Floats]:
    """For ends of open fronts the halfedge of the selvedge on which they lie, where on it, and the angle from it."""
    halfedge, place = ground.rims(face, weights)
    axis = np.zeros(len(face))
    base, k, frames = 3 * face, halfedge % 3, ground.frames
    axis[k == 1] = np.arctan2(frames.next_y[base], frames.next_x[base])[k == 1]
    axis[k == 2] = np.arctan2(frames.previous_y[base], frames.previous_x[base])[k == 2]
    off = (angle - axis + np.pi) % (2 * np.pi) - np.pi
    return np.where(is_end, halfedge, NO_TWIN), np.where(is_end, place, 0.0), off


def _resample(curves: Curves, step: float) -> tuple[Ints, Floats, Floats, Ints]:
    """Segments (n,), places on them (n,) in 0 to 1, stations (n,), and offsets (C+1,) of the resampled polylines."""
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
    after = next_along(offsets, curves.closed)
    between = curves.is_corner[kept] & curves.is_corner[kept[after]] & (after != np.arange(len(kept)))
    n_parts[between & (n_parts == 1)] = 2
    offsets = offsets_of(n_parts)
    row = rows_of(offsets)
    rank = np.arange(len(row)) - offsets[row]
    owner = curves.owner[kept[row]]
    station = total[kept[row]] + gaps[row] * rank / n_parts[row]
    beyond = curves.closed[owner] & (station >= total[curves.offsets[owner + 1]])
    station = np.where(beyond, station - around[owner], station)
    segment, part = curves.locate(station, owner)
    segment[rank == 0] = kept[row[rank == 0]]
    part = np.where(rank == 0, 0.0, part)
    return segment, part, station, offsets_of(np.bincount(owner, minlength=len(curves)))


def _gaps(total: Floats, curves: Curves, vertex: Ints, offsets: Ints) -> Floats:
    """Arc length from each vertex to the next of the same curve, none after the last of an open one."""
    after = vertex[next_along(offsets, curves.closed)]
    around = total[curves.offsets[1:]] - total[curves.offsets[:-1]]
    gap = total[after] - total[vertex]
    owner = curves.owner[vertex]
    gaps: Floats = np.where((after <= vertex) & curves.closed[owner], gap + around[owner], gap)
    return gaps
