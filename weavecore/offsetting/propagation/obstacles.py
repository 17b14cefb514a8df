"""Where the rays of a front part at a selvedge: the ends of open children.

Of two neighbours one arrives and a selvedge is in the way of the other.  The ray between them that just arrives is
found by halving.  Either it ends on the selvedge itself, and so does the child; or it passes a corner of the
selvedge, behind which the front opens: rays leave that corner to all sides up to the selvedge, and one creeps on
along it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import Walks, on_halfedge, place_along, walk_far
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.chords import measure_chords
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.propagation.ray_directions import FAN_ANGLE, Seeds, aim

_LEAST_FAN = 0.02
"""Radians between the last ray of an open front and the selvedge that are left without a fan."""

_HALVINGS = 44
_MOST_ROUNDS = 12
_ARRIVED = 1e-3
"""Parts of the step: a ray that a selvedge stops so shortly before its end arrives there."""

_TRIALS = 16
"""Parts in which the gap between two rays is looked through for a spike of a selvedge."""

_ASIDE = 1e-9
"""Radians by which the first ray behind a corner keeps to the side of the one that just passed it.

Both lead on in one line, and may just touch another selvedge: rounding is not to let one pass and stop the other.
"""

_AHEAD = 0.5
"""Parts of the step that a child is prolonged by at most to come to a selvedge."""


def part_at_selvedges(
    ground: Ground, seeds: Seeds, walks: Walks, reach: Floats, *, step: float, ahead: float
) -> tuple[Aims, Walks]:
    """All rays of fronts on a surface with selvedges, in order: those of the seeds, and what selvedges ask for.

    Rays are walked so much further ``ahead`` than their steps.
    """
    rims = _Rims(ground, seeds.fronts, walks, step, ahead)
    rims.aims = _first_aims(ground, seeds, walks, reach)
    rims.open_ends()
    rims.find_spikes()
    for _ in range(_MOST_ROUNDS):
        if not rims.settle():
            break
    else:
        raise Degenerate(
            "Behind the corners of the other borders the polylines cannot be offset step by step",
            remedy='Take the method "levels", or another spacing.',
            ids=rims.find_unsettled_faces().tolist(),
            kind="face",
        )
    return replace(rims.aims, walk=np.arange(len(rims.aims))), strung(rims.walks, rims.aims.walk)


def _first_aims(ground: Ground, seeds: Seeds, walks: Walks, reach: Floats) -> Aims:
    n = len(seeds.halfedge)
    return Aims(
        seeds.owner,
        seeds.station,
        seeds.pivot,
        seeds.place,
        seeds.angle,
        ground.frames.directions(seeds.halfedge, seeds.ux, seeds.uy),
        np.zeros(n),
        reach,
        np.where(is_out(ground, walks) & (walks.far < reach), OUT, FREE),
        np.full(n, NO_TWIN),
        np.arange(n),
    )


class _Rims:
    """The rays so far, and what is put between them."""

    def __init__(self, ground: Ground, fronts: Curves, walks: Walks, step: float, ahead: float) -> None:
        self.ground, self.fronts, self.step, self.ahead = ground, fronts, step, ahead
        self.aims: Aims
        self.walks = [walks]
        self._n_walks = len(walks)
        self._added: list[Aims] = []
        self._places: list[Floats] = []

    def open_ends(self) -> None:
        """What goes on from the ends of open fronts: the wedge between the front's direction and the selvedge."""
        aims = self.aims
        offsets = offsets_of(np.bincount(aims.front, minlength=len(self.fronts)))
        kept = np.ones(len(aims), bool)
        for front in np.flatnonzero(~self.fronts.closed & (np.diff(offsets) > 0)).tolist():
            for index, on_right in ((int(offsets[front]), False), (int(offsets[front + 1]) - 1, True)):
                kept[index] = self._open_end(index, on_right)
        self._insert(kept)

    def _open_end(self, index: int, on_right: bool) -> bool:
        """Whether the ray of an end stays; what goes on beside it is put there."""
        ground, end = self.ground, self.aims.take(np.array([index]))
        pivot, place, angle = int(end.pivot[0]), float(end.place[0]), float(end.angle[0])
        full = np.pi if place > 0 else float(ground.walls.angle[pivot])
        if not on_right and angle < -np.pi / 2:
            angle += 2 * np.pi
        wedge = angle if on_right else full - angle
        if wedge < -STRAIGHT:
            # Beyond the surface at its end, which may bend there: rays in between turn in the front's own face.
            self.aims.state[index], self.aims.way[index] = OUT, self._across_end(int(end.front[0]), on_right)
            return True
        angles = fan(wedge)[1:] if wedge > _LEAST_FAN else np.zeros(0)
        before = index if on_right else index - 1
        self._put_crept(before, end, pivot, place, angles if on_right else full - angles, on_right, full)
        return wedge > _LEAST_FAN

    def _across_end(self, front: int, on_right: bool) -> Floats:
        """Direction in space square to the first or the last segment of an open front, to its left."""
        fronts = self.fronts
        segment = np.array([fronts.offsets[front + 1] - 2 if on_right else fronts.offsets[front]])
        along = self.ground.points(fronts.face[segment], fronts.end[segment] - fronts.start[segment])[0]
        across = np.cross(self.ground.normals[fronts.face[segment[0]]], along)
        return np.asarray(across / max(float(np.linalg.norm(across)), np.finfo(float).tiny))

    def find_spikes(self) -> None:
        """Put rays that a selvedge stops between neighbours that pass it on both sides."""
        aims, walks = self.aims, strung(self.walks, self.aims.walk)
        i, j = self._neighbours()
        both = (aims.state[i] == FREE) & (aims.state[j] == FREE) & (aims.lead[i] == 0) & (aims.lead[j] == 0)
        i, j = i[both], j[both]
        face, weights = place_along(walks, aims.reach)
        apart = np.isinf(measure_chords(self.ground, face[i], weights[i], face[j], weights[j]))
        i, j = i[apart], j[apart]
        n = len(i)
        if n == 0:
            return
        share = np.tile(np.arange(1, _TRIALS) / _TRIALS, n)
        one, other = aims.take(np.repeat(i, _TRIALS - 1)), aims.take(np.repeat(j, _TRIALS - 1))
        tried, tried_walks = between(self.ground, self.fronts, one, other, np.ones(len(share), bool), share)
        is_stopped = (tried.state == OUT).reshape(n, -1)
        for k in range(n):
            chosen = np.arange(len(share)) == k * (_TRIALS - 1) + int(is_stopped[k].argmax())
            stopped, walk = tried.take(chosen), tried_walks.take(chosen)
            if is_stopped[k].any():
                self._put(int(i[k]), stopped, walk)
            else:
                self._split(int(i[k]), int(j[k]), stopped, walk)
        self._insert(np.ones(len(aims), bool))

    def _split(self, i: int, j: int, between_them: Aims, walk: Walks) -> None:
        """Let the child end on both sides of a spike too thin for any ray, if a spike it is."""
        one, other, right = self.aims.take(np.array([i])), self.aims.take(np.array([j])), np.ones(1, bool)
        before, before_walk = between(self.ground, self.fronts, one, other, right, np.zeros(1))
        behind, behind_walk = between(self.ground, self.fronts, one, other, right, np.ones(1))
        left_rim, left_walk = self._prolonged(before, before_walk, True)
        right_rim, right_walk = self._prolonged(behind, behind_walk, False)
        if left_rim.rim[0] != NO_TWIN and right_rim.rim[0] != NO_TWIN:
            self._put(i, left_rim, left_walk)
            self._put(i, replace(between_them, state=np.array([OUT])), walk)
            self._put(i, right_rim, right_walk)

    def settle(self) -> bool:
        """Put what belongs between neighbours of which one arrives; whether there were any."""
        i, j = self._parting()
        if len(i) == 0:
            return False
        on_right = self.aims.state[i] == FREE
        free, out = self.aims.take(np.where(on_right, i, j)), self.aims.take(np.where(on_right, j, i))
        last_free, free_walks, first_out, out_walks = self._halve(free, out, on_right)
        for k in range(len(i)):
            one = np.arange(len(i)) == k
            pair = last_free.take(one), free_walks.take(one), first_out.take(one), out_walks.take(one)
            self._part(int(i[k]), *pair, on_right=bool(on_right[k]))
        self._insert(np.ones(len(self.aims), bool))
        return True

    def find_unsettled_faces(self) -> Ints:
        """Faces of the fronts where neighbours still part."""
        i, _ = self._parting()
        segment, _ = self.fronts.locate(self.aims.station[i], self.aims.front[i])
        faces: Ints = np.unique(self.fronts.face[segment])
        return faces

    def _parting(self) -> tuple[Ints, Ints]:
        """Neighbours of which one arrives and a selvedge is in the way of the other."""
        i, j = self._neighbours()
        state = self.aims.state
        parts = (state[i] == FREE) & (state[j] == OUT) | (state[i] == OUT) & (state[j] == FREE)
        return i[parts], j[parts]

    def _neighbours(self) -> tuple[Ints, Ints]:
        front = self.aims.front
        offsets = offsets_of(np.bincount(front, minlength=len(self.fronts)))
        i = np.arange(len(front))
        is_last = i == offsets[1:][front] - 1
        j = np.where(is_last, offsets[:-1][front], i + 1)
        kept = ~is_last | (self.fronts.closed[front] & (j != i))
        return i[kept], j[kept]

    def _halve(self, free: Aims, out: Aims, on_right: Bools) -> tuple[Aims, Walks, Aims, Walks]:
        """The last ray that arrives and the first that does not, between neighbours."""
        low, high = np.zeros(len(free)), np.ones(len(free))
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            aims, _ = between(self.ground, self.fronts, free, out, on_right, middle)
            low, high = np.where(aims.state == FREE, middle, low), np.where(aims.state == FREE, high, middle)
        return (
            *between(self.ground, self.fronts, free, out, on_right, low),
            *between(self.ground, self.fronts, free, out, on_right, high),
        )

    def _part(self, index: int, free: Aims, free_walk: Walks, out: Aims, out_walk: Walks, *, on_right: bool) -> None:
        """Let the child end on the selvedge, or the front open behind a corner of it."""
        ground, far, wall = self.ground, float(out_walk.far[0]), int(out_walk.wall[0])
        left = float(out.reach[0]) - far
        if wall != NO_TWIN and left <= _ARRIVED * self.step:
            self._put(index, replace(out, reach=out_walk.far, state=np.array([AT_RIM]), rim=out_walk.wall), out_walk)
            return
        corner = corner_passed(ground, out_walk, on_right) if wall != NO_TWIN else None
        if corner is None:
            self._put(index, *self._prolonged(free, free_walk, on_right))
            return
        pivot, wedge = corner
        full = float(ground.walls.angle[pivot])
        at_corner = replace(out, lead=out.lead + far, reach=np.array([left]))
        away = fan(wedge)
        away[0] += _ASIDE
        angles = away if on_right else full - away
        self._put_crept(index, at_corner, pivot, 0.0, angles, on_right, full)

    def _prolonged(self, free: Aims, walk: Walks, on_right: bool) -> tuple[Aims, Walks]:
        """The way of a ray and, from its end, straight on along the child to the selvedge."""
        ground, face = self.ground, walk.face[-1:]
        here, there = ground.flat(face, walk.start[-1:])[0], ground.flat(face, walk.end[-1:])[0]
        ux, uy = (there - here) / max(float(np.linalg.norm(there - here)), np.finfo(float).tiny)
        ux, uy = (uy, -ux) if on_right else (-uy, ux)
        x, y, dx, dy = (np.array([value]) for value in (*there, ux, uy))
        on = walk_far(ground.frames, 3 * face, x, y, dx, dy, np.array([_AHEAD * self.step]))
        both = Walks(
            np.array([0, len(walk.face) + len(on.face)]),
            np.concatenate([walk.face, on.face]),
            np.concatenate([walk.start, on.start]),
            np.concatenate([walk.end, on.end]),
            np.concatenate([walk.begin, on.begin + walk.far]),
            np.concatenate([walk.finish, on.finish + walk.far]),
            walk.far + on.far,
            on.wall,
            on.wall_ux,
            on.wall_uy,
        )
        rim = np.where(is_out(ground, on), on.wall, NO_TWIN)
        return replace(free, reach=both.far, state=np.array([AT_RIM]), rim=rim), both

    def _put_crept(
        self, index: int, start: Aims, pivot: int, place: float, angles: Floats, on_right: bool, full: float
    ) -> None:
        """A fan at a place on a selvedge, what leaves it further on, and the ray that creeps along it."""
        ground = self.ground
        if on_right or place > 0:
            halfedge, at = pivot, place
        else:
            halfedge = int(ground.walls.before[pivot])
            at = float(ground.frames.length[halfedge])
        reach = float(start.reach[0])
        if not ground.is_selvedge[halfedge]:
            return
        crept = creep(ground, halfedge=halfedge, place=at, on_right=on_right, reach=reach)
        rays, walks = self._leaving(start, pivot, place, angles, crept)
        along = walks_along([crept.halfedge], [crept.start], [crept.end], ground)
        sign = 1.0 if on_right else -1.0
        way = ground.frames.directions(np.array([halfedge]), np.array([sign]), np.zeros(1))
        # At the end of the selvedge the way along it is stopped as by a wall.
        ends_here = crept.state == AT_RIM and float(along.far[0]) > reach * (1 - _ARRIVED)
        last = replace(
            start,
            pivot=np.array([pivot]),
            place=np.array([place]),
            angle=np.array([0.0 if on_right else full]),
            way=way,
            reach=np.minimum(along.far, reach) if crept.state == AT_RIM else start.reach,
            state=np.array([crept.state]),
            rim=np.where(ends_here, crept.halfedge[-1:], NO_TWIN),
        )
        self._put_in_order(index, [rays, last], [walks, along], on_right)

    def _leaving(self, start: Aims, pivot: int, place: float, angles: Floats, crept: Crept) -> tuple[Aims, Walks]:
        """Rays that leave a selvedge: from where the way along it begins, and from corners further on."""
        ground = self.ground
        pivots = np.concatenate([np.full(len(angles), pivot), crept.pivot])
        places = np.concatenate([np.full(len(angles), place), np.zeros(len(crept.pivot))])
        angle = np.concatenate([angles, crept.angle])
        gone = np.concatenate([np.zeros(len(angles)), crept.lead])
        n = len(angle)
        halfedge, px, ux, uy = aim(ground, pivots, places, angle)
        reach = start.reach - gone
        walks = walk_far(ground.frames, halfedge, px, np.zeros(n), ux, uy, reach + self.ahead)
        none = np.full(n, NO_TWIN)
        rays = Aims(
            np.repeat(start.front, n),
            np.repeat(start.station, n),
            pivots,
            places,
            angle,
            ground.frames.directions(halfedge, ux, uy),
            start.lead + gone,
            reach,
            np.where(is_out(ground, walks) & (walks.far < reach), OUT, FREE),
            none,
            none,
        )
        return rays, walks

    def _put(self, index: int, aims: Aims, walk: Walks) -> None:
        self._put_in_order(index, [aims], [walk], True)

    def _put_in_order(self, index: int, aims: list[Aims], walks: list[Walks], on_right: bool) -> None:
        """Put rays after one, or, seen from their own side, before the next; in the order away from it."""
        joined = Aims.of(aims)
        joined = replace(joined, walk=self._n_walks + np.arange(len(joined)))
        self.walks += walks
        self._n_walks += len(joined)
        self._added.append(joined if on_right else joined.take(np.arange(len(joined))[::-1]))
        self._places.append(np.full(len(joined), float(index)))

    def _insert(self, kept: Bools) -> None:
        own = np.flatnonzero(kept)
        place = np.concatenate([own.astype(np.float64), *(p + 0.5 for p in self._places)])
        order = np.argsort(place, kind="stable")
        self.aims = Aims.of([self.aims.take(own), *self._added]).take(order)
        self._added, self._places = [], []


# ----------------------------------------------------------------------
# `Aims`: the rays of fronts that come to selvedges, and what becomes of each.

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


# ----------------------------------------------------------------------
# Rays that creep along a selvedge, and leave it where it turns away.
#
# So do shortest paths, which bend around its reflex corners.

STRAIGHT = 0.05
"""Radians that a selvedge may turn away before rays leave it, or turn in before none goes on along it."""

_LEAVES = 1e-4
_OFF_THE_VERTEX = 1e-4

_AT_THE_VERTEX = 0.02
"""Parts of an edge: a walk that ends so near to its vertex may be one that passes a corner there."""

_LEAST_WEDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Crept:
    """What leaves a place on a selvedge, in the order in which the way along it comes to it.

    Parameters
    ----------
    pivot, angle, lead : (k,)
        Rays that leave the selvedge: the vertex, as the tail of a halfedge of the wall, the direction from that, and
        how far it is to there.
    halfedge, start, end : (m,)
        The way along the selvedge, and from which part of each halfedge to which.
    state : int
        `AT_RIM` where the step ends on the selvedge, `OUT` where the selvedge turns into the way.
    """

    pivot: Ints
    angle: Floats
    lead: Floats
    halfedge: Ints
    start: Floats
    end: Floats
    state: int


def creep(ground: Ground, *, halfedge: int, place: float, on_right: bool, reach: float) -> Crept:
    """Walk along a selvedge from a place on a halfedge of it, with the selvedge on one's right or left."""
    walls, length = ground.walls, ground.frames.length
    leaving: list[tuple[int, float, float]] = []
    way: list[tuple[int, float, float]] = []
    gone, net, at, x, state = 0.0, 0.0, halfedge, place, AT_RIM
    while True:
        size = float(length[at])
        room = size - x if on_right else x
        if reach - gone <= room:
            end = float(
                np.clip((x + (reach - gone) * (1 if on_right else -1)) / size, _OFF_THE_VERTEX, 1 - _OFF_THE_VERTEX)
            )
            way.append((at, x / size, end))
            break
        way.append((at, x / size, 1.0 if on_right else 0.0))
        gone += room
        onward = int(walls.after[at] if on_right else walls.before[at])
        if not ground.is_selvedge[onward]:
            break
        pivot = onward if on_right else at
        turn = float(walls.angle[pivot]) - np.pi
        net = net + turn
        if net < -STRAIGHT:
            state = OUT
            break
        if net > STRAIGHT and turn > _LEAVES:
            angles = fan(turn)
            leaving += [(pivot, a if on_right else np.pi + turn - a, gone) for a in angles.tolist()]
            net = 0.0
        at, x = onward, 0.0 if on_right else float(length[onward])
    left, crept = np.array(leaving).reshape(-1, 3), np.array(way)
    corners, halfedges = left[:, 0].astype(np.int64), crept[:, 0].astype(np.int64)
    return Crept(corners, left[:, 1], left[:, 2], halfedges, crept[:, 1], crept[:, 2], state)


def fan(wedge: float) -> Floats:
    """Angles from a wedge down to 0, which is left out."""
    count = max(1, int(np.ceil(wedge / FAN_ANGLE)))
    return np.asarray(wedge * (1.0 - np.arange(count) / count))


def corner_passed(ground: Ground, walk: Walks, on_right: bool) -> tuple[int, float] | None:
    """The corner of a selvedge by which a walk is stopped as it just passes it, and the angle that opens behind."""
    wall, walls = int(walk.wall[0]), ground.walls
    part = float(walk.end[-1][(wall % 3 + 1) % 3])
    slant = float(np.arctan2(-walk.wall_uy[0], walk.wall_ux[0]))
    pivot = int(walls.after[wall]) if on_right else wall
    beyond = pivot if on_right else int(walls.before[wall])
    wedge = float(walls.angle[pivot]) - (np.pi + slant if on_right else 2 * np.pi - slant)
    is_there = (1.0 - part if on_right else part) < _AT_THE_VERTEX
    is_passed = is_there and wedge > -STRAIGHT and ground.is_selvedge[beyond]
    return (pivot, max(wedge, _LEAST_WEDGE)) if is_passed else None
