"""A curve as points on about the distance of the mesh's edges below it, kinks and ends among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import FaceFinder
from weavecore.geometry.curve_points import (
    clean_curve,
    divided,
    keep_ends,
    room_beside,
    segments_of,
    thinned,
    turns,
)

_EXTENT = 0.1
"""This part of its own extent counts as an edge where the edges below a curve are longer."""

_SLACK_OF_ROOM = 0.1
"""And to this part of the distance to where it comes back to itself."""

_MOST_ROUNDS = 4
_KINK, _SHARP = np.radians(30), np.radians(120)
_SHORTEST = 0.1  # of the least height of a face below it: a shorter curve is lost on the mesh
_FAR_OF_EDGE, _FAR, _FAR_BETWEEN = 0.25, 0.02, 0.1
"""The points of a curve may lie off the mesh by these parts of the edge there or of the mesh's size, whichever is
more; the chords between them by this part of its size."""


@dataclass(frozen=True, eq=False)
class CurveOnMesh:
    """A curve as points on a mesh.

    Parameters
    ----------
    places : (n, 3) float64
        On the mesh.
    face : (n,) int64
        The face that each lies on.
    is_closed : bool
    is_exact : (n,) bool
        Whether a place may not be moved: a kink, or an end.
    room : (n,) float64
        Distance to where the curve comes back to itself; infinite where it does not.
    edge : (n,) float64
        Mean edge of the face below each point.
    height : (n,) float64
        Least height of that face.
    """

    places: Floats
    face: Ints
    is_closed: bool
    is_exact: Bools
    room: Floats
    edge: Floats
    height: Floats

    def take(self, rows: Ints) -> CurveOnMesh:
        """Some of the points."""
        kept = (self.is_exact[rows], self.room[rows], self.edge[rows], self.height[rows])
        return CurveOnMesh(self.places[rows], self.face[rows], self.is_closed, *kept)


class _Ground:
    """The mesh below a curve."""

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        self._finder = FaceFinder(vertices, faces)
        corners = vertices[faces]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        self.mean_side = sides.mean(1)
        self.height = area / sides.max(1)
        self.size = float(np.linalg.norm(np.ptp(vertices, axis=0)))

    def below(self, points: Floats) -> tuple[Ints, Floats, Floats]:
        """Face below each point, place on it and distance from it."""
        face, place = self._finder.find(points)
        return face, place, np.linalg.norm(points - place, axis=1)

    def side_at(self, points: Floats) -> Floats:
        """Mean side of the face below each point."""
        side: Floats = self.mean_side[self.below(points)[0]]
        return side


def curve_on_mesh(
    vertices: Floats, faces: Ints, curve: Floats, *, tolerance: float, slack: float, least: float
) -> CurveOnMesh:
    """Points that tell the shape of a curve, on the mesh that it lies on or near.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    curve : (n, 3) float64
        Points along it; a closed one comes back to its first.
    tolerance : float
    slack : float
        To which part of the edges below it the points are to tell its shape, or of a tenth of its extent.
    least : float
        The same where it comes back to itself, however near.

    Raises
    ------
    BadCurve
        Where it is too far off, or too short.
    NonFinite, TooMuchWork
    """
    points, is_closed = clean_curve(curve, tolerance)
    ground = _Ground(vertices, faces)
    face, place, gap = ground.below(points)
    side = ground.mean_side[face]
    _refuse_far(points, gap, np.maximum(_FAR_OF_EDGE * side, max(tolerance, _FAR * ground.size)))
    is_new = np.append(True, (place[1:] != place[:-1]).any(1))
    points, side, face = place[is_new], side[is_new], face[is_new]
    start, end = segments_of(points, is_closed)
    length = float(np.linalg.norm(end - start, axis=1).sum())
    if length <= _SHORTEST * ground.height[face].min():
        raise BadCurve(
            f"A curve of the length {length:.4g} is lost on a mesh with edges of {side.min():.4g}",
            remedy="Give a longer one, or a finer mesh.",
        )
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    unit = np.minimum(side, _EXTENT * extent)
    told, is_exact, room = _told_by_points(points, is_closed, slack * unit, least * unit, ground)
    below, place, gap = ground.below(told)
    _refuse_far(told, gap, np.full(len(told), max(tolerance, _FAR_BETWEEN * ground.size)))
    return CurveOnMesh(place, below, is_closed, is_exact, room, ground.mean_side[below], ground.height[below])


def _told_by_points(
    points: Floats, is_closed: bool, slack: Floats, least: Floats, ground: _Ground
) -> tuple[Floats, Bools, Floats]:
    """Points that tell the shape of a curve, whether each must stay where it is, and the room beside it."""
    for _ in range(_MOST_ROUNDS):
        kept = thinned(points, is_closed, slack)
        line, given = divided(points[kept], is_closed, ground.side_at)
        room = room_beside(line, is_closed)
        rough = _SLACK_OF_ROOM * room
        # What a stretch has beside it bounds how far its own points may lie off what is left of it.
        owner = np.maximum.accumulate(np.where(given >= 0, given, 0))
        allowed = np.full(len(kept), np.inf)
        np.minimum.at(allowed, owner, rough)
        np.minimum.at(allowed, (owner + 1) % len(kept), rough)
        span = np.searchsorted(kept, np.arange(len(points)), side="right") - 1
        wanted = np.maximum(np.minimum(allowed[span], allowed[(span + 1) % len(kept)]), least)
        if not (wanted < slack).any():
            break
        slack = np.minimum(slack, wanted)
    is_given, turn = given >= 0, turns(points[kept], is_closed)
    is_exact = np.zeros(len(line), bool)
    is_exact[is_given] = keep_ends(turn > _KINK, is_closed)
    room[np.flatnonzero(is_given)[turn > _SHARP]] = 0.0  # both sides come together there
    return line, is_exact, room


def _refuse_far(points: Floats, gap: Floats, most: Floats) -> None:
    worst = int(np.argmax(gap - most))
    if gap[worst] > most[worst]:
        x, y, z = points[worst].tolist()
        raise BadCurve(
            f"The curve lies up to {gap[worst]:.4g} off the surface, near ({x:.6g}, {y:.6g}, {z:.6g})",
            remedy="Pull or project it onto the surface, or look at whether its unit is that of the surface.",
        )
