"""The order of the rods at every joint: stacked in layers, plain, or twill."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.model.joints import Joints
from weavecore.model.lattice import LATITUDINAL
from weavecore.model.strands import Strands
from weavecore.weaving.joints import Meetings, steps_along


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
