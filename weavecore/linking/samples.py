"""Samples: places along the polylines at equal arc length, and the spikes among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.linking.division import points_at
from weavecore.model.latitudes import Latitudes

SAMPLES_PER_NODE = 8

SPIKE = 0.72
"""A polyline has a spike where an edge's length of it would become shorter than this part as a chord."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Places along polylines, polyline after polyline.

    Parameters
    ----------
    offsets : (P+1,) int64
        Samples of each polyline, `SAMPLES_PER_NODE` a node, the first at station 0; of an open one the last at its end.
    owner : (M,) int64
        Polyline of each sample.
    step : (P,) float64
        Arc length from one to the next.
    points : (M, 3) float64
    closed : (P,) bool
    """

    offsets: Ints
    owner: Ints
    step: Floats
    points: Floats
    closed: Bools

    def beside(self, samples: Ints, shift: int) -> Ints:
        """The samples so many steps further along the same polylines; not beyond the ends of open ones."""
        first = self.offsets[self.owner[samples]]
        count = self.offsets[self.owner[samples] + 1] - first
        place = samples - first + shift
        beside: Ints = first + np.where(self.closed[self.owner[samples]], place % count, np.clip(place, 0, count - 1))
        return beside


def sample_polylines(latitudes: Latitudes, counts: Ints) -> Samples:
    """Sample every polyline according to the number of its nodes."""
    offsets = offsets_of(counts * SAMPLES_PER_NODE)
    owner = rows_of(offsets)
    closed = latitudes.polylines.closed
    step: Floats = latitudes.polylines.lengths / (np.diff(offsets) - ~closed)
    station = (np.arange(len(owner)) - offsets[owner]) * step[owner]
    return Samples(offsets, owner, step, points_at(latitudes.polylines, owner, station), closed)


def find_spikes(samples: Samples) -> dict[int, Floats]:
    """Stations of the spikes of each polyline that has any, the sharpest first.

    Divided without regard to them, a ring would cut off its spikes, and with them what lies
    between the ring and its children.
    """
    here = np.arange(len(samples.owner))
    half = SAMPLES_PER_NODE // 2
    chord = samples.points[samples.beside(here, half)] - samples.points[samples.beside(here, -half)]
    ratio = np.linalg.norm(chord, axis=1) / (2 * half * samples.step[samples.owner])
    count, rank = np.diff(samples.offsets)[samples.owner], here - samples.offsets[samples.owner]
    ratio[~samples.closed[samples.owner] & ((rank < half) | (rank >= count - half))] = 1.0
    sharp = np.flatnonzero(ratio < SPIKE)
    for shift in range(1, half + 1):
        before, behind = ratio[samples.beside(sharp, -shift)], ratio[samples.beside(sharp, shift)]
        sharp = sharp[(ratio[sharp] < before) & (ratio[sharp] <= behind)]
    sharp = sharp[np.lexsort((sharp, ratio[sharp], samples.owner[sharp]))]
    station = (sharp - samples.offsets[samples.owner[sharp]]) * samples.step[samples.owner[sharp]]
    return {int(p): station[samples.owner[sharp] == p] for p in np.unique(samples.owner[sharp])}
