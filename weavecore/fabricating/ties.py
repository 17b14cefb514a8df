"""The cable ties of every joint: how many, and how long.

A joint takes one tie for each pair of rods that touch.  The tie runs halfway between the two rods that leave the widest
angle 2β, so it meets the rods beside it at β and goes around ellipses d / sin β wide and d high, d the diameter of the
thickest of them::

    ╲     ╱            loop = perimeter of the ellipse + 2 · height,
     ╲ β ╱             height = distance of the outermost axis from the innermost one,
    ──╲·╱── tie        length = loop + GRIP
       ╳
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.plan import RodPlan
from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import each

GRIP = 25.0
"""Length of a tie beyond its loop in millimetres: the head, and what the fingers pull."""

TIE_SIZES = (100.0, 140.0, 200.0, 250.0, 300.0, 370.0, 430.0, 530.0, 760.0)
"""Lengths in millimetres that cable ties are sold in."""

_SIZE_STEP = 100.0
"""Longer ties are named by the next whole 100 mm."""


@dataclass(frozen=True, eq=False)
class Ties:
    """The ties of all joints, one row for each of the J joints.

    Parameters
    ----------
    angle : (J,) float64
        The least angle between two of its rods, in degrees from 0 to 90.
    count : (J,) int64
        One for each pair of rods that touch.
    length : (J,) float64
        The least length of each tie in millimetres.
    """

    angle: Floats
    count: Ints
    length: Floats


def find_ties(plan: RodPlan) -> Ties:
    """Measure the ties of every joint.

    Parameters
    ----------
    plan : RodPlan

    Returns
    -------
    Ties
    """
    joints = plan.weave.joints
    angles, widest = np.zeros(len(joints)), np.zeros(len(joints))
    directions = _directions(plan)
    for j, (a, b) in each(enumerate(zip(joints.offsets.tolist(), joints.offsets[1:].tolist()))):
        turned = np.sort(directions[a:b])
        gaps = np.diff(np.append(turned, turned[0] + np.pi))
        angles[j], widest[j] = gaps.min(), gaps.max()
    d = np.zeros(len(joints))
    np.maximum.at(d, joints.joint, plan.diameters[joints.strand])
    width = d / np.sin(widest / 2)
    offsets = plan.axes.layer_offsets[joints.visit]
    height = np.zeros(len(joints))
    if len(joints):
        height = np.maximum.reduceat(offsets, joints.offsets[:-1]) - np.minimum.reduceat(offsets, joints.offsets[:-1])
    loop = _perimeter(width, d) + 2 * height
    return Ties(np.degrees(angles), np.diff(joints.offsets) - 1, loop + GRIP)


def size_of_tie(length: float) -> float:
    """The shortest tie on sale that is long enough.

    Parameters
    ----------
    length : float
        In millimetres.
    """
    return next((size for size in TIE_SIZES if size >= length), float(np.ceil(length / _SIZE_STEP) * _SIZE_STEP))


def _directions(plan: RodPlan) -> Floats:
    """(V,) the angle from 0 to π of the line of each rod at each joint, in the plane of the joint, joint by joint."""
    joints = plan.weave.joints
    normal = plan.weave.normals[joints.node][joints.joint]
    along = plan.tangents[joints.visit]
    along = along - (along * normal).sum(1, keepdims=True) * normal
    first = along[joints.offsets[:-1]][joints.joint] if len(joints) else along
    across = np.cross(normal, first)
    angle: Floats = np.arctan2((along * across).sum(1), (along * first).sum(1)) % np.pi
    return angle


def _perimeter(width: Floats, height: Floats) -> Floats:
    """Perimeters (J,) of ellipses (Ramanujan 1914, the second formula)."""
    a, b = width / 2, height / 2
    h = ((a - b) / (a + b)) ** 2
    around: Floats = np.pi * (a + b) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    return around
