"""Which rod lies over which at every joint: stacked in layers, plain, or twill.

Each style gives every visit of a rod to a node a *height*; the rods of a joint lie in the order of theirs.  Where the
style cannot be kept, the step along the rod is a conflict.

- stacked: a height for each rod, by its lean, so that rods stay in their layer;
- plain: over and under in turn (`plain`, and `annealing` where that leaves conflicts);
- twill: over m, under n, shifted by one from rod to rod (`twill`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, ranks_in_rows, rows_of
from weavecore.model.joints import Joints
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.annealing import Steps, anneal_sides
from weavecore.weaving.plain import alternate
from weavecore.weaving.strands import SharedNodes, find_shared_nodes, steps_along
from weavecore.weaving.twill import twill

STACKED, PLAIN, TWILL = "stacked", "plain", "twill"
"""Names of the styles."""

_TWILL = re.compile(r"twill(?: (\d)/(\d))?")

_JOINTS_OF_STRUT = 2

USUAL = {"triangular": STACKED, "twill": "twill 2/2"}
"""Style of the patterns whose style is not plain."""


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


@dataclass(frozen=True, eq=False)
class Order:
    """Joints with their rods in order, and the conflicts (C, 3) of `Weave`."""

    joints: Joints
    conflicts: Ints


def order_rods(lattice: Lattice, strands: Strands, lean: Ints, style: Style) -> Order:
    """Decide at every joint which rod lies over which.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    lean : (S,) int64
        Whether each strand leans forward (1), back (-1) or neither way (0).
    style : Style

    Returns
    -------
    Order
    """
    shared_nodes = find_shared_nodes(strands)
    if style.name == STACKED:
        return _ordered(strands, shared_nodes, _stacked_heights(strands, lean), changes=False)
    if style.name == PLAIN:
        both = alternate(lattice, strands, shared_nodes)
        orders = [_ordered(strands, shared_nodes, height, changes=True) for height in both]
        return _with_fewer_conflicts(min(orders, key=lambda order: len(order.conflicts)), strands, shared_nodes)
    height, is_broken = twill(lattice, strands, shared_nodes, style.over, style.under)
    return Order(_order_joints(strands, shared_nodes, height), _find_conflicts(strands, is_broken))


def _stacked_heights(strands: Strands, lean: Ints) -> Floats:
    """Heights (M,) of three layers: rods that lean forward below, rings between, those that lean back above."""
    return (-lean).astype(np.float64)[rows_of(strands.offsets)]


def _ordered(strands: Strands, shared_nodes: SharedNodes, height: Floats, *, changes: bool) -> Order:
    joints = _order_joints(strands, shared_nodes, height)
    return Order(joints, _find_conflicts(strands, _broken_steps(joints, strands, changes=changes)))


def _with_fewer_conflicts(order: Order, strands: Strands, shared_nodes: SharedNodes) -> Order:
    """The order of a plain weave with conflicts moved to where they meet and vanish, as far as they do."""
    # Where most rods are struts between two joints, as in the hexagonal pattern, they do not weave.
    if len(order.conflicts) == 0 or np.median(np.diff(strands.offsets)) <= _JOINTS_OF_STRUT:
        return order
    before, after = steps_along(strands)
    joint = shared_nodes.joint_of_visit
    between = (joint[before] >= 0) & (joint[after] >= 0) & (joint[before] != joint[after])
    steps = Steps(shared_nodes.offsets, shared_nodes.visit, before[between], after[between])
    side = anneal_sides(steps, _sides(order.joints, len(strands.nodes)))
    return _ordered(strands, shared_nodes, side.astype(np.float64), changes=True)


def _order_joints(strands: Strands, shared_nodes: SharedNodes, height: Floats) -> Joints:
    """Joints with their visits in the order of the heights (M,); of rods of one height a ring lies below."""
    owner = rows_of(strands.offsets)[shared_nodes.visit]
    is_ring = strands.family[owner] == LATITUDINAL
    joint = rows_of(shared_nodes.offsets)
    order = np.lexsort([owner, ~is_ring, height[shared_nodes.visit], joint])
    return Joints(shared_nodes.node, shared_nodes.offsets, shared_nodes.visit[order], owner[order])


def _broken_steps(joints: Joints, strands: Strands, *, changes: bool) -> Bools:
    """Which steps along the strands break the style: they keep their side, or with ``changes`` False change it."""
    side = _sides(joints, len(strands.nodes))
    before, after = steps_along(strands)
    product = side[before] * side[after]
    broken: Bools = product > 0 if changes else product < 0
    return broken


def _sides(joints: Joints, n_visits: int) -> Ints:
    """1 for the outermost visit of a joint, -1 for the innermost, 0 for those between and for visits at no joint."""
    side = np.zeros(n_visits, np.int64)
    side[joints.visit[joints.offsets[:-1]]] = -1
    side[joints.visit[joints.offsets[1:] - 1]] = 1
    return side


def _find_conflicts(strands: Strands, is_broken: Bools) -> Ints:
    """Rows (C, 3) of strand, node and the node before it, of the steps along the strands that are broken."""
    before, after = (visits[is_broken] for visits in steps_along(strands))
    owner = rows_of(strands.offsets)
    found: Ints = np.stack([owner[before], strands.nodes[after], strands.nodes[before]], axis=1)
    return found


def layer_offsets(joints: Joints, strands: Strands, shifts: Floats, *, centred_on_rings: bool) -> Floats:
    """Find how far out of the surface each visit lies.

    The layers of a joint lie evenly about the surface, or about the ring where there is one and
    that is asked for.

    Parameters
    ----------
    joints : Joints
    strands : Strands
    shifts : (C,) float64
        Distance between the two rods of each contact, along the normal.
    centred_on_rings : bool
        Whether a ring stays on the surface.

    Returns
    -------
    (M,) float64
        By the visits of ``strands.nodes``, positive out of the surface; 0 at nodes that one rod passes alone.
    """
    total = np.zeros(len(joints.visit))
    total[joints.contacts[:, 1]] = shifts
    rank = ranks_in_rows(np.diff(joints.offsets))
    # Sums of single joints do not depend on the joints before.
    for layer in range(1, int(rank.max(initial=0)) + 1):
        above = np.flatnonzero(rank == layer)
        total[above] += total[above - 1]
    first, last = joints.offsets[:-1], joints.offsets[1:] - 1
    middle = (total[first] + total[last]) / 2.0
    if centred_on_rings:
        ring = np.flatnonzero(strands.family[joints.strand] == LATITUDINAL)
        middle[joints.joint[ring]] = total[ring]
    offsets = np.zeros(len(strands.nodes))
    offsets[joints.visit] = total - middle[joints.joint]
    return offsets


def usual_style(pattern: str) -> str:
    """The style in which a pattern is woven.

    Parameters
    ----------
    pattern : str
        Name of a pattern of `weavecore.linking`.
    """
    return USUAL.get(pattern, PLAIN)


def style_named(name: str) -> Style:
    """The style of that name.

    Parameters
    ----------
    name : str
        ``"stacked"``, ``"plain"``, ``"twill"``, ``"twill 3/1"``…

    Returns
    -------
    Style

    Raises
    ------
    Unsupported
        Where there is no style of that name.
    """
    if name == STACKED:
        return Style(STACKED, 0, 0)
    if name == PLAIN:
        return Style(PLAIN, 1, 1)
    match = _TWILL.fullmatch(name)
    over, under = (int(match[k] or 2) for k in (1, 2)) if match else (0, 0)
    if not (over and under):
        raise Unsupported(f"Unknown weave {name!r}", remedy="Take stacked, plain, or twill with counts: twill 2/2.")
    return Style(f"{TWILL} {over}/{under}", over, under)
