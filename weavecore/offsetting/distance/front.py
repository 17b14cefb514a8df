"""Keeping the front whole: rays that drift apart get new ones between them, crowded ones go.

All rays are looked at when they have come as far as one distance.  Two linked rays that
spread tell the curvature of the front between them; a new ray starts from beside one of
them, at right angles to that front.  Where the front lags behind all the same, it is taken up
again from the vertices that it has reached.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, sorted_unique
from weavecore.geometry.geodesics import Unfolding, back_to_edge, barycentric_at, walk_straight
from weavecore.offsetting.distance.ray_seeds import ray_spacing
from weavecore.offsetting.distance.rays import Rays, Records, advance, offer_start

WIDEST = 1.0
WIDE_GAP = 1.5  # ray spacings from which on a gap is filled
LOST_GAP = 8.0  # ray spacings from which on two rays are not of one front
LOOK_BACK = 1.5  # mean edge lengths behind a new ray at which its distance is checked
MOST_GAIN = 0.1  # mean edge lengths that a new ray may be ahead of what lies behind it
ROUND_GAIN = 0.25  # the same for each unit of curvature times mean edge length: round fronts interpolate too high
STEEPEST = 0.95  # cosine to the edge of the flattest direction in which a lagging front goes on
_ROUNDS = 4


class Look:
    """The rays' places at one distance: points and directions (n, 3), gap to the next (n,), spacing wanted (n,)."""

    def __init__(self, frames: Unfolding, rays: Rays, distance: float) -> None:
        self.linked = rays.after >= 0
        self.next = np.where(self.linked, rays.after, 0)
        self.directions = frames.directions(rays.halfedge, rays.ux, rays.uy)
        back = (rays.distance - distance)[:, None] * self.directions
        self.points = frames.points(rays.halfedge, rays.px) - back
        self.aside = self.points[self.next] - self.points
        self.gap = np.where(self.linked, np.sqrt(np.einsum("ij,ij->i", self.aside, self.aside)), -1.0)
        ends = frames.tail[rays.halfedge], frames.head[rays.halfedge]
        self.spacing = ray_spacing(frames) * np.minimum(
            np.minimum(frames.mean_length[ends[0]], frames.mean_length[ends[1]]), WIDEST
        )


def measure_growth(rays: Rays, look: Look, advance_made: float) -> None:
    """Learn the front's curvature between neighbours from how their gap has grown.

    The gap g obeys g' = k g and the curvature k' = -k^2 on flat faces; where the gap was not known
    before, the angle between the two rays serves.
    """
    known = (look.gap > 0) & (rays.gap > 0)
    gap = np.maximum(look.gap, np.finfo(float).tiny)
    mean = 2 * (gap - rays.gap) / ((gap + np.maximum(rays.gap, 0)) * advance_made)
    grown = mean / np.maximum(1 + mean * advance_made / 2, 1e-3)
    turned = look.directions[look.next] - look.directions
    spread = np.maximum(np.einsum("ij,ij->i", turned, look.aside) / (gap * gap), 0)
    rays.growth = np.clip(np.where(known, grown, np.where(look.linked, spread, 0.0)), -1.0, 1.0)
    rays.gap = look.gap.copy()


def thin(rays: Rays, look: Look) -> Rays:
    """Drop every other one of rays that crowd: those of lesser grade, of which no two are neighbours."""
    before, grade_before = np.full(len(rays), np.inf), np.zeros(len(rays), np.int64)
    onward = look.next[look.linked]
    before[onward], grade_before[onward] = look.gap[look.linked], rays.grade[look.linked]
    least = (rays.grade <= grade_before) & (rays.grade <= rays.grade[look.next])
    crowded = look.linked & (look.gap + before < look.spacing) & least
    crowded &= ~(crowded[look.next] & look.linked)
    return rays.without(crowded) if crowded.any() else rays


def fill_gaps(frames: Unfolding, records: Records, rays: Rays, distance: float) -> Rays:
    """Start rays in the gaps that have become too wide, and bring them up to the others."""
    for _ in range(_ROUNDS):
        look = Look(frames, rays, distance)
        wide = np.flatnonzero(look.linked & (look.gap > WIDE_GAP * look.spacing) & (look.gap < LOST_GAP * look.spacing))
        if len(wide) == 0:
            break
        offset = np.minimum(look.gap[wide] / 2, look.spacing[wide])
        new, started = _rays_beside(frames, records, rays, wide, look.aside[wide], offset)
        if len(new) == 0:
            break
        wide, offset = wide[started], offset[started]
        new.after, new.gap, new.growth = rays.after[wide], look.gap[wide] - offset, rays.growth[wide]
        number = len(rays)
        rays.after[wide], rays.gap[wide] = number + np.arange(len(new)), offset
        rays = rays.joined(new)
        offer_start(frames, records, new)
        advance(frames, records, rays, distance, first=number)
        rays = rays.without(np.isinf(rays.distance))
    return rays


def _rays_beside(
    frames: Unfolding, records: Records, rays: Rays, index: Ints, aside: Floats, offset: Floats
) -> tuple[Rays, Bools]:
    """New rays at an offset to the side of others, and which of them could be started."""
    h, ux, uy = rays.halfedge[index], rays.ux[index], rays.uy[index]
    to_left = np.einsum("ij,ij->i", aside, frames.directions(h, -uy, ux))
    side = np.where(to_left >= 0, 1.0, -1.0)
    at, x, y, wx, wy, arrived = walk_straight(frames, h, rays.px[index], -uy * side, ux * side, offset)
    bend = np.clip(rays.growth[index], 0, 0.9 / offset) * offset
    stretch = np.sqrt(1 + bend * bend)
    forward_x, forward_y = wy * side, -wx * side
    turn = side * bend / stretch
    vx, vy = forward_x / stretch - forward_y * turn, forward_y / stretch + forward_x * turn
    entry, along, vx, vy, back = back_to_edge(frames, at, x, y, vx, vy)
    distance = rays.distance[index] + bend * offset / (1 + stretch) - back
    curvature = bend / (offset * stretch)
    curvature = curvature / np.maximum(1 - curvature * back, 1e-3)
    distance, sound = _check_behind(frames, records, entry, along, vx, vy, distance, curvature)
    started = arrived & sound & (vy > 1e-6)
    new = Rays.starting(entry, along, vx, vy, distance, curvature, offset / 2).take(np.flatnonzero(started))
    return new, started


def _check_behind(
    frames: Unfolding,
    records: Records,
    halfedge: Ints,
    along: Floats,
    ux: Floats,
    uy: Floats,
    distance: Floats,
    curvature: Floats,
) -> tuple[Floats, Bools]:
    """Raise distances that are less than what lies behind and the way from there allow."""
    nearby = frames.mean_length[frames.tail[halfedge]]
    far = LOOK_BACK * nearby
    at, x, y, _, _, arrived = walk_straight(frames, halfedge, along, -ux, -uy, far)
    behind = records.along(at, barycentric_at(frames, at, x, y))
    sound = arrived & np.isfinite(behind)
    least = np.where(sound, behind, 0.0) + far
    too_low = sound & (least - distance > nearby * (MOST_GAIN + ROUND_GAIN * curvature * nearby))
    return np.where(too_low, least, distance), sound


class Lag:
    """Faces that the front should have crossed: watched from when it reaches a corner of them."""

    def __init__(self, frames: Unfolding) -> None:
        corners = frames.faces.ravel()
        self._corner = np.argsort(corners)
        self._offsets = np.searchsorted(corners[self._corner], np.arange(len(frames.vertices) + 1))
        self._waiting = np.zeros(0, np.int64)

    def _faces_at(self, vertex: Ints) -> Ints:
        count = self._offsets[vertex + 1] - self._offsets[vertex]
        shift = np.repeat(self._offsets[vertex] - (np.cumsum(count) - count), count)
        faces: Ints = self._corner[shift + np.arange(count.sum())] // 3
        return faces

    @property
    def is_over(self) -> bool:
        """Whether no face waits for a corner to be reached."""
        return len(self._waiting) == 0

    def take_up(self, frames: Unfolding, records: Records, distance: float) -> Rays:
        """Rays that go on from the edges beyond which a corner should have been reached."""
        seen = sorted_unique(np.concatenate([self._waiting, self._faces_at(records.newly_reached())]))
        missing = np.isinf(records.distance[frames.faces[seen]])
        n_missing = missing.sum(1)
        self._waiting = seen[n_missing > 0]
        one = n_missing == 1
        edge = 3 * seen[one] + (np.argmax(missing[one], axis=1) + 1) % 3
        start, end = records.distance[frames.tail[edge]], records.distance[frames.head[edge]]
        length = frames.length[edge]
        latest = np.minimum(start + frames.length[frames.previous[edge]], end + frames.length[frames.next[edge]])
        late = latest < distance
        edge, start, end, length = edge[late], start[late], end[late], length[late]
        cosine = np.clip((end - start) / length, -STEEPEST, STEEPEST)
        middle = np.minimum((start + end) / 2, np.minimum(start, end) + length / 2)
        flat = np.zeros(len(edge))
        return Rays.starting(edge, length / 2, cosine, np.sqrt(1 - cosine * cosine), middle, flat, length / 2)
