"""Where rods are cut into pieces and how the pieces are joined: `cut_rods`, `Piece` and `Splice`.

A rod that is longer than a bar, and every ring, is spliced::

    overlap   ═══════════╪═══════════╪════            the pieces lie side by side and are tied at two crossings
                     ════╪═══════════╪═══════════     low │<── ≥ 30 d ──>│ high
    sleeve    ══════════╪═════▐████▌═════╪═══════     end to end in a tube of 20 d between two crossings

The candidates of a rod are the middles between neighbouring joints.  Of these, the splices are chosen by dynamic
programming over the candidates in order of their stations: the cost of the pieces up to candidate j is

    cost(j) = penalty(j) + 1e6 + min cost(i)   over all i < j from which a bar is long enough to reach j,

so the fewest pieces win, and of those the ones with the least penalty: bent no more than 0.8 of the allowable stress,
far from the splices of rods cut before, and held by crossings.  A ring is solved from each of its best candidates.
O(c²) for c candidates of a rod.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.workshop import (
    OVERLAP,
    OVERLAP_DIAMETERS,
    SLEEVE,
    SPLICE_UTILISATION,
    TAIL_DIAMETERS,
    Workshop,
)
from weavecore.geometry.arrays import Floats
from weavecore.polling import each, poll

_COST_OF_SPLICE = 1e6
"""Above the sum of all penalties that a rod can have, so that the fewest splices win."""

_PENALTY_BENT, _PENALTY_NEAR, _PENALTY_LOOSE = 1000.0, 300.0, 100.0
"""Penalties of a candidate: bent beyond `SPLICE_UTILISATION`, near another rod's splice, not held by crossings as it
should be.  A splice in a bend may break, two beside each other weaken one place, a loose one can be tied by hand."""

_GREATEST_BENDING_PENALTY = 50.0
"""The utilisation is added as a penalty up to this, below the least of the others: it decides between equals."""

_MOST_STARTS = 12
"""A ring is solved from so many candidates, those of least penalty: a bound on the time, O(c²) each."""

_CANDIDATES_PER_BAR = 40
"""Where no middle between joints will do, a rod is tried at so many places a bar: 150 mm apart on bars of 6 m."""

_MOST_CANDIDATES = 10_000
"""Bounds the work on a rod that is thousands of bars long."""

_STAGGER_SPACINGS = 1.5
"""Splices of two rods keep this many spacings apart: farther than neighbouring rods lie from each other."""


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
        Stations along the rod between which the pieces lie side by side, or the sleeve lies.
    n_crossings : int
        Joints between them.
    utilisation : float
        The greatest bending utilisation between them.
    nearest : float
        Distance to the nearest splice of a rod cut before, infinite where there is none.
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
        """Length of the splice on each of its pieces."""
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
        Stations along the rod; on a ring they may exceed its length and continue around.
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
        """Length to cut, in millimetres."""
        return self.end - self.start


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
        Ends of the splice.
    n_crossings : int
        Joints in the zone.
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
        """The candidate with all stations shifted."""
        return replace(
            self,
            centre=self.centre + by,
            low=self.low + by,
            high=self.high + by,
            zone_low=self.zone_low + by,
            zone_high=self.zone_high + by,
        )


def cut_rods(plan: RodPlan, workshop: Workshop) -> tuple[list[Piece], list[Splice]]:
    """Cut every rod into pieces no longer than the stock.

    Parameters
    ----------
    plan : RodPlan
    workshop : Workshop

    Returns
    -------
    pieces : list of Piece
        By rod, and along each.
    splices : list of Splice
        In the same order.

    Raises
    ------
    Unsupported
        Where the stock is too short for a rod.
    """
    placed = _PlacedSplices(plan, workshop)
    pieces: list[Piece] = []
    splices: list[Splice] = []
    longest = workshop.stock - workshop.kerf
    for rod in each(range(len(plan.ids))):
        length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
        if not closed and length + 2 * workshop.overhang <= longest:
            pieces.append(Piece(plan.ids[rod], rod, 1, -workshop.overhang, length + workshop.overhang, None, None))
            continue
        chosen = None
        for candidates in (_candidates_between_joints(plan, workshop, rod), _even_candidates(plan, workshop, rod)):
            rated = placed.rate(rod, candidates)
            chosen = choose_splices(rated, length, closed=closed, longest=longest, overhang=workshop.overhang)
            if chosen is not None:
                break
        if chosen is None:
            raise Unsupported(
                f"Stock of {workshop.stock:g} mm is too short for a rod of {length:.0f} mm and its splices",
                remedy="Use longer stock, or splice with sleeves.",
                ids=[plan.ids[rod]],
                kind="rod",
            )
        placed.add(rod, chosen)
        own = [_splice(plan, workshop.splice, rod, k, one) for k, one in enumerate(chosen, start=1)]
        splices += own
        pieces += _pieces_between(plan.ids[rod], rod, own, length, closed, workshop)
    return pieces, splices


def stagger(plan: RodPlan) -> float:
    """The least distance between splices of two rods, in millimetres.

    Parameters
    ----------
    plan : RodPlan
    """
    return max(_STAGGER_SPACINGS * plan.spacing, OVERLAP_DIAMETERS * plan.diameter)


def _candidates_between_joints(plan: RodPlan, workshop: Workshop, rod: int) -> list[Candidate]:
    """Candidates in the middles between neighbouring joints, by station; an overlap reaches beyond both joints."""
    stations = np.unique(plan.axes.stations[plan.visits_at_joints(rod)])
    length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
    if len(stations) < 2:
        return []
    after = np.append(stations[1:], stations[0] + length) if closed else stations[1:]
    before = stations[: len(after)]
    reach = (after - before) / 2 + TAIL_DIAMETERS * plan.diameter
    return _candidates(plan, workshop, rod, (before + after) / 2, reach)


def _even_candidates(plan: RodPlan, workshop: Workshop, rod: int) -> list[Candidate]:
    """Candidates at equal distances, for rods whose joints leave no choice."""
    length = float(plan.axes.lengths[rod])
    n = int(min(np.ceil(_CANDIDATES_PER_BAR * length / workshop.stock), _MOST_CANDIDATES)) + 2
    stations = np.linspace(0.0, length, n + 2)[1:-1]
    return _candidates(plan, workshop, rod, stations, np.zeros(n))


def _candidates(plan: RodPlan, workshop: Workshop, rod: int, centres: Floats, reach: Floats) -> list[Candidate]:
    """Candidates at stations (n,), an overlap reaching at least so far (n,) to both sides; on the rod only."""
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
    joints = np.sort(plan.axes.stations[plan.visits_at_joints(rod)])
    crossings = _joints_between(joints, length, closed, centres - half, centres + half)
    return [
        Candidate(
            centre=c,
            low=c - h if is_overlap else c,
            high=c + h if is_overlap else c,
            zone_low=c - h,
            zone_high=c + h,
            n_crossings=n,
            utilisation=plan.bending.greatest(rod, length, c - h, c + h),
        )
        for c, h, n in zip(centres.tolist(), half.tolist(), crossings.tolist())
    ]


def _joints_between(joints: Floats, length: float, closed: bool, low: Floats, high: Floats) -> Floats:
    """(n,) how many joints, at rising stations (j,), lie between the stations ``low`` and ``high`` (n,), each once."""
    laps = (-length, 0.0, length) if closed else (0.0,)
    found = sum(
        np.searchsorted(joints + lap, high, side="right") - np.searchsorted(joints + lap, low, side="left")
        for lap in laps
    )
    return np.minimum(found, len(joints))


class _PlacedSplices:
    """The splices of the rods that have been cut, from which those of the next rods keep away."""

    def __init__(self, plan: RodPlan, workshop: Workshop) -> None:
        self._plan = plan
        self._workshop = workshop
        self._points = np.zeros((0, 3))
        self._apart = stagger(plan)

    def rate(self, rod: int, candidates: list[Candidate]) -> list[Candidate]:
        """The candidates with their distances from the splices of other rods, and penalties."""
        if not candidates:
            return []
        at = self._centres(rod, candidates)
        nearest = np.full(len(at), np.inf)
        if len(self._points):
            nearest = np.linalg.norm(at[:, None] - self._points[None], axis=2).min(1)
        wanted = 2 if self._workshop.splice == OVERLAP else 0
        rated = []
        for one, gap in zip(candidates, nearest.tolist()):
            is_loose = one.n_crossings < wanted if wanted else one.n_crossings > 0
            penalty = (
                _PENALTY_BENT * (one.utilisation > SPLICE_UTILISATION)
                + _PENALTY_NEAR * (gap < self._apart)
                + _PENALTY_LOOSE * is_loose
            )
            bend = min(one.utilisation, _GREATEST_BENDING_PENALTY)
            rated.append(replace(one, nearest=gap, penalty=penalty + bend))
        return rated

    def add(self, rod: int, chosen: list[Candidate]) -> None:
        """Remember the splices of a rod."""
        self._points = np.concatenate([self._points, self._centres(rod, chosen)])

    def _centres(self, rod: int, candidates: list[Candidate]) -> Floats:
        """(n, 3) the middles of the candidates in space."""
        length = float(self._plan.axes.lengths[rod])
        centres = np.array([one.centre for one in candidates])
        return self._plan.bending.points(rod, centres % length if self._plan.axes.closed[rod] else centres)


def choose_splices(
    candidates: Sequence[Candidate], length: float, *, closed: bool, longest: float, overhang: float
) -> Optional[list[Candidate]]:
    """Choose the splices of a rod.

    Parameters
    ----------
    candidates : sequence of Candidate
        By station, with their penalties.
    length : float
        Length of the rod.
    closed : bool
    longest : float
        The longest piece that a bar can give.
    overhang : float
        Length of an open rod beyond each of its ends.

    Returns
    -------
    list of Candidate or None
        In order; those of a ring begin with the one at which its first piece begins and its last piece ends.
        None where no pieces of that length make up the rod.
    """
    if not closed:
        start = Candidate(-overhang, -overhang, -overhang, -overhang, -overhang, 0, 0.0)
        end = start.moved(length + 2 * overhang)
        found = _cheapest([start, *candidates, end], longest)
        return None if found is None else found[1][1:-1]
    best: Optional[tuple[float, list[Candidate]]] = None
    for k in sorted(range(len(candidates)), key=lambda k: candidates[k].penalty)[:_MOST_STARTS]:
        poll()
        begin = candidates[k]
        around = [*candidates[k + 1 :], *(one.moved(length) for one in candidates[:k])]
        found = _cheapest([begin, *around, begin.moved(length)], longest)
        if found is not None and (best is None or found[0] < best[0]):
            best = (found[0], found[1][:-1])
    return None if best is None else best[1]


def _cheapest(row: list[Candidate], longest: float) -> Optional[tuple[float, list[Candidate]]]:
    """The cheapest way from the first to the last candidate in steps of one bar, and its cost."""
    low = np.array([one.low for one in row])
    high = np.array([one.high for one in row])
    zone_low, zone_high = np.array([one.zone_low for one in row]), np.array([one.zone_high for one in row])
    cost = np.full(len(row), np.inf)
    came_from = np.zeros(len(row), np.int64)
    cost[0] = row[0].penalty
    for j in range(1, len(row)):
        is_last = j == len(row) - 1
        before = cost[:j].copy()
        is_too_long = high[j] - low[:j] > longest
        # Splices of one rod keep apart, but a ring of one piece meets its own.
        is_overlapping = (zone_high[:j] > zone_low[j]) & ~(is_last & (np.arange(j) == 0))
        before[is_too_long | is_overlapping] = np.inf
        came_from[j] = int(np.argmin(before))
        cost[j] = before[came_from[j]] + _COST_OF_SPLICE + (0.0 if is_last else row[j].penalty)
    if not np.isfinite(cost[-1]):
        return None
    path = [len(row) - 1]
    while path[-1] != 0:
        path.append(int(came_from[path[-1]]))
    return float(cost[-1]), [row[j] for j in reversed(path)]


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
    """The pieces from splice to splice, each with the length of the splices at its ends."""

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
