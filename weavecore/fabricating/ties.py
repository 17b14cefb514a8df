"""Joints: the angle at which rods cross, and the ties that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.plan import RodPlan
from weavecore.geometry.arrays import Floats, Ints

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
