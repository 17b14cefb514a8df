"""Feet: for places along every child, the nearest places on its parents.

A sample's *foot* is the place nearest to it on the parents of the same band.  Others are
never asked, so that a sheet of the surface that lies close in space does not matter unless it
belongs to the very same ring.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.linking.samples import Samples
from weavecore.model.latitudes import Bands, Latitudes


@dataclass(frozen=True, eq=False)
class Feet:
    """Samples of all polylines and where they stand on the parents.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline.
    parent : (M,) int64
        The polyline on which each sample stands, -1 for generation 0.
    station : (M,) float64
        Where on it.
    is_against : (M,) bool
        Whether that parent runs the other way, as the far side of a cut does.
    """

    offsets: Ints
    parent: Ints
    station: Floats
    is_against: Bools


def find_feet(latitudes: Latitudes, samples: Samples) -> Feet:
    """The foot of every sample of every child."""
    bands, owner, points = latitudes.bands, samples.owner, samples.points
    parent = np.full(len(owner), -1, np.int64)
    foot = np.zeros(len(owner))
    is_against = np.zeros(len(owner), bool)
    band = rows_of(bands.offsets)
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    above = np.flatnonzero(bands.is_parent & has_child[band])
    below = np.flatnonzero(~bands.is_parent)
    if len(below):
        side, source = _gather(samples, bands, above)
        child_side, child = _gather(samples, bands, below)
        # A fourth coordinate keeps the bands apart, so that one search serves them all.
        size = 4.0 * latitudes.surface.size
        tree = cKDTree(np.c_[points[source], size * band[side]])
        _, nearest = tree.query(np.c_[points[child], size * band[child_side]])
        at = source[nearest]
        parent[child] = owner[at]
        is_against[child] = ~bands.is_left[side[nearest]]
        foot[child] = _project(points[child], at, samples)
    return Feet(samples.offsets, parent, foot, is_against)


def _gather(samples: Samples, bands: Bands, sides: Ints) -> tuple[Ints, Ints]:
    """For the samples of the polylines of these sides: the side, and the sample."""
    polyline = bands.polyline[sides]
    counts = np.diff(samples.offsets)[polyline]
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(sides, counts), np.repeat(samples.offsets[polyline], counts) + within


def _project(points: Floats, at: Ints, samples: Samples) -> Floats:
    """Station of the nearest place on the two segments beside the nearest sample."""
    rank = at - samples.offsets[samples.owner[at]]
    best = np.full(len(at), np.inf)
    station = np.zeros(len(at))
    for shift in (0, -1):
        start = samples.points[samples.beside(at, shift)]
        along = samples.points[samples.beside(at, shift + 1)] - start
        square = np.maximum((along * along).sum(1), np.finfo(float).tiny)
        part = np.clip(((points - start) * along).sum(1) / square, 0.0, 1.0)
        gap = ((points - start - along * part[:, None]) ** 2).sum(1)
        nearer = gap < best
        best[nearer] = gap[nearer]
        station[nearer] = ((rank + shift + part) * samples.step[samples.owner[at]])[nearer]
    return station
