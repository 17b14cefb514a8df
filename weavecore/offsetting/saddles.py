"""Corners of selvedges that shortest paths bend around.

Glued to its mirror a selvedge that turns away from the surface is a saddle with so much angle that no ray sees what
lies behind it.  The front turns about it as about a border's corner: a fan of rays leaves it all around when it has
been reached.  Those that run where the front has been are late, and die.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.unfolding import Unfolding
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.rays import Rays
from weavecore.offsetting.records import Records
from weavecore.offsetting.seeds import FAN_ANGLE, find_sector, start_off_corner

SHARP = 0.05
"""Radians above a full turn from which on fans are worth their while."""


class Saddles:
    """The corners of a surface's selvedges that the front has not reached yet."""

    def __init__(self, frames: Unfolding, surface: SurfaceMesh) -> None:
        selvedge = np.flatnonzero(surface.is_selvedge)
        vertex = surface.faces.ravel()[selvedge]
        is_sharp = frames.excess[vertex] > SHARP
        self._vertex, self._leaving = vertex[is_sharp], selvedge[is_sharp]

    def fan_out(self, frames: Unfolding, records: Records, distance: float) -> Rays:
        """Rays that leave all around the saddles which lie within a distance."""
        at = records.distance[self._vertex]
        reached = at < distance
        rays = _fans(frames, self._vertex[reached], self._leaving[reached], at[reached])
        self._vertex, self._leaving = self._vertex[~reached], self._leaving[~reached]
        return rays


def _fans(frames: Unfolding, vertex: Ints, leaving: Ints, distance: Floats) -> Rays:
    total = frames.total_angle[vertex]
    # An even number, so that no ray runs along the selvedge, where rounding would tell which sheet it is on.
    count = 2 * np.ceil(total / (2 * FAN_ANGLE)).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    angle = (np.arange(len(owner)) - offsets[owner] + 0.5) * (total / count)[owner]
    halfedge, angle = find_sector(frames, leaving[owner], angle)
    rays = start_off_corner(frames, halfedge, angle)
    rays.distance = distance[owner]
    # Counter-clockwise neighbours: the front between them runs the other way.
    rays.after = np.arange(len(owner)) - 1
    first = offsets[:-1]
    rays.after[first] = offsets[1:] - 1
    return rays
