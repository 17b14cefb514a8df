"""`Mark`: where a piece passes a node of the lattice, and which rods cross it there.

Left and right are seen from outside of the surface, along the rod of the mark::

              other rod
                 ↑              side = "left" where (t × u) · n ≥ 0,
    rod ─────────┼────→         t and u the directions of the rod and of the other one,
                 │              n the normal out of the surface
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from string import ascii_lowercase

import numpy as np

from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splices import Piece
from weavecore.geometry.arrays import rows_of
from weavecore.polling import each

OVER, UNDER = "over", "under"
LEFT, RIGHT = "left", "right"

_ON_END = 1e-6
"""Rods end at joints: a mark at most so many millimetres beyond an end, by rounding, is on it."""


@dataclass(frozen=True)
class Crossing:
    """Another rod at a mark.

    Parameters
    ----------
    rod : int
    station : float
        Along the other rod, in millimetres.
    is_over : bool
        Whether the rod of the mark lies over it, further out of the surface.
    side : str
        To which side it continues: ``"left"`` or ``"right"``.
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
        Along the rod, in millimetres.
    at : float
        From the start of the piece, in millimetres.
    node : int
    joint : int
        -1 at a node that the rod passes alone.
    code : str
        Name of the joint, with a letter where the rod passes it twice: no other mark of the rod has it.
    crossings : tuple of Crossing
    """

    piece: Piece
    number: int
    station: float
    at: float
    node: int
    joint: int
    code: str
    crossings: tuple[Crossing, ...]


def mark_pieces(plan: RodPlan, pieces: list[Piece]) -> list[Mark]:
    """Mark every node that a piece passes; where pieces overlap both are marked.

    Parameters
    ----------
    plan : RodPlan
    pieces : list of Piece

    Returns
    -------
    list of Mark
        By piece, and along each.
    """
    strands, axes = plan.weave.strands, plan.axes
    crossings, codes = _crossings(plan), _codes(plan)
    marks = []
    for piece in each(pieces):
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
            marks.append(Mark(piece, number, float(axes.stations[v]), where, node, joint, codes[v], crossings[v]))
    return marks


def joint_name(node: int, joint: int, n_nodes: int) -> str:
    """Name a joint: ``J`` and the number of its node in the lattice, or ``N`` where one rod passes the node alone.

    Parameters
    ----------
    node, joint : int
        The joint is -1 where there is none.
    n_nodes : int
        Count of the lattice's nodes, which sets the count of digits.

    Returns
    -------
    str
    """
    digits = max(4, len(str(n_nodes - 1)))
    return f"{'N' if joint < 0 else 'J'}{node:0{digits}d}"


def _codes(plan: RodPlan) -> list[str]:
    """The code of every visit (M,)."""
    nodes, joints = plan.weave.strands.nodes.tolist(), plan.joint_of_visit.tolist()
    rods = rows_of(plan.weave.strands.offsets).tolist()
    times = Counter(zip(rods, nodes))
    passed: Counter[tuple[int, int]] = Counter()
    codes = []
    for rod, node, joint in each(zip(rods, nodes, joints)):
        code = joint_name(node, joint, len(plan.nodes))
        if times[rod, node] > 1:
            code += ascii_lowercase[passed[rod, node]]
            passed[rod, node] += 1
        codes.append(code)
    return codes


def _crossings(plan: RodPlan) -> list[tuple[Crossing, ...]]:
    """The other rods at every visit, from the innermost outwards."""
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
