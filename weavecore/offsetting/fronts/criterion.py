"""Whether two segments cross: the sum of four angles (Yan et al. 2016, §4.3), and who decides in doubt.

Seen on a reference plane, the segments ab and cd cross where they are the diagonals of a convex
quadrilateral a c b d.  Its four inner angles sum up to 2π; four points in any other position give less.
The sum tends to 2π as well where the segments just touch, or miss each other by a hair: there
the sides on which the ends lie decide, in exact arithmetic where rounding could turn them.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

DOUBT = 1e-6
"""Radians below 2π down to which the sum of the angles leaves a crossing possible."""


def sum_of_four_angles(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Sum (n,) of the angles at the corners of the quadrilaterals a c b d, each between 0 and π.

    Parameters
    ----------
    a, b, c, d : (n, 2) float64
        Ends of the segments ab and cd on the reference plane.
    """
    total = np.zeros(len(a))
    for before, at, after in ((d, a, c), (a, c, b), (c, b, d), (b, d, a)):
        u, v = before - at, after - at
        total += np.abs(np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(1)))
    return total


def sides_of(a: Floats, b: Floats, points: Floats) -> Ints:
    """On which side of the lines from a to b points lie: 1 left, -1 right; on the line counts as left.

    The sign is that of the exact value of the coordinates given.
    """
    sides, is_sure = _sides_in(np.float64, a, b, points)
    rest = np.flatnonzero(~is_sure)
    # Where the machine has longer numbers these tell nearly all of the rest apart.
    sides[rest], is_sure = _sides_in(np.longdouble, a[rest], b[rest], points[rest])
    for k in rest[~is_sure].tolist():
        (ax, ay), (bx, by), (px, py) = (tuple(map(Fraction, q[k].tolist())) for q in (a, b, points))
        sides[k] = 1 if (bx - ax) * (py - ay) >= (by - ay) * (px - ax) else -1
    return sides


def _sides_in(kind: type, a: Floats, b: Floats, points: Floats) -> tuple[Ints, Bools]:
    """The sides by numbers of a kind, and where rounding cannot have turned them."""
    a, b, points = a.astype(kind), b.astype(kind), points.astype(kind)
    u, v = b - a, points - a
    one, other = u[:, 0] * v[:, 1], u[:, 1] * v[:, 0]
    # The differences are rounded as well: their errors are of the size of the coordinates.
    size = np.maximum(np.abs(a), np.maximum(np.abs(b), np.abs(points))).max(axis=1, initial=0)
    spread = np.abs(u).max(axis=1, initial=0) + np.abs(v).max(axis=1, initial=0)
    bound = 8 * np.finfo(kind).eps * (np.abs(one) + np.abs(other) + size * spread)
    in_line = ((u == 0) & (v == 0)).any(axis=1)  # with an axis, exactly
    return np.where(one >= other, 1, -1), np.asarray(in_line | (np.abs(one - other) > bound))


def ends_on_opposite_sides(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Whether each of the segments ab and cd (n, 2) has its ends on both sides of the other."""
    return np.asarray((sides_of(a, b, c) != sides_of(a, b, d)) & (sides_of(c, d, a) != sides_of(c, d, b)))


def segments_cross(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Which of the segments ab and cd (n, 2) cross: the sum of four angles first, then the sides."""
    crosses = sum_of_four_angles(a, b, c, d) > 2 * np.pi - DOUBT
    n = np.flatnonzero(crosses)
    crosses[n] = ends_on_opposite_sides(a[n], b[n], c[n], d[n])
    return crosses


def places_of_crossing(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Where on ab and where on cd, in 0 to 1, segments that cross do so."""
    u, v, w = b - a, d - c, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area = np.where(area == 0, np.finfo(float).tiny, area)
    on_first = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / area
    on_second = (w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / area
    return np.clip(on_first, 0.0, 1.0), np.clip(on_second, 0.0, 1.0)
