"""`Piece` and `Splice`: what a rod is cut into, and where its pieces are joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.fabricating.plan import (
    MOST_UTILISED,
    OVERLAP,
    OVERLAP_DIAMETERS,
    SLEEVE,
    TAIL_DIAMETERS,
    RodPlan,
    Workshop,
    visits_of,
)
from weavecore.geometry.arrays import Floats


@dataclass(frozen=True)
class Splice:
    """A place where two pieces of a rod are joined, or the two ends of a ring.

    Parameters
    ----------
    id : str
    kind : str
        ``"overlap"`` or ``"sleeve"``.
    rod : int
    low, high : float
        Stations along the rod between which the pieces lie side by side, or the sleeve.
    n_crossings : int
        Joints between them.
    utilisation : float
        The greatest between them.
    nearest : float
        Distance to the nearest splice of another rod, infinite where there is none.
    """

    id: str
    kind: str
    rod: int
    low: float
    high: float
    n_crossings: int
    utilisation: float
    nearest: float

    @property
    def reach(self) -> float:
        """How much of the end of each of its pieces it takes."""
        width = self.high - self.low
        return width / 2 if self.kind == SLEEVE else width


@dataclass(frozen=True)
class Piece:
    """What is cut from one bar.

    Parameters
    ----------
    id : str
        The rod's name, and a number where the rod has several pieces.
    rod : int
    seq : int
        From 1 along the rod.
    start, end : float
        Stations along the rod; of a ring they may lie beyond its length, and go around again.
    splice_start, splice_end : Splice, optional
    """

    id: str
    rod: int
    seq: int
    start: float
    end: float
    splice_start: Optional[Splice]
    splice_end: Optional[Splice]

    @property
    def cut_length(self) -> float:
        """Length to cut."""
        return self.end - self.start


def cut_rods(plan: RodPlan, workshop: Workshop) -> tuple[list[Piece], list[Splice]]:
    """Cut every rod into pieces no longer than the stock; by rod, along each.

    Of the places where a rod can be spliced those are taken that need the fewest pieces, then those that are
    bent no more than is good for a splice, then those far from the splices of rods before.

    Raises
    ------
    Unsupported
        Where the stock is too short for a rod.
    """
    placed = PlacedSplices(plan, workshop)
    pieces: list[Piece] = []
    splices: list[Splice] = []
    longest = workshop.stock - workshop.kerf
    for rod in range(len(plan.ids)):
        length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
        if not closed and length + 2 * workshop.overhang <= longest:
            pieces.append(Piece(plan.ids[rod], rod, 1, -workshop.overhang, length + workshop.overhang, None, None))
            continue
        chosen = None
        for candidates in (find_candidates(plan, workshop, rod), spread_candidates(plan, workshop, rod)):
            rated = placed.rate(rod, candidates)
            chosen = choose_splices(rated, length, closed=closed, longest=longest, overhang=workshop.overhang)
            if chosen is not None:
                break
        if chosen is None:
            raise Unsupported(
                f"Stock of {workshop.stock:g} mm is too short for a rod of {length:.0f} mm and its splices",
                remedy="Give longer stock, or splice with sleeves.",
                ids=[plan.ids[rod]],
                kind="rod",
            )
        placed.add(rod, chosen)
        own = [_splice(plan, workshop.splice, rod, k, one) for k, one in enumerate(chosen, start=1)]
        splices += own
        pieces += _pieces_between(plan.ids[rod], rod, own, length, closed, workshop)
    return pieces, splices


def _splice(plan: RodPlan, kind: str, rod: int, number: int, one: Candidate) -> Splice:
    return Splice(
        f"{plan.ids[rod]}-S{number}",
        kind,
        rod,
        one.zone_low,
        one.zone_high,
        one.n_crossings,
        one.utilisation,
        one.nearest,
    )


def _pieces_between(
    name: str, rod: int, splices: list[Splice], length: float, closed: bool, workshop: Workshop
) -> list[Piece]:
    """The pieces from splice to splice, each reaching over those at its ends."""

    def begin(splice: Optional[Splice]) -> float:
        return -workshop.overhang if splice is None else splice.high - splice.reach

    def end(splice: Optional[Splice]) -> float:
        return length + workshop.overhang if splice is None else splice.low + splice.reach

    row: list[Optional[Splice]] = [*splices, splices[0]] if closed else [None, *splices, None]
    sides = list(zip(row, row[1:]))
    names = [name] if len(sides) == 1 else [f"{name}-{k}" for k in range(1, len(sides) + 1)]
    laps = [length if closed and k == len(sides) else 0.0 for k in range(1, len(sides) + 1)]
    return [
        Piece(piece, rod, k, begin(a), end(b) + lap, a, b)
        for k, (piece, (a, b), lap) in enumerate(zip(names, sides, laps), start=1)
    ]


# ----------------------------------------------------------------------
# Which of the places along a rod are taken for its splices: the fewest, and of those the best.

_PER_SPLICE = 1e6
_MOST_STARTS = 12
"""A ring is tried from so many places, the best ones."""


@dataclass(frozen=True)
class Candidate:
    """A place where a rod could be spliced.

    Parameters
    ----------
    centre : float
        Station.
    low, high : float
        Where the piece after it begins and the one before it ends.
    zone_low, zone_high : float
        What the splice takes up.
    n_crossings : int
    utilisation : float
        The greatest in the zone.
    nearest : float
        Distance to the nearest splice of another rod.
    penalty : float
    """

    centre: float
    low: float
    high: float
    zone_low: float
    zone_high: float
    n_crossings: int
    utilisation: float
    nearest: float = np.inf
    penalty: float = 0.0

    def moved(self, by: float) -> Candidate:
        """The same place a lap on."""
        return replace(
            self,
            centre=self.centre + by,
            low=self.low + by,
            high=self.high + by,
            zone_low=self.zone_low + by,
            zone_high=self.zone_high + by,
        )


def choose_splices(
    candidates: Sequence[Candidate], length: float, *, closed: bool, longest: float, overhang: float
) -> Optional[list[Candidate]]:
    """The splices of a rod in order, or None where no pieces of the given length make it up.

    Those of a ring begin with the one that its first piece begins at; its last piece ends there too.
    """
    if not closed:
        start = Candidate(-overhang, -overhang, -overhang, -overhang, -overhang, 0, 0.0)
        end = start.moved(length + 2 * overhang)
        found = _cheapest([start, *candidates, end], longest)
        return None if found is None else found[1][1:-1]
    best: Optional[tuple[float, list[Candidate]]] = None
    for k in sorted(range(len(candidates)), key=lambda k: candidates[k].penalty)[:_MOST_STARTS]:
        begin = candidates[k]
        around = [*candidates[k + 1 :], *(one.moved(length) for one in candidates[:k])]
        found = _cheapest([begin, *around, begin.moved(length)], longest)
        if found is not None and (best is None or found[0] < best[0]):
            best = (found[0], found[1][:-1])
    return None if best is None else best[1]


def _cheapest(row: list[Candidate], longest: float) -> Optional[tuple[float, list[Candidate]]]:
    """The cheapest way from the first to the last in steps that a bar is long enough for, and its cost."""
    low = np.array([one.low for one in row])
    high = np.array([one.high for one in row])
    zone_low, zone_high = np.array([one.zone_low for one in row]), np.array([one.zone_high for one in row])
    cost = np.full(len(row), np.inf)
    came_from = np.zeros(len(row), np.int64)
    cost[0] = row[0].penalty
    for j in range(1, len(row)):
        is_last = j == len(row) - 1
        way = cost[:j].copy()
        way[(high[j] - low[:j] > longest) | ((zone_high[:j] > zone_low[j]) & ~(is_last & (np.arange(j) == 0)))] = np.inf
        came_from[j] = int(np.argmin(way))
        cost[j] = way[came_from[j]] + _PER_SPLICE + (0.0 if is_last else row[j].penalty)
    if not np.isfinite(cost[-1]):
        return None
    path = [len(row) - 1]
    while path[-1] != 0:
        path.append(int(came_from[path[-1]]))
    return float(cost[-1]), [row[j] for j in reversed(path)]


# ----------------------------------------------------------------------
# Where a rod could be spliced, and how good each place is.
#
# An overlap lies about the middle between two joints that follow each other and reaches beyond both, so that both
# pieces are tied at two crossings; a sleeve lies between them, where no rod is in its way.

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
