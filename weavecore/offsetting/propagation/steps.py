"""The steps of a front: straight walks from its vertices, each as long as the spacing (§4.2).

A ray is walked a little further than its end.  How far it comes before it meets an ancestor
tells whether the front had room (§4.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import Walks, place_along, walk_far
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.curves import Ground, next_along
from weavecore.offsetting.propagation.obstacles import AT_RIM, FREE, OUT, is_out, part_at_selvedges
from weavecore.offsetting.propagation.ray_directions import Seeds
from weavecore.tolerances import LEAST_CAP

BEYOND = 1.0 + 6.0 * LEAST_CAP
"""Spacings that a ray is walked: where all of them come to an ancestor, a child has hardly room."""

_BEFORE_A_STOP = 0.95
_JITTER = 1e-7
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Rays:
    """The rays of some fronts, in the order of the fronts.

    Parameters
    ----------
    offsets : (C+1,) int64
        Rays of each front.
    closed : (C,) bool
        Which fronts are closed.
    walks : Walks
        Of all rays, each `BEYOND` times as long as its step unless a wall is in the way.
    lead, reach : (n,) float64
        The step of each ray: how far it is from the front to where the ray starts, and from there on.
    start : (n, 3) float64
        Where the ray starts.
    stop : (n,) float64
        How far it is to what stops the ray: a wall, or another front; infinite where nothing does or a selvedge does.
    is_out : (n,) bool
        Whether a selvedge is in the way, before the step has ended: no child goes there.
    rim : (n,) int64
        The halfedge of the selvedge on which the step ends, and an open child with it; -1 elsewhere.
    step : float
        The distance by which the fronts are offset.
    """

    offsets: Ints
    closed: Bools
    walks: Walks
    lead: Floats
    reach: Floats
    start: Floats
    stop: Floats
    is_out: Bools
    rim: Ints
    step: float

    def __len__(self) -> int:
        return len(self.reach)

    @cached_property
    def owner(self) -> Ints:
        """(n,) the front of each ray."""
        return rows_of(self.offsets)

    @cached_property
    def after(self) -> Ints:
        """(n,) the next ray of the same front."""
        return next_along(self.offsets, self.closed)

    @cached_property
    def of_segment(self) -> Ints:
        """(m,) the ray of each segment of the walks."""
        return rows_of(self.walks.offsets)

    def take(self, chosen: Bools) -> Rays:
        """The rays of some of the fronts."""
        kept = chosen[self.owner]
        walks = self.walks.take(kept)
        return Rays(
            offsets_of(np.diff(self.offsets)[chosen]),
            self.closed[chosen],
            walks,
            self.lead[kept],
            self.reach[kept],
            self.start[kept],
            self.stop[kept],
            self.is_out[kept],
            self.rim[kept],
            self.step,
        )

    def stopped(self, ray: Ints, far: Floats) -> Rays:
        """The same rays, of which some are stopped when they have come so far."""
        stop = self.stop.copy()
        np.minimum.at(stop, ray, far)
        return replace(self, stop=stop)


@dataclass(frozen=True, eq=False)
class Ends:
    """Where steps end: the vertices of the children.

    Parameters
    ----------
    face : (n,) int64
    weights : (n, 3) float64
    points : (n, 3) float64
    far : (n,) float64
        How long the steps are.
    """

    face: Ints
    weights: Floats
    points: Floats
    far: Floats


def cast_rays(ground: Ground, seeds: Seeds, *, spacing: float) -> Rays:
    """Walk one step and a little from each seed."""
    n = len(seeds.halfedge)
    # Fronts that meet after whole steps would coincide: a trifle tells them apart.
    trifle = _JITTER * ((np.arange(n) * _GOLDEN) % 1.0 - 0.5)
    reach = spacing * seeds.stretch * (1.0 + trifle)
    walks = walk_far(ground.frames, seeds.halfedge, seeds.px, seeds.py, seeds.ux, seeds.uy, BEYOND * reach)
    if ground.has_selvedges:
        return _cast_at_selvedges(ground, seeds, walks, reach, spacing)
    stop, none = np.where(walks.is_blocked, walks.far, np.inf), np.full(n, NO_TWIN)
    start = _starts(ground, walks)
    closed = seeds.fronts.closed
    return Rays(seeds.offsets, closed, walks, np.zeros(n), reach, start, stop, none != NO_TWIN, none, spacing)


def _starts(ground: Ground, walks: Walks) -> Floats:
    first = walks.offsets[:-1]
    return ground.points(walks.face[first], walks.start[first])


def _cast_at_selvedges(ground: Ground, seeds: Seeds, walks: Walks, reach: Floats, spacing: float) -> Rays:
    ahead = (BEYOND - 1.0) * spacing
    aims, walks = part_at_selvedges(ground, seeds, walks, reach, step=spacing, ahead=ahead)
    stopped = (aims.state == FREE) & walks.is_blocked & ~is_out(ground, walks)
    stopped |= (aims.state == AT_RIM) & (aims.rim == NO_TWIN)
    return Rays(
        offsets_of(np.bincount(aims.front, minlength=len(seeds.fronts))),
        seeds.fronts.closed,
        walks,
        aims.lead,
        aims.reach,
        _starts(ground, walks),
        np.where(stopped, walks.far, np.inf),
        aims.state == OUT,
        aims.rim,
        spacing,
    )


def end_steps(ground: Ground, rays: Rays) -> Ends:
    """Where the step of each ray ends.

    One that is stopped within its step ends a little before: what lies there is nearer to what
    stops it than the spacing and will be taken out, so it matters only that the child goes on unbroken.
    """
    end = np.minimum(rays.reach, _BEFORE_A_STOP * rays.stop)
    face, weights = place_along(rays.walks, end)
    at = np.flatnonzero((rays.rim != NO_TWIN) & (end == rays.reach))
    face[at], weights[at] = rays.rim[at] // 3, _on_rim(weights[at], rays.rim[at])
    return Ends(face, weights, ground.points(face, weights), end)


def _on_rim(weights: Floats, rim: Ints) -> Floats:
    """Barycentric coordinates moved onto the edge of the selvedge that they lie beside."""
    kept = weights.copy()
    kept[np.arange(len(rim)), (rim + 2) % 3] = 0.0
    return np.asarray(kept / kept.sum(1, keepdims=True))
