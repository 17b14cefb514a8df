"""Diffracted rays: how a front goes on along a free border, and behind the corners where that border turns away.

A shortest path bends around the reflex corners of a border.  So at such a corner a front opens: a fan of rays leaves
the corner into the region behind it, and one ray *creeps* on along the border (the diffracted and the creeping rays
of Keller 1962, "Geometrical theory of diffraction")::

                |   /  _-    fan: what is left of the step behind the corner
                |  / _-
         corner | /_-
                +============+ - -   the creeping ray follows the free border; where this turns away again,
                |  obstacle  |       more rays leave it
       last ray |            |
    ------------+            +-----  front

Behind a round hole the front is an involute of it.

The time is linear in the border's halfedges along the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.geodesics import Walks
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.ray_directions import FAN_ANGLE

STRAIGHT = 0.05
"""Radians: a border that turns away by less is straight, one that turns in by more ends the creeping ray."""

_LEAST_TURN = 1e-4
"""Radians: no rays leave a vertex at which the border turns away by less; the next that turns more has them all."""

_OFF_THE_VERTEX = 1e-4
"""Parts of an edge: a creeping ray ends no nearer to the vertices, so that no child ends on one."""

_AT_THE_VERTEX = 0.02
"""Parts of an edge: a walk that meets the border so near to a corner is taken for one that just passes it."""

_LEAST_WEDGE = 1e-6
"""Radians of the fan behind a corner at least: the border may run straight on, and the walk miss it by rounding."""


@dataclass(frozen=True, eq=False)
class DiffractedRays:
    """What leaves a place on a free border, in the order in which the creeping ray comes to it.

    Parameters
    ----------
    pivot : (k,) int64
        The boundary halfedges at whose tails rays leave the border.
    angle : (k,) float64
        Their directions counter-clockwise from the pivots, in radians.
    lead : (k,) float64
        Length along the border to where they leave.
    halfedge : (m,) int64
        The way of the creeping ray.
    start, end : (m,) float64
        From which part of each halfedge to which, in 0 to 1.
    ends_on_border : bool
        Whether the step ends on the border; if not, the border turns into the way of the ray.
    """

    pivot: Ints
    angle: Floats
    lead: Floats
    halfedge: Ints
    start: Floats
    end: Floats
    ends_on_border: bool


def diffract(domain: Domain, *, halfedge: int, place: float, on_right: bool, reach: float) -> DiffractedRays:
    """Creep along a free border from a place on it.

    Parameters
    ----------
    domain : Domain
    halfedge : int
        Of the free border.
    place : float
        Length along the halfedge from its tail.
    on_right : bool
        Whether the border lies on the right of the creeping ray, which then runs along the halfedges; else against.
    reach : float
        Length of the step.

    Returns
    -------
    DiffractedRays
    """
    boundary, length = domain.boundary, domain.frames.length
    leaving: list[tuple[int, float, float]] = []
    way: list[tuple[int, float, float]] = []
    gone, turned, at, x, ends_on_border = 0.0, 0.0, halfedge, place, True
    while True:
        size = float(length[at])
        room = size - x if on_right else x
        if reach - gone <= room:
            end = (x + (reach - gone) * (1 if on_right else -1)) / size
            way.append((at, x / size, float(np.clip(end, _OFF_THE_VERTEX, 1 - _OFF_THE_VERTEX))))
            break
        way.append((at, x / size, 1.0 if on_right else 0.0))
        gone += room
        onward = int(boundary.after[at] if on_right else boundary.before[at])
        if not domain.is_free_border[onward]:
            break
        pivot = onward if on_right else at
        turn = float(boundary.angle[pivot]) - np.pi
        turned = turned + turn
        if turned < -STRAIGHT:
            ends_on_border = False
            break
        if turned > STRAIGHT and turn > _LEAST_TURN:
            leaving += [(pivot, a if on_right else np.pi + turn - a, gone) for a in fan_angles(turn).tolist()]
            turned = 0.0
        at, x = onward, 0.0 if on_right else float(length[onward])
    left, along = np.array(leaving).reshape(-1, 3), np.array(way)
    return DiffractedRays(
        pivot=left[:, 0].astype(np.int64),
        angle=left[:, 1],
        lead=left[:, 2],
        halfedge=along[:, 0].astype(np.int64),
        start=along[:, 1],
        end=along[:, 2],
        ends_on_border=ends_on_border,
    )


def fan_angles(wedge: float) -> Floats:
    """Directions of the rays of a fan.

    Parameters
    ----------
    wedge : float
        Radians between the first ray and the free border.

    Returns
    -------
    (k,) float64
        Radians from the border: from the wedge down, without 0, at most `FAN_ANGLE` apart.
    """
    count = max(1, int(np.ceil(wedge / FAN_ANGLE)))
    return np.asarray(wedge * (1.0 - np.arange(count) / count))


def find_passed_corner(domain: Domain, walk: Walks, on_right: bool) -> tuple[int, float] | None:
    """The corner of a free border which a walk just fails to pass.

    Parameters
    ----------
    domain : Domain
    walk : Walks
        A single one that meets a boundary halfedge.
    on_right : bool
        Whether the obstacle lies on the right of the walk.

    Returns
    -------
    tuple of int and float, or None
        The boundary halfedge whose tail is the corner, and the wedge that opens behind it in radians; None where the
        walk meets the border too far from a corner, or nothing opens.
    """
    wall, boundary = int(walk.stopped_at[0]), domain.boundary
    part = float(walk.end[-1][(wall % 3 + 1) % 3])
    slant = float(np.arctan2(-walk.stop_uy[0], walk.stop_ux[0]))
    pivot = int(boundary.after[wall]) if on_right else wall
    beyond = pivot if on_right else int(boundary.before[wall])
    wedge = float(boundary.angle[pivot]) - (np.pi + slant if on_right else 2 * np.pi - slant)
    is_there = (1.0 - part if on_right else part) < _AT_THE_VERTEX
    is_passed = is_there and wedge > -STRAIGHT and domain.is_free_border[beyond]
    return (pivot, max(wedge, _LEAST_WEDGE)) if is_passed else None
