"""Nodes on the ridges, where two fronts meet in the middle of an edge.

On such an edge the distance rises from both ends to a peak.  Where a level passes just below
the peak, the ends know nothing of it, and the level would fall to pieces along the ridge.  So
the edge gets a node at its peak, and the faces beside it are split.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.bisection import NOT_SPLIT, split_edges
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.isolines.crossings import KINK, slope_along
from weavecore.offsetting.isolines.cut_mesh import Sheet
from weavecore.offsetting.spacing import Ladder

_LEAST_SHARE = 0.01
"""A peak nearer to an end than this part of the edge is as well told by that end."""


def split_ridges(sheet: Sheet, edge_lengths: Floats, *, ladder: Ladder) -> Sheet:
    """The sheet with a node wherever an edge has a peak less than its length beyond a level.

    Parameters
    ----------
    sheet : Sheet
    edge_lengths : (3F,) float64
        Length of every halfedge.
    ladder : Ladder
    """
    halfedge, share, peak = _find_peaks(sheet, edge_lengths, ladder)
    if len(halfedge) == 0:
        return sheet
    a, b = sheet.tail[halfedge], sheet.head[halfedge]
    points = np.concatenate([sheet.points, sheet.points[a] + (sheet.points[b] - sheet.points[a]) * share[:, None]])
    middle = np.full(len(sheet.tail), NOT_SPLIT, np.int64)
    middle[halfedge] = middle[sheet.opposite[halfedge]] = sheet.n_nodes + np.arange(len(halfedge))
    faces, part_of, twins = split_edges(points, sheet.faces, sheet.twins, middle[: len(sheet.twins)])
    steepness = 0.5 * np.linalg.norm(sheet.gradient[a] + sheet.gradient[b], axis=1)
    return replace(
        sheet,
        points=points,
        faces=faces,
        twins=twins,
        distance=np.concatenate([sheet.distance, peak]),
        gradient=np.concatenate([sheet.gradient, np.zeros((len(peak), 3))]),
        face_of=part_of,
        edge_of=np.concatenate([sheet.edge_of, np.stack([a, b], axis=1)]),
        share=np.concatenate([sheet.share, share]),
        steepness=np.concatenate([sheet.steepness, steepness]),
    )


def _find_peaks(sheet: Sheet, edge_lengths: Floats, ladder: Ladder) -> tuple[Ints, Floats, Floats]:
    """Halfedges with a peak that a level comes near, where on them it lies, and its distance."""
    h = sheet.edges
    at_start = sheet.distance == 0
    h = h[(sheet.twins[h] != NO_TWIN) | ~at_start[sheet.tail[h]] | ~at_start[sheet.head[h]]]
    a, b = sheet.tail[h], sheet.head[h]
    higher = np.maximum(sheet.distance[a], sheet.distance[b])
    # No distance rises faster than the way: this is the most that a peak can be.
    most = 0.5 * (sheet.distance[a] + sheet.distance[b] + edge_lengths[h])
    h = h[_level_at(most, ladder) > higher - edge_lengths[h]]
    h = h[_rises_from_both_ends(sheet, h)]
    a, b = sheet.tail[h], sheet.head[h]
    along, normal = sheet.points[b] - sheet.points[a], sheet.edge_normals(h)
    rise, is_rise = slope_along(sheet.gradient[a], along, normal)
    fall, is_fall = slope_along(-sheet.gradient[b], along, normal)
    is_ridge = is_rise & is_fall & (rise + fall > KINK * edge_lengths[h])
    h, a, b, rise, fall = h[is_ridge], a[is_ridge], b[is_ridge], rise[is_ridge], fall[is_ridge]
    share = (sheet.distance[b] + fall - sheet.distance[a]) / (rise + fall)
    peak = sheet.distance[a] + rise * share
    level = _level_at(peak, ladder)
    is_near = (level > 0) & (peak - level < edge_lengths[h]) & (share > _LEAST_SHARE) & (share < 1 - _LEAST_SHARE)
    return h[is_near], share[is_near], peak[is_near]


def _rises_from_both_ends(sheet: Sheet, h: Ints) -> Bools:
    a, b = sheet.tail[h], sheet.head[h]
    along = sheet.points[b] - sheet.points[a]
    rise = np.einsum("ij,ij->i", sheet.gradient[a], along)
    fall = -np.einsum("ij,ij->i", sheet.gradient[b], along)
    return np.asarray((rise > 0) & (fall > 0))


def _level_at(distance: Floats, ladder: Ladder) -> Floats:
    """The highest level at or below each distance."""
    return ladder.distance(ladder.count_below(distance).astype(np.float64))
