"""How far two results of the offset agree: counts, parents, and the distance between their polylines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import next_in_loop, offsets_of, rows_of
from weavecore.model import Latitudes

AGREED = 0.05
"""Spacings that polylines may lie apart."""

NARROW = 0.15
"""Spacings between two strands of a generation that face each other in a tongue."""

_SAMPLES_PER_SPACING = 200


@dataclass(frozen=True)
class Comparison:
    """What two methods made of one surface; distances in spacings.

    Attributes
    ----------
    counts : (list of int, list of int)
        Polylines of each generation, by the first and by the second method.
    same_parents : bool
        Whether the polylines, matched by nearness, have the same parents.
    mean, farthest : float
        Distance from a polyline to the other method's of the same generation: over all generations that
        both have, from either side.
    farthest_outside : float
        The same but for tongues, where two strands of one generation face each other over less than `NARROW`.
    apart : float
        Part of the length that lies further off than `AGREED`.
    """

    counts: tuple[list[int], list[int]]
    same_parents: bool
    mean: float
    farthest: float
    farthest_outside: float
    apart: float

    @property
    def same_counts(self) -> bool:
        """Whether both have as many polylines in each generation."""
        return self.counts[0] == self.counts[1]


class _Samples:
    """Places along all polylines, with the way that these run."""

    def __init__(self, latitudes: Latitudes) -> None:
        lines = latitudes.polylines
        side = lines.points[next_in_loop(lines.offsets)] - lines.points
        length = np.linalg.norm(side, axis=1)
        ragged = offsets_of(np.maximum(1, np.ceil(length / latitudes.spacing * _SAMPLES_PER_SPACING)))
        row = rows_of(ragged)
        part = (np.arange(ragged[-1]) - ragged[row]) / np.diff(ragged)[row]
        self.points = lines.points[row] + side[row] * part[:, None]
        self.way = side[row] / np.maximum(length, 1e-300)[row][:, None]
        self.line = lines.owner[row]
        self.generation = latitudes.generation[self.line]

    def of(self, generation: int) -> np.ndarray:
        return np.flatnonzero(self.generation == generation)


def compare(first: Latitudes, second: Latitudes) -> Comparison:
    """Compare two results of the same spacing on the same surface."""
    a, b = _Samples(first), _Samples(second)
    off, narrow, matched = [], [], True
    partner = np.full(len(first), -1)
    for generation in range(min(first.n_generations, second.n_generations)):
        i, j = a.of(generation), b.of(generation)
        for one, other, near, far in ((a, b, i, j), (b, a, j, i)):
            away, at = cKDTree(other.points[far]).query(one.points[near])
            off.append(away / first.spacing)
            narrow.append(_face_another(one, near, NARROW * first.spacing))
            if one is a:
                matched &= _match(partner, one.line[near], other.line[far[at]])
    distance, tongue = np.concatenate(off), np.concatenate(narrow)
    return Comparison(
        (np.bincount(first.generation).tolist(), np.bincount(second.generation).tolist()),
        matched and _same_graph(first, second, partner),
        float(distance.mean()),
        float(distance.max()),
        float(distance[~tongue].max()),
        float(np.mean(distance > AGREED)),
    )


def _face_another(samples: _Samples, chosen: np.ndarray, reach: float) -> np.ndarray:
    """Which samples have one of the same generation in reach that runs the other way."""
    points, way = samples.points[chosen], samples.way[chosen]
    facing = np.zeros(len(chosen), bool)
    away, near = cKDTree(points[::5]).query(points, k=min(64, len(points[::5])), distance_upper_bound=reach)
    near, away = near.reshape(len(chosen), -1), away.reshape(len(chosen), -1)
    for column, far in zip(near.T, away.T):
        found = np.isfinite(far)
        facing[found] |= np.einsum("ij,ij->i", way[found], way[::5][column[found]]) < -0.3
    return facing


def _match(partner: np.ndarray, line: np.ndarray, nearest: np.ndarray) -> bool:
    """Give each polyline the one that most of its places are nearest to; whether no two have the same."""
    for p in np.unique(line):
        partner[p] = np.bincount(nearest[line == p]).argmax()
    matched = partner[np.unique(line)]
    return len(np.unique(matched)) == len(matched)


def _same_graph(first: Latitudes, second: Latitudes, partner: np.ndarray) -> bool:
    if len(first) != len(second):
        return False
    told = np.unique(partner[first.parents], axis=0)
    return np.array_equal(told, np.unique(second.parents, axis=0))
