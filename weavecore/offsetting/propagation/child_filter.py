"""The child filter: which children go on (Yan et al. 2016, §4.5).

The paper offsets a child once more and drops it where the grandchild crosses the grandparent.  That is not enough: the
loop cut off at a sharp corner is offset sideways and meets no ancestor, and parallel fronts on a cylinder change places
between two steps without crossing.  So two questions are asked, both by side:

1. `find_uncovered_loops`, of the loops that reconnecting leaves: do the steps of the parents cross it before they end,
   or is it nearer to their starts than the step?  Then a front has been there already, and the loop goes.
2. `filter_by_grandchild`, of the children that are left: do their own steps reach an ancestor?  Then the grandchild
   would lie beyond the grandparent, whether the two cross or have passed each other::

       child A   ---->|           |<----  child B       no room: each step ends beyond the other child
                 ---->|        |<----                   room

   Of a child in doubt it is tried whether anything is left when it is offset by the least cap, `MIN_CAP_RISE`.

The time is linear in segments and in pairs of segments that share a face.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, connected, ranks_in_rows
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.child_curves import embed_children
from weavecore.offsetting.propagation.chords import measure_chords
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import (
    Intersections,
    find_intersections,
    find_ray_intersections,
)
from weavecore.offsetting.propagation.obstacle_shadows import is_obstructed
from weavecore.offsetting.propagation.offset_vertices import (
    BEYOND,
    ChildVertices,
    FrontRays,
    cast_rays,
    offset_vertices,
)
from weavecore.offsetting.propagation.ray_directions import start_on_curves
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves
from weavecore.offsetting.propagation.uncrossing import UncrossedCurves, reconnect_at_crossings
from weavecore.tolerances import MIN_CAP_RISE

# ----------------------------------------------------------------------
# Of the loops that reconnecting leaves: has a front been there already?

_SHORT_OF_THE_END = 0.95
"""Parts of a step within which it covers what it crosses; a loop made of its own ends lies at 1."""

_MOST_COVERED = 0.6
"""Parts of its length up to which a loop may be covered: between the 0 of a child and the 1 of what is cut off."""

_FLATTEST = 0.2
"""Sine of the angle at which a ray crosses a loop; a lesser one counts as this, lest a ray along it cover it all."""

_ASKED, _NEAREST = 24, 6
"""About so many vertices of a loop, and so many starts of rays next to each, are asked how far they are apart."""

_MOST_NEAR = 0.3
"""Parts of those vertices that may be nearer to the parents than the step: at corners some are."""

_SHORTEST = 1e-3
"""Steps along an open front at least; one that cuts off a narrow tip may be so short."""

_SHORT = 0.5
"""Steps along a loop up to which it may be an island."""

_ROUND = 0.02
"""Area of an island over the square of its length at least: a quarter of a circle's, 0.08."""

_BESIDE = 2.0
"""Lengths of an open front that the free border on its right is long at most where the two enclose an island."""


def find_uncovered_loops(
    domain: Domain, rays: FrontRays, vertices: ChildVertices, raw: SurfaceCurves, uncrossed: UncrossedCurves
) -> Bools:
    """Which loops bound what the rays have not covered.

    Of loops that hang together, those of one winding number do or none does; noise may make tiny ones that are higher
    still.  So the winding number with the greatest length that is not covered decides.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
        Of the parents.
    vertices : ChildVertices
        The ends of the rays' steps.
    raw : SurfaceCurves
        The children through these.
    uncrossed : UncrossedCurves
        The same, reconnected, of C curves.

    Returns
    -------
    (C,) bool
    """
    curves, length = uncrossed.curves, uncrossed.curves.curve_lengths
    covered = _measure_covered(domain, rays, vertices, raw, uncrossed)
    # How deep it is beyond an open one, which may cut off a narrow tip, is asked later.
    least = np.where(curves.closed, np.pi * MIN_CAP_RISE, _SHORTEST) * rays.step
    is_new = (covered < _MOST_COVERED * length) & (length > least) & _leave_their_faces(curves)
    is_new[is_new] = ~_are_near(domain, rays, curves.take(is_new))
    is_new[is_new] = ~_are_islands(domain, curves.take(is_new), rays.step)
    free = np.where(is_new, length - covered, 0.0)
    winding = uncrossed.winding - uncrossed.winding.min(initial=0)
    n_windings = int(winding.max(initial=0)) + 1
    n_groups = int(uncrossed.group.max(initial=0)) + 1
    tally = np.bincount(uncrossed.group * n_windings + winding, free, minlength=n_groups * n_windings)
    best = tally.reshape(n_groups, n_windings).argmax(1)
    return np.asarray(is_new & (winding == best[uncrossed.group]))


def _measure_covered(
    domain: Domain, rays: FrontRays, vertices: ChildVertices, raw: SurfaceCurves, uncrossed: UncrossedCurves
) -> Floats:
    """How much of each loop (C,) is crossed by rays, each as wide there as its share of the front."""
    hits = find_ray_intersections(domain, rays, raw)
    ray, far = _measure_travel(rays, hits)
    within = far < _SHORT_OF_THE_END
    ray, far = ray[within], far[within]
    place = hits.second[within] + hits.on_second[within]
    key = uncrossed.segment + uncrossed.first
    order = np.argsort(key, kind="stable")
    at = order[np.clip(np.searchsorted(key[order], place, side="right") - 1, 0, len(order) - 1)]
    width = _measure_widths(rays, rays.start)[ray] * (1 - far) + _measure_widths(rays, vertices.points)[ray] * far
    curves, row = uncrossed.curves, hits.first[within]
    way = domain.points(rays.walks.face[row], rays.walks.end[row] - rays.walks.start[row])
    along = domain.points(curves.face[at], curves.end[at] - curves.start[at])
    width = width / np.maximum(_sine(way, along), _FLATTEST)
    return np.bincount(curves.owner[at], width, minlength=len(curves)).astype(np.float64)


def _measure_travel(rays: FrontRays, hits: Intersections) -> tuple[Ints, Floats]:
    """The ray (k,) of each intersection, and how far from its front it had come (k,), in parts of its step."""
    walks, row = rays.walks, hits.first
    ray = rays.of_segment[row]
    far = walks.begin[row] + (walks.finish[row] - walks.begin[row]) * hits.on_first
    return ray, np.asarray((rays.lead[ray] + far) / (rays.lead[ray] + rays.reach[ray]))


def _measure_widths(rays: FrontRays, points: Floats) -> Floats:
    """Half the distance (n,) from the ray before to the ray after, at points (n, 3) of the rays."""
    gap = np.linalg.norm(points[rays.after] - points, axis=1)
    width = gap / 2
    onward = rays.after != np.arange(len(rays))
    width[rays.after[onward]] += gap[onward] / 2
    return np.asarray(width)


def _sine(u: Floats, v: Floats) -> Floats:
    """Sine (n,) of the angle between vectors (n, 3)."""
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    return np.asarray(np.linalg.norm(np.cross(u, v), axis=1) / np.maximum(size, np.finfo(float).tiny))


def _leave_their_faces(curves: SurfaceCurves) -> Bools:
    """Which curves (C,) are open or leave the face they begin in; others are smaller than the mesh resolves."""
    leaves = curves.face != curves.face[curves.after]
    return np.asarray((np.bincount(curves.owner, leaves, minlength=len(curves)) > 0) | ~curves.closed)


def _are_near(domain: Domain, rays: FrontRays, loops: SurfaceCurves) -> Bools:
    """Which loops (C,) have chords to where the rays start that are shorter than the step."""
    vertex = np.flatnonzero(loops.is_vertex)
    counts = np.bincount(loops.owner[vertex], minlength=len(loops))
    rank = ranks_in_rows(counts)
    vertex = vertex[rank % np.maximum(counts // _ASKED, 1)[loops.owner[vertex]] == 0]
    is_near = measure_nearness(domain, rays, loops, vertex) < _SHORT_OF_THE_END
    total = np.bincount(loops.owner[vertex], minlength=len(loops))
    return np.asarray(np.bincount(loops.owner[vertex], is_near, minlength=len(loops)) > _MOST_NEAR * total)


def measure_nearness(domain: Domain, rays: FrontRays, loops: SurfaceCurves, vertex: Ints) -> Floats:
    """How near vertices of loops are to where rays start.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
    loops : SurfaceCurves
    vertex : (k,) int64
        Segments of the loops that begin at vertices.

    Returns
    -------
    (k,) float64
        Length of the shortest chord from each to a start nearby, in steps: no less than the distance from the
        parents, and little more where the surface is smooth.
    """
    if len(vertex) == 0:
        return np.zeros(0)
    n_near = min(_NEAREST, len(rays))
    _, nearest = cKDTree(rays.start).query(loops.points[vertex], k=n_near)
    ray = np.asarray(nearest, np.int64).reshape(-1)
    from_ = np.repeat(vertex, n_near)
    begin = rays.walks.offsets[:-1][ray]
    start = rays.walks.face[begin], rays.walks.start[begin]
    length = measure_chords(domain, loops.face[from_], loops.start[from_], *start)
    length = length + rays.lead[ray]
    return np.asarray(length.reshape(-1, n_near).min(1) / rays.step)


def _are_islands(domain: Domain, loops: SurfaceCurves, step: float) -> Bools:
    """Which curves (C,) are small and have a disc on their right, or cut one off: no front leaves so little behind."""
    middle = np.stack([np.bincount(loops.owner, x, len(loops)) for x in loops.points.T], axis=1)
    arm = loops.points - (middle / np.maximum(np.diff(loops.offsets), 1)[:, None])[loops.owner]
    area = np.einsum("ij,ij->i", np.cross(arm, arm[loops.after]), domain.normals[loops.face]) / 2
    total, length = np.bincount(loops.owner, area, len(loops)), loops.curve_lengths
    is_island = total < -_ROUND * length**2
    first, last = loops.ends
    (border, place), (other_border, other) = (
        domain.find_free_borders(loops.face[at], loops.start[at]) for at in (first, last)
    )
    beside = domain.boundary.measure_along(border, place, other_border, other)
    cuts_off = (border != NO_TWIN) & (other_border != NO_TWIN)
    is_island[~loops.closed] = (beside < _BESIDE * length[~loops.closed]) & cuts_off
    return np.asarray((length < _SHORT * step) & is_island)


# ----------------------------------------------------------------------
# Of the children that are left: has the grandchild room?

_MOST_BEYOND = 0.5
"""A child whose rays reach an ancestor within the spacing, more than this part of them, has no room."""

_MOST_ROOM = 0.02
"""A child with fewer rays than this part of them that meet no ancestor up to `BEYOND` is in doubt."""

_DOUBTFUL_LENGTH = 3.0
"""Spacings along a child up to which it may be too shallow whatever room some of its rays find."""

_STEPS_PER_CAP = 4.0
"""Gaps between rays on a length of the least cap, where a child is offset by that."""

_OFF_THE_START = 1e-3
"""Parts of its step within which a ray is still at its own front."""


def filter_by_grandchild(
    domain: Domain, rays: FrontRays, children: SurfaceCurves, grandparents: SurfaceCurves | None
) -> Bools:
    """Which children go on (§4.5): those whose own children would not lie beyond an ancestor.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
        Of the children.
    children : SurfaceCurves
    grandparents : SurfaceCurves or None
        The generation before; None where that is the borders, at which rays stop.

    Returns
    -------
    (C,) bool
    """
    has_room, has_none = find_room_for_grandchildren(domain, rays, children, grandparents)
    doubtful = (~has_room | (children.curve_lengths < _DOUBTFUL_LENGTH * rays.step)) & ~has_none
    has_room[doubtful] = _are_deep(domain, children.take(doubtful), spacing=rays.step)
    return has_room


def find_room_for_grandchildren(
    domain: Domain, rays: FrontRays, children: SurfaceCurves, parents: SurfaceCurves | None
) -> tuple[Bools, Bools]:
    """Which children have room before them beyond doubt, and which have none.

    Children that nearly touch each other are judged together.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
        Of the children.
    children : SurfaceCurves
    parents : SurfaceCurves or None
        The generation before; None where that is the borders, at which rays stop.

    Returns
    -------
    has_room : (C,) bool
        Some rays go on for more than the spacing and meet no ancestor.
    has_none : (C,) bool
        Most rays come to an ancestor within the spacing: the grandchild would lie beyond it.
    """
    room = (rays.lead + rays.stop) / (rays.lead + rays.reach)
    # A free border is no ancestor: rays that come to one do not count.
    counts = ~rays.is_obstructed & (rays.end_border == NO_TWIN) & ~is_obstructed(domain, rays.walks)
    if parents is not None:
        ray, far = _measure_travel(rays, find_ray_intersections(domain, rays, parents))
        np.minimum.at(room, ray, far)
    hits = find_ray_intersections(domain, rays, children)
    ray, far = _measure_travel(rays, hits)
    near = far < BEYOND - 1.0
    n = len(children)
    ends = rays.owner[ray[near]], children.owner[hits.second[near]]
    _, group = connected(*ends, n)
    total = np.bincount(group[rays.owner], counts, minlength=n)
    free = np.bincount(group[rays.owner], counts & np.isinf(room), minlength=n)
    beyond = np.bincount(group[rays.owner], counts & (room < 1.0), minlength=n)
    return (free > _MOST_ROOM * total)[group], (beyond > _MOST_BEYOND * total)[group]


def _are_deep(domain: Domain, fronts: SurfaceCurves, *, spacing: float) -> Bools:
    """Which fronts (C,) enclose what is deeper than the least cap: something is left when they are offset by it.

    A front of which nothing is left itself is judged with those that its child crosses.
    """
    if len(fronts) == 0:
        return np.zeros(0, bool)
    cap = MIN_CAP_RISE * spacing
    rays = cast_rays(domain, start_on_curves(domain, fronts, step=cap / _STEPS_PER_CAP), spacing=cap)
    rays = stop_at_fronts(domain, rays, fronts)
    vertices = offset_vertices(domain, rays)
    raw, front = embed_children(domain, rays, vertices, fronts)
    uncrossed = reconnect_at_crossings(domain, raw, find_intersections(domain, raw))
    is_left = find_uncovered_loops(domain, rays, vertices, raw, uncrossed)
    group = np.full(len(fronts), -1)
    group[front[raw.owner[uncrossed.segment]]] = uncrossed.group[uncrossed.curves.owner]
    return np.isin(group, uncrossed.group[is_left])


def stop_at_fronts(domain: Domain, rays: FrontRays, fronts: SurfaceCurves) -> FrontRays:
    """The rays of some fronts, stopped where they come to one of these again.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
    fronts : SurfaceCurves

    Returns
    -------
    FrontRays
    """
    ray, far = _measure_travel(rays, find_ray_intersections(domain, rays, fronts))
    away = far > _OFF_THE_START
    return rays.stopped(ray[away], (far * (rays.lead + rays.reach)[ray] - rays.lead[ray])[away])
