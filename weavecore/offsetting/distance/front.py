"""Keeping the front whole: new rays where neighbours drift apart, fewer where they crowd.

All rays are compared at one distance (`FrontSnapshot`).  For two neighbours with gap g and a front of curvature k
between them, g' = k g along the way, and on flat faces k' = −k²; so how the gap has grown gives k, and k gives
distance and direction of a new ray beside an old one::

                      new ray                            k > 0: the front is convex
           old ray   ↗           direction of the front's normal at the offset o:
              ↑     /            turned by atan(k o), and the front falls behind by
              |    /             (√(1 + k²o²) − 1) / k  = k o² / (1 + √(1 + k²o²))
        ------*---*------ tangent
              |<o>|

Where the front has left a face behind all the same, the ray starts again from the vertices that it has reached
(`UnsweptFaces`).  The distances are in median edge lengths throughout.

Work: linear in the rays, for each comparison.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, ranges, sorted_unique
from weavecore.geometry.geodesics import Unfolding, back_to_edge, barycentric_at, walk_straight
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge
from weavecore.offsetting.distance.ray_seeds import ray_spacing
from weavecore.offsetting.distance.rays import GeodesicRays, RayState, TentativeDistances, advance, offer_at_start

MAX_NEARBY_LENGTH = 1.0
"""Mean edge lengths above this (in medians) do not widen the spacing of rays: finer faces may lie ahead."""

WIDE_GAP = 1.5
"""Ray spacings from which a gap is filled: two of the resulting gaps are at least 0.75 wide."""

LOST_GAP = 8.0
"""Ray spacings from which two linked rays no longer belong to one front."""

LOOK_BACK = 1.5
"""Mean edge lengths behind a new ray at which its distance is compared: beyond the face that it starts in."""

MAX_LEAD = 0.1
"""Mean edge lengths that a new ray may be ahead of what lies behind it: linear interpolation on smooth fronts errs
less."""

MAX_FLATNESS = 0.95
"""Cosine to the edge of the flattest direction in which a front that was left behind goes on."""

_MAX_ROUNDS = 4  # each at least halves a gap, and gaps are filled every stride
_MIN_SINE = 1e-6  # of a new ray to the edge that it starts on


class FrontSnapshot:
    """Rays where they had the same distance.

    Parameters
    ----------
    frames : Unfolding
    rays : GeodesicRays
        None of them stopped.
    distance : float
    before : FrontSnapshot, optional
        Of the first of the rays, at the same distance.

    Attributes
    ----------
    linked : (n,) bool
        Whether a ray has a next one.
    next : (n,) int64
        That one; 0 where there is none.
    points, directions : (n, 3) float64
    aside : (n, 3) float64
        From each point to the next one.
    gap : (n,) float64
        Its length, -1 where there is no next one.
    spacing : (n,) float64
        Gap that is aimed at.
    """

    def __init__(
        self, frames: Unfolding, rays: GeodesicRays, distance: float, *, before: FrontSnapshot | None = None
    ) -> None:
        n, n_known = len(rays), 0
        self.points: Floats = np.empty((n, 3))
        self.directions: Floats = np.empty((n, 3))
        self.spacing: Floats = np.empty(n)
        if before is not None:
            n_known = len(before.points)
            self.points[:n_known], self.directions[:n_known] = before.points, before.directions
            self.spacing[:n_known] = before.spacing
        for k in blocks(n - n_known):
            self._place(frames, rays.state, distance, slice(n_known + k.start, n_known + k.stop))
        self._link(rays)

    def _place(self, frames: Unfolding, state: RayState, distance: float, k: slice) -> None:
        h = state.halfedge[k]
        directions = frames.directions(h, state.ux[k], state.uy[k])
        back = (state.distance[k] - distance)[:, None] * directions
        self.directions[k], self.points[k] = directions, frames.points(h, state.px[k]) - back
        ends = frames.tail[h], frames.head[h]
        self.spacing[k] = ray_spacing(frames) * np.minimum(
            np.minimum(frames.mean_length[ends[0]], frames.mean_length[ends[1]]), MAX_NEARBY_LENGTH
        )

    def _link(self, rays: GeodesicRays) -> None:
        after = rays.links.after
        self.linked = after >= 0
        self.next = np.where(self.linked, after, 0)
        self.aside = self.points[self.next] - self.points
        self.gap = np.where(self.linked, np.sqrt(np.einsum("ij,ij->i", self.aside, self.aside)), -1.0)

    def of_rest(self, rays: GeodesicRays, kept: Bools) -> FrontSnapshot:
        """The snapshot of the rays that are left of these.

        Parameters
        ----------
        rays : GeodesicRays
        kept : (n,) bool
            Which ones of these they are.
        """
        rest = copy(self)
        rest.points, rest.directions, rest.spacing = self.points[kept], self.directions[kept], self.spacing[kept]
        rest._link(rays)
        return rest


def measure_growth(rays: GeodesicRays, snapshot: FrontSnapshot, travelled: float) -> None:
    """Estimate the front's curvature between neighbours, in place: from g' = k g, or from the angle between the rays.

    Parameters
    ----------
    rays : GeodesicRays
    snapshot : FrontSnapshot
        Of these rays.
    travelled : float
        Distance since the gaps were measured last.
    """
    links = rays.links
    known = (snapshot.gap > 0) & (links.gap > 0)
    gap = np.maximum(snapshot.gap, np.finfo(float).tiny)
    # The mean of k over the way; k' = −k² takes it on to its end.
    mean = 2 * (gap - links.gap) / ((gap + np.maximum(links.gap, 0)) * travelled)
    grown = mean / np.maximum(1 + mean * travelled / 2, 1e-3)
    turned = snapshot.directions[snapshot.next] - snapshot.directions
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # no gap to the next ray: not used
        spread = np.maximum(np.einsum("ij,ij->i", turned, snapshot.aside) / (gap * gap), 0)
    links.growth = np.clip(np.where(known, grown, np.where(snapshot.linked, spread, 0.0)), -1.0, 1.0)
    links.gap = snapshot.gap.copy()


def thin(rays: GeodesicRays, snapshot: FrontSnapshot) -> tuple[GeodesicRays, FrontSnapshot]:
    """Remove crowded rays of least priority, of which no two are neighbours.

    Parameters
    ----------
    rays : GeodesicRays
    snapshot : FrontSnapshot
        Of these rays.

    Returns
    -------
    GeodesicRays, FrontSnapshot
        What is left; a removed ray had both neighbours within one spacing.
    """
    priority = rays.links.priority
    before, priority_before = np.full(len(rays), np.inf), np.zeros(len(rays), np.int64)
    onward = snapshot.next[snapshot.linked]
    before[onward], priority_before[onward] = snapshot.gap[snapshot.linked], priority[snapshot.linked]
    least = (priority <= priority_before) & (priority <= priority[snapshot.next])
    crowded = snapshot.linked & (snapshot.gap + before < snapshot.spacing) & least
    crowded &= ~(crowded[snapshot.next] & snapshot.linked)
    if not crowded.any():
        return rays, snapshot
    rays = rays.without(crowded)
    return rays, snapshot.of_rest(rays, ~crowded)


def fill_gaps(
    frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays, snapshot: FrontSnapshot, distance: float
) -> GeodesicRays:
    """Start rays in gaps that have become too wide, and bring them up to the others.

    Parameters
    ----------
    frames : Unfolding
    tentative : TentativeDistances
    rays : GeodesicRays
    snapshot : FrontSnapshot
        Of these rays, at the distance.
    distance : float
        To which all have come.

    Returns
    -------
    GeodesicRays
    """
    for _ in range(_MAX_ROUNDS):
        gap, spacing = snapshot.gap, snapshot.spacing
        wide = np.flatnonzero(snapshot.linked & (gap > WIDE_GAP * spacing) & (gap < LOST_GAP * spacing))
        if len(wide) == 0:
            break
        offset = np.minimum(gap[wide] / 2, spacing[wide])
        new, started = _rays_beside(frames, tentative, rays, wide, snapshot.aside[wide], offset)
        if len(new) == 0:
            break
        wide, offset = wide[started], offset[started]
        links, number = rays.links, len(rays)
        new.links.after, new.links.growth = links.after[wide], links.growth[wide]
        new.links.gap = gap[wide] - offset
        links.after[wide], links.gap[wide] = number + np.arange(len(new)), offset
        rays = rays.joined(new)
        offer_at_start(frames, tentative, new)
        advance(frames, tentative, rays, distance, first=number)
        rays = rays.without(rays.stopped())  # of the new ones: the others have come so far already
        snapshot = FrontSnapshot(frames, rays, distance, before=snapshot)
    return rays


def _rays_beside(
    frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays, index: Ints, aside: Floats, offset: Floats
) -> tuple[GeodesicRays, Bools]:
    """New rays at an offset to the side of others, and which of them could be started."""
    state = rays.state.take(index)
    h, ux, uy = state.halfedge, state.ux, state.uy
    to_left = np.einsum("ij,ij->i", aside, frames.directions(h, -uy, ux))
    side = np.where(to_left >= 0, 1.0, -1.0)
    at, x, y, wx, wy, arrived = walk_straight(frames, h, state.px, -uy * side, ux * side, offset)
    bend = np.clip(rays.links.growth[index], 0, 0.9 / offset) * offset
    stretch = np.sqrt(1 + bend * bend)
    forward_x, forward_y = wy * side, -wx * side
    turn = side * bend / stretch
    vx, vy = forward_x / stretch - forward_y * turn, forward_y / stretch + forward_x * turn
    entry, along, vx, vy, back = back_to_edge(frames, at, x, y, vx, vy)
    distance = state.distance + bend * offset / (1 + stretch) - back
    curvature = bend / (offset * stretch)
    curvature = curvature / np.maximum(1 - curvature * back, 1e-3)
    distance, sound = _not_ahead_of_what_lies_behind(frames, tentative, entry, along, vx, vy, distance)
    started = arrived & sound & (vy > _MIN_SINE)
    new = GeodesicRays.starting(entry, along, vx, vy, distance, curvature, offset / 2).take(np.flatnonzero(started))
    return new, started


def _not_ahead_of_what_lies_behind(
    frames: Unfolding,
    tentative: TentativeDistances,
    halfedge: Ints,
    along: Floats,
    ux: Floats,
    uy: Floats,
    distance: Floats,
) -> tuple[Floats, Bools]:
    """Raise distances below what lies behind and the way from there allow; and where that is known."""
    nearby = frames.mean_length[frames.tail[halfedge]]
    far = LOOK_BACK * nearby
    at, x, y, _, _, arrived = walk_straight(frames, halfedge, along, -ux, -uy, far)
    behind = tentative.interpolated(at, barycentric_at(frames, at, x, y))
    sound = arrived & np.isfinite(behind)
    least = np.where(sound, behind, 0.0) + far
    return np.where(sound & (least - distance > MAX_LEAD * nearby), least, distance), sound


class UnsweptFaces:
    """Queue of faces with a reached and an unreached corner, from which the front may have to start again.

    Parameters
    ----------
    frames : Unfolding
    """

    def __init__(self, frames: Unfolding) -> None:
        self._corner, self._offsets = frames.outgoing
        self._waiting = np.zeros(0, np.int64)

    @property
    def is_empty(self) -> bool:
        """Whether no face waits for a corner to be reached."""
        return len(self._waiting) == 0

    def rays_into(self, frames: Unfolding, tentative: TentativeDistances, distance: float) -> GeodesicRays:
        """Rays from edges with both ends reached, into faces whose third corner should have been reached.

        Parameters
        ----------
        frames : Unfolding
        tentative : TentativeDistances
        distance : float
            To which the front has come.

        Returns
        -------
        GeodesicRays
            One from the middle of each edge, at right angles to the front that is linear between its ends.
        """
        seen = sorted_unique(np.concatenate([self._waiting, self._faces_at(tentative.newly_reached())]))
        missing = np.isinf(tentative.distance[frames.faces[seen]])
        n_missing = missing.sum(1)
        self._waiting = seen[n_missing > 0]
        one = n_missing == 1
        edge = 3 * seen[one] + (np.argmax(missing[one], axis=1) + 1) % 3
        start, end = tentative.distance[frames.tail[edge]], tentative.distance[frames.head[edge]]
        length = frames.length[edge]
        before, after = previous_halfedge(edge), next_halfedge(edge)
        latest = np.minimum(start + frames.length[before], end + frames.length[after])
        late = latest < distance
        edge, start, end, length = edge[late], start[late], end[late], length[late]
        cosine = np.clip((end - start) / length, -MAX_FLATNESS, MAX_FLATNESS)
        middle = np.minimum((start + end) / 2, np.minimum(start, end) + length / 2)
        flat = np.zeros(len(edge))
        return GeodesicRays.starting(edge, length / 2, cosine, np.sqrt(1 - cosine * cosine), middle, flat, length / 2)

    def _faces_at(self, vertex: Ints) -> Ints:
        start = self._offsets[vertex]
        faces: Ints = self._corner[ranges(start, self._offsets[vertex + 1] - start)] // 3
        return faces
