"""Where the nodes of an open polyline lie: one at either end, the others at equal arc lengths between.

From the end to the next node it may be a whole edge or half of one: rows that begin alike in turns make
even triangles, cut in half along the selvedge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.linking.patterns import Pattern

_STRAIN_COST = 4.0
"""Of each edge, times the square of its strain: by which part of the length aimed at it is longer or shorter."""
_FEWEST_TO_SHIFT = 3
"""Polylines of fewer edges are divided evenly."""
_NEAR_SPIKE = 0.5
"""A node is moved onto a spike by no more than this part of an edge."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to divide an open polyline: stations (k,) of its nodes, its ends among them, and what it costs."""

    stations: Floats
    cost: float


def divide_open(length: float, n_edges: int, spikes: Optional[Floats]) -> Floats:
    """Stations (n + 1,) at equal arc lengths; nodes nearest to spikes are moved onto them."""
    return _onto_spikes(np.linspace(0.0, length, n_edges + 1), spikes)


def divide_openly(length: float, n_edges: int, spikes: Optional[Floats], pattern: Pattern) -> list[Way]:
    """The ways to divide a polyline that has about so many edges: evenly, or with a half edge at one end or at both."""
    ways = [Way(divide_open(length, n_edges, spikes), 0.0)]
    if not pattern.has_diagonals:
        return ways
    for first, last in ((0.5, 0.5), (0.5, 1.0), (1.0, 0.5)):
        whole = int(np.rint(n_edges - first - last))
        if whole < 0 or n_edges < _FEWEST_TO_SHIFT:
            continue
        edge = length / (first + whole + last)
        stations = np.concatenate([[0.0], (first + np.arange(whole + 1)) * edge, [length]])
        strain = edge * n_edges / length - 1.0
        ways.append(Way(_onto_spikes(stations, spikes), _STRAIN_COST * n_edges * strain**2))
    return ways


def _onto_spikes(stations: Floats, spikes: Optional[Floats]) -> Floats:
    """The stations with inner nodes moved onto spikes that are near, the sharpest first."""
    moved = stations.copy()
    for spike in [] if spikes is None else spikes.tolist():
        node = int(np.argmin(np.abs(stations - spike)))
        if 0 < node < len(stations) - 1 and moved[node] == stations[node]:
            gap = min(stations[node] - stations[node - 1], stations[node + 1] - stations[node])
            if abs(spike - stations[node]) <= _NEAR_SPIKE * gap:
                moved[node] = spike
    return moved
