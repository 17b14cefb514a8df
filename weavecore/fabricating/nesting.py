"""Which pieces are cut from which bar: one-dimensional bin packing.

Best fit decreasing: the longest piece first, each from the bar that it fills best, which never needs more than 11/9 of
the fewest bars and one more (Johnson 1974).  Where that is more than the lower bound L2 (Martello and Toth 1990), the
bars are also filled one after the other, each as full as a sum of lengths in whole millimetres can be (subset sum), and
the better of the two is taken.  O(n · bars) for best fit, O(n · bars · stock) for the subset sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.fabricating.splices import Piece
from weavecore.geometry.arrays import Floats

_MOST_TRIALS = 200_000
"""Bars times pieces up to which subset sums are tried: a bound on the time."""

_FIT_TOLERANCE = 1e-6
"""Pieces that exceed a bar by less than this many millimetres, by rounding, still fit."""

_MOST_THRESHOLDS = 200
"""The bound L2 is the greatest over thresholds; the shortest lengths of the pieces are tried, up to so many."""


@dataclass(frozen=True)
class Bar:
    """A bar of stock and the pieces that are cut from it, in this order.

    Parameters
    ----------
    id : str
    pieces : tuple of Piece
    used, offcut : float
        In millimetres; with the kerf of each cut.
    """

    id: str
    pieces: tuple[Piece, ...]
    used: float
    offcut: float


def nest_pieces(pieces: Sequence[Piece], *, stock: float, kerf: float, diameters: Optional[Floats] = None) -> list[Bar]:
    """Cut all pieces from as few bars as can be found.

    Parameters
    ----------
    pieces : sequence of Piece
        None with a cut longer than the stock.
    stock, kerf : float
        Length of the bars, and what the saw removes at each cut, in millimetres.
    diameters : (S,) float64, optional
        Of the rods; pieces of different ones are cut from different bars, the thickest first.

    Returns
    -------
    list of Bar
    """
    lengths = np.array([piece.cut_length + kerf for piece in pieces])
    bars: list[list[int]] = []
    thickness = np.zeros(len(pieces)) if diameters is None else diameters[[piece.rod for piece in pieces]]
    for size in np.unique(thickness)[::-1]:
        bars += _nest_alike(lengths, np.flatnonzero(thickness == size).tolist(), stock)
    digits = max(3, len(str(len(bars))))
    found = []
    for number, bar in enumerate(bars, start=1):
        used = float(lengths[bar].sum())
        found.append(Bar(f"S{number:0{digits}d}", tuple(pieces[k] for k in bar), used, max(stock - used, 0.0)))
    return found


def _nest_alike(lengths: Floats, pieces: Sequence[int], stock: float) -> list[list[int]]:
    """The pieces of each bar, of pieces that may lie on one bar."""
    order = sorted(pieces, key=lambda k: (-lengths[k], k))
    bars = _best_fit(lengths, order, stock)
    if len(bars) > least_bars(lengths[order].tolist(), stock) and len(bars) * len(pieces) <= _MOST_TRIALS:
        fuller = _fill_one_by_one(lengths, order, stock)
        bars = fuller if len(fuller) < len(bars) else bars
    return bars


def least_bars(lengths: Sequence[float], stock: float) -> int:
    """A lower bound on the count of bars (Martello and Toth 1990, bound L2).

    Pieces longer than half a bar need one each.  For each threshold t, pieces longer than ``stock - t`` leave
    no room for one of length t or more; the others of the long ones leave what the short ones can use.

    Parameters
    ----------
    lengths : sequence of float
        Of the pieces, with the kerf.
    stock : float

    Returns
    -------
    int
    """
    if not lengths:
        return 0
    row = np.sort(np.asarray(lengths))[::-1]
    total = np.concatenate([[0.0], np.cumsum(row)])
    half = stock / 2
    n_long = int(np.searchsorted(-row, -half, side="left"))
    best = math.ceil((total[-1] - _FIT_TOLERANCE) / stock)
    for least in np.unique(row[row <= half])[:_MOST_THRESHOLDS].tolist():
        n_huge = int(np.searchsorted(-row, -(stock - least), side="left"))
        n_counted = int(np.searchsorted(-row, -least, side="right"))
        room = (n_long - n_huge) * stock - (total[n_long] - total[n_huge])
        short = total[n_counted] - total[n_long]
        best = max(best, n_long + max(0, math.ceil((short - room - _FIT_TOLERANCE) / stock)))
    return int(max(best, n_long))


def _best_fit(lengths: Floats, order: Sequence[int], stock: float) -> list[list[int]]:
    """The pieces of each bar, each piece put where it leaves the least."""
    bars: list[list[int]] = []
    left = np.full(len(order), np.inf)  # Bars that are not begun are never the fullest.
    for k in order:
        room = left[: len(bars)] - lengths[k]
        room = np.where(room >= -_FIT_TOLERANCE, room, np.inf)
        best = int(np.argmin(room)) if len(room) else 0
        if len(room) and np.isfinite(room[best]):
            bars[best].append(k)
            left[best] -= lengths[k]
        else:
            left[len(bars)] = stock - lengths[k]
            bars.append([k])
    return bars


def _fill_one_by_one(lengths: Floats, order: Sequence[int], stock: float) -> list[list[int]]:
    """Fill each bar, beginning with the longest piece that is left, as full as a sum of whole millimetres can be."""
    left = list(order)
    bars = []
    while left:
        first = left.pop(0)
        chosen = _fullest([lengths[k] for k in left], stock - lengths[first])
        bars.append([first, *(left[i] for i in chosen)])
        taken = set(chosen)
        left = [k for i, k in enumerate(left) if i not in taken]
    return bars


def _fullest(lengths: Sequence[float], room: float) -> list[int]:
    """Which of the lengths, each rounded up to a whole millimetre, fill the room best (subset sum)."""
    space = int(room + _FIT_TOLERANCE)
    reached_by = np.full(space + 1, -1, np.int64)
    reached_by[0] = len(lengths)
    for i, length in enumerate(lengths):
        need = math.ceil(length - _FIT_TOLERANCE)
        if need > space:
            continue
        fresh = (reached_by[: space + 1 - need] >= 0) & (reached_by[need:] < 0)
        reached_by[need:][fresh] = i
        if reached_by[space] >= 0:
            break
    at = int(np.flatnonzero(reached_by >= 0)[-1])
    chosen = []
    while at > 0:
        i = int(reached_by[at])
        chosen.append(i)
        at -= math.ceil(lengths[i] - _FIT_TOLERANCE)
    return sorted(chosen)
