"""Clearance: whether the axes of rods are a diameter apart, at the joints and everywhere else."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Ints, rows_of
from weavecore.geometry.segments import segment_distances
from weavecore.geometry.splines import CurveSamples
from weavecore.model.clashes import Clashes
from weavecore.model.rod_axes import RodAxes

_STEPS_PER_DIAMETER = 2
_OWN_REACH = 4.0
"""Along one rod, places less than so many diameters apart are near each other by right."""

TOLERANCE = 0.02
"""Part of a diameter by which axes may come nearer than one diameter."""


def find_clashes(axes: RodAxes, rod_diameter: float) -> Clashes:
    """Find the rods that cut into each other, at joints or between them."""
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
