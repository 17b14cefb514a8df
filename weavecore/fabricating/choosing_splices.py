"""Which of the places along a rod are taken for its splices: the fewest, and of those the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

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
