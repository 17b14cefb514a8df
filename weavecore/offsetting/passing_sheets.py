"""Where parts of a surface pass through each other, or lie so close to each other that their latitudes cross.

On the surface no two latitudes cross.  In space they do where the surface passes through itself, or lies on itself
beside a sharp fold: the rods there would run into each other.  Two segments cross where, seen along the normal of the
face of a, the ends c and d of one lie on different sides of the other, and the two are apart by less than half of the
longer one::

            c
            │
      a ────┼──── b
            d

Segments are compared whose middles are no further apart than nearly all segments are long.  O(n log n).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from weavecore.geometry.arrays import Floats, Ints, dots, next_in_loop, unit_vectors
from weavecore.model import Latitudes, Note
from weavecore.model.notes import at
from weavecore.polling import each, poll

_NEARLY_ALL = 0.999
"""Part of the segments that are no longer than the distance within which others are compared: a few may be as long as
the surface."""

_CLOSE = 0.5
"""Of the longer segment: the gap between two that cross."""

_INSIDE = 1e-9
"""Of a segment: nearer to its end it is touched, not crossed."""

_MOST_PAIRS = 20_000_000
"""Pairs that are compared: as many as take some seconds."""

_MOST_HALVINGS = 20
"""Of the distance; where that many leave too many pairs, the segments lie on each other, and none is compared."""

_PAIRS_AT_ONCE = 200_000


def note_crossings(latitudes: Latitudes) -> Latitudes:
    """Note where latitudes of parts that pass each other cross.

    Parameters
    ----------
    latitudes : Latitudes

    Returns
    -------
    Latitudes
        With a note CROSSING on its surface where some do; else the same.
    """
    places = crossing_places(latitudes)
    if len(places) == 0:
        return latitudes
    some = "in 1 place" if len(places) == 1 else f"in {len(places):,} places"
    text = f"Polylines cross {some} as seen along the surface, first at {at(places[0])}: parts of it pass through "
    text += "each other there, or lie on each other beside a sharp fold, and their rods run into each other. Move them "
    text += "apart, open the fold, or leave one of them out."
    note = Note("CROSSING", text, {"count": len(places)}, places)
    return replace(latitudes, surface=latitudes.surface.with_notes((*latitudes.surface.notes, note)))


def crossing_places(latitudes: Latitudes) -> Floats:
    """(n, 3) where two segments cross, in the order of the first one.

    Parameters
    ----------
    latitudes : Latitudes
    """
    lines, surface = latitudes.polylines, latitudes.surface
    after = next_in_loop(lines.offsets)
    goes_on = np.ones(len(after), bool)
    goes_on[lines.offsets[1:][~lines.closed & (lines.counts > 0)] - 1] = False
    start = np.flatnonzero(goes_on)
    end, points = after[start], lines.points
    length = np.linalg.norm(points[end] - points[start], axis=1)
    pairs = _near_pairs((points[start] + points[end]) / 2, float(np.quantile(length, _NEARLY_ALL)))
    normal = surface.face_normals[lines.face[start]]
    places = []
    for k in each(range(0, len(pairs), _PAIRS_AT_ONCE)):
        i, j = pairs[k : k + _PAIRS_AT_ONCE].T
        apart = (start[i] != start[j]) & (start[i] != end[j]) & (end[i] != start[j]) & (end[i] != end[j])
        i, j = i[apart], j[apart]
        a, b, c, d = (points[one] for one in (start[i], end[i], start[j], end[j]))
        places.append(_crossings(a, b, c, d, normal[i], _CLOSE * np.maximum(length[i], length[j])))
    return np.concatenate([*places, np.zeros((0, 3))])


def _near_pairs(middles: Floats, reach: float) -> Ints:
    """(n, 2) pairs of points no further apart than ``reach``, or less where that would be too many, in rising order."""
    tree = KDTree(middles)
    poll()
    for _ in each(range(_MOST_HALVINGS)):
        if tree.count_neighbors(tree, reach) <= 2 * _MOST_PAIRS:
            break
        reach /= 2
    else:
        return np.zeros((0, 2), np.int64)
    poll()
    pairs: Ints = tree.query_pairs(reach, output_type="ndarray").astype(np.int64).reshape(-1, 2)
    poll()
    return pairs[np.lexsort(pairs.T[::-1])]


def _crossings(a: Floats, b: Floats, c: Floats, d: Floats, normal: Floats, most_gap: Floats) -> Floats:
    """(m, 3) the places, on ``c d``, where segments (n, 3) from a to b and from c to d cross, seen along a normal."""
    along = (b - a) - normal * dots(b - a, normal)[:, None]
    size = np.linalg.norm(along, axis=1)
    along = unit_vectors(along)
    aside = np.cross(normal, along)
    c_side, d_side = dots(c - a, aside), dots(d - a, aside)
    is_opposite = (c_side * d_side < 0) & (size > 0)
    share = c_side / np.where(is_opposite, c_side - d_side, 1.0)
    place = c + (d - c) * share[:, None]
    station, gap = dots(place - a, along), np.abs(dots(place - a, normal))
    crosses = is_opposite & (station > _INSIDE * size) & (station < (1 - _INSIDE) * size) & (gap < most_gap)
    crossing: Floats = place[crosses]
    return crossing
