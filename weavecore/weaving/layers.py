"""Which rod lies over which, in any style."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.model.joints import Joints
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.plain import alternate
from weavecore.weaving.strands import Meetings, find_meetings, steps_along
from weavecore.weaving.twill import twill


@dataclass(frozen=True, eq=False)
class Order:
    """Joints with their rods in order, and the conflicts (C, 3) of `Weave`."""

    joints: Joints
    conflicts: Ints


def order_rods(lattice: Lattice, strands: Strands, lean: Ints, style: Style) -> Order:
    """Lay the rods over and under each other.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    lean : (S,) int64
        Whether each strand leans forward (1), back (-1) or neither way (0).
    style : Style
    """
    meetings = find_meetings(strands)
    if style.name == STACKED:
        return _ordered(strands, meetings, stack(strands, lean), changes=False)
    if style.name == PLAIN:
        ways = alternate(lattice, strands, meetings)
        orders = [_ordered(strands, meetings, wish, changes=True) for wish in ways]
        return min(orders, key=lambda order: len(order.conflicts))
    wish, is_broken = twill(lattice, strands, meetings, style.over, style.under)
    return Order(order_joints(strands, meetings, wish), find_conflicts(strands, is_broken))


def _ordered(strands: Strands, meetings: Meetings, wish: Floats, *, changes: bool) -> Order:
    joints = order_joints(strands, meetings, wish)
    return Order(joints, find_conflicts(strands, broken_steps(joints, strands, changes=changes)))


# ----------------------------------------------------------------------
# The order of the rods at every joint: stacked in layers, plain, or twill.


def order_joints(strands: Strands, meetings: Meetings, wish: Floats) -> Joints:
    """Joints with their visits in the order of what each visit wishes for (M,); rings lie under their equals."""
    owner = rows_of(strands.offsets)[meetings.visit]
    is_ring = strands.family[owner] == LATITUDINAL
    joint = rows_of(meetings.offsets)
    order = np.lexsort([owner, ~is_ring, wish[meetings.visit], joint])
    return Joints(meetings.node, meetings.offsets, meetings.visit[order], owner[order])


def stack(strands: Strands, lean: Ints) -> Floats:
    """Wishes (M,) of three layers: rods that lean forward below, rings in the middle, those that lean back above."""
    return (-lean).astype(np.float64)[rows_of(strands.offsets)]


def layer_offsets(joints: Joints, strands: Strands, shifts: Floats, *, centred_on_rings: bool) -> Floats:
    """How far out of the surface each visit (M,) lies, from the shift (C,) between the rods of each contact.

    The layers of a joint lie evenly about the surface, or about the ring where there is one and
    that is asked for.
    """
    climb = np.zeros(len(joints.visit))
    climb[joints.contacts[:, 1]] = shifts
    total = np.cumsum(climb)
    first, last = joints.offsets[:-1], joints.offsets[1:] - 1
    middle = (total[first] + total[last]) / 2.0
    if centred_on_rings:
        ring = np.flatnonzero(strands.family[joints.strand] == LATITUDINAL)
        middle[joints.joint[ring]] = total[ring]
    offsets = np.zeros(len(strands.nodes))
    offsets[joints.visit] = total - middle[joints.joint]
    return offsets


def sides(joints: Joints, n_visits: int) -> Ints:
    """1 for the outermost visit of a joint, -1 for the innermost, 0 for those between and for visits at no joint."""
    side = np.zeros(n_visits, np.int64)
    side[joints.visit[joints.offsets[:-1]]] = -1
    side[joints.visit[joints.offsets[1:] - 1]] = 1
    return side


def find_conflicts(strands: Strands, is_broken: Bools) -> Ints:
    """Rows (C, 3) of strand, node and the node before it, of the steps along the strands that are broken."""
    before, after = (visits[is_broken] for visits in steps_along(strands))
    owner = rows_of(strands.offsets)
    found: Ints = np.stack([owner[before], strands.nodes[after], strands.nodes[before]], axis=1)
    return found


def broken_steps(joints: Joints, strands: Strands, *, changes: bool) -> Bools:
    """Which steps along the strands do not change sides, as in a plain weave, or do, as in a stack they should not."""
    side = sides(joints, len(strands.nodes))
    before, after = steps_along(strands)
    product = side[before] * side[after]
    broken: Bools = product > 0 if changes else product < 0
    return broken


# ----------------------------------------------------------------------
# Styles of going over and under, by name.

STACKED, PLAIN, TWILL = "stacked", "plain", "twill"
_TWILL = re.compile(r"twill(?: (\d)/(\d))?")

USUAL = {"triangular": STACKED, "twill": "twill 2/2"}
"""What a pattern is woven in where it is not plain."""


@dataclass(frozen=True)
class Style:
    """How rods go over and under.

    Parameters
    ----------
    name : str
    over, under : int
        How many rods at a time; 0 in a stack, where rods keep to their layers.
    """

    name: str
    over: int
    under: int


def usual_style(pattern: str) -> str:
    """The style in which a pattern is woven."""
    return USUAL.get(pattern, PLAIN)


def style_named(name: str) -> Style:
    """The style of that name: ``"stacked"``, ``"plain"``, ``"twill"``, ``"twill 3/1"``…

    Raises
    ------
    Unsupported
    """
    if name == STACKED:
        return Style(STACKED, 0, 0)
    if name == PLAIN:
        return Style(PLAIN, 1, 1)
    match = _TWILL.fullmatch(name)
    over, under = (int(match[k] or 2) for k in (1, 2)) if match else (0, 0)
    if not (over and under):
        raise Unsupported(f"There is no weave {name!r}", remedy="Take stacked, plain, or twill with counts: twill 2/2.")
    return Style(f"{TWILL} {over}/{under}", over, under)
