"""Where rods are cut into pieces and how the pieces are joined: `cut_rods`, `Piece` and `Splice`.

A rod that is longer than a bar, and every ring, is spliced::

    overlap   ═══════════╪═══════════╪════            the pieces lie side by side and are tied at two crossings
                     ════╪═══════════╪═══════════     low │<── ≥ 30 d ──>│ high
    sleeve    ══════════╪═════▐████▌═════╪═══════     end to end in a tube of 20 d between two crossings

The candidates of a rod are the middles between neighbouring joints.  Of these, the splices are chosen by dynamic
programming over the candidates in order of their stations: the cost of the pieces up to candidate j is

    cost(j) = penalty(j) + 1e6 + min cost(i)   over all i < j from which a bar is long enough to reach j.

A splice that is bent beyond 0.8 of the allowable stress costs 1e9, so it is taken only where all places within reach
are bent so; then the fewest pieces win, and of those the ones with the least penalty: far from the splices of rods cut
before, held by crossings, and little bent.  A ring that one bar is long enough for takes its cheapest candidate, a
longer one is solved from each of its best candidates.  O(c²) for c candidates of a rod.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Unsupported
from weavecore.fabricating.plan import BendingProfile, RodPlan
from weavecore.fabricating.workshop import (
    OVERLAP,
    OVERLAP_DIAMETERS,
    SLEEVE,
    SLEEVE_DIAMETERS,
    SPLICE_UTILISATION,
    TAIL_DIAMETERS,
    Workshop,
)
from weavecore.geometry.arrays import Floats, Ints
from weavecore.polling import each, poll

_COST_OF_SPLICE = 1e6
"""Above the sum of all penalties but the first that a rod can have, so that the fewest splices win."""

_PENALTY_BENT, _PENALTY_NEAR, _PENALTY_LOOSE = 1e9, 300.0, 100.0
"""Penalties of a candidate: bent beyond `SPLICE_UTILISATION`, near another rod's splice, not held by crossings as it
should be.  A splice in a bend may break, so one more piece is better; two beside each other weaken one place, a loose
one can be tied by hand."""

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
    is_spliced = plan.axes.closed | (plan.axes.lengths > workshop.stock - workshop.kerf)
    placed = _PlacedSplices(plan, workshop, plan.bending_along(is_spliced))
    chosen: dict[int, list[Candidate]] = {}
    for rod in each(np.flatnonzero(is_spliced).tolist()):
        chosen[rod] = _choose(plan, workshop, placed, rod)
        placed.add(rod, chosen[rod])
    nearest = iter(placed.nearest().tolist())
    pieces: list[Piece] = []
    splices: list[Splice] = []
    for rod in each(range(len(plan.ids))):
        length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
        own = [
            _splice(plan, workshop.splice, rod, k, one, next(nearest))
            for k, one in enumerate(chosen.get(rod, []), start=1)
        ]
        splices += own
        pieces += _pieces_between(plan.ids[rod], rod, own, length, closed)
    return pieces, splices


def _choose(plan: RodPlan, workshop: Workshop, placed: _PlacedSplices, rod: int) -> list[Candidate]:
    """The splices of one rod."""
    length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
    for find in (_candidates_between_joints, _even_candidates):
        rated = placed.rate(rod, find(plan, workshop, placed.bending, rod))
        chosen = choose_splices(rated, length, closed=closed, longest=workshop.stock - workshop.kerf)
        if chosen is not None:
            return chosen
    raise Unsupported(
        f"Stock of {workshop.stock:g} mm is too short for a rod of {length:.0f} mm and its splices",
        remedy="Use longer stock, or splice with sleeves.",
        ids=[plan.ids[rod]],
        kind="rod",
    )


def stagger(plan: RodPlan) -> float:
    """The least distance between splices of two rods, in millimetres.

    Parameters
    ----------
    plan : RodPlan
    """
    return max(_STAGGER_SPACINGS * plan.spacing, OVERLAP_DIAMETERS * float(plan.diameters.max(initial=0.0)))


def places_between_joints(
    stations: Floats, length: float, *, closed: bool, kind: str, diameter: float
) -> tuple[Floats, Floats]:
    """Centres (n,), and half the lengths (n,), of the splices that a rod can have between its joints.

    A sleeve has its own length.  An overlap reaches beyond both joints, and is thirty diameters long at least.

    Parameters
    ----------
    stations : (n,) or (n + 1,) float64
        Of the joints, rising; of an open rod there is one place less.
    length : float
        Of the rod.
    closed : bool
    kind : str
        ``"overlap"`` or ``"sleeve"``.
    diameter : float
    """
    after = np.append(stations[1:], stations[:1] + length) if closed else stations[1:]
    before = stations[: len(after)]
    centres = (before + after) / 2
    if kind == SLEEVE:
        return _on_rod(centres, np.full(len(centres), SLEEVE_DIAMETERS / 2 * diameter), length, closed)
    half = np.maximum((after - before) / 2 + TAIL_DIAMETERS * diameter, OVERLAP_DIAMETERS / 2 * diameter)
    return _on_rod(centres, half, length, closed)


def _on_rod(centres: Floats, half: Floats, length: float, closed: bool) -> tuple[Floats, Floats]:
    """The places that lie on the rod; a ring shorter than its overlap lies double all around."""
    if closed:
        return centres, np.minimum(half, length / 2)
    fits = (centres - half >= 0) & (centres + half <= length)
    return centres[fits], half[fits]


def _candidates_between_joints(plan: RodPlan, workshop: Workshop, bending: BendingProfile, rod: int) -> list[Candidate]:
    """Candidates in the middles between neighbouring joints, by station."""
    stations = np.unique(plan.axes.stations[plan.visits_at_joints(rod)])
    if len(stations) < 2:
        return []
    places = places_between_joints(
        stations,
        float(plan.axes.lengths[rod]),
        closed=bool(plan.axes.closed[rod]),
        kind=workshop.splice,
        diameter=float(plan.diameters[rod]),
    )
    return _candidates(plan, workshop, bending, rod, *places)


def _even_candidates(plan: RodPlan, workshop: Workshop, bending: BendingProfile, rod: int) -> list[Candidate]:
    """Candidates at equal distances, for rods whose joints leave no choice."""
    length = float(plan.axes.lengths[rod])
    n = int(min(np.ceil(_CANDIDATES_PER_BAR * length / workshop.stock), _MOST_CANDIDATES)) + 2
    stations = np.linspace(0.0, length, n + 2)[1:-1]
    diameters = OVERLAP_DIAMETERS if workshop.splice == OVERLAP else SLEEVE_DIAMETERS
    half = np.full(n, diameters / 2 * plan.diameters[rod])
    return _candidates(plan, workshop, bending, rod, *_on_rod(stations, half, length, bool(plan.axes.closed[rod])))


def _candidates(
    plan: RodPlan, workshop: Workshop, bending: BendingProfile, rod: int, centres: Floats, half: Floats
) -> list[Candidate]:
    """Candidates at stations (n,), reaching ``half`` (n,) to both sides."""
    length, closed = float(plan.axes.lengths[rod]), bool(plan.axes.closed[rod])
    is_overlap = workshop.splice == OVERLAP
    joints = np.sort(plan.axes.stations[plan.visits_at_joints(rod)])
    crossings = _joints_between(joints, length, closed, centres - half, centres + half)
    bent = bending.greatest(rod, centres - half, centres + half, around=length if closed else None)
    return [
        Candidate(
            centre=c,
            low=c - h if is_overlap else c,
            high=c + h if is_overlap else c,
            zone_low=c - h,
            zone_high=c + h,
            n_crossings=n,
            utilisation=utilisation,
        )
        for c, h, n, utilisation in zip(centres.tolist(), half.tolist(), crossings.tolist(), bent.tolist())
    ]


def _joints_between(joints: Floats, length: float, closed: bool, low: Floats, high: Floats) -> Floats:
    """(n,) how many joints, at rising stations (j,), lie between the stations ``low`` and ``high`` (n,), each once."""
    laps = (-length, 0.0, length) if closed else (0.0,)
    found = sum(
        np.searchsorted(joints + lap, high, side="right") - np.searchsorted(joints + lap, low, side="left")
        for lap in laps
    )
    return np.minimum(found, len(joints))


def nearest_of_others(points: Floats, owners: Ints) -> Floats:
    """(n,) distances from each point (n, 3) to the nearest one with another owner (n,); infinite without one."""
    nearest = np.full(len(points), np.inf)
    for k in range(len(points)):
        others = points[owners != owners[k]]
        if len(others):
            nearest[k] = np.linalg.norm(others - points[k], axis=1).min()
    return nearest


class _PlacedSplices:
    """The splices of the rods that have been cut, from which those of the next rods keep away."""

    def __init__(self, plan: RodPlan, workshop: Workshop, bending: BendingProfile) -> None:
        self.bending = bending
        self._plan = plan
        self._workshop = workshop
        self._points = np.zeros((0, 3))
        self._rods = np.zeros(0, np.int64)
        self._apart = stagger(plan)

    def rate(self, rod: int, candidates: list[Candidate]) -> list[Candidate]:
        """The candidates with their distances from the splices of other rods, and penalties."""
        if not candidates:
            return []
        at = self._centres(rod, candidates)
        nearest: Floats = np.full(len(at), np.inf)
        if len(self._points):
            nearest = np.asarray(cKDTree(self._points).query(at)[0], np.float64)
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
        self._rods = np.append(self._rods, np.full(len(chosen), rod))

    def nearest(self) -> Floats:
        """(n,) the distance of each splice, in the order of `add`, from the nearest one of another rod."""
        return nearest_of_others(self._points, self._rods)

    def _centres(self, rod: int, candidates: list[Candidate]) -> Floats:
        """(n, 3) the middles of the candidates in space."""
        length = float(self._plan.axes.lengths[rod])
        centres = np.array([one.centre for one in candidates])
        return self.bending.points(rod, centres % length if self._plan.axes.closed[rod] else centres)


def choose_splices(
    candidates: Sequence[Candidate], length: float, *, closed: bool, longest: float
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

    Returns
    -------
    list of Candidate or None
        In order; those of a ring begin with the one at which its first piece begins and its last piece ends.
        None where no pieces of that length make up the rod.
    """
    if not closed:
        start = Candidate(0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0)
        found = _cheapest([start, *candidates, start.moved(length)], longest)
        return None if found is None else found[1][1:-1]
    single = [one for one in candidates if length + one.high - one.low <= longest]
    if single:
        return [min(single, key=lambda one: one.penalty)]
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
    highest_low = np.maximum.accumulate(low)
    cost = np.full(len(row), np.inf)
    came_from = np.zeros(len(row), np.int64)
    cost[0] = row[0].penalty
    for j in range(1, len(row)):
        is_last = j == len(row) - 1
        first = int(np.searchsorted(highest_low, high[j] - longest))  # Before it, no bar is long enough.
        if first >= j:
            continue
        # Splices of one rod keep apart.
        is_out = (high[j] - low[first:j] > longest) | (zone_high[first:j] > zone_low[j])
        before = np.where(is_out, np.inf, cost[first:j])
        came_from[j] = first + int(np.argmin(before))
        cost[j] = before[came_from[j] - first] + _COST_OF_SPLICE + (0.0 if is_last else row[j].penalty)
    if not np.isfinite(cost[-1]):
        return None
    path = [len(row) - 1]
    while path[-1] != 0:
        path.append(int(came_from[path[-1]]))
    return float(cost[-1]), [row[j] for j in reversed(path)]


def _splice(plan: RodPlan, kind: str, rod: int, number: int, one: Candidate, nearest: float) -> Splice:
    return Splice(
        f"{plan.ids[rod]}-S{number}",
        kind,
        rod,
        one.zone_low,
        one.zone_high,
        one.n_crossings,
        one.utilisation,
        nearest,
    )


def _pieces_between(name: str, rod: int, splices: list[Splice], length: float, closed: bool) -> list[Piece]:
    """The pieces from splice to splice, each with the length of the splices at its ends."""
    row: list[Optional[Splice]] = [*splices, splices[0]] if closed else [None, *splices, None]
    sides = list(zip(row, row[1:]))
    names = [name] if len(sides) == 1 else [f"{name}-{k}" for k in range(1, len(sides) + 1)]
    pieces = []
    for k, (piece, (a, b)) in enumerate(zip(names, sides), start=1):
        lap = length if closed and k == len(sides) else 0.0
        begin = 0.0 if a is None else a.high - a.reach
        end = length if b is None else b.low + b.reach
        pieces.append(Piece(piece, rod, k, begin, end + lap, a, b))
    return pieces
