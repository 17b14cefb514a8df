"""The offset of a front's vertices by one step (Yan et al. 2016, §4.2): the end of each ray is a vertex of the child.

Each vertex walks one spacing along a straightest geodesic, at right angles to the front.  A ray is walked a little
further than its step, to `BEYOND`: how far it comes before it meets an ancestor decides whether the child had room
(§4.5)::

    front                    child
      |--------- step ---------|-- beyond --|
      o----------------------->o - - - - - -
    start       reach          end                 lead: from the front to the start, where rays leave an obstacle

The time is linear in the faces crossed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import Walks, place_along, walk_far
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.obstacle_shadows import (
    ARRIVES,
    ENDS_ON_BORDER,
    OBSTRUCTED,
    is_obstructed,
    resolve_obstacles,
)
from weavecore.offsetting.propagation.ray_directions import RayStarts
from weavecore.offsetting.propagation.surface_curves import next_along
from weavecore.tolerances import MIN_CAP_RISE

BEYOND = 1.0 + 6.0 * MIN_CAP_RISE
"""Spacings that a ray is walked: a child all of whose rays meet an ancestor within them may lack room."""

_BEFORE_A_STOP = 0.95
"""Parts of its way at which a stopped ray ends: clear of what stops it, and still inside what the step has swept."""

_JITTER = 1e-7
"""Parts by which steps differ: two fronts that meet after whole steps would coincide, and so they cross."""

_GOLDEN = 0.6180339887498949
"""The golden ratio less 1: its multiples, modulo 1, are spread evenly, and no two rays near each other step alike."""


@dataclass(frozen=True, eq=False)
class FrontRays:
    """The rays of some fronts, in the order of the fronts and along them.

    Parameters
    ----------
    offsets : (C+1,) int64
        Rays of each front.
    closed : (C,) bool
        Which fronts are closed.
    walks : Walks
        The way of each ray, `BEYOND` times as long as its step unless the boundary is in the way.
    lead, reach : (n,) float64
        The step of each ray: length from the front to where the ray starts, and from there on.
    start : (n, 3) float64
        Where the ray starts.
    stop : (n,) float64
        Length from the start to what stops the ray: a source, or another front; infinite where nothing does, or a
        free border.
    is_obstructed : (n,) bool
        Whether a free border is in the way before the step has ended: the child does not go there.
    end_border : (n,) int64
        The free-border halfedge on which the step ends, and an open child with it; -1 elsewhere.
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
    is_obstructed: Bools
    end_border: Ints
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

    def take(self, chosen: Bools) -> FrontRays:
        """The rays of the fronts where ``chosen`` (C,) is true."""
        kept = chosen[self.owner]
        return FrontRays(
            offsets_of(np.diff(self.offsets)[chosen]),
            self.closed[chosen],
            self.walks.take(kept),
            self.lead[kept],
            self.reach[kept],
            self.start[kept],
            self.stop[kept],
            self.is_obstructed[kept],
            self.end_border[kept],
            self.step,
        )

    def stopped(self, ray: Ints, far: Floats) -> FrontRays:
        """The same, with rays (k,) stopped at lengths (k,) from their starts, if not before."""
        stop = self.stop.copy()
        np.minimum.at(stop, ray, far)
        return replace(self, stop=stop)


@dataclass(frozen=True, eq=False)
class ChildVertices:
    """Where the steps end: the vertices of the children before anything is reconnected.

    Parameters
    ----------
    face : (n,) int64
    weights : (n, 3) float64
        Barycentric coordinates.
    points : (n, 3) float64
    far : (n,) float64
        Length of each step from the ray's start.
    """

    face: Ints
    weights: Floats
    points: Floats
    far: Floats


def cast_rays(domain: Domain, starts: RayStarts, *, spacing: float) -> FrontRays:
    """Walk one step and a little beyond it from each start.

    Parameters
    ----------
    domain : Domain
    starts : RayStarts
    spacing : float
        In the domain's unit.

    Returns
    -------
    FrontRays
        One for each start, and on surfaces with free borders those that pass around these.

    Raises
    ------
    Degenerate
        Where free borders are so ragged that the rays around them do not settle.
    """
    n = len(starts.halfedge)
    jitter = _JITTER * ((np.arange(n) * _GOLDEN) % 1.0 - 0.5)
    reach = spacing * starts.stretch * (1.0 + jitter)
    walks = walk_far(domain.frames, starts.halfedge, starts.px, starts.py, starts.ux, starts.uy, BEYOND * reach)
    if domain.has_free_borders:
        return _cast_around_obstacles(domain, starts, walks, reach, spacing)
    return FrontRays(
        offsets=starts.offsets,
        closed=starts.curves.closed,
        walks=walks,
        lead=np.zeros(n),
        reach=reach,
        start=_find_starts(domain, walks),
        stop=np.where(walks.is_blocked, walks.far, np.inf),
        is_obstructed=np.zeros(n, bool),
        end_border=np.full(n, NO_TWIN),
        step=spacing,
    )


def _cast_around_obstacles(domain: Domain, starts: RayStarts, walks: Walks, reach: Floats, spacing: float) -> FrontRays:
    ahead = (BEYOND - 1.0) * spacing
    targets, walks = resolve_obstacles(domain, starts, walks, reach, step=spacing, ahead=ahead)
    # Sources stop rays, and so does the end of a free border along which a ray creeps.
    is_stopped = (targets.state == ARRIVES) & walks.is_blocked & ~is_obstructed(domain, walks)
    is_stopped |= (targets.state == ENDS_ON_BORDER) & (targets.end_border == NO_TWIN)
    return FrontRays(
        offsets=offsets_of(np.bincount(targets.front, minlength=len(starts.curves))),
        closed=starts.curves.closed,
        walks=walks,
        lead=targets.lead,
        reach=targets.reach,
        start=_find_starts(domain, walks),
        stop=np.where(is_stopped, walks.far, np.inf),
        is_obstructed=targets.state == OBSTRUCTED,
        end_border=targets.end_border,
        step=spacing,
    )


def _find_starts(domain: Domain, walks: Walks) -> Floats:
    first = walks.offsets[:-1]
    return domain.points(walks.face[first], walks.start[first])


def offset_vertices(domain: Domain, rays: FrontRays) -> ChildVertices:
    """The place at which the step of each ray ends (§4.2).

    A ray that is stopped within its step ends a little before: that place is nearer to what stops the ray than the
    spacing and will be taken out, so it matters only that the child goes on unbroken.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays

    Returns
    -------
    ChildVertices
        In the order of the rays.
    """
    end = np.minimum(rays.reach, _BEFORE_A_STOP * rays.stop)
    face, weights = place_along(rays.walks, end)
    at = np.flatnonzero((rays.end_border != NO_TWIN) & (end == rays.reach))
    face[at], weights[at] = rays.end_border[at] // 3, _onto_border(weights[at], rays.end_border[at])
    return ChildVertices(face, weights, domain.points(face, weights), end)


def _onto_border(weights: Floats, halfedge: Ints) -> Floats:
    """Barycentric coordinates (k, 3) moved onto the halfedges (k,) beside which they lie."""
    kept = weights.copy()
    kept[np.arange(len(halfedge)), (halfedge + 2) % 3] = 0.0
    return np.asarray(kept / kept.sum(1, keepdims=True))
