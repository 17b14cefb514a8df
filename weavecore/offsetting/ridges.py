"""Nodes on the ridges, where two fronts meet in the middle of an edge.

On such an edge the distance rises from both ends to a peak.  Where a level passes just below
the peak, the ends know nothing of it, and the level would fall to pieces along the ridge.  So
the edge gets a node at its peak, and the faces beside it are split.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, find_twins, halfedge_ends
from weavecore.offsetting.contours import count_levels
from weavecore.offsetting.edge_profile import KINK, slope_along
from weavecore.offsetting.sheet import Sheet

_LEAST_SHARE = 0.01
"""A peak nearer to an end than this part of the edge is as well told by that end."""


def split_ridges(sheet: Sheet, edge_lengths: Floats, *, spacing: float) -> Sheet:
    """The sheet with a node wherever an edge has a peak less than its length beyond a level.

    Parameters
    ----------
    sheet : Sheet
    edge_lengths : (3F,) float64
        Length of every halfedge.
    spacing : float
    """
    halfedge, share, peak = _find_peaks(sheet, edge_lengths, spacing)
    if len(halfedge) == 0:
        return sheet
    tail, head = halfedge_ends(sheet.faces)
    a, b = tail[halfedge], head[halfedge]
    middle = np.full(len(tail), -1, np.int64)
    middle[halfedge] = middle[sheet.twins[halfedge]] = sheet.n_nodes + np.arange(len(halfedge))
    points = sheet.points[a] + (sheet.points[b] - sheet.points[a]) * share[:, None]
    faces, part_of, twins = _split_faces(sheet, middle, np.concatenate([sheet.points, points]))
    return replace(
        sheet,
        points=np.concatenate([sheet.points, points]),
        faces=faces,
        twins=twins,
        distance=np.concatenate([sheet.distance, peak]),
        gradient=np.concatenate([sheet.gradient, np.zeros((len(peak), 3))]),
        face_of=part_of,
        edge_of=np.concatenate([sheet.edge_of, np.c_[a, b]]),
        share=np.concatenate([sheet.share, share]),
        steepness=np.concatenate(
            [sheet.steepness, 0.5 * np.linalg.norm(sheet.gradient[a] + sheet.gradient[b], axis=1)]
        ),
    )


def _find_peaks(sheet: Sheet, edge_lengths: Floats, spacing: float) -> tuple[Ints, Floats, Floats]:
    """Halfedges with a peak that a level comes near, where on them it lies, and its distance."""
    tail, head = halfedge_ends(sheet.faces)
    higher = np.maximum(sheet.distance[tail], sheet.distance[head])
    # No distance rises faster than the way: this is the most that a peak can be.
    most = 0.5 * (sheet.distance[tail] + sheet.distance[head] + edge_lengths)
    may = (tail < head) & (sheet.twins != NO_TWIN) & (_level_at(most, spacing) > higher - edge_lengths)
    h = np.flatnonzero(may)
    a, b = tail[h], head[h]
    along = sheet.points[b] - sheet.points[a]
    rise, is_rise = slope_along(sheet.gradient[a], along)
    fall, is_fall = slope_along(-sheet.gradient[b], along)
    is_ridge = is_rise & is_fall & (rise > 0) & (fall > 0) & (rise + fall > KINK * edge_lengths[h])
    h, a, b, rise, fall = h[is_ridge], a[is_ridge], b[is_ridge], rise[is_ridge], fall[is_ridge]
    share = (sheet.distance[b] + fall - sheet.distance[a]) / (rise + fall)
    peak = sheet.distance[a] + rise * share
    level = _level_at(peak, spacing)
    is_near = (level > 0) & (peak - level < edge_lengths[h]) & (share > _LEAST_SHARE) & (share < 1 - _LEAST_SHARE)
    return h[is_near], share[is_near], peak[is_near]


def _level_at(distance: Floats, spacing: float) -> Floats:
    """The highest level at or below each distance."""
    level: Floats = spacing * count_levels(distance, spacing)
    return level


def _split_faces(sheet: Sheet, middle: Ints, points: Floats) -> tuple[Ints, Ints, Ints]:
    """Faces split at the given middle nodes of their halfedges, the face each is part of, and twins."""
    middle = middle.reshape(-1, 3)
    n_split = (middle >= 0).sum(1)
    touched = np.flatnonzero(n_split)
    # Turn each face so that its split edges come first.
    is_split = middle[touched] >= 0
    turn = np.where(n_split[touched] == 2, (np.argmin(is_split, 1) + 1) % 3, np.argmax(is_split, 1))
    columns = (turn[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(sheet.faces[touched], columns, 1)
    middles = np.take_along_axis(middle[touched], columns, 1)
    pieces, owners = [], []
    for n, cut in ((1, _halve), (2, _cut_off_corner), (3, _quarter)):
        these = n_split[touched] == n
        made = cut(corners[these], middles[these], points)
        pieces += made
        owners += [touched[these]] * len(made)
    piece, owner = np.concatenate(pieces), np.concatenate(owners)
    # The first piece of a face takes its place, the others are appended.
    _, first = np.unique(owner, return_index=True)
    is_extra = np.ones(len(piece), bool)
    is_extra[first] = False
    place = owner.copy()
    place[is_extra] = len(sheet.faces) + np.arange(int(is_extra.sum()))
    faces = np.concatenate([sheet.faces, piece[is_extra]])
    faces[place] = piece
    part_of = np.concatenate([sheet.face_of, sheet.face_of[owner[is_extra]]])
    return faces, part_of, _join(sheet, touched, faces, place, len(points))


def _halve(corners: Ints, middles: Ints, points: Floats) -> list[Ints]:
    a, b, c = corners.T
    m = middles[:, 0]
    return [np.c_[a, m, c], np.c_[m, b, c]]


def _cut_off_corner(corners: Ints, middles: Ints, points: Floats) -> list[Ints]:
    a, b, c = corners.T
    m, n = middles[:, 0], middles[:, 1]
    to_n = np.linalg.norm(points[a] - points[n], axis=1) <= np.linalg.norm(points[c] - points[m], axis=1)
    return [
        np.c_[m, b, n],
        np.c_[a, m, np.where(to_n, n, c)],
        np.c_[np.where(to_n, a, m), n, c],
    ]


def _quarter(corners: Ints, middles: Ints, points: Floats) -> list[Ints]:
    a, b, c = corners.T
    m, n, o = middles.T
    return [np.c_[a, m, o], np.c_[m, b, n], np.c_[o, n, c], middles]


def _join(sheet: Sheet, touched: Ints, faces: Ints, place: Ints, n_nodes: int) -> Ints:
    """Twins after a split: found anew for the pieces and the faces beside them."""
    twins = np.concatenate([sheet.twins, np.full(3 * (len(faces) - len(sheet.faces)), NO_TWIN)])
    beside = sheet.twins.reshape(-1, 3)[touched].ravel()
    local = np.unique(np.concatenate([place, beside[beside != NO_TWIN] // 3]))
    found = find_twins(faces[local], n_nodes)
    h = (3 * local[:, None] + np.arange(3)).ravel()
    is_piece = np.repeat(np.isin(local, place), 3)
    known = is_piece | (found != NO_TWIN)
    twins[h[known]] = np.where(found[known] == NO_TWIN, NO_TWIN, h[found[known]])
    return twins
