"""Gaps at joints: the least distance between the axes of two rods near the joint in which they touch.

Most rods cross at a fair angle: their axes are parabolas there, and the nearest places follow from two steps of
Newton's method.  The others are sampled at points that lie closer near the joint.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, unit_vectors
from weavecore.geometry.closest import dots_of_columns, segment_distances
from weavecore.geometry.splines import SplineRows
from weavecore.model.joints import Joints
from weavecore.model.strands import Strands
from weavecore.polling import each

_REACH = 5.0
"""The nearest places are looked for so many diameters along each rod, and no further than half an edge."""

_PIECES = 6
"""Each way from the joint a rod is taken for so many straight pieces, shorter ones near the joint."""

_CROSSINGS_AT_ONCE, _CONTACTS_AT_ONCE = 4096, 1024
"""Contacts whose gaps are solved for, or sampled, between two polls; their arrays fit into a processor's cache."""

_NEWTON_STEPS = 2
"""Steps to the nearest places of two axes that cross: they are next to the joint, and each squares what is left."""

_LEAST_SINE = 0.4
"""Of the angle between axes that cross well; at sharper ones the nearest places may be far from the joint."""

_NEAR_JOINT = 0.25
"""Part of the shorter edge beside a joint within which axes are taken for parabolas."""

_AT_END = 0.02
"""Nearest places so few diameters from the end of a rod may lie beyond it: the gap is the same to a part of 1e-4."""


def gaps_at_joints(
    points: Floats,
    rows: SplineRows,
    strands: Strands,
    joints: Joints,
    apart: Floats,
    counts_overhangs: Bools,
    contacts: Ints,
) -> Floats:
    """Least distance between the axes of the two rods of contacts, near the joint.

    Parameters
    ----------
    points : (M, 3) float64
        Of the visits.
    rows : SplineRows
    strands : Strands
    joints : Joints
    apart : (C,) float64
        Mean diameter of the two rods.
    counts_overhangs : (C,) bool
        Whether rods that end at the joint are taken to run on straight beyond it.
    contacts : (k,) int64
        Those that are measured.

    Returns
    -------
    (k,) float64
    """
    visits = joints.visit[joints.contacts[contacts]]
    axes = _AxesAtVisits(points, rows, strands)
    least = np.empty(len(visits))
    sampled = [np.zeros(0, np.int64)]
    for begin in each(range(0, len(visits), _CROSSINGS_AT_ONCE)):
        part = slice(begin, begin + _CROSSINGS_AT_ONCE)
        least[part], is_crossing = _gaps_of_crossings(axes, visits[part], apart[contacts[part]])
        sampled.append(begin + np.flatnonzero(~is_crossing))
    rest = np.concatenate(sampled)
    for begin in each(range(0, len(rest), _CONTACTS_AT_ONCE)):
        some = rest[begin : begin + _CONTACTS_AT_ONCE]
        reach = _REACH * apart[contacts[some]]
        beyond = np.where(counts_overhangs[contacts[some]], reach, 0.0)
        least[some] = _least_distances(*(axes.around(v, reach, beyond) for v in visits[some].T))
    return least


def _gaps_of_crossings(axes: _AxesAtVisits, visits: Ints, apart: Floats) -> tuple[Floats, Bools]:
    """Least distances (k,) of axes that cross well, and which do: at no sharp angle, nearest right at the joint.

    Near the joint the axes are parabolas, and their nearest places are found by Newton's method.
    """
    place, slope, bend = zip(*(axes.parabolas(v) for v in visits.T))
    room = np.minimum(apart, _NEAR_JOINT * np.minimum(*(axes.room(v) for v in visits.T)))
    s, t = np.zeros(len(visits)), np.zeros(len(visits))
    start = place[0] - place[1]
    is_crossing = np.ones(len(visits), bool)
    for _ in range(_NEWTON_STEPS):
        one, other = slope[0] + s * bend[0], slope[1] + t * bend[1]
        gap = start + s * (slope[0] + one) / 2.0 - t * (slope[1] + other) / 2.0
        oo, tt, ot = (dots_of_columns(*pair) for pair in ((one, one), (other, other), (one, other)))
        is_crossing &= oo * tt - ot * ot > _LEAST_SINE**2 * oo * tt
        oo, tt = oo + dots_of_columns(gap, bend[0]), tt - dots_of_columns(gap, bend[1])
        along, across = dots_of_columns(gap, one), dots_of_columns(gap, other)
        det = np.where(is_crossing, oo * tt - ot * ot, 1.0)
        s, t = s + (ot * across - tt * along) / det, t + (oo * across - ot * along) / det
        is_crossing &= (np.abs(s) < room) & (np.abs(t) < room) & (det > 0.0)
        s, t = np.where(is_crossing, s, 0.0), np.where(is_crossing, t, 0.0)
    for v, way in zip(visits.T, (s, t)):
        is_crossing &= ~axes.is_end(v) | (np.abs(way) < _AT_END * apart)
    gap = start + s * (slope[0] + s * bend[0] / 2.0) - t * (slope[1] + t * bend[1] / 2.0)
    return np.sqrt(dots_of_columns(gap, gap)), is_crossing


def _least_distances(one: Floats, other: Floats) -> Floats:
    """Least distances (k,) between two rows of polylines (3, m, k): between the segments at their nearest corners."""
    m, n = one.shape[1:]
    square = np.empty((m, m, n))
    for i in range(m):
        gap = one[:, i, None] - other
        gap *= gap
        np.add(gap[0], gap[1], out=square[i])
        square[i] += gap[2]
    p, q = np.divmod(square.reshape(m * m, n).argmin(0), m)
    row = np.arange(n)
    least = np.full(n, np.inf)
    for i in (np.maximum(p - 1, 0), np.minimum(p, m - 2)):
        for j in (np.maximum(q - 1, 0), np.minimum(q, m - 2)):
            ends = one[:, i, row].T, one[:, i + 1, row].T, other[:, j, row].T, other[:, j + 1, row].T
            least = np.minimum(least, segment_distances(*ends)[0])
    return least


class _AxesAtVisits:
    """The axes on both sides of visits, as polynomials; coordinates in rows."""

    def __init__(self, points: Floats, rows: SplineRows, strands: Strands) -> None:
        self._points, self._slopes = np.ascontiguousarray(points.T), np.ascontiguousarray(rows.derivatives.T)
        self._following, self._preceding = strands.following, strands.preceding
        goes_round = strands.following < np.arange(len(points))
        ahead = np.where(goes_round, rows.ends[strands.owner], rows.parameters[strands.following])
        self._width = np.where(strands.following >= 0, ahead - rows.parameters, 1.0)

    def is_end(self, visits: Ints) -> Bools:
        """Whether a rod ends there."""
        ends: Bools = (self._following[visits] < 0) | (self._preceding[visits] < 0)
        return ends

    def room(self, visits: Ints) -> Floats:
        """Width by the parameter of the shorter cubic beside visits."""
        ahead, behind = self._following[visits] >= 0, self._preceding[visits]
        before = np.where(behind >= 0, self._width[behind], np.inf)
        return np.minimum(np.where(ahead, self._width[visits], np.inf), before)

    def parabolas(self, visits: Ints) -> tuple[Floats, Floats, Floats]:
        """Places, first and second derivatives (3, k) at visits; no second ones where a rod ends."""
        after = self._following[visits]
        place, slope, width = self._points[:, visits], self._slopes[:, visits], self._width[visits]
        rise = self._points[:, after] - place
        is_end = self.is_end(visits)
        width = np.where(is_end, 1.0, width)
        bend = (6.0 * rise / width - 4.0 * slope - 2.0 * self._slopes[:, after]) / width
        return place, slope, np.where(is_end, 0.0, bend)

    def around(self, visits: Ints, reach: Floats, beyond: Floats) -> Floats:
        """Points (3, 2 · pieces + 1, k) on both sides of visits, and ``beyond`` the end of a rod straight on."""
        steps = (np.arange(_PIECES + 1) / _PIECES)[:, None] ** 2
        sides = []
        for is_ahead, beside in ((False, self._preceding[visits]), (True, self._following[visits])):
            start, stop = (visits, beside) if is_ahead else (beside, visits)
            first, last = self._points[:, start], self._points[:, stop]
            width = self._width[start]
            slope, rise = width * self._slopes[:, start], last - first
            turn = slope + width * self._slopes[:, stop]
            second, third = 3.0 * rise - slope - turn, turn - 2.0 * rise
            part = np.minimum(reach / width, 0.5) * steps
            t = part if is_ahead else 1.0 - part
            place = ((third[:, None] * t + second[:, None]) * t + slope[:, None]) * t + first[:, None]
            end = np.flatnonzero(beside < 0)
            tangent = unit_vectors(self._slopes[:, visits[end]].T).T
            straight = tangent[:, None] * (beyond[end] * steps)
            at = self._points[:, None, visits[end]]
            place[:, :, end] = at + straight if is_ahead else at - straight
            sides.append(place)
        return np.concatenate([sides[0][:, :0:-1], sides[1]], axis=1)
