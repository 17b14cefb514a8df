"""Rays that creep along a selvedge, and leave it where it turns away.

So do shortest paths, which bend around its reflex corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.walking import Walks
from weavecore.offsetting.fronts.aims import AT_RIM, OUT
from weavecore.offsetting.fronts.ground import Ground
from weavecore.offsetting.fronts.seeds import FAN_ANGLE

STRAIGHT = 0.05
"""Radians that a selvedge may turn away before rays leave it, or turn in before none goes on along it."""

_LEAVES = 1e-4
_OFF_THE_VERTEX = 1e-4

_AT_THE_VERTEX = 0.02
"""Parts of an edge: a walk that ends so near to its vertex may be one that passes a corner there."""

_LEAST_WEDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Crept:
    """What leaves a place on a selvedge, in the order in which the way along it comes to it.

    Parameters
    ----------
    pivot, angle, lead : (k,)
        Rays that leave the selvedge: the vertex, as the tail of a halfedge of the wall, the direction from that, and
        how far it is to there.
    halfedge, start, end : (m,)
        The way along the selvedge, and from which part of each halfedge to which.
    state : int
        `AT_RIM` where the step ends on the selvedge, `OUT` where the selvedge turns into the way.
    """

    pivot: Ints
    angle: Floats
    lead: Floats
    halfedge: Ints
    start: Floats
    end: Floats
    state: int


def creep(ground: Ground, *, halfedge: int, place: float, on_right: bool, reach: float) -> Crept:
    """Walk along a selvedge from a place on a halfedge of it, with the selvedge on one's right or left."""
    walls, length = ground.walls, ground.frames.length
    leaving: list[tuple[int, float, float]] = []
    way: list[tuple[int, float, float]] = []
    gone, net, at, x, state = 0.0, 0.0, halfedge, place, AT_RIM
    while True:
        size = float(length[at])
        room = size - x if on_right else x
        if reach - gone <= room:
            end = float(
                np.clip((x + (reach - gone) * (1 if on_right else -1)) / size, _OFF_THE_VERTEX, 1 - _OFF_THE_VERTEX)
            )
            way.append((at, x / size, end))
            break
        way.append((at, x / size, 1.0 if on_right else 0.0))
        gone += room
        onward = int(walls.after[at] if on_right else walls.before[at])
        if not ground.is_selvedge[onward]:
            break
        pivot = onward if on_right else at
        turn = float(walls.angle[pivot]) - np.pi
        net = net + turn
        if net < -STRAIGHT:
            state = OUT
            break
        if net > STRAIGHT and turn > _LEAVES:
            angles = fan(turn)
            leaving += [(pivot, a if on_right else np.pi + turn - a, gone) for a in angles.tolist()]
            net = 0.0
        at, x = onward, 0.0 if on_right else float(length[onward])
    left, crept = np.array(leaving).reshape(-1, 3), np.array(way)
    corners, halfedges = left[:, 0].astype(np.int64), crept[:, 0].astype(np.int64)
    return Crept(corners, left[:, 1], left[:, 2], halfedges, crept[:, 1], crept[:, 2], state)


def fan(wedge: float) -> Floats:
    """Angles from a wedge down to 0, which is left out."""
    count = max(1, int(np.ceil(wedge / FAN_ANGLE)))
    return np.asarray(wedge * (1.0 - np.arange(count) / count))


def corner_passed(ground: Ground, walk: Walks, on_right: bool) -> tuple[int, float] | None:
    """The corner of a selvedge by which a walk is stopped as it just passes it, and the angle that opens behind."""
    wall, walls = int(walk.wall[0]), ground.walls
    part = float(walk.end[-1][(wall % 3 + 1) % 3])
    slant = float(np.arctan2(-walk.wall_uy[0], walk.wall_ux[0]))
    pivot = int(walls.after[wall]) if on_right else wall
    beyond = pivot if on_right else int(walls.before[wall])
    wedge = float(walls.angle[pivot]) - (np.pi + slant if on_right else 2 * np.pi - slant)
    is_there = (1.0 - part if on_right else part) < _AT_THE_VERTEX
    is_passed = is_there and wedge > -STRAIGHT and ground.is_selvedge[beyond]
    return (pivot, max(wedge, _LEAST_WEDGE)) if is_passed else None
