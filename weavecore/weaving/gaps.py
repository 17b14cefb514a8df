"""Gaps: how near two rods that touch at a joint come to each other there."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.segments import segment_distances
from weavecore.geometry.splines import SplineRows, cubic_points, span_ends
from weavecore.model.joints import Joints
from weavecore.model.strands import Strands

REACH = 3.0
"""The nearest places are looked for so many diameters along each rod, and no further than half an edge."""

_PIECES = 5
"""Each way from the joint a rod is taken for so many straight pieces, shorter ones near the joint."""


def gaps_at_joints(points: Floats, rows: SplineRows, strands: Strands, joints: Joints, rod_diameter: float) -> Floats:
    """Least distance (C,) between the axes of the two rods of each contact, near the joint.

    Parameters
    ----------
    points : (M, 3) float64
        Of the visits.
    rows : SplineRows
    strands : Strands
    joints : Joints
    rod_diameter : float
    """
    visits = joints.visit[joints.contacts]
    one, other = (_stretches(points, rows, strands, v, REACH * rod_diameter) for v in visits.T)
    least = np.full(len(visits), np.inf)
    for p in range(one.shape[1] - 1):
        for q in range(other.shape[1] - 1):
            distance, _ = segment_distances(one[:, p], one[:, p + 1], other[:, q], other[:, q + 1])
            least = np.minimum(least, distance)
    return least


def _stretches(points: Floats, rows: SplineRows, strands: Strands, visits: Ints, reach: float) -> Floats:
    """Points (k, 2 · pieces + 1, 3) along the axes on both sides of visits; at an end of a rod they stay there."""
    start, stop, width = span_ends(rows.parameters, strands.offsets, strands.closed, rows.ends)
    ahead, behind = np.full(len(points), -1), np.full(len(points), -1)
    ahead[start], behind[stop] = np.arange(len(start)), np.arange(len(start))
    steps = (np.arange(_PIECES + 1) / _PIECES) ** 2
    sides = []
    for span, is_ahead in ((behind[visits], False), (ahead[visits], True)):
        part = np.minimum(reach / width[span], 0.5)[:, None] * steps
        t = part if is_ahead else 1.0 - part
        flat = np.repeat(span, len(steps))
        a, b = start[flat], stop[flat]
        place, _ = cubic_points(points[a], points[b], rows.derivatives[a], rows.derivatives[b], width[flat], t.ravel())
        place = place.reshape(len(visits), len(steps), 3)
        sides.append(np.where((span >= 0)[:, None, None], place, points[visits][:, None]))
    return np.concatenate([sides[0][:, :0:-1], sides[1]], axis=1)
