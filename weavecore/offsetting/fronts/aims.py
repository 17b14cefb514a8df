"""`Aims`: the rays of fronts that come to selvedges, and what becomes of each."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.geometry.walking import Walks, on_halfedge, walk_far
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.seeds import aim

FREE, OUT, AT_RIM = 0, 1, 2
"""A ray ends inside the surface; or a selvedge is in its way; or it ends on one, and its child with it."""

_INSIDE = 1e-7
"""Barycentric: rays along a wall run so far beside it."""

_OFF_THE_WALL = 1e-9


@dataclass(frozen=True, eq=False)
class Aims:
    """Rays in the order of the fronts.

    Parameters
    ----------
    front : (n,) int64
    station, pivot, place, angle
        As in `Seeds`; the pivot may be any vertex of a selvedge that the ray has come to.
    way : (n, 3) float64
        Direction in space, of rays that start at a front.
    lead : (n,) float64
        How far it is from the front to where the ray starts.
    reach : (n,) float64
        The step, less the lead.
    state : (n,) int64
    rim : (n,) int64
        The halfedge of the selvedge on which the ray ends, -1 where it does not.
    walk : (n,) int64
        Number of its walk.
    """

    front: Ints
    station: Floats
    pivot: Ints
    place: Floats
    angle: Floats
    way: Floats
    lead: Floats
    reach: Floats
    state: Ints
    rim: Ints
    walk: Ints

    def __len__(self) -> int:
        return len(self.front)

    def take(self, index: Ints | Bools) -> Aims:
        """Some of the rays."""
        return Aims(*(getattr(self, field.name)[index] for field in fields(self)))

    @staticmethod
    def of(parts: list[Aims]) -> Aims:
        """One value of several."""
        return Aims(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Aims)))


def between(
    ground: Ground, fronts: Curves, free: Aims, out: Aims, on_right: Bools, share: Floats
) -> tuple[Aims, Walks]:
    """Rays that are parts of the way from each free one to its neighbour, and their walks.

    Where both start at a front they start between the two; where they start at one place of a wall only
    their directions differ.
    """
    by_angle = (free.pivot != NO_TWIN) & (free.pivot == out.pivot) & (free.place == out.place)
    turned = by_angle | (free.lead > 0) | (out.lead > 0)
    full = np.where(free.place == 0.0, ground.walls.angle[free.pivot], np.pi)
    goal = np.where(by_angle, out.angle, np.where(on_right, 0.0, full))
    angle = free.angle + (goal - free.angle) * share
    pivot = np.where(turned, free.pivot, NO_TWIN)
    place = np.where(turned, free.place, 0.0)
    station = _stations_between(fronts, free, out, on_right, share)
    way = free.way * (1 - share)[:, None] + out.way * share[:, None]
    reach = np.where(turned, free.reach, free.reach * (1 - share) + out.reach * share)
    segment, part = fronts.locate(station, free.front)
    face = fronts.face[segment]
    weights = fronts.start[segment] * (1 - part)[:, None] + fronts.end[segment] * part[:, None]
    x, y = ground.flat(face, weights).T
    ux, uy = ground.aimed(face, way)
    h = 3 * face
    at = np.flatnonzero(turned)
    h[at], x[at], ux[at], uy[at] = aim(ground, pivot[at], place[at], kept_off_walls(ground, pivot, place, angle)[at])
    y = np.where(turned, 0.0, y)
    walks = walk_far(ground.frames, h, x, y, ux, uy, reach)
    none = np.full(len(free), NO_TWIN)
    state = np.where(is_out(ground, walks), OUT, FREE)
    lead = np.where(turned, free.lead, 0.0)
    return Aims(free.front, station, pivot, place, angle, way, lead, reach, state, none, none), walks


def kept_off_walls(ground: Ground, pivot: Ints, place: Floats, angle: Floats) -> Floats:
    """Directions at walls, turned into the surface by a trifle where they lead along or out of it."""
    full = np.where(place == 0.0, ground.walls.angle[pivot], np.pi)
    return np.clip(angle, _OFF_THE_WALL, full - _OFF_THE_WALL)


def is_out(ground: Ground, walks: Walks) -> Bools:
    """Which walks were ended by a selvedge."""
    return np.asarray(walks.is_blocked & ground.is_selvedge[walks.wall])


def _stations_between(fronts: Curves, free: Aims, out: Aims, on_right: Bools, share: Floats) -> Floats:
    total = np.concatenate([[0.0], np.cumsum(fronts.lengths)])
    low, high = total[fronts.offsets[free.front]], total[fronts.offsets[free.front + 1]]
    there = out.station + np.where(on_right & (out.station < free.station), high - low, 0.0)
    there = there - np.where(~on_right & (out.station > free.station), high - low, 0.0)
    station = free.station + (there - free.station) * share
    station = np.where(station >= high, station - (high - low), station)
    return np.asarray(np.where(station < low, station + (high - low), station))


def walks_along(halfedges: list[Ints], starts: list[Floats], ends: list[Floats], ground: Ground) -> Walks:
    """Walks along walls: for each its halfedges, and from which part of each to which."""
    offsets = offsets_of([len(h) for h in halfedges])
    owner = rows_of(offsets)
    h = np.concatenate([np.zeros(0, np.int64), *halfedges])
    start, end = np.concatenate([np.zeros(0), *starts]), np.concatenate([np.zeros(0), *ends])
    length = np.abs(end - start) * ground.frames.length[h]
    total = np.concatenate([[0.0], np.cumsum(length)])
    begin = total[:-1] - total[offsets[:-1]][owner]
    finish = begin + length
    far = np.bincount(owner, length, minlength=len(halfedges)).astype(np.float64)
    n, zero = len(halfedges), np.zeros(len(halfedges))
    lifted = _lifted(on_halfedge(h, start)), _lifted(on_halfedge(h, end))
    return Walks(offsets, h // 3, *lifted, begin, finish, far, np.full(n, NO_TWIN), zero, zero)


def _lifted(weights: Floats) -> Floats:
    kept = np.maximum(weights, _INSIDE)
    return np.asarray(kept / kept.sum(1, keepdims=True))


def strung(parts: list[Walks], order: Ints) -> Walks:
    """The walks of several values, one after the other, in the given order."""
    names = [field.name for field in fields(Walks)][1:]
    face, start, end, begin, finish, far, wall, ux, uy = (
        np.concatenate([getattr(part, name) for part in parts]) for name in names
    )
    counts = np.concatenate([np.diff(part.offsets) for part in parts])
    first = offsets_of(counts)[:-1]
    offsets = offsets_of(counts[order])
    owner = rows_of(offsets)
    row = first[order][owner] + np.arange(len(owner)) - offsets[owner]
    return Walks(
        offsets, face[row], start[row], end[row], begin[row], finish[row], far[order], wall[order], ux[order], uy[order]
    )
