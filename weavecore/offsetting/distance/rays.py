r"""Rays: straightest geodesics that leave the origins at right angles, all traced at the same time.

Each ray stands for a short piece of the *front*, the set of points at one distance.  Straight lines keep their
distance exactly (Yan et al. 2016, §4.2, offset each vertex along n × t; here the same lines run on through all
generations, so that no error adds up from one to the next), and a circle of curvature k is a circle of
curvature k / (1 + k s) after a length s.

A ray lives in the frame of the halfedge by which it enters a face: origin at the tail, x along the halfedge,
y into the face.  It starts at (px, 0), runs in the unit direction (ux, uy) and leaves by the face's *next* halfedge
if the apex lies on its left, else by the *previous* one::

                     apex (apex_x, apex_y)
                       *
         previous    / |\            forward : from the ray's start to the nearest point to the apex on it
                   /   | \           lateral : from there to the apex, > 0 on the left (as here)
                 /   ^ |  \  next
               /    /     \
             /     / ray   \
      tail *------*---------* head      x ->
           |<-px->|

In every face a ray offers the apex its distance from the front (`TentativeDistances`).  A ray stops where the edge
that it reaches has a lower distance already: the first front wins, which resolves self- and mutual intersections
(§4.3, §4.4) without a search for them.

A vertex with more than a full turn of angle (a saddle) bends the shortest paths that pass it on the far side.  It
becomes the ray's *blocker* on that side, and corners behind it are measured around it (Mitchell, Mount and
Papadimitriou 1987: a saddle is a pseudo-source for what lies in its shadow).

Work: a constant number of array operations for each face that a ray crosses.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, sorted_unique
from weavecore.geometry.elementary import arctangents, sines_and_cosines
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge

MIN_SADDLE_EXCESS = 0.02
"""Radians above a full turn from which a vertex blocks the view; less bends a path by less than rays are apart."""

MAX_LAG_OF_EDGE = 0.3
"""A ray stops where it comes later than its edge's interpolated distance by more than this part of the edge: what
linear interpolation errs on a round front stays below it."""

MAX_LAG_OF_CORNER = 0.05
"""The same against the way along the edge from one of its ends, which is an upper bound but for rounding."""

LATERAL_PENALTY = 0.4
"""Added to an offered distance when offers are compared, for each squared lateral offset over mean edge length: the
error of a circle of estimated curvature grows with that square, so the nearest ray wins."""

COMPACTED_SHARE = 0.75
r"""Rays that have stopped are put aside when fewer than this part still move; copying more often costs more."""

_EDGE_MARGIN = 1e-9  # of an edge: rays cross it no nearer to its ends
_LEAST_SINE = 1e-12  # of the angle between a ray and an edge that it crosses

AT, SIDE, DISTANCE, EXCESS = range(4)
"""Rows of a blocker: distance travelled and lateral offset where it lies, its distance, its angle above a full turn."""

NO_RAY = -1
NO_HALFEDGE = -1

_Record = TypeVar("_Record", bound="_Columns")


class _Columns:
    """A record of arrays whose last axis counts rays."""

    def take(self: _Record, index: Ints) -> _Record:
        """Copies of the rows of some rays."""
        return type(self)(*(column[..., index] for column in self._columns()))

    def joined(self: _Record, other: _Record) -> _Record:
        """The rows of both, these first."""
        pairs = zip(self._columns(), other._columns())
        return type(self)(*(np.concatenate(pair, axis=-1) for pair in pairs))

    def put(self: _Record, index: Ints, part: _Record) -> None:
        """Write the rows of some rays."""
        for column, values in zip(self._columns(), part._columns()):
            column[..., index] = values

    def _columns(self) -> list[Floats]:
        return [getattr(self, field.name) for field in fields(self)]  # type: ignore[arg-type]  # all subclasses are dataclasses


@dataclass
class RayState(_Columns):
    """What changes as rays run.

    Parameters
    ----------
    halfedge : (n,) int64
        Edge by which each ray enters its face.
    px, ux, uy : (n,) float64
        Place along that edge, and unit direction in its frame (uy > 0).
    distance : (n,) float64
        From the origins to that place; infinite once the ray has stopped.
    curvature : (n,) float64
        Of the front there: positive where rays spread, infinite at a point source.
    left, right : (4, n) float64
        Blockers on both sides.
    """

    halfedge: Ints
    px: Floats
    ux: Floats
    uy: Floats
    distance: Floats
    curvature: Floats
    left: Floats
    right: Floats


@dataclass
class RayStart(_Columns):
    """What a ray keeps from its start.

    Parameters
    ----------
    birth : (n,) float64
        Distance at its start.
    half_width : (n,) float64
        How far the front was straight to both sides there.
    """

    birth: Floats
    half_width: Floats


@dataclass
class FrontLinks(_Columns):
    """Neighbours along the front.

    Parameters
    ----------
    after : (n,) int64
        Next ray along the front, -1 where there is none.
    gap : (n,) float64
        Width between the two when last measured, -1 if it was not.
    growth : (n,) float64
        Curvature of the front between the two.
    priority : (n,) int64
        Thinning priority: of crowded neighbours those with the least are removed first.
    """

    after: Ints
    gap: Floats
    growth: Floats
    priority: Ints


@dataclass
class GeodesicRays:
    """Rays of one front: moving state, start and links, each with one row a ray."""

    state: RayState
    start: RayStart
    links: FrontLinks

    @classmethod
    def starting(
        cls, halfedge: Ints, px: Floats, ux: Floats, uy: Floats, distance: Floats, curvature: Floats, half_width: Floats
    ) -> GeodesicRays:
        """Rays with an open view and no neighbours.

        Parameters
        ----------
        halfedge : (n,) int64
        px, ux, uy, distance, curvature : (n,) float64
            As of `RayState`.
        half_width : (n,) float64
            As of `RayStart`.
        """
        n = len(halfedge)
        left, right = np.zeros((4, n)), np.zeros((4, n))
        left[SIDE], right[SIDE] = np.inf, -np.inf
        return cls(
            RayState(halfedge, px, ux, uy, distance, curvature, left, right),
            RayStart(distance.copy(), half_width),
            FrontLinks(np.full(n, NO_RAY), np.full(n, -1.0), np.zeros(n), np.zeros(n, np.int64)),
        )

    def __len__(self) -> int:
        return len(self.state.halfedge)

    def take(self, index: Ints) -> GeodesicRays:
        """Copies of some rays; links still count in the old numbering."""
        return GeodesicRays(self.state.take(index), self.start.take(index), self.links.take(index))

    def joined(self, other: GeodesicRays) -> GeodesicRays:
        """Both, these first; links of the other must count from these on."""
        return GeodesicRays(
            self.state.joined(other.state), self.start.joined(other.start), self.links.joined(other.links)
        )

    def without(self, gone: Bools) -> GeodesicRays:
        """The other rays, linked over those that are gone; such links have no known gap.

        Parameters
        ----------
        gone : (n,) bool

        Notes
        -----
        Rays that are gone hand on their links: by pointer doubling, so that runs of any length are bridged in
        log2(n) rounds.
        """
        n, after = len(self), self.links.after
        none = n  # an extra element stands for "no ray"
        onward = np.append(np.where(gone, np.where(after >= 0, after, none), np.arange(n)), none)
        for _ in range(n.bit_length()):
            onward = onward[onward]
        target = onward[np.where(after >= 0, after, none)]
        is_lost = (target == none) | np.append(gone, True)[target] | (target == np.arange(n))
        bridged = (after >= 0) & gone[after]
        rest = self.take(np.flatnonzero(~gone))
        number = np.append(np.cumsum(~gone) - 1, NO_RAY)
        rest.links.after = np.where(is_lost, NO_RAY, number[target])[~gone]
        rest.links.gap[bridged[~gone]] = -1.0
        return rest

    def stopped(self) -> Bools:
        """(n,) whether each ray has stopped."""
        return np.isinf(self.state.distance)


def advance(
    frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays, until: float, *, first: int = 0
) -> None:
    """Step rays until each has come as far as a distance, or stopped.

    Parameters
    ----------
    frames : Unfolding
    tentative : TentativeDistances
        Gets the offers.
    rays : GeodesicRays
        Changed in place.
    until : float
        In median edge lengths.
    first : int
        Number of the first ray to step.
    """
    index = first + np.flatnonzero(rays.state.distance[first:] < until)
    state, start = rays.state.take(index), rays.start.take(index)
    while len(index):
        _step(frames, tentative, state, start)
        tentative.n_steps += 1
        tentative.n_crossed += len(index)
        moving = state.distance < until
        if int(moving.sum()) < COMPACTED_SHARE * len(index):
            done, go = np.flatnonzero(~moving), np.flatnonzero(moving)
            rays.state.put(index[done], state.take(done))
            index, state, start = index[go], state.take(go), start.take(go)


def _step(frames: Unfolding, tentative: TentativeDistances, state: RayState, start: RayStart) -> None:
    """Take rays across the faces ahead of them; those that are no longer first stop.

    Also takes rays that have come far enough, until `advance` puts them aside: they go a face further.
    """
    is_left = _offer_apex(frames, tentative, state, start)
    edge, place, run, ux, uy = _cross_face(frames, state, is_left)
    _enter(frames, tentative, state, edge, place, run)
    state.ux, state.uy = ux, uy


def _offer_apex(frames: Unfolding, tentative: TentativeDistances, state: RayState, start: RayStart) -> Bools:
    """Offer the corner ahead its distance from the front; (n,) whether it lies on the left of the ray."""
    h, ux, uy = state.halfedge, state.ux, state.uy
    apex, apex_y = frames.apex[h], frames.apex_y[h]
    dx = frames.apex_x[h] - state.px
    forward, lateral = ux * dx + uy * apex_y, ux * apex_y - uy * dx
    is_left: Bools = lateral > 0
    rise, ahead, aside = front_distance(state.curvature, forward, lateral)
    with np.errstate(invalid="ignore"):  # stopped rays not put aside yet: infinite, and their offers lose
        rise += _around_end_of_piece(state.curvature, start, state.distance + rise, lateral)
    travel = state.distance + forward
    behind = _around_blockers(state, is_left, travel, lateral, rise, ahead, aside)
    offered = state.distance + rise
    tentative.offer(apex, offered, lateral, h, ux * ahead - uy * aside, uy * ahead + ux * aside)
    _add_blockers(frames, state, is_left, apex, np.stack([travel, lateral, offered]), behind)
    return is_left


def _cross_face(frames: Unfolding, state: RayState, is_left: Bools) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """Where rays leave their faces.

    With (cx, cy) the unit direction of the edge that is left and base the distance along x from the ray to the
    vertex that this edge shares with the entry edge, the law of sines gives the run to it: base · cy / sine, where the
    sine of the angle between ray and edge is ux · cy − uy · cx.

    Returns
    -------
    edge : (n,) int64
        Halfedge of the face that is left.
    place : (n,) float64
        Place on its twin.
    run : (n,) float64
        Length of the way through the face.
    ux, uy : (n,) float64
        Direction in the frame of the twin.
    """
    h, ux, uy = state.halfedge, state.ux, state.uy
    edge = np.where(is_left, next_halfedge(h), previous_halfedge(h))
    size, length, apex_x, apex_y = frames.length[edge], frames.length[h], frames.apex_x[h], frames.apex_y[h]
    cx, cy = np.where(is_left, apex_x - length, -apex_x) / size, np.where(is_left, apex_y, -apex_y) / size
    sine = np.maximum(ux * cy - uy * cx, _LEAST_SINE)
    base = np.where(is_left, length - state.px, -state.px)
    run = np.maximum(base * cy / sine, 0)
    # `next` starts at the shared vertex, `previous` ends there; the twin counts from the other end.
    from_shared = (run * ux - base) * cx + run * uy * cy
    place = np.where(is_left, size - from_shared, -from_shared)
    place = np.clip(place, _EDGE_MARGIN * size, (1 - _EDGE_MARGIN) * size)
    return edge, place, run, -(ux * cx + uy * cy), sine


def _enter(
    frames: Unfolding, tentative: TentativeDistances, state: RayState, edge: Ints, place: Floats, run: Floats
) -> None:
    """Move rays on to the twins of the edges that they leave by, or stop them there."""
    size, twin = frames.length[edge], frames.twin[edge]
    point = np.isinf(state.curvature)
    k = np.where(point, 0.0, state.curvature)
    # A front that converges has its centre at k run = -1; the rays beyond it are late and stop below.
    with np.errstate(divide="ignore"):
        state.curvature = np.where(point & (run > 0), 1 / run, np.where(point, np.inf, k / (1 + k * run)))
    distance = state.distance + run
    start, end = tentative.distance[frames.head[edge]], tentative.distance[frames.tail[edge]]
    with np.errstate(invalid="ignore"):  # both ends may be unreached still: then nothing stops the ray
        interpolated = start + (end - start) * (place / size)
    latest = np.fmin(
        interpolated + MAX_LAG_OF_EDGE * size,
        np.minimum(start + place, end + size - place) + MAX_LAG_OF_CORNER * size,
    )
    stops = (twin < 0) | (distance > latest) | ~np.isfinite(distance)
    state.halfedge = np.where(twin < 0, state.halfedge, twin)
    state.px = place
    state.distance = np.where(stops, np.inf, distance)


def front_distance(curvature: Floats, forward: Floats, lateral: Floats) -> tuple[Floats, Floats, Floats]:
    """Distance from a circular front, and the direction of the shortest path.

    The front passes through the origin at right angles to the forward axis; its centre lies at −1/k.  With
    r = |(1 + k f, k l)| the distance is (r − 1)/k, written here as (2 f + k (f² + l²)) / (r + 1), which also holds
    for k = 0.

    Parameters
    ----------
    curvature : (n,) float64
        k; infinite for a point source at the origin.
    forward, lateral : (n,) float64
        f and l of the place that is measured.

    Returns
    -------
    distance : (n,) float64
        Negative behind the front.
    ahead, aside : (n,) float64
        Unit direction, forward and lateral, in which the path arrives.
    """
    point = np.isinf(curvature)
    k = np.where(point, 0.0, curvature)
    ahead, aside = 1 + k * forward, k * lateral
    radius = np.sqrt(ahead * ahead + aside * aside)
    distance = (2 * forward + k * (forward * forward + lateral * lateral)) / (radius + 1.0)
    if point.any():
        straight = np.sqrt(forward * forward + lateral * lateral)
        distance = np.where(point, straight, distance)
        ahead, aside = np.where(point, forward, ahead), np.where(point, lateral, aside)
        radius = np.where(point, straight, radius)
    radius = np.maximum(radius, np.finfo(float).tiny)
    return distance, ahead / radius, aside / radius


def _around_end_of_piece(curvature: Floats, start: RayStart, distance: Floats, lateral: Floats) -> Floats:
    """What a path is longer by where its start lies beyond the end of the front's straight piece."""
    beyond = np.maximum(np.abs(lateral) - start.half_width, 0)
    run = np.maximum(distance - start.birth, 0)
    longer: Floats = np.sqrt(run * run + beyond * beyond) - run
    return np.where(np.isinf(curvature), 0.0, longer)


def _around_blockers(
    state: RayState, is_left: Bools, travel: Floats, lateral: Floats, rise: Floats, ahead: Floats, aside: Floats
) -> Bools:
    """Measure the corners that lie behind a blocker around it, in place; (n,) which ones those are.

    Seen from the blocker, a path bends by the angle between the corner's direction and the front's, less the
    excess angle, through which paths pass on the blocker's other side.
    """
    at, side = np.where(is_left, state.left[:2], state.right[:2])
    blocked: Bools = np.isfinite(side)
    m = np.flatnonzero(blocked)
    if len(m) == 0:
        return blocked
    curvature, is_left_there = state.curvature[m], is_left[m]
    k = np.where(np.isinf(curvature), 0.0, curvature)
    with np.errstate(divide="ignore", invalid="ignore"):  # where the front had its centre at the blocker: not behind
        at_blocker = k / (1 + k * (at[m] - state.distance[m]))
        edge = side[m] * (1 + at_blocker * (travel[m] - at[m]))
        hidden = np.where(is_left_there, lateral[m] > edge, lateral[m] < edge)
    behind: Bools = np.zeros(len(blocked), bool)
    behind[m[hidden]] = True
    m, kb = m[hidden], at_blocker[hidden]
    if len(m) == 0:
        return behind
    blocker = np.where(is_left[m], state.left[:, m], state.right[:, m])
    forward, offset = travel[m] - blocker[AT], lateral[m] - blocker[SIDE]
    far = np.sqrt(forward * forward + offset * offset)
    turned = arctangents(kb * blocker[SIDE], 1.0)
    bend = arctangents(offset, forward) - turned
    kept = np.sign(bend) * np.maximum(np.abs(bend) - blocker[EXCESS], 0)
    sine, cosine = sines_and_cosines(kept)
    longer, gx, gy = front_distance(kb, far * cosine, far * sine)
    longer += blocker[DISTANCE] - state.distance[m]
    higher = longer > rise[m]
    turn = (bend - kept + turned)[higher]
    gx, gy, m = gx[higher], gy[higher], m[higher]
    rise[m] = longer[higher]
    sine, cosine = sines_and_cosines(turn)
    ahead[m], aside[m] = gx * cosine - gy * sine, gy * cosine + gx * sine
    return behind


def _add_blockers(
    frames: Unfolding, state: RayState, is_left: Bools, apex: Ints, values: Floats, behind: Bools
) -> None:
    """Make saddles in view the blockers of the rays that pass them."""
    excess = frames.excess[apex]
    saddle = (excess > MIN_SADDLE_EXCESS) & ~behind & np.isfinite(values[DISTANCE])
    if not saddle.any():
        return
    for side, blockers in ((is_left, state.left), (~is_left, state.right)):
        m = np.flatnonzero(saddle & side)
        blockers[:3, m] = values[:, m]
        blockers[EXCESS, m] = excess[m]


def offer_at_start(frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays) -> None:
    """Offer both ends of the edges on which rays start their distances.

    Parameters
    ----------
    frames : Unfolding
    tentative : TentativeDistances
    rays : GeodesicRays
        None of them stopped.
    """
    state = rays.state
    for vertex, offset in (
        (frames.tail[state.halfedge], -state.px),
        (frames.head[state.halfedge], frames.length[state.halfedge] - state.px),
    ):
        forward, lateral = state.ux * offset, -state.uy * offset
        rise, ahead, aside = front_distance(state.curvature, forward, lateral)
        distance = state.distance + rise
        distance = distance + _around_end_of_piece(state.curvature, rays.start, distance, lateral)
        distance[state.distance + forward < 0] = np.inf
        ux, uy = state.ux * ahead - state.uy * aside, state.uy * ahead + state.ux * aside
        tentative.offer(vertex, distance, lateral, state.halfedge, ux, uy)


class TentativeDistances:
    """Best offer of each vertex so far: its distance, and the direction in which the path arrives.

    Offers are compared by a *score*, the distance plus a penalty on the square of the lateral offset.

    Parameters
    ----------
    frames : Unfolding
    sources : (s,) int64
        Vertices at distance 0.

    Attributes
    ----------
    distance, score : (V,) float64
        Infinite where a vertex has not been reached.
    halfedge : (V,) int64
        By which the best ray entered its face, -1 where there is none; ``ux, uy`` are in its frame.
    ux, uy : (V,) float64
        Unit direction in which the path arrives.
    last_reached : int
        One of the vertices that got their first offer last.
    n_steps : int
        How often rays have been stepped across faces, all that move at once.
    n_crossed : int
        How many faces they have crossed.
    """

    def __init__(self, frames: Unfolding, sources: Ints) -> None:
        n = len(frames.vertices)
        self.n_steps = self.n_crossed = 0
        self.frames = frames
        self.score = np.full(n, np.inf)
        self.distance = np.full(n, np.inf)
        self.halfedge = np.full(n, NO_HALFEDGE, np.int64)
        self.ux, self.uy = np.zeros(n), np.zeros(n)
        self.score[sources] = -np.inf
        self.distance[sources] = 0.0
        self._penalty = LATERAL_PENALTY / frames.mean_length
        self._reached: list[Ints] = [sources]
        self.last_reached = int(sources[0])

    def offer(self, vertex: Ints, distance: Floats, lateral: Floats, halfedge: Ints, ux: Floats, uy: Floats) -> None:
        """Keep the offers that beat what their vertices have.

        Parameters
        ----------
        vertex : (n,) int64
            May repeat.
        distance, lateral : (n,) float64
            Distance, and offset of the vertex from the ray.
        halfedge : (n,) int64
        ux, uy : (n,) float64
            Arrival in the frame of the halfedge.
        """
        score = distance + self._penalty[vertex] * lateral * lateral
        better = np.flatnonzero(score < self.score[vertex])
        if len(better) == 0:
            return
        first = better[np.isinf(self.score[vertex[better]])]
        if len(first):
            self._reached.append(vertex[first])
            self.last_reached = int(vertex[first[0]])
        while len(better):  # where one vertex got several, the last one written need not be the best
            v = vertex[better]
            self.score[v] = score[better]
            self.distance[v] = distance[better]
            self.halfedge[v] = halfedge[better]
            self.ux[v], self.uy[v] = ux[better], uy[better]
            better = better[score[better] < self.score[v]]

    def newly_reached(self) -> Ints:
        """Vertices that got their first offer since the last call, in rising order."""
        reached = sorted_unique(np.concatenate(self._reached)) if self._reached else np.zeros(0, np.int64)
        self._reached = []
        return reached

    def interpolated(self, halfedge: Ints, weights: Floats) -> Floats:
        """Distances interpolated linearly in faces; not finite where a corner is unreached.

        Parameters
        ----------
        halfedge : (n,) int64
        weights : (n, 3) float64
            Of tail, head and apex.

        Returns
        -------
        (n,) float64
        """
        f = self.frames
        corners = np.stack([f.tail[halfedge], f.head[halfedge], f.apex[halfedge]], axis=1)
        with np.errstate(invalid="ignore"):  # an unreached corner of weight 0 gives inf · 0
            distance: Floats = (self.distance[corners] * weights).sum(1)
        return distance
