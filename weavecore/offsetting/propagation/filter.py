"""Which of the loops go on: those that bound what no front has covered (Yan et al. 2016, §4.5).

Two questions are asked.  Of a new loop: do steps from the parents cross it?  Then it lies where
a front has passed already.  Of a child, when it is offset once more: do its steps reach an ancestor?
Then the grandchild lies beyond the grandparent, whether the two polylines cross or have passed each
other whole, as parallel fronts on a cylinder do.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.propagation.chords import measure_chords
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.propagation.intersections import Meetings, Regrouped, lengths_of, rays_meet
from weavecore.offsetting.propagation.obstacles import is_out
from weavecore.offsetting.propagation.steps import BEYOND, Ends, Rays
from weavecore.tolerances import LEAST_CAP

_SHORT_OF_THE_END = 0.95
"""A loop that steps cross within this part of their length is covered there."""

_MOST_COVERED = 0.6
_FLATTEST = 0.2
"""Sine of the angle at which a ray crosses a loop; a lesser one counts as this."""

_ASKED, _NEAREST = 24, 6
"""So many vertices of a loop, and so many starts of rays about each, are asked how far they are apart."""

_MOST_NEAR = 0.3

_SHORTEST = 1e-3
"""Steps along an open front at least."""

_SHORT, _ROUND = 0.5, 0.02
"""Steps along a loop up to which it is small; area of a loop over the square of its length: 0.08 of a circle."""

_BESIDE = 2.0
"""Lengths of an open front that the selvedge on its right is long at most where the two enclose a disc."""

_OFF_THE_START = 1e-3
"""Parts of its step within which a ray is still at its own front."""

_MOST_BEYOND = 0.5
_MOST_ROOM = 0.02
"""A child goes where fewer than this part of its rays have room."""


def find_uncovered(ground: Ground, rays: Rays, ends: Ends, raw: Curves, regrouped: Regrouped) -> Bools:
    """(C,) which loops bound what the rays have not covered.

    Of loops that hang together, those of one height do or none does; noise may make tiny ones that
    are higher still.  So the height with the most length that is not covered has the say.
    """
    curves, length = regrouped.curves, lengths_of(regrouped.curves)
    covered = _covered_lengths(ground, rays, ends, raw, regrouped)
    # How deep it is beyond an open one, which may cut off a narrow tip, is asked later.
    least = np.where(curves.closed, np.pi * LEAST_CAP, _SHORTEST) * rays.step
    is_new = (covered < _MOST_COVERED * length) & (length > least) & _cross_edges(curves)
    is_new[is_new] = ~_are_near(ground, rays, curves.take(is_new))
    is_new[is_new] = ~_are_islands(ground, curves.take(is_new), rays.step)
    free = np.where(is_new, length - covered, 0.0)
    height = regrouped.height - regrouped.height.min(initial=0)
    n_heights = int(height.max(initial=0)) + 1
    n_groups = int(regrouped.group.max(initial=0)) + 1
    tally = np.bincount(regrouped.group * n_heights + height, free, minlength=n_groups * n_heights)
    best = tally.reshape(n_groups, n_heights).argmax(1)
    return np.asarray(is_new & (height == best[regrouped.group]))


def _are_near(ground: Ground, rays: Rays, loops: Curves) -> Bools:
    """(C,) which loops have chords to where the rays start that are shorter than the step."""
    vertex = np.flatnonzero(loops.is_vertex)
    counts = np.bincount(loops.owner[vertex], minlength=len(loops))
    rank = np.arange(len(vertex)) - offsets_of(counts)[loops.owner[vertex]]
    vertex = vertex[rank % np.maximum(counts // _ASKED, 1)[loops.owner[vertex]] == 0]
    is_near = measure_nearness(ground, rays, loops, vertex) < _SHORT_OF_THE_END
    total = np.bincount(loops.owner[vertex], minlength=len(loops))
    return np.asarray(np.bincount(loops.owner[vertex], is_near, minlength=len(loops)) > _MOST_NEAR * total)


def measure_nearness(ground: Ground, rays: Rays, loops: Curves, vertex: Ints) -> Floats:
    """How long the shortest chord is from vertices of loops to where rays start near them, in steps.

    No less than the distance from the parents, and little more where the surface is smooth.
    """
    if len(vertex) == 0:
        return np.zeros(0)
    n_near = min(_NEAREST, len(rays))
    _, nearest = cKDTree(rays.start).query(loops.points[vertex], k=n_near)
    ray = np.asarray(nearest, np.int64).reshape(-1)
    from_ = np.repeat(vertex, n_near)
    begin = rays.walks.offsets[:-1][ray]
    start = rays.walks.face[begin], rays.walks.start[begin]
    length = measure_chords(ground, loops.face[from_], loops.start[from_], *start)
    length = length + rays.lead[ray]
    return np.asarray(length.reshape(-1, n_near).min(1) / rays.step)


def _are_islands(ground: Ground, loops: Curves, step: float) -> Bools:
    """(C,) which curves are small and have a disc on their right, or cut one off: no front leaves so little behind."""
    middle = np.stack([np.bincount(loops.owner, x, len(loops)) for x in loops.points.T], axis=1)
    arm = loops.points - (middle / np.maximum(np.diff(loops.offsets), 1)[:, None])[loops.owner]
    area = np.einsum("ij,ij->i", np.cross(arm, arm[loops.after]), ground.normals[loops.face]) / 2
    total, length = np.bincount(loops.owner, area, len(loops)), lengths_of(loops)
    is_island = total < -_ROUND * length**2
    first, last = loops.ends
    (rim, place), (other_rim, other) = (ground.rims(loops.face[at], loops.start[at]) for at in (first, last))
    beside = ground.walls.measure_along(rim, place, other_rim, other)
    is_island[~loops.closed] = (beside < _BESIDE * length[~loops.closed]) & (rim != NO_TWIN) & (other_rim != NO_TWIN)
    return np.asarray((length < _SHORT * step) & is_island)


def _cross_edges(curves: Curves) -> Bools:
    """Which curves are open or leave the face they begin in; others are smaller than the mesh can tell."""
    leaves = curves.face != curves.face[curves.after]
    return np.asarray((np.bincount(curves.owner, leaves, minlength=len(curves)) > 0) | ~curves.closed)


def _covered_lengths(ground: Ground, rays: Rays, ends: Ends, raw: Curves, regrouped: Regrouped) -> Floats:
    """(C,) how much of each loop is crossed by rays, each as wide there as its share of the front."""
    meetings = rays_meet(ground, rays, raw)
    ray, far = _travel(rays, meetings)
    within = far < _SHORT_OF_THE_END
    ray, far = ray[within], far[within]
    place = meetings.second[within] + meetings.on_second[within]
    key = regrouped.segment + regrouped.first
    order = np.argsort(key, kind="stable")
    at = order[np.clip(np.searchsorted(key[order], place, side="right") - 1, 0, len(order) - 1)]
    width = _widths(rays, rays.start)[ray] * (1 - far) + _widths(rays, ends.points)[ray] * far
    curves, row = regrouped.curves, meetings.first[within]
    way = ground.points(rays.walks.face[row], rays.walks.end[row] - rays.walks.start[row])
    along = ground.points(curves.face[at], curves.end[at] - curves.start[at])
    width = width / np.maximum(_sine(way, along), _FLATTEST)
    return np.bincount(curves.owner[at], width, minlength=len(curves)).astype(np.float64)


def _sine(u: Floats, v: Floats) -> Floats:
    """Sine (n,) of the angle between vectors (n, 3)."""
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    return np.asarray(np.linalg.norm(np.cross(u, v), axis=1) / np.maximum(size, np.finfo(float).tiny))


def _widths(rays: Rays, points: Floats) -> Floats:
    """Half the distance from the ray before to the ray after, at the given points."""
    gap = np.linalg.norm(points[rays.after] - points, axis=1)
    width = gap / 2
    onward = rays.after != np.arange(len(rays))
    width[rays.after[onward]] += gap[onward] / 2
    return np.asarray(width)


def _travel(rays: Rays, meetings: Meetings) -> tuple[Ints, Floats]:
    """The ray of each meeting, and how far from its front it had come, in parts of its step."""
    walks, row = rays.walks, meetings.first
    ray = rays.of_segment[row]
    far = walks.begin[row] + (walks.finish[row] - walks.begin[row]) * meetings.on_first
    return ray, np.asarray((rays.lead[ray] + far) / (rays.lead[ray] + rays.reach[ray]))


def find_room(ground: Ground, rays: Rays, children: Curves, parents: Curves | None) -> tuple[Bools, Bools]:
    """Which children have room before them beyond doubt, and which have none: the grandchild test, by side.

    Children that nearly touch each other are judged together.

    Parameters
    ----------
    rays : Rays
        Of the children.
    children : Curves
    parents : Curves or None
        The generation before; None where that is the borders, at which rays stop.

    Returns
    -------
    has_room : (C,) bool
        Some rays go on for more than the spacing and meet no ancestor.
    has_none : (C,) bool
        Most rays come to an ancestor within the spacing: the grandchild would lie beyond it.
    """
    room = (rays.lead + rays.stop) / (rays.lead + rays.reach)
    # A selvedge is no ancestor: rays that come to one have no say.
    has_say = ~rays.is_out & (rays.rim == NO_TWIN) & ~is_out(ground, rays.walks)
    if parents is not None:
        ray, far = _travel(rays, rays_meet(ground, rays, parents))
        np.minimum.at(room, ray, far)
    meetings = rays_meet(ground, rays, children)
    ray, far = _travel(rays, meetings)
    near = far < BEYOND - 1.0
    n = len(children)
    ends = rays.owner[ray[near]], children.owner[meetings.second[near]]
    links = coo_matrix((np.ones(len(ends[0])), ends), shape=(n, n))
    _, group = connected_components(links, directed=False)
    total = np.bincount(group[rays.owner], has_say, minlength=n)
    free = np.bincount(group[rays.owner], has_say & np.isinf(room), minlength=n)
    beyond = np.bincount(group[rays.owner], has_say & (room < 1.0), minlength=n)
    return (free > _MOST_ROOM * total)[group], (beyond > _MOST_BEYOND * total)[group]


def stop_at(ground: Ground, rays: Rays, fronts: Curves) -> Rays:
    """The rays of some fronts, stopped where they come to one of these again."""
    meetings = rays_meet(ground, rays, fronts)
    ray, far = _travel(rays, meetings)
    away = far > _OFF_THE_START
    return rays.stopped(ray[away], (far * (rays.lead + rays.reach)[ray] - rays.lead[ray])[away])
