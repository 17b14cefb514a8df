"""Clearance: whether the axes of rods are a diameter apart, at the joints and everywhere else.

`find_clashes` takes all axes as straight pieces of half a diameter and compares those whose middles are near each
other in a k-d tree: O(n log n) for n pieces.  `gaps_at_joints` is finer and looks only at the two rods of each contact,
near their joint.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.closest import segment_distances
from weavecore.geometry.splines import CurveSamples, SplineRows, cubic_points, span_ends
from weavecore.model.joints import Clashes, Joints
from weavecore.model.rod_axes import RodAxes
from weavecore.model.strands import Strands

_STEPS_PER_DIAMETER = 2
"""Straight pieces of an axis on the length of a diameter."""

_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are neighbours and do not clash."""

TOLERANCE = 0.02
"""Part of a diameter by which axes may come nearer than one diameter."""

REACH = 3.0
"""The nearest places are looked for so many diameters along each rod, and no further than half an edge."""

_PIECES = 5
"""Each way from the joint a rod is taken for so many straight pieces, shorter ones near the joint."""


def find_clashes(axes: RodAxes, rod_diameter: float) -> Clashes:
    """Find the rods that cut into each other, at joints or between them.

    Parameters
    ----------
    axes : RodAxes
    rod_diameter : float
        In the model's unit.

    Returns
    -------
    Clashes
        Each pair of rods once, at the place where they are nearest; the nearest pair first.
    """
    least = rod_diameter * (1.0 - TOLERANCE)
    step = rod_diameter / _STEPS_PER_DIAMETER
    samples = axes.samples(step)
    strand = rows_of(samples.offsets)
    start = np.flatnonzero(np.diff(strand) == 0)
    a, b = samples.points[start], samples.points[start + 1]
    pairs = cKDTree((a + b) / 2.0).query_pairs(least + step, output_type="ndarray").astype(np.int64)
    pairs = pairs[~_is_own(axes, samples, strand[start], start, pairs, _OWN_REACH * rod_diameter)]
    distance, middle = segment_distances(a[pairs[:, 0]], b[pairs[:, 0]], a[pairs[:, 1]], b[pairs[:, 1]])
    near = distance < least
    owners = np.sort(strand[start][pairs[near]], axis=1)
    order = np.lexsort([distance[near], owners[:, 1], owners[:, 0]])
    _, first = np.unique(owners[order] @ (len(axes), 1), return_index=True)
    chosen = order[first]
    chosen = chosen[np.argsort(distance[near][chosen], kind="stable")]
    return Clashes(owners[chosen], distance[near][chosen], middle[near][chosen])


def _is_own(axes: RodAxes, samples: CurveSamples, strand: Ints, start: Ints, pairs: Ints, reach: float) -> Bools:
    """Which pairs are of one rod, and near each other along it."""
    one, other = pairs.T
    apart = np.abs(samples.stations[start[one]] - samples.stations[start[other]])
    length = axes.lengths[strand[one]]
    apart = np.where(axes.closed[strand[one]], np.minimum(apart, length - apart), apart)
    own: Bools = (strand[one] == strand[other]) & (apart < reach)
    return own


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
