"""Folds: where a child turns back over itself without crossing itself.

On a rough surface the ends of two neighbouring rays may change places.  The child then runs forth, back and
forth again; where it turns sharply to the right, which no front that opens does, the vertex is left out.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.offsetting.fronts.chords import lay_chords
from weavecore.offsetting.fronts.ground import Curves, Ground, next_along

SHARPEST_FAN = 1.0
"""Radians: a child that turns to the right by more has folded."""

FEWEST = 4
"""A polyline keeps at least so many vertices."""

_MOST_ROUNDS = 5


def find_turns(ground: Ground, face: Ints, points: Floats, offsets: Ints, closed: Bools) -> tuple[Floats, Floats]:
    """How much polylines turn to the left at each point, and in which direction they come to it.

    Both as angles in the frames of the first halfedges of the faces.  Open ones go on straight at their ends.
    """
    after = next_along(offsets, closed)
    before = np.arange(len(after))
    onward = after != before
    before[after[onward]] = np.flatnonzero(onward)
    ax, ay = ground.aimed(face, points - points[before])
    bx, by = ground.aimed(face, points[after] - points)
    first, last = before == np.arange(len(after)), ~onward
    ax[first], ay[first] = bx[first], by[first]
    bx[last], by[last] = ax[last], ay[last]
    return np.arctan2(ax * by - ay * bx, ax * bx + ay * by), np.arctan2(ay, ax)


def unfold(ground: Ground, curves: Curves) -> Curves:
    """The curves without the vertices at which they fold, and with new chords across these."""
    vertex = np.flatnonzero(curves.is_vertex)
    kept = vertex
    for _ in range(_MOST_ROUNDS):
        counts = np.bincount(curves.owner[kept], minlength=len(curves))
        turn, _ = find_turns(ground, curves.face[kept], curves.points[kept], offsets_of(counts), curves.closed)
        folds = (turn < -SHARPEST_FAN) & (counts[curves.owner[kept]] > FEWEST)
        if not folds.any():
            break
        kept = kept[~folds]
    return curves if len(kept) == len(vertex) else _joined(ground, curves, vertex, kept)


def _joined(ground: Ground, curves: Curves, vertex: Ints, kept: Ints) -> Curves:
    """The curves through some of their vertices: old chords where both ends stay, new ones elsewhere."""
    next_vertex = _next(curves, vertex)
    next_kept = _next(curves, kept)
    stays = next_kept == next_vertex[np.searchsorted(vertex, kept)]
    chord, rank = _chords(curves, vertex)
    place = np.full(len(curves.face), -1)
    place[kept[stays]] = np.flatnonzero(stays)
    old = np.flatnonzero(place[chord] >= 0)
    at, to = kept[~stays], next_kept[~stays]
    new, face, start, end = lay_chords(ground, curves.face[at], curves.start[at], curves.face[to], curves.start[to])
    row = np.concatenate([place[chord[old]], np.flatnonzero(~stays)[new]])
    order = np.lexsort((np.concatenate([rank[old], np.arange(len(new))]), row))
    face = np.concatenate([curves.face[old], face])[order]
    start = np.concatenate([curves.start[old], start])[order]
    end = np.concatenate([curves.end[old], end])[order]
    row = row[order]
    is_vertex = np.ones(len(row), bool)
    is_vertex[1:] = row[1:] != row[:-1]
    counts = np.bincount(curves.owner[kept[row]], minlength=len(curves))
    is_corner = is_vertex & curves.is_corner[kept[row]]
    return Curves(offsets_of(counts), curves.closed, face, start, end, is_vertex, is_corner, ground.points(face, start))


def _next(curves: Curves, vertex: Ints) -> Ints:
    """For each of these vertices the next one of the same curve."""
    following: Ints = vertex[
        next_along(offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves))), curves.closed)
    ]
    return following


def _chords(curves: Curves, vertex: Ints) -> tuple[Ints, Ints]:
    """For each segment the vertex with which its chord begins, and its rank in the chord."""
    n = len(curves.face)
    row = np.searchsorted(vertex, np.arange(n), side="right") - 1
    first = np.searchsorted(vertex, curves.offsets[:-1])
    last = np.searchsorted(vertex, curves.offsets[1:]) - 1
    # What comes before the first vertex of a curve belongs to the chord from its last one.
    row = np.where(row < first[curves.owner], last[curves.owner], row)
    chord = vertex[row]
    around = np.diff(curves.offsets)[curves.owner]
    return chord, (np.arange(n) - chord) % around
