"""Closest-point projections of the children onto their parents, and the cusps of the polylines.

Every polyline is sampled `SAMPLES_PER_NODE` times a node at equal arc lengths.  Each sample of a child is projected
to the closest point of the parents of its band; the samples of the parents answer in a k-d tree, then the two
segments beside the closest sample give the exact foot point:

      child    ──·──·──·──·──·──·──
                 ╲  │  │  ╱  ╱
      parent   ───●──●──●─●─●──────      station of ● on the parent; it rises along the child in an annulus

Only polylines of the same band are searched, so another sheet of the surface that lies close in space does not
matter.  Time is O(M log M) for M samples.

A *cusp* is a place where an isoline of the distance folds back on itself, as at the end of a medial axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.linking.arc_length import points_at
from weavecore.model.latitudes import Bands, Latitudes

SAMPLES_PER_NODE = 8
"""Projections of nodes are interpolated between samples an eighth of an edge apart: finer than the divisions tried."""
_CUSP_CHORD = 0.72
"""There is a cusp where one edge length of a polyline has a chord shorter than this part of it: where it
turns by about a right angle or more within an edge."""


@dataclass(frozen=True, eq=False)
class PolylineSamples:
    """Points along polylines at equal arc lengths, polyline after polyline.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline, `SAMPLES_PER_NODE` a node, the first at station 0; of an open one the last at its end.
    owner : (M,) int64
        Polyline of each sample.
    step : (P,) float64
        Arc length from one sample to the next.
    points : (M, 3) float64
    closed : (P,) bool
    """

    offsets: Ints
    owner: Ints
    step: Floats
    points: Floats
    closed: Bools

    def shifted(self, samples: Ints, shift: int) -> Ints:
        """The samples ``shift`` steps further along the same polylines; at the ends of open ones the last.

        Parameters
        ----------
        samples : (k,) int64
        shift : int
        """
        first = self.offsets[self.owner[samples]]
        count = self.offsets[self.owner[samples] + 1] - first
        place = samples - first + shift
        wrapped = np.where(self.closed[self.owner[samples]], place % count, np.clip(place, 0, count - 1))
        shifted: Ints = first + wrapped
        return shifted


@dataclass(frozen=True, eq=False)
class ParentProjections:
    """The closest points on the parents of the samples of all polylines.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline.
    parent : (M,) int64
        The polyline on which the projection of each sample lies, -1 in generation 0.
    station : (M,) float64
        Arc length of the projection along it.
    is_reversed : (M,) bool
        Whether that parent runs against the child, as the right side of a cut does.
    """

    offsets: Ints
    parent: Ints
    station: Floats
    is_reversed: Bools


def sample_polylines(latitudes: Latitudes, counts: Ints) -> PolylineSamples:
    """Sample every polyline at equal arc lengths.

    Parameters
    ----------
    latitudes : Latitudes
    counts : (P,) int64
        Number of nodes of each polyline.
    """
    offsets = offsets_of(counts * SAMPLES_PER_NODE)
    owner = rows_of(offsets)
    closed = latitudes.polylines.closed
    step: Floats = latitudes.polylines.lengths / (np.diff(offsets) - ~closed)
    station = (np.arange(len(owner)) - offsets[owner]) * step[owner]
    return PolylineSamples(offsets, owner, step, points_at(latitudes.polylines, owner, station), closed)


def project_to_parents(latitudes: Latitudes, samples: PolylineSamples) -> ParentProjections:
    """Project every sample of every child to the closest point of the parents in its band.

    Parameters
    ----------
    latitudes : Latitudes
    samples : PolylineSamples
    """
    bands, owner, points = latitudes.bands, samples.owner, samples.points
    parent = np.full(len(owner), -1, np.int64)
    station = np.zeros(len(owner))
    is_reversed = np.zeros(len(owner), bool)
    band = rows_of(bands.offsets)
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    above = np.flatnonzero(bands.is_parent & has_child[band])
    below = np.flatnonzero(~bands.is_parent)
    if len(below):
        side, source = _samples_of_sides(samples, bands, above)
        child_side, child = _samples_of_sides(samples, bands, below)
        # A fourth coordinate keeps the bands apart, so that one search serves them all.
        size = 4.0 * latitudes.surface.size
        tree = cKDTree(np.c_[points[source], size * band[side]])
        _, nearest = tree.query(np.c_[points[child], size * band[child_side]])
        at = source[nearest]
        parent[child] = owner[at]
        is_reversed[child] = ~bands.is_left[side[nearest]]
        station[child] = _project_to_segments(points[child], at, samples)
    return ParentProjections(samples.offsets, parent, station, is_reversed)


def _samples_of_sides(samples: PolylineSamples, bands: Bands, sides: Ints) -> tuple[Ints, Ints]:
    """For the samples of the polylines of these sides: the side, and the sample."""
    polyline = bands.polyline[sides]
    counts = np.diff(samples.offsets)[polyline]
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(sides, counts), np.repeat(samples.offsets[polyline], counts) + within


def _project_to_segments(points: Floats, at: Ints, samples: PolylineSamples) -> Floats:
    """Station of the closest point on the two segments beside the closest sample ``at`` of each point."""
    rank = at - samples.offsets[samples.owner[at]]
    best = np.full(len(at), np.inf)
    station = np.zeros(len(at))
    for shift in (0, -1):
        start = samples.points[samples.shifted(at, shift)]
        along = samples.points[samples.shifted(at, shift + 1)] - start
        square = np.maximum((along * along).sum(1), np.finfo(float).tiny)
        part = np.clip(((points - start) * along).sum(1) / square, 0.0, 1.0)
        gap = ((points - start - along * part[:, None]) ** 2).sum(1)
        nearer = gap < best
        best[nearer] = gap[nearer]
        station[nearer] = ((rank + shift + part) * samples.step[samples.owner[at]])[nearer]
    return station


def find_cusps(samples: PolylineSamples) -> dict[int, Floats]:
    """Stations of the cusps of each polyline that has any, the sharpest first.

    A ring that is divided without regard to its cusps cuts them off, and with them what lies
    between the ring and its children.

    Parameters
    ----------
    samples : PolylineSamples

    Returns
    -------
    dict of int to (k,) float64
    """
    here = np.arange(len(samples.owner))
    half = SAMPLES_PER_NODE // 2
    chord = samples.points[samples.shifted(here, half)] - samples.points[samples.shifted(here, -half)]
    ratio = np.linalg.norm(chord, axis=1) / (2 * half * samples.step[samples.owner])
    count, rank = np.diff(samples.offsets)[samples.owner], here - samples.offsets[samples.owner]
    ratio[~samples.closed[samples.owner] & ((rank < half) | (rank >= count - half))] = 1.0
    sharp = np.flatnonzero(ratio < _CUSP_CHORD)
    for shift in range(1, half + 1):
        before, behind = ratio[samples.shifted(sharp, -shift)], ratio[samples.shifted(sharp, shift)]
        sharp = sharp[(ratio[sharp] < before) & (ratio[sharp] <= behind)]
    sharp = sharp[np.lexsort((sharp, ratio[sharp], samples.owner[sharp]))]
    station = (sharp - samples.offsets[samples.owner[sharp]]) * samples.step[samples.owner[sharp]]
    return {int(p): station[samples.owner[sharp] == p] for p in np.unique(samples.owner[sharp])}
