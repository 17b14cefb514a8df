"""Where a rod could be spliced, and how good each place is.

An overlap lies about the middle between two joints that follow each other and reaches beyond both, so that both
pieces are tied at two crossings; a sleeve lies between them, where no rod is in its way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.fabricating.choosing_splices import Candidate
from weavecore.fabricating.plan import RodPlan, visits_of
from weavecore.fabricating.workshop import (
    MOST_UTILISED,
    OVERLAP,
    OVERLAP_DIAMETERS,
    TAIL_DIAMETERS,
    Workshop,
)
from weavecore.geometry.arrays import Floats

_SPREAD = 40
"""Where joints leave no choice, a rod is tried at so many places a bar."""

_BENT, _NEAR, _LOOSE = 1000.0, 300.0, 100.0
"""Penalties: more bent than a splice should be, near another rod's splice, not held by crossings as it should be."""


def find_candidates(plan: RodPlan, workshop: Workshop, rod: int) -> list[Candidate]:
    """Places between joints, by station; on an open rod those that it has the length for."""
    stations = np.unique(plan.axes.stations[visits_of(plan, rod)])
    length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
    if len(stations) < 2:
        return []
    after = np.append(stations[1:], stations[0] + length) if closed else stations[1:]
    before = stations[: len(after)]
    reach = (after - before) / 2 + TAIL_DIAMETERS * plan.diameter
    return _candidates(plan, workshop, rod, (before + after) / 2, reach)


def spread_candidates(plan: RodPlan, workshop: Workshop, rod: int) -> list[Candidate]:
    """Places at equal distances, for rods that joints leave no other place on."""
    length = float(plan.axes.lengths[rod])
    n = int(min(np.ceil(_SPREAD * length / workshop.stock), 10_000)) + 2
    stations = np.linspace(0.0, length, n + 2)[1:-1]
    return _candidates(plan, workshop, rod, stations, np.zeros(n))


def _candidates(plan: RodPlan, workshop: Workshop, rod: int, centres: Floats, reach: Floats) -> list[Candidate]:
    length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
    is_overlap = workshop.splice == OVERLAP
    if is_overlap:
        half = np.maximum(reach, OVERLAP_DIAMETERS / 2 * plan.diameter)
    else:
        half = np.full(len(centres), workshop.sleeve_length(plan.diameter) / 2)
    if closed:  # A ring shorter than its overlap lies double all around.
        half = np.minimum(half, length / 2)
    else:
        fits = (centres - half >= 0) & (centres + half <= length)
        centres, half = centres[fits], half[fits]
    joints = np.sort(plan.axes.stations[visits_of(plan, rod)])
    crossings = crossings_between(joints, length, closed, centres - half, centres + half)
    return [
        Candidate(
            centre=c,
            low=c - h if is_overlap else c,
            high=c + h if is_overlap else c,
            zone_low=c - h,
            zone_high=c + h,
            n_crossings=n,
            utilisation=plan.bend.greatest(rod, length, c - h, c + h),
        )
        for c, h, n in zip(centres.tolist(), half.tolist(), crossings.tolist())
    ]


def crossings_between(joints: Floats, length: float, closed: bool, low: Floats, high: Floats) -> Floats:
    """How many joints, at rising stations, lie between two stations of a rod, each once."""
    laps = (-length, 0.0, length) if closed else (0.0,)
    found = sum(
        np.searchsorted(joints + lap, high, side="right") - np.searchsorted(joints + lap, low, side="left")
        for lap in laps
    )
    return np.minimum(found, len(joints))


@dataclass
class PlacedSplices:
    """The splices of the rods that have been cut, and how far others should keep from them."""

    plan: RodPlan
    workshop: Workshop

    def __post_init__(self) -> None:
        self._points = np.zeros((0, 3))
        self.apart = stagger(self.plan)

    def rate(self, rod: int, candidates: list[Candidate]) -> list[Candidate]:
        """The candidates with their distances from the splices of other rods, and penalties."""
        if not candidates:
            return []
        centres = np.array([one.centre for one in candidates])
        length = float(self.plan.axes.lengths[rod])
        at = self.plan.bend.points(rod, centres % length if self.plan.axes.closed[rod] else centres)
        nearest = np.full(len(at), np.inf)
        if len(self._points):
            nearest = np.linalg.norm(at[:, None] - self._points[None], axis=2).min(1)
        wanted = 2 if self.workshop.splice == OVERLAP else 0
        rated = []
        for one, gap in zip(candidates, nearest.tolist()):
            is_loose = one.n_crossings < wanted if wanted else one.n_crossings > 0
            penalty = _BENT * (one.utilisation > MOST_UTILISED) + _NEAR * (gap < self.apart) + _LOOSE * is_loose
            rated.append(replace(one, nearest=gap, penalty=penalty + min(one.utilisation, 50.0)))
        return rated

    def add(self, rod: int, chosen: list[Candidate]) -> None:
        """Remember the splices of a rod."""
        length = float(self.plan.axes.lengths[rod])
        centres = np.array([one.centre for one in chosen])
        at = self.plan.bend.points(rod, centres % length if self.plan.axes.closed[rod] else centres)
        self._points = np.concatenate([self._points, at])


def stagger(plan: RodPlan) -> float:
    """How far apart the splices of two rods should be: farther than neighbours lie beside each other."""
    return max(1.5 * plan.spacing, OVERLAP_DIAMETERS * plan.diameter)
