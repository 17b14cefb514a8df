"""`Mark`: where a piece passes a node, and what crosses it there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.cut import Piece
from weavecore.fabricating.plan import RodPlan
from weavecore.geometry.arrays import Floats, Ints

OVER, UNDER = "over", "under"
LEFT, RIGHT = "left", "right"

_ON_END = 1e-6
"""Rods end at joints: a mark so far beyond an end is on it."""


@dataclass(frozen=True)
class Crossing:
    """Another rod at a mark.

    Parameters
    ----------
    rod : int
    station : float
        Along that rod.
    is_over : bool
        Whether the rod of the mark lies over it, further out of the surface.
    side : str
        Where it runs on to, seen from outside and along the rod of the mark: ``"left"`` or ``"right"``.
    """

    rod: int
    station: float
    is_over: bool
    side: str


@dataclass(frozen=True)
class Mark:
    """A tick on a piece.

    Parameters
    ----------
    piece : Piece
    number : int
        From 1 along the piece.
    station : float
        Along the rod.
    at : float
        From the start of the piece.
    node : int
    joint : int
        Or -1 at a node that the rod passes alone.
    crossings : tuple of Crossing
    """

    piece: Piece
    number: int
    station: float
    at: float
    node: int
    joint: int
    crossings: tuple[Crossing, ...]


def joint_name(node: int, joint: int, n_nodes: int) -> str:
    """``J`` and the number of the node in the lattice; ``N`` where one rod passes it alone."""
    digits = max(4, len(str(n_nodes - 1)))
    return f"{'N' if joint < 0 else 'J'}{node:0{digits}d}"


def mark_pieces(plan: RodPlan, pieces: list[Piece]) -> list[Mark]:
    """Every pass of a piece by a node, by piece and along it; where pieces overlap both are marked."""
    strands, axes = plan.weave.strands, plan.axes
    crossings = _crossings(plan)
    marks = []
    for piece in pieces:
        visits = np.arange(strands.offsets[piece.rod], strands.offsets[piece.rod + 1])
        length = float(axes.lengths[piece.rod])
        laps = np.arange(-1, 3) * length if axes.closed[piece.rod] else np.zeros(1)
        at = (axes.stations[visits][None] + laps[:, None] - piece.start).ravel()
        visit = np.tile(visits, len(laps))
        on = np.flatnonzero((at >= -_ON_END) & (at <= piece.cut_length + _ON_END))
        on = on[np.argsort(at[on], kind="stable")]
        places = np.clip(at[on], 0.0, piece.cut_length).tolist()
        for number, (v, where) in enumerate(zip(visit[on].tolist(), places), start=1):
            node, joint = int(strands.nodes[v]), int(plan.joint_of_visit[v])
            marks.append(Mark(piece, number, float(axes.stations[v]), where, node, joint, crossings[v]))
    return marks


def _crossings(plan: RodPlan) -> list[tuple[Crossing, ...]]:
    """The other rods at every visit, from the innermost out."""
    joints, weave, stations = plan.weave.joints, plan.weave, plan.axes.stations
    found: list[tuple[Crossing, ...]] = [()] * len(stations)
    tangents, normals = plan.tangents.tolist(), weave.normals[joints.node].tolist()
    for j, (a, b) in enumerate(zip(joints.offsets.tolist(), joints.offsets[1:].tolist())):
        visits, rods = joints.visit[a:b].tolist(), joints.strand[a:b].tolist()
        for rank, visit in enumerate(visits):
            found[visit] = tuple(
                Crossing(rod, float(stations[other]), rank > k, _side(tangents[visit], tangents[other], normals[j]))
                for k, (other, rod) in enumerate(zip(visits, rods))
                if k != rank
            )
    return found


def _side(along: list[float], other: list[float], normal: list[float]) -> str:
    (a, b, c), (u, v, w), (x, y, z) = along, other, normal
    turn = (b * w - c * v) * x + (c * u - a * w) * y + (a * v - b * u) * z
    return LEFT if turn >= 0 else RIGHT


# ----------------------------------------------------------------------
# Joints: the angle at which rods cross, and the ties that hold them.

GRIP = 25.0
"""Length of a tie beyond the loop that it makes: the head, and what is pulled."""

TIE_SIZES = (100.0, 140.0, 200.0, 250.0, 300.0, 370.0, 430.0, 530.0, 760.0)
"""Lengths that cable ties are sold in."""


@dataclass(frozen=True, eq=False)
class Ties:
    """One row for each joint.

    Parameters
    ----------
    angle : (J,) float64
        The least angle between two of its rods, in degrees from 0 to 90.
    count : (J,) int64
        One for each pair of rods that touch.
    length : (J,) float64
        The least length of each tie: around all the rods of the joint once, along the widest gap between them.
    """

    angle: Floats
    count: Ints
    length: Floats


def find_ties(plan: RodPlan) -> Ties:
    """The ties of every joint.

    The tie runs halfway between the two rods that leave the widest angle, so it meets the rods
    beside it at half that angle, β, and goes around ellipses d / sin β wide and d high that stand on one another.
    """
    joints = plan.weave.joints
    angles, widest = np.zeros(len(joints)), np.zeros(len(joints))
    directions = _directions(plan)
    for j, (a, b) in enumerate(zip(joints.offsets.tolist(), joints.offsets[1:].tolist())):
        turned = np.sort(directions[a:b])
        gaps = np.diff(np.append(turned, turned[0] + np.pi))
        angles[j], widest[j] = gaps.min(), gaps.max()
    d = plan.diameter
    width = d / np.sin(widest / 2)
    offsets = plan.axes.layer_offsets[joints.visit]
    height = np.zeros(len(joints))
    if len(joints):
        height = np.maximum.reduceat(offsets, joints.offsets[:-1]) - np.minimum.reduceat(offsets, joints.offsets[:-1])
    loop = ellipse_around(width, d) + 2 * height
    return Ties(np.degrees(angles), np.diff(joints.offsets) - 1, loop + GRIP)


def ellipse_around(width: Floats, height: float) -> Floats:
    """Perimeter of an ellipse (Ramanujan 1914, the second formula)."""
    a, b = width / 2, height / 2
    h = ((a - b) / (a + b)) ** 2
    around: Floats = np.pi * (a + b) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    return around


def size_of_tie(length: float) -> float:
    """The least length of ties that are sold which is long enough; of longer ones the next 100 mm."""
    return next((size for size in TIE_SIZES if size >= length), float(np.ceil(length / 100) * 100))


def _directions(plan: RodPlan) -> Floats:
    """Angle (…,) from 0 to π of the line of each rod at each joint, in the plane of the joint."""
    joints = plan.weave.joints
    normal = plan.weave.normals[joints.node][joints.joint]
    along = plan.tangents[joints.visit]
    along = along - (along * normal).sum(1, keepdims=True) * normal
    first = along[joints.offsets[:-1]][joints.joint] if len(joints) else along
    across = np.cross(normal, first)
    angle: Floats = np.arctan2((along * across).sum(1), (along * first).sum(1)) % np.pi
    return angle
