"""`Piece` and `Splice`: what a rod is cut into, and where its pieces are joined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from weavecore.errors import Unsupported
from weavecore.fabricating.choosing_splices import Candidate, choose_splices
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splice_candidates import PlacedSplices, find_candidates, spread_candidates
from weavecore.fabricating.workshop import SLEEVE, Workshop


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
