"""Obstacle shadows: where free borders stop some rays of a front, and what goes on beside and behind them.

The paper offsets closed polylines between borders that are all sources.  A free border, from which no distance starts,
is an obstacle: it cuts the front, which then is open.  Rays run along the front with later ones on the right::

      ^     ^    ^  .         .  a ray that the border stops: obstructed
      |     |    |  .____     |  one whose step arrives
      |     |    |  |    |    !  the last that arrives, found by bisection between the two
      i     |    !  j    | obstacle
    --+-----+----+--+----+--> front

Where neighbours i and j part so, the child either ends on the border (of the obstructed rays the first then ends
there), or the last ray passes a corner: behind it the front opens (`diffraction.py`).  The same is done at both ends of
an open front, where the free border may leave the front at more than a right angle.

An obstacle thinner than the gap between two rays stops none of them.  It is looked for wherever the chord between
neighbouring ends cannot be embedded.

The cost is 44 walks for each pair of neighbours that part; these are some two for each open front and corner.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, ranges
from weavecore.geometry.geodesics import Walks, on_halfedge, place_along, walk_far
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.chords import measure_chords
from weavecore.offsetting.propagation.diffraction import (
    STRAIGHT,
    DiffractedRays,
    diffract,
    fan_angles,
    find_passed_corner,
)
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.ray_directions import RayStarts, find_ray_frames
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves

ARRIVES, OBSTRUCTED, ENDS_ON_BORDER = 0, 1, 2
"""States of a ray: its step ends inside the surface; a free border is in its way; or it ends on one, with its child."""

_LEAST_FAN = 0.02
"""Radians between the last ray of an open front and the free border: a smaller wedge needs no ray."""

_BISECTIONS = 44
"""Until the gap between two rays is parts of 6e-14 wide: what rounding leaves of it."""

_MOST_ROUNDS = 12
"""Corners behind corners that one step may pass."""

_ARRIVED = 1e-3
"""Parts of the step: a ray that a free border stops so shortly before its end arrives there."""

_TRIALS = 16
"""Rays that are tried in a gap whose chord is not found, to hit the obstacle in it; plus one."""

_ASIDE = 1e-9
"""Radians by which the first ray behind a corner keeps to the side of the one that just passed it.

Both lie on one line, and may just touch another free border: rounding must not let one pass and stop the other.
"""

_AHEAD = 0.5
"""Parts of the step by which a child is prolonged at most to come to a free border."""

_OFF_THE_BORDER = 1e-9
"""Radians by which rays along the boundary are turned into the surface."""

_INSIDE = 1e-7
"""Barycentric coordinate of a creeping ray beside the border, so that it lies inside its faces."""


def resolve_obstacles(
    domain: Domain, starts: RayStarts, walks: Walks, reach: Floats, *, step: float, ahead: float
) -> tuple[RayTargets, Walks]:
    """All rays of fronts on a domain with free borders, and what becomes of each.

    Parameters
    ----------
    domain : Domain
    starts : RayStarts
        Of n rays.
    walks : Walks
        Their ways.
    reach : (n,) float64
        Their steps.
    step : float
        The spacing.
    ahead : float
        Length by which rays are walked beyond their steps.

    Returns
    -------
    targets : RayTargets
        In the order of the fronts and along them: the given rays, and those that obstacles ask for.
    walks : Walks
        Their ways in the same order.

    Raises
    ------
    Degenerate
        Where neighbours still part after all rounds; with the faces of the front.
    """
    return _ObstacleShadows(domain, starts, walks, reach, step=step, ahead=ahead).resolve()


@dataclass(frozen=True, eq=False)
class RayTargets:
    """Rays in the order of the fronts and along them, and where each comes to.

    Parameters
    ----------
    front : (n,) int64
    station, pivot, place, angle : (n,)
        As in `RayStarts`; the pivot may be any vertex of a free border that the ray has come to.
    direction : (n, 3) float64
        Direction in space in which the ray starts.
    lead : (n,) float64
        Length from the front to where the ray starts.
    reach : (n,) float64
        The step, less the lead.
    state : (n,) int64
        `ARRIVES`, `OBSTRUCTED` or `ENDS_ON_BORDER`.
    end_border : (n,) int64
        The free-border halfedge on which the ray ends; -1 where it does not.
    walk : (n,) int64
        Number of its walk.
    """

    front: Ints
    station: Floats
    pivot: Ints
    place: Floats
    angle: Floats
    direction: Floats
    lead: Floats
    reach: Floats
    state: Ints
    end_border: Ints
    walk: Ints

    def __len__(self) -> int:
        return len(self.front)

    def take(self, index: Ints) -> RayTargets:
        """The rays of these numbers, in their order."""
        return RayTargets(*(getattr(self, field.name)[index] for field in fields(self)))

    def at(self, number: int) -> RayTargets:
        """A single ray."""
        return self.take(np.array([number]))

    @staticmethod
    def concatenate(parts: list[RayTargets]) -> RayTargets:
        """All rays of several values."""
        return RayTargets(
            *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(RayTargets))
        )


class _ObstacleShadows:
    """The rays so far, and those that wait to be inserted between them.

    Parameters as of `resolve_obstacles`.
    """

    def __init__(
        self, domain: Domain, starts: RayStarts, walks: Walks, reach: Floats, *, step: float, ahead: float
    ) -> None:
        self._domain, self._fronts, self._step, self._ahead = domain, starts.curves, step, ahead
        self._targets = _first_targets(domain, starts, walks, reach)
        self._walks, self._n_walks = [walks], len(walks)
        self._added: list[RayTargets] = []
        self._added_after: list[Ints] = []

    def resolve(self) -> tuple[RayTargets, Walks]:
        """Insert rays until no neighbours part."""
        self._open_ends()
        self._find_thin_obstacles()
        i, j = self._find_partings()
        rounds = 0
        while len(i):
            if rounds == _MOST_ROUNDS:
                raise self._too_ragged(i)
            self._part(i, j)
            i, j = self._find_partings()
            rounds += 1
        walks = _gather_walks(self._walks, self._targets.walk)
        return replace(self._targets, walk=np.arange(len(self._targets))), walks

    def _too_ragged(self, i: Ints) -> Degenerate:
        segment, _ = self._fronts.locate(self._targets.station[i], self._targets.front[i])
        return Degenerate(
            "The polylines cannot be offset step by step around the corners of the other borders",
            remedy='Use the method "levels", or another spacing.',
            ids=np.unique(self._fronts.face[segment]).tolist(),
            kind="face",
        )

    def _find_partings(self) -> tuple[Ints, Ints]:
        """Neighbours of which one arrives and the other is obstructed."""
        i, j = self._find_neighbours()
        one, other = self._targets.state[i], self._targets.state[j]
        parts = (one == ARRIVES) & (other == OBSTRUCTED) | (one == OBSTRUCTED) & (other == ARRIVES)
        return i[parts], j[parts]

    def _find_neighbours(self) -> tuple[Ints, Ints]:
        """Pairs of rays that follow each other along a front."""
        front = self._targets.front
        offsets = offsets_of(np.bincount(front, minlength=len(self._fronts)))
        i = np.arange(len(front))
        is_last = i == offsets[1:][front] - 1
        j = np.where(is_last, offsets[:-1][front], i + 1)
        kept = ~is_last | (self._fronts.closed[front] & (j != i))
        return i[kept], j[kept]

    # Ends of open fronts.

    def _open_ends(self) -> None:
        """Insert what fills the wedges between the end rays of open fronts and the free border."""
        targets = self._targets
        offsets = offsets_of(np.bincount(targets.front, minlength=len(self._fronts)))
        kept = np.ones(len(targets), bool)
        state, direction = targets.state.copy(), targets.direction.copy()
        for front in np.flatnonzero(~self._fronts.closed & (np.diff(offsets) > 0)).tolist():
            for number, on_right in ((int(offsets[front]), False), (int(offsets[front + 1]) - 1, True)):
                end = targets.at(number)
                wedge = self._measure_wedge(end, on_right)
                kept[number] = wedge > _LEAST_FAN or wedge < -STRAIGHT
                if wedge < -STRAIGHT:
                    # Beyond the surface at its end, which may bend there: rays in between turn in the front's own face.
                    state[number], direction[number] = OBSTRUCTED, self._across_end(front, on_right)
                else:
                    away = fan_angles(wedge)[1:] if wedge > _LEAST_FAN else np.zeros(0)
                    self._add_diffracted(number if on_right else number - 1, end, away, on_right)
        self._targets = replace(targets, state=state, direction=direction)
        self._insert(kept)

    def _measure_wedge(self, end: RayTargets, on_right: bool) -> float:
        """Radians from the end ray of an open front to the free border; negative where the ray leads out."""
        angle = float(end.angle[0])
        if on_right:
            return angle
        angle += 2 * np.pi if angle < -np.pi / 2 else 0.0
        return self._full_angle(int(end.pivot[0]), float(end.place[0])) - angle

    def _full_angle(self, pivot: int, place: float) -> float:
        """Angle of the surface at a place on the boundary, in radians."""
        return np.pi if place > 0 else float(self._domain.boundary.angle[pivot])

    def _across_end(self, front: int, on_right: bool) -> Floats:
        """Unit vector (3,) at right angles to the first or the last segment of an open front, to its left."""
        fronts = self._fronts
        segment = np.array([fronts.offsets[front + 1] - 2 if on_right else fronts.offsets[front]])
        along = self._domain.points(fronts.face[segment], fronts.end[segment] - fronts.start[segment])[0]
        across = np.cross(self._domain.normals[fronts.face[segment[0]]], along)
        return np.asarray(across / max(float(np.linalg.norm(across)), np.finfo(float).tiny))

    # Obstacles between two rays that both arrive.

    def _find_thin_obstacles(self) -> None:
        """Insert obstructed rays between neighbours that pass an obstacle on both sides."""
        targets, walks = self._targets, _gather_walks(self._walks, self._targets.walk)
        i, j = self._find_neighbours()
        both = (targets.state[i] == ARRIVES) & (targets.state[j] == ARRIVES)
        both &= (targets.lead[i] == 0) & (targets.lead[j] == 0)
        i, j = i[both], j[both]
        face, weights = place_along(walks, targets.reach)
        apart = np.isinf(measure_chords(self._domain, face[i], weights[i], face[j], weights[j]))
        i, j = i[apart], j[apart]
        if len(i) == 0:
            return
        share = np.tile(np.arange(1, _TRIALS) / _TRIALS, len(i))
        one, other = targets.take(np.repeat(i, _TRIALS - 1)), targets.take(np.repeat(j, _TRIALS - 1))
        tried, tried_walks = _interpolate_rays(self._domain, self._fronts, one, other, np.ones(len(share), bool), share)
        hits = (tried.state == OBSTRUCTED).reshape(len(i), -1)
        for k, (first, is_hit) in enumerate(zip(hits.argmax(1).tolist(), hits.any(1).tolist())):
            number = np.array([k * (_TRIALS - 1) + first])
            trial, walk = tried.take(number), _take_walks(tried_walks, number)
            if is_hit:
                self._add(int(i[k]), trial, walk)
            else:
                self._split(int(i[k]), int(j[k]), trial, walk)
        self._insert(np.ones(len(targets), bool))

    def _split(self, i: int, j: int, between: RayTargets, walk: Walks) -> None:
        """Let the child end on both sides of an obstacle too thin for any ray, if there is one."""
        one, other, right = self._targets.at(i), self._targets.at(j), np.ones(1, bool)
        before, before_walk = _interpolate_rays(self._domain, self._fronts, one, other, right, np.zeros(1))
        behind, behind_walk = _interpolate_rays(self._domain, self._fronts, one, other, right, np.ones(1))
        left_end, left_walk = self._prolong(before, before_walk, True)
        right_end, right_walk = self._prolong(behind, behind_walk, False)
        if left_end.end_border[0] != NO_TWIN and right_end.end_border[0] != NO_TWIN:
            self._add(i, left_end, left_walk)
            self._add(i, replace(between, state=np.array([OBSTRUCTED])), walk)
            self._add(i, right_end, right_walk)

    # Neighbours of which one is obstructed.

    def _part(self, i: Ints, j: Ints) -> None:
        """Insert what belongs between neighbours i, j (k,) that part."""
        targets = self._targets
        on_right = targets.state[i] == ARRIVES
        arriving = targets.take(np.where(on_right, i, j))
        obstructed = targets.take(np.where(on_right, j, i))
        low, high = self._bisect(arriving, obstructed, on_right)
        last, last_walks = _interpolate_rays(self._domain, self._fronts, arriving, obstructed, on_right, low)
        first, first_walks = _interpolate_rays(self._domain, self._fronts, arriving, obstructed, on_right, high)
        for k, (after, right) in enumerate(zip(i.tolist(), on_right.tolist())):
            one = np.array([k])
            if not self._end_or_open(after, first.take(one), _take_walks(first_walks, one), right):
                self._add(after, *self._prolong(last.take(one), _take_walks(last_walks, one), right))
        self._insert(np.ones(len(targets), bool))

    def _bisect(self, arriving: RayTargets, obstructed: RayTargets, on_right: Bools) -> tuple[Floats, Floats]:
        """Shares (k,) of the gaps at which the last ray arrives and the first does not."""
        low, high = np.zeros(len(arriving)), np.ones(len(arriving))
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            rays, _ = _interpolate_rays(self._domain, self._fronts, arriving, obstructed, on_right, middle)
            arrives = rays.state == ARRIVES
            low, high = np.where(arrives, middle, low), np.where(arrives, high, middle)
        return low, high

    def _end_or_open(self, after: int, obstructed: RayTargets, walk: Walks, on_right: bool) -> bool:
        """Let the child end on the border where a ray is stopped, or open behind a corner; False where neither fits."""
        wall = int(walk.stopped_at[0])
        if wall == NO_TWIN:
            return False
        left = float(obstructed.reach[0]) - float(walk.far[0])
        if left <= _ARRIVED * self._step:
            ended = replace(obstructed, reach=walk.far, state=np.array([ENDS_ON_BORDER]), end_border=walk.stopped_at)
            self._add(after, ended, walk)
            return True
        corner = find_passed_corner(self._domain, walk, on_right)
        if corner is None:
            return False
        pivot, wedge = corner
        away = fan_angles(wedge)
        away[0] += _ASIDE
        at_corner = replace(
            obstructed,
            pivot=np.array([pivot]),
            place=np.zeros(1),
            lead=obstructed.lead + walk.far,
            reach=np.array([left]),
        )
        self._add_diffracted(after, at_corner, away, on_right)
        return True

    def _prolong(self, ray: RayTargets, walk: Walks, on_right: bool) -> tuple[RayTargets, Walks]:
        """A ray and, from its end, straight on along the child to the free border on its right or left."""
        domain, face = self._domain, walk.face[-1:]
        here, there = domain.plane_points(face, walk.start[-1:])[0], domain.plane_points(face, walk.end[-1:])[0]
        ux, uy = (there - here) / max(float(np.linalg.norm(there - here)), np.finfo(float).tiny)
        ux, uy = (uy, -ux) if on_right else (-uy, ux)
        x, y, dx, dy = (np.array([value]) for value in (*there, ux, uy))
        on = walk_far(domain.frames, 3 * face, x, y, dx, dy, np.array([_AHEAD * self._step]))
        both = Walks(
            np.array([0, len(walk.face) + len(on.face)]),
            np.concatenate([walk.face, on.face]),
            np.concatenate([walk.start, on.start]),
            np.concatenate([walk.end, on.end]),
            np.concatenate([walk.begin, on.begin + walk.far]),
            np.concatenate([walk.finish, on.finish + walk.far]),
            walk.far + on.far,
            on.stopped_at,
            on.stop_ux,
            on.stop_uy,
        )
        end_border = np.where(is_obstructed(domain, on), on.stopped_at, NO_TWIN)
        return replace(ray, reach=both.far, state=np.array([ENDS_ON_BORDER]), end_border=end_border), both

    # Rays that leave the border.

    def _add_diffracted(self, after: int, start: RayTargets, away: Floats, on_right: bool) -> None:
        """Add a fan at a place on the boundary, what leaves the border further on, and the creeping ray.

        ``start`` is a single ray with that place; ``away`` (k,) are the angles of the fan from the free border, which
        lies on the right or on the left.
        """
        domain, pivot, place = self._domain, int(start.pivot[0]), float(start.place[0])
        if on_right or place > 0:
            halfedge, at = pivot, place
        else:
            halfedge = int(domain.boundary.before[pivot])
            at = float(domain.frames.length[halfedge])
        if not domain.is_free_border[halfedge]:
            return
        reach, full = float(start.reach[0]), self._full_angle(pivot, place)
        diffracted = diffract(domain, halfedge=halfedge, place=at, on_right=on_right, reach=reach)
        fan, fan_walks = self._leave_border(start, away if on_right else full - away, diffracted)
        along = _walk_along_border(domain, diffracted)
        state = ENDS_ON_BORDER if diffracted.ends_on_border else OBSTRUCTED
        # Where the free border ends at a source, the creeping ray is stopped there.
        ends_here = diffracted.ends_on_border and float(along.far[0]) > reach * (1 - _ARRIVED)
        creeping = replace(
            start,
            angle=np.array([0.0 if on_right else full]),
            direction=domain.frames.directions(
                np.array([halfedge]), np.array([1.0 if on_right else -1.0]), np.zeros(1)
            ),
            reach=np.minimum(along.far, reach) if diffracted.ends_on_border else start.reach,
            state=np.array([state]),
            end_border=np.where(ends_here, diffracted.halfedge[-1:], NO_TWIN),
        )
        self._add_in_order(after, [fan, creeping], [fan_walks, along], on_right)

    def _leave_border(self, start: RayTargets, angles: Floats, diffracted: DiffractedRays) -> tuple[RayTargets, Walks]:
        """Rays that leave a free border: at these angles (k,) where the creeping ray begins, and further on."""
        domain, k = self._domain, len(angles)
        pivot = np.concatenate([np.repeat(start.pivot, k), diffracted.pivot])
        place = np.concatenate([np.repeat(start.place, k), np.zeros(len(diffracted.pivot))])
        angle = np.concatenate([angles, diffracted.angle])
        gone = np.concatenate([np.zeros(k), diffracted.lead])
        n = len(angle)
        halfedge, px, ux, uy = find_ray_frames(domain, pivot, place, angle)
        reach = start.reach - gone
        walks = walk_far(domain.frames, halfedge, px, np.zeros(n), ux, uy, reach + self._ahead)
        rays = RayTargets(
            front=np.repeat(start.front, n),
            station=np.repeat(start.station, n),
            pivot=pivot,
            place=place,
            angle=angle,
            direction=domain.frames.directions(halfedge, ux, uy),
            lead=start.lead + gone,
            reach=reach,
            state=np.where(is_obstructed(domain, walks) & (walks.far < reach), OBSTRUCTED, ARRIVES),
            end_border=np.full(n, NO_TWIN),
            walk=np.full(n, NO_TWIN),
        )
        return rays, walks

    # Insertion.

    def _add(self, after: int, ray: RayTargets, walk: Walks) -> None:
        """Add a ray after the one of that number, and after what was added there before."""
        self._add_in_order(after, [ray], [walk], True)

    def _add_in_order(self, after: int, rays: list[RayTargets], walks: list[Walks], on_right: bool) -> None:
        """Add rays in their order, or in the reverse one where they go away to the left of the next ray."""
        joined = RayTargets.concatenate(rays)
        joined = replace(joined, walk=self._n_walks + np.arange(len(joined)))
        self._walks += walks
        self._n_walks += len(joined)
        self._added.append(joined if on_right else joined.take(np.arange(len(joined))[::-1]))
        self._added_after.append(np.full(len(joined), after))

    def _insert(self, kept: Bools) -> None:
        """Sort the added rays in behind their numbers, and leave out rays that are not kept (n,)."""
        own = np.flatnonzero(kept)
        # Ray k has key 2k, and what comes after it 2k + 1: those in the order in which they were added.
        key = np.concatenate([2 * own, *(2 * after + 1 for after in self._added_after)])
        order = np.argsort(key, kind="stable")
        self._targets = RayTargets.concatenate([self._targets.take(own), *self._added]).take(order)
        self._added, self._added_after = [], []


def _first_targets(domain: Domain, starts: RayStarts, walks: Walks, reach: Floats) -> RayTargets:
    """The given rays, obstructed where a free border stops them within their steps."""
    n = len(starts.halfedge)
    return RayTargets(
        front=starts.owner,
        station=starts.station,
        pivot=starts.pivot,
        place=starts.place,
        angle=starts.angle,
        direction=domain.frames.directions(starts.halfedge, starts.ux, starts.uy),
        lead=np.zeros(n),
        reach=reach,
        state=np.where(is_obstructed(domain, walks) & (walks.far < reach), OBSTRUCTED, ARRIVES),
        end_border=np.full(n, NO_TWIN),
        walk=np.arange(n),
    )


def _interpolate_rays(
    domain: Domain, fronts: SurfaceCurves, one: RayTargets, other: RayTargets, on_right: Bools, share: Floats
) -> tuple[RayTargets, Walks]:
    """Rays at shares (n,) of the gap from each ray to its neighbour on the right or left, and their walks.

    Where both start at a front they start between the two; where they start at one place of the boundary only their
    directions differ; a diffracted ray turns about its corner towards the border.
    """
    by_angle = (one.pivot != NO_TWIN) & (one.pivot == other.pivot) & (one.place == other.place)
    turned = by_angle | (one.lead > 0) | (other.lead > 0)
    full = np.where(one.place == 0.0, domain.boundary.angle[one.pivot], np.pi)
    goal = np.where(by_angle, other.angle, np.where(on_right, 0.0, full))
    angle = one.angle + (goal - one.angle) * share
    pivot = np.where(turned, one.pivot, NO_TWIN)
    place = np.where(turned, one.place, 0.0)
    station = _interpolate_stations(fronts, one, other, on_right, share)
    direction = one.direction * (1 - share)[:, None] + other.direction * share[:, None]
    reach = np.where(turned, one.reach, one.reach * (1 - share) + other.reach * share)
    face, weights = fronts.interpolate(*fronts.locate(station, one.front))
    x, y = domain.plane_points(face, weights).T
    ux, uy = domain.plane_directions(face, direction)
    h = 3 * face
    at = np.flatnonzero(turned)
    inside = _turn_inside(domain, pivot, place, angle)
    h[at], x[at], ux[at], uy[at] = find_ray_frames(domain, pivot[at], place[at], inside[at])
    y = np.where(turned, 0.0, y)
    walks = walk_far(domain.frames, h, x, y, ux, uy, reach)
    none = np.full(len(one), NO_TWIN)
    state = np.where(is_obstructed(domain, walks), OBSTRUCTED, ARRIVES)
    lead = np.where(turned, one.lead, 0.0)
    return RayTargets(one.front, station, pivot, place, angle, direction, lead, reach, state, none, none), walks


def _interpolate_stations(
    fronts: SurfaceCurves, one: RayTargets, other: RayTargets, on_right: Bools, share: Floats
) -> Floats:
    """Stations (n,) at shares of the way, around the ends of closed fronts as well."""
    total = np.concatenate([[0.0], np.cumsum(fronts.segment_lengths)])
    low, high = total[fronts.offsets[one.front]], total[fronts.offsets[one.front + 1]]
    there = other.station + np.where(on_right & (other.station < one.station), high - low, 0.0)
    there = there - np.where(~on_right & (other.station > one.station), high - low, 0.0)
    station = one.station + (there - one.station) * share
    station = np.where(station >= high, station - (high - low), station)
    return np.asarray(np.where(station < low, station + (high - low), station))


def _turn_inside(domain: Domain, pivot: Ints, place: Floats, angle: Floats) -> Floats:
    """Directions (n,) from boundary halfedges, turned into the surface where they lead along the boundary or out."""
    full = np.where(place == 0.0, domain.boundary.angle[pivot], np.pi)
    return np.clip(angle, _OFF_THE_BORDER, full - _OFF_THE_BORDER)


def is_obstructed(domain: Domain, walks: Walks) -> Bools:
    """Which walks were ended by a free border.

    Parameters
    ----------
    domain : Domain
    walks : Walks
        Of n rays.

    Returns
    -------
    (n,) bool
    """
    return np.asarray(walks.is_blocked & domain.is_free_border[walks.stopped_at])


# ----------------------------------------------------------------------
# Walks as ragged arrays.


def _walk_along_border(domain: Domain, diffracted: DiffractedRays) -> Walks:
    """The way of a creeping ray, just inside the faces beside the border."""
    h, start, end = diffracted.halfedge, diffracted.start, diffracted.end
    total = np.concatenate([[0.0], np.cumsum(np.abs(end - start) * domain.frames.length[h])])
    return Walks(
        offsets=np.array([0, len(h)]),
        face=h // 3,
        start=_lift_off_edge(on_halfedge(h, start)),
        end=_lift_off_edge(on_halfedge(h, end)),
        begin=total[:-1],
        finish=total[1:],
        far=total[-1:],
        stopped_at=np.full(1, NO_TWIN),
        stop_ux=np.zeros(1),
        stop_uy=np.zeros(1),
    )


def _lift_off_edge(weights: Floats) -> Floats:
    kept = np.maximum(weights, _INSIDE)
    return np.asarray(kept / kept.sum(1, keepdims=True))


def _gather_walks(parts: list[Walks], order: Ints) -> Walks:
    """The walks of several values, numbered one value after the other, in the given order."""
    offsets = offsets_of(np.concatenate([np.diff(part.offsets) for part in parts]))
    names = [field.name for field in fields(Walks)][1:]
    joined = Walks(offsets, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))
    return _take_walks(joined, order)


def _take_walks(walks: Walks, index: Ints) -> Walks:
    """The walks of these numbers, in their order."""
    counts = np.diff(walks.offsets)[index]
    offsets = offsets_of(counts)
    row = ranges(walks.offsets[:-1][index], counts)
    return Walks(
        offsets,
        walks.face[row],
        walks.start[row],
        walks.end[row],
        walks.begin[row],
        walks.finish[row],
        walks.far[index],
        walks.stopped_at[index],
        walks.stop_ux[index],
        walks.stop_uy[index],
    )
