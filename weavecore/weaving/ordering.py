"""Which rod lies over which, in any style."""

from __future__ import annotations

from dataclasses import dataclass

from weavecore.geometry.arrays import Floats, Ints
from weavecore.model.joints import Joints
from weavecore.model.lattice import Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.alternating import alternate
from weavecore.weaving.joints import Meetings, find_meetings
from weavecore.weaving.stacking import broken_steps, find_conflicts, order_joints, stack
from weavecore.weaving.styles import PLAIN, STACKED, Style
from weavecore.weaving.twilling import twill


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
