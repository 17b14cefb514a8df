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

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.meeting import Meetings, rays_meet
from weavecore.offsetting.fronts.rays import BEYOND, Ends, Rays
from weavecore.offsetting.fronts.regrouping import Regrouped, lengths_of

_SHORT_OF_THE_END = 0.97
"""A loop that steps cross within this part of their length is covered there."""

_MOST_COVERED = 0.2
_FLATTEST = 0.2
"""Sine of the angle at which a ray crosses a loop; a lesser one counts as this."""

_OFF_THE_START = 1e-3
"""Parts of its step within which a ray is still at its own front."""

_MOST_ROOM = 0.02
"""A child goes where fewer than this part of its rays have room."""


def find_uncovered(ground: Ground, rays: Rays, ends: Ends, raw: Curves, regrouped: Regrouped) -> Bools:
    """(C,) which loops bound what the rays have not covered.

    Of loops that hang together, those of one height do or none does; noise may make tiny ones that
    are higher still.  So the height with the most length that is not covered has the say.
    """
    length = lengths_of(regrouped.curves)
    covered = _covered_lengths(ground, rays, ends, raw, regrouped)
    free = np.maximum(length - covered, 0.0)
    height = regrouped.height - regrouped.height.min(initial=0)
    n_heights = int(height.max(initial=0)) + 1
    n_groups = int(regrouped.group.max(initial=0)) + 1
    tally = np.bincount(regrouped.group * n_heights + height, free, minlength=n_groups * n_heights)
    best = tally.reshape(n_groups, n_heights).argmax(1)
    is_best = height == best[regrouped.group]
    return np.asarray(is_best & (covered < _MOST_COVERED * length) & _cross_edges(regrouped.curves))


def _cross_edges(curves: Curves) -> Bools:
    """Which curves leave the face that they begin in; others are smaller than the mesh can tell."""
    leaves = curves.face != curves.face[curves.after]
    return np.asarray(np.bincount(curves.owner, leaves, minlength=len(curves)) > 0)


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
    width[rays.after] += gap / 2
    return np.asarray(width)


def _travel(rays: Rays, meetings: Meetings) -> tuple[Ints, Floats]:
    """The ray of each meeting, and how far it had come, in parts of its step."""
    walks, row = rays.walks, meetings.first
    ray = rays.of_segment[row]
    far = walks.begin[row] + (walks.finish[row] - walks.begin[row]) * meetings.on_first
    return ray, np.asarray(far / rays.reach[ray])


def find_room(ground: Ground, rays: Rays, children: Curves, parents: Curves | None) -> tuple[Bools, Rays]:
    """Which children have room before them, the grandchild test by side; and the rays of these.

    Children that face each other over less than twice the least cap are judged together.

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
    rays : Rays
        Of the children that have room, stopped where they come to one of these.
    """
    meets = np.isfinite(rays.stop)
    if parents is not None:
        meets[_travel(rays, rays_meet(ground, rays, parents))[0]] = True
    meetings = rays_meet(ground, rays, children)
    ray, far = _travel(rays, meetings)
    front = children.owner[meetings.second]
    near = far < BEYOND - 1.0
    n = len(children)
    links = coo_matrix((np.ones(int(near.sum())), (rays.owner[ray[near]], front[near])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    total = np.bincount(group[rays.owner], minlength=n)
    room = np.bincount(group[rays.owner], ~meets, minlength=n)
    has_room: Bools = (room > _MOST_ROOM * total)[group]
    in_the_way = has_room[front] & (far > _OFF_THE_START)
    stopped = rays.stopped(ray[in_the_way], (far * rays.reach[ray])[in_the_way])
    return has_room, stopped.take(has_room)
