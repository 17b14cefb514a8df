"""Phases: how far the nodes of each ring are turned, generation by generation, so that rings line up."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.linking.division import divide_border, divide_evenly, index_at
from weavecore.linking.feet import SAMPLES_PER_NODE, Feet
from weavecore.linking.patterns import Pattern
from weavecore.model.latitudes import Latitudes


def place_nodes(latitudes: Latitudes, counts: Ints, feet: Feet, pattern: Pattern) -> list[Floats]:
    """Rising stations of the nodes of each polyline."""
    polylines = latitudes.polylines
    nodes: list[Floats] = []
    for p in range(len(latitudes)):
        length, count = float(polylines.lengths[p]), int(counts[p])
        part = slice(polylines.offsets[p], polylines.offsets[p + 1])
        if latitudes.generation[p] == 0:
            nodes.append(divide_border(polylines.points[part], polylines.stations[part], length, count))
        else:
            phase = _best_phase(foot_indices(latitudes, p, feet, nodes), pattern)
            nodes.append(divide_evenly(length, count, phase))
    return nodes


def foot_indices(latitudes: Latitudes, p: int, feet: Feet, nodes: list[Floats]) -> Floats:
    """Index of each sample's foot among the nodes of its parent, rising along the child."""
    part = slice(feet.offsets[p], feet.offsets[p + 1])
    parent, station, against = feet.parent[part], feet.station[part], feet.is_against[part]
    index = np.empty(len(parent))
    for q in np.unique(parent):
        here = parent == q
        index[here] = index_at(nodes[q], float(latitudes.polylines.lengths[q]), station[here])
    return np.where(against, -index, index)


def _best_phase(index: Floats, pattern: Pattern) -> float:
    """The turn, in edges, that brings most nodes to where the pattern wants them.

    With ``index`` the feet's indices, a node of the child is well placed where ``index -
    child_sits`` is whole.  As the index rises by about one from node to node, the sum of
    the cosines of the misfit is one harmonic of the turn, and its peak is known outright.
    """
    misfit = np.exp(2j * np.pi * (index - pattern.child_sits)).reshape(-1, SAMPLES_PER_NODE)
    turn = np.exp(-2j * np.pi * np.arange(SAMPLES_PER_NODE) / SAMPLES_PER_NODE)
    return float(-np.angle((misfit * turn).sum()) / (2 * np.pi))
