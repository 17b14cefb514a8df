"""Rays: straightest geodesics that leave the borders at right angles, stepped all at once.

Each ray stands for a short piece of the *front*, the set of points at one distance.  It knows
its distance from the borders exactly, because it runs straight, and the curvature of the front
about it.  In every face that it crosses it offers the corner ahead the distance of that corner
from the front (Yan et al. 2016, §4.2: each vertex of the parent is offset along n x t; here the
offsets run on through all generations, so that no error piles up from one to the next).

A ray *views* the strip of faces that it has crossed.  A vertex with more than a full turn of
angle around it (a saddle) bends the paths that pass it on the far side: it becomes the
ray's *blocker* on that side, and corners behind it are measured around it.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, sorted_unique
from weavecore.geometry.geodesics import Unfolding

LEAST_SADDLE = 0.02  # radians above a full turn from which on a vertex blocks the view
BEHIND_THE_FRONT = 0.3  # a ray dies where it comes later than the edge's ends say, by this part of the edge
BEHIND_A_CORNER = 0.05  # the same against going along the edge from one of its ends

AT, SIDE, DISTANCE, EXCESS = range(4)  # rows of a blocker: travel, lateral offset, distance, excess angle


class Rays:
    """Rays on the edges by which they enter faces, as arrays (n,).

    Attributes
    ----------
    halfedge, px, ux, uy : entry edge, place along it, unit direction in its frame (uy > 0)
    distance : from the borders to that place; infinite for dead rays
    curvature : of the front there, positive where rays spread, infinite at a point source
    birth, half_width : the distance at which the front was straight for this far to both sides
    left, right : (4, n) blockers on both sides
    after : the next ray along the front, -1 where there is none
    gap : the width between the two when it was last measured, -1 if it was not
    growth : curvature of the front between the two
    grade : among crowding neighbours those of the least grade go first
    """

    MOVING = ("halfedge", "px", "ux", "uy", "distance", "curvature", "left", "right", "birth", "half_width")
    LINKED = ("after", "gap", "growth", "grade")

    halfedge: Ints
    px: Floats
    ux: Floats
    uy: Floats
    distance: Floats
    curvature: Floats
    left: Floats
    right: Floats
    birth: Floats
    half_width: Floats
    after: Ints
    gap: Floats
    growth: Floats
    grade: Ints

    @classmethod
    def starting(
        cls, halfedge: Ints, px: Floats, ux: Floats, uy: Floats, distance: Floats, curvature: Floats, half_width: Floats
    ) -> Rays:
        """Rays with an open view and no neighbours."""
        rays, n = cls(), len(halfedge)
        rays.halfedge, rays.px, rays.ux, rays.uy = halfedge, px, ux, uy
        rays.distance, rays.curvature = distance, curvature
        rays.birth, rays.half_width = distance.copy(), half_width
        rays.left, rays.right = np.zeros((4, n)), np.zeros((4, n))
        rays.left[SIDE], rays.right[SIDE] = np.inf, -np.inf
        rays.after, rays.gap, rays.growth = np.full(n, -1), np.full(n, -1.0), np.zeros(n)
        rays.grade = np.zeros(n, np.int64)
        return rays

    def __len__(self) -> int:
        return len(self.halfedge)

    def take(self, index: Ints, names: tuple[str, ...] = MOVING + LINKED) -> Rays:
        """Copies of some rays; links still count in the old numbering."""
        part = Rays()
        for name in names:
            setattr(part, name, getattr(self, name)[..., index])
        return part

    def put(self, index: Ints, part: Rays) -> None:
        """Write back the moving state of some rays."""
        for name in Rays.MOVING[:8]:
            getattr(self, name)[..., index] = getattr(part, name)

    def joined(self, other: Rays) -> Rays:
        """Both, these first; links of the other must count from these on."""
        both = Rays()
        for name in Rays.MOVING + Rays.LINKED:
            setattr(both, name, np.concatenate([getattr(self, name), getattr(other, name)], axis=-1))
        return both

    def without(self, gone: Bools) -> Rays:
        """The other rays, linked over those that are gone; such links have no known gap."""
        after = self.after
        bridged = np.zeros(len(self), bool)
        for _ in range(64):
            hit = (after >= 0) & gone[after] & ~gone
            if not hit.any():
                break
            after = np.where(hit, self.after[after], after)
            bridged |= hit
        after = np.where((after >= 0) & ~gone[after] & (after != np.arange(len(self))), after, -1)
        rest = self.take(np.flatnonzero(~gone))
        number = np.cumsum(~gone) - 1
        rest.after = np.where(after >= 0, number[after], -1)[~gone]
        rest.gap[bridged[~gone]] = -1.0
        return rest


def front_distance(curvature: Floats, forward: Floats, lateral: Floats) -> tuple[Floats, Floats, Floats]:
    """Distance from a front that is a circle of the given curvature, and its direction.

    The front passes through the origin at right angles to the forward axis.  Returns the
    distance and the unit direction (forward, lateral) of the path that arrives.
    """
    point = np.isinf(curvature)
    k = np.where(point, 0.0, curvature)
    ahead, aside = 1 + k * forward, k * lateral
    radius = np.sqrt(ahead * ahead + aside * aside)
    distance = (2 * forward + k * (forward * forward + lateral * lateral)) / (radius + 1.0)
    if point.any():
        straight = np.hypot(forward, lateral)
        distance = np.where(point, straight, distance)
        ahead, aside = np.where(point, forward, ahead), np.where(point, lateral, aside)
        radius = np.where(point, straight, radius)
    radius = np.maximum(radius, np.finfo(float).tiny)
    return distance, ahead / radius, aside / radius


def _beside_its_piece(rays: Rays, distance: Floats, lateral: Floats) -> Floats:
    """What a path is longer by because the front's straight piece ends before its foot."""
    beyond = np.maximum(np.abs(lateral) - rays.half_width, 0)
    run = np.maximum(distance - rays.birth, 0)
    longer: Floats = np.sqrt(run * run + beyond * beyond) - run
    return np.where(np.isinf(rays.curvature), 0.0, longer)


def offer_start(frames: Unfolding, records: Records, rays: Rays) -> None:
    """Offer both ends of the entry edges their distances."""
    for vertex, offset in (
        (frames.tail[rays.halfedge], -rays.px),
        (frames.head[rays.halfedge], frames.length[rays.halfedge] - rays.px),
    ):
        forward, lateral = rays.ux * offset, -rays.uy * offset
        rise, ahead, aside = front_distance(rays.curvature, forward, lateral)
        distance = rays.distance + rise
        distance = distance + _beside_its_piece(rays, distance, lateral)
        distance[rays.distance + forward < 0] = np.inf
        ux, uy = rays.ux * ahead - rays.uy * aside, rays.uy * ahead + rays.ux * aside
        records.offer(vertex, distance, lateral, rays.halfedge, ux, uy)


def _around_blockers(
    rays: Rays, is_left: Bools, travel: Floats, lateral: Floats, rise: Floats, ahead: Floats, aside: Floats
) -> Bools:
    """Measure the corners that lie behind a blocker around it; returns which ones those are.

    Seen from the blocker, a path bends by what the corner's direction differs from the front's,
    less the excess angle, which lets paths pass on the blocker's other side (Mitchell, Mount and
    Papadimitriou 1987: a saddle is a source of its own for what lies in its shadow).
    """
    blocked: Bools = np.isfinite(np.where(is_left, rays.left[SIDE], rays.right[SIDE]))
    if not blocked.any():
        return blocked
    k = np.where(np.isinf(rays.curvature), 0.0, rays.curvature)
    at, side = np.where(is_left, rays.left[:2], rays.right[:2])
    with np.errstate(invalid="ignore"):
        at_blocker = k / (1 + k * (at - rays.distance))
        edge = side * (1 + at_blocker * (travel - at))
        behind: Bools = np.where(is_left, lateral > edge, lateral < edge)
    m = np.flatnonzero(behind)
    if len(m) == 0:
        return behind
    blocker = np.where(is_left[m], rays.left[:, m], rays.right[:, m])
    forward, offset, kb = travel[m] - blocker[AT], lateral[m] - blocker[SIDE], at_blocker[m]
    far = np.hypot(forward, offset)
    turned = np.arctan(kb * blocker[SIDE])
    bend = np.arctan2(offset, forward) - turned
    kept = np.sign(bend) * np.maximum(np.abs(bend) - blocker[EXCESS], 0)
    longer, gx, gy = front_distance(kb, far * np.cos(kept), far * np.sin(kept))
    longer += blocker[DISTANCE] - rays.distance[m]
    higher = longer > rise[m]
    turn = (bend - kept + turned)[higher]
    gx, gy, m = gx[higher], gy[higher], m[higher]
    rise[m] = longer[higher]
    ahead[m], aside[m] = gx * np.cos(turn) - gy * np.sin(turn), gy * np.cos(turn) + gx * np.sin(turn)
    return behind


def _block(frames: Unfolding, rays: Rays, is_left: Bools, apex: Ints, values: Floats, behind: Bools) -> None:
    """Saddles in view become the blockers of the rays that pass them."""
    excess = frames.excess[apex]
    saddle = (excess > LEAST_SADDLE) & ~behind & np.isfinite(values[DISTANCE])
    if not saddle.any():
        return
    for side, blockers in ((is_left, rays.left), (~is_left, rays.right)):
        m = np.flatnonzero(saddle & side)
        blockers[:3, m] = values[:, m]
        blockers[EXCESS, m] = excess[m]


def step(frames: Unfolding, records: Records, rays: Rays) -> None:
    """Take all rays across the face ahead of them; those that are no longer first die."""
    h, px, ux, uy = rays.halfedge, rays.px, rays.ux, rays.uy
    apex, apex_x, apex_y, length = frames.apex[h], frames.apex_x[h], frames.apex_y[h], frames.length[h]
    dx = apex_x - px
    forward, lateral = ux * dx + uy * apex_y, ux * apex_y - uy * dx
    rise, ahead, aside = front_distance(rays.curvature, forward, lateral)
    is_left = lateral > 0
    rise += _beside_its_piece(rays, rays.distance + rise, lateral)
    travel = rays.distance + forward
    behind = _around_blockers(rays, is_left, travel, lateral, rise, ahead, aside)
    offered = rays.distance + rise
    records.offer(apex, offered, lateral, h, ux * ahead - uy * aside, uy * ahead + ux * aside)
    _block(frames, rays, is_left, apex, np.stack([travel, lateral, offered]), behind)
    cx = np.where(is_left, frames.next_x[h], frames.previous_x[h])
    cy = np.where(is_left, frames.next_y[h], frames.previous_y[h])
    edge = np.where(is_left, frames.next[h], frames.previous[h])
    size = frames.length[edge]
    across = np.maximum(ux * cy - uy * cx, 1e-12)
    base = np.where(is_left, length - px, -px)
    far = np.maximum(base * cy / across, 0)
    on_edge = (far * ux - base) * cx + far * uy * cy
    place = np.where(is_left, size - on_edge, -on_edge)
    _enter(frames, records, rays, edge, np.clip(place, 1e-9 * size, (1 - 1e-9) * size), far)
    rays.ux, rays.uy = -(ux * cx + uy * cy), across


def _enter(frames: Unfolding, records: Records, rays: Rays, edge: Ints, place: Floats, far: Floats) -> None:
    size = frames.length[edge]
    with np.errstate(divide="ignore", invalid="ignore"):
        point = np.isinf(rays.curvature)
        k = np.where(point, 0.0, rays.curvature)
        rays.curvature = np.where(point & (far > 0), 1 / far, np.where(point, np.inf, k / (1 + k * far)))
        distance = rays.distance + far
        start, end = records.distance[frames.head[edge]], records.distance[frames.tail[edge]]
        part = place / size
        latest = np.minimum(
            start + (end - start) * part + BEHIND_THE_FRONT * size,
            np.minimum(start + place, end + size - place) + BEHIND_A_CORNER * size,
        )
        twin = frames.twin[edge]
        dead = (twin < 0) | (distance > latest) | ~np.isfinite(distance)
    rays.halfedge = np.where(twin < 0, rays.halfedge, twin)
    rays.px = place
    rays.distance = np.where(dead, np.inf, distance)


def advance(frames: Unfolding, records: Records, rays: Rays, until: float, first: int = 0) -> None:
    """Step the rays from number ``first`` on until each has come as far as a distance, or died."""
    index = first + np.flatnonzero(rays.distance[first:] < until)
    part = rays.take(index, Rays.MOVING)
    while len(index):
        step(frames, records, part)
        moving = part.distance < until
        n_moving = int(moving.sum())
        if n_moving < 0.75 * len(index):
            stopped = ~moving
            rays.put(index[stopped], part.take(np.flatnonzero(stopped), Rays.MOVING))
            go = np.flatnonzero(moving)
            index, part = index[go], part.take(go, Rays.MOVING)


# ----------------------------------------------------------------------
# `Records`: for every vertex the best path found so far.
#
# A *candidate* is a distance that a ray offers to a vertex beside its way.  Rays that pass
# nearer know better, so candidates are compared by a *score*: the distance plus a penalty that
# grows with the square of the lateral offset.

LATERAL_PENALTY = 0.4  # per mean edge length, of the squared lateral offset

NO_HALFEDGE = -1


class Records:
    """Best candidate of each vertex: its distance, and the direction of the path's arrival.

    The direction is kept in the frame of the halfedge by which the ray came in.
    """

    def __init__(self, frames: Unfolding, sources: Ints) -> None:
        n = len(frames.vertices)
        self.frames = frames
        self.score = np.full(n, np.inf)
        self.distance = np.full(n, np.inf)
        self.halfedge = np.full(n, NO_HALFEDGE, np.int64)
        self.ux, self.uy = np.zeros(n), np.zeros(n)
        self.score[sources] = -np.inf
        self.distance[sources] = 0.0
        self._penalty = LATERAL_PENALTY / frames.mean_length
        self._reached: list[Ints] = [sources]

    def offer(self, vertex: Ints, distance: Floats, lateral: Floats, halfedge: Ints, ux: Floats, uy: Floats) -> None:
        """Keep the candidates (n,) that beat what their vertices have."""
        score = distance + self._penalty[vertex] * lateral * lateral
        better = np.flatnonzero(score < self.score[vertex])
        if len(better) == 0:
            return
        first = better[np.isinf(self.score[vertex[better]])]
        if len(first):
            self._reached.append(vertex[first])
        while len(better):  # where one vertex got several, the last one written need not be the best
            v = vertex[better]
            self.score[v] = score[better]
            self.distance[v] = distance[better]
            self.halfedge[v] = halfedge[better]
            self.ux[v], self.uy[v] = ux[better], uy[better]
            better = better[score[better] < self.score[v]]

    def newly_reached(self) -> Ints:
        """Vertices that got their first candidate since the last call."""
        reached = sorted_unique(np.concatenate(self._reached)) if self._reached else np.zeros(0, np.int64)
        self._reached = []
        return reached

    def along(self, halfedge: Ints, weights: Floats) -> Floats:
        """Distance interpolated linearly in faces; weights (n, 3) of tail, head and apex."""
        f = self.frames
        corners = np.stack([f.tail[halfedge], f.head[halfedge], f.apex[halfedge]], axis=1)
        distance: Floats = (self.distance[corners] * weights).sum(1)
        return distance
