"""`WrittenAxes`: the curves through the points of axes.csv, and what the checks measure on them.

The points of a rod, at stations s, are interpolated by a cubic spline in s.  *Curvature* is that of the circle through
three points in a row.  Where they lie within the rounding of the file of a straight line, it is what is left of their
sag h over a chord of length c after the rounding is taken off::

    curvature ≈ 8 h / c²,      h → max(h - 2 · ROUNDING, 0)

The *nearest points* of two rods a and b are found from stations (s, t) by Gauss and Newton's method: the two curves
are replaced by their tangents, u and v, and (s, t) moves to where these are nearest, within a reach.  Everything is
linear in the points or pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, dots, offsets_of, range_maxima, rows_of, unit_vectors
from weavecore.geometry.splines import cubic_curvatures, cubic_points, fit_derivatives

AXIS_DIGITS = 6
"""Points of the axes are written to a nanometre: their curvature is measured again from three points in a row, which
lie a few millimetres apart, and a micrometre would move a radius of 100 mm by percents."""

BENDING_TOLERANCE = 0.05
"""Part of a curvature by which the one measured on the points may be off: the circle through three points that are a
few millimetres apart is that close to the curve."""

_ROUNDING = 10.0**-AXIS_DIGITS
_GAUSS = np.polynomial.legendre.leggauss(3)
"""Nodes and weights on [-1, 1], exact for polynomials of degree 5."""

_NEAREST_ROUNDS = 6
"""Rounds of Gauss and Newton: rods turn by little on the few diameters about a joint, so that each round squares the
error, which begins at a part of a diameter."""

_NEARLY_PARALLEL = 1e-6
"""Squared sine of the angle (0.06°) below which only one of two nearest points moves: parallel rods are as near
everywhere."""


@dataclass(frozen=True, eq=False)
class WrittenAxes:
    """Points along the axes, by rod and station; of a ring the first comes again at the end.

    Parameters
    ----------
    ids : tuple of str
        The R rods in the order of the file.
    offsets : (R+1,) int64
        The points of ``ids[k]`` are ``offsets[k]:offsets[k + 1]``.
    closed : (R,) bool
    stations, layer_offsets : (n,) float64
    points : (n, 3) float64
    """

    ids: tuple[str, ...]
    offsets: Ints
    closed: Bools
    stations: Floats
    points: Floats
    layer_offsets: Floats

    @classmethod
    def of(
        cls, rods: list[str], stations: Floats, points: Floats, layer_offsets: Floats, closed: set[str]
    ) -> WrittenAxes:
        """Group the rows (n) of ``axes.csv`` by the names of their rods; ``closed`` are the names of the rings."""
        names = np.array(rods)
        starts = np.flatnonzero(np.append(True, names[1:] != names[:-1])) if len(names) else np.zeros(0, np.int64)
        offsets = np.append(starts, len(names)).astype(np.int64)
        ids = tuple(names[starts].tolist())
        is_closed = np.array([rod in closed for rod in ids], bool)
        return cls(ids, offsets, is_closed, stations, points, layer_offsets)

    def rod(self, k: int) -> slice:
        """The rows of a rod."""
        return slice(int(self.offsets[k]), int(self.offsets[k + 1]))

    @cached_property
    def rod_of(self) -> dict[str, int]:
        """The index of each rod in ``ids``."""
        return {name: k for k, name in enumerate(self.ids)}

    @cached_property
    def ends(self) -> Floats:
        """(R,) the last station of each rod."""
        return self.stations[self.offsets[1:] - 1]

    @cached_property
    def spans(self) -> Ints:
        """(m,) the rows at which the straight or curved parts between two points of a rod begin."""
        rod = rows_of(self.offsets)
        begins: Ints = np.flatnonzero(rod[1:] == rod[:-1])
        return begins

    @cached_property
    def is_rising(self) -> Bools:
        """(R,) whether the stations of each rod rise; where they do not, it has no spline."""
        falls = np.add.reduceat(np.append(np.diff(self.stations) <= 0, False), self.offsets[:-1])
        last = np.append(np.diff(self.stations) <= 0, False)[self.offsets[1:] - 1]
        rising: Bools = falls - last == 0
        return rising

    @cached_property
    def derivatives(self) -> Floats:
        """(n, 3) of the splines by the station; chords where stations do not rise."""
        # The last point of a ring is its first one again: a periodic spline has it once.
        counts = np.diff(self.offsets) - self.closed
        keep = np.ones(len(self.stations), bool)
        keep[(self.offsets[1:] - 1)[self.closed]] = False
        offsets = offsets_of(counts)
        width = np.append(np.diff(self.stations), 1.0)
        is_bad = ~self.is_rising[rows_of(self.offsets)]
        width = np.where(is_bad, 1.0, width)[keep]
        width[offsets[1:][~self.closed] - 1] = 1.0
        found = np.zeros_like(self.points)
        found[keep] = fit_derivatives(self.points[keep], offsets, self.closed & (counts > 2), width)
        found[(self.offsets[1:] - 1)[self.closed]] = found[self.offsets[:-1][self.closed]]
        return found

    @cached_property
    def lengths(self) -> Floats:
        """(R,) arc lengths of the splines, by Gauss-Legendre quadrature; of the chords where stations do not rise."""
        a = self.spans
        chord = np.linalg.norm(self.points[a + 1] - self.points[a], axis=1)
        width = self.stations[a + 1] - self.stations[a]
        rod = rows_of(self.offsets)[a]
        rising = self.is_rising[rod]
        width = np.where(rising, width, 1.0)
        speed = np.zeros(len(a))
        for x, weight in zip(*_GAUSS):
            slope = self._hermite(a, width, np.full(len(a), (1 + x) / 2))[1]
            speed += weight * np.sqrt(dots(slope, slope))
        part = np.where(rising, speed * width / 2, chord)
        total: Floats = np.bincount(rod, part, minlength=len(self.ids)).astype(np.float64)
        return total

    def _hermite(self, span: Ints, width: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Points and derivatives (m, 3) at parts t (m,) of spans (m,)."""
        p, d = self.points, self.derivatives
        return cubic_points(p[span], p[span + 1], d[span], d[span + 1], width, t)

    @cached_property
    def curvatures(self) -> Floats:
        """(n,) at each point; 0 at the ends of open rods."""
        first, last = self.offsets[:-1], self.offsets[1:] - 1
        before, after = np.arange(len(self.points)) - 1, np.arange(len(self.points)) + 1
        is_ring = self.closed & (last - first > 2)
        before[first[is_ring]], after[last[is_ring]] = last[is_ring] - 1, first[is_ring] + 1
        inside = np.ones(len(self.points), bool)
        inside[first[~is_ring]] = inside[last[~is_ring]] = False
        b = np.flatnonzero(inside)
        u, v = self.points[b] - self.points[before[b]], self.points[after[b]] - self.points[b]
        chord = u + v
        twice_area = np.linalg.norm(np.cross(u, v), axis=1)
        base = np.sqrt(dots(chord, chord))
        sag = np.divide(twice_area, base, out=np.zeros(len(b)), where=base > 0)
        kept = np.divide(np.maximum(sag - 2 * _ROUNDING, 0.0), sag, out=np.zeros(len(b)), where=sag > 0)
        sides = np.sqrt(dots(u, u) * dots(v, v)) * base
        found = np.zeros(len(self.points))
        found[b] = np.divide(2.0 * twice_area, sides, out=np.zeros(len(b)), where=sides > 0) * kept
        return found

    @cached_property
    def least_radii(self) -> Floats:
        """(R,) the least radius of each rod, infinite for a straight one."""
        if not self.ids:
            return np.zeros(0)
        greatest = np.maximum.reduceat(self.curvatures, self.offsets[:-1])
        radii: Floats = np.divide(1.0, greatest, out=np.full(len(greatest), np.inf), where=greatest > 0)
        return radii

    def greatest_curvatures(self, rod: int, low: Floats, high: Floats) -> Floats:
        """(m,) the greatest curvature of a rod between stations (m,), which may go around a ring."""
        part = self.rod(rod)
        stations, values = self.stations[part], self.curvatures[part]
        if self.closed[rod]:
            length = float(self.ends[rod])
            stations = np.concatenate([stations[:-1] - length, stations[:-1], stations + length])
            values = np.concatenate([values[:-1], values[:-1], values])
        inside = range_maxima(values, np.searchsorted(stations, low), np.searchsorted(stations, high, side="right"))
        span, width, t = self._spans_at(np.full(2 * len(low), rod), np.concatenate([low, high]))
        p, d = self.points, self.derivatives
        ends = cubic_curvatures(p[span], p[span + 1], d[span], d[span + 1], width, t).reshape(2, -1)
        greatest: Floats = np.maximum(inside, ends.max(0))
        return greatest

    @cached_property
    def _keys(self) -> tuple[float, Floats]:
        """A shift that is longer than all stations, and the stations of all rods as one rising sequence."""
        shift = float(self.stations.max(initial=0.0)) + 1.0
        return shift, rows_of(self.offsets) * shift + self.stations

    def rows_at(self, rods: Sequence[str], stations: Floats) -> Ints:
        """(m,) the row nearest to the station of a rod, for m rods and stations."""
        shift, key = self._keys
        wanted = np.array([self.rod_of[rod] for rod in rods], np.int64) * shift + stations
        after = np.clip(np.searchsorted(key, wanted), 1, len(key) - 1)
        nearest: Ints = np.where(np.abs(key[after - 1] - wanted) <= np.abs(key[after] - wanted), after - 1, after)
        return nearest

    def at(self, rod: Ints, station: Floats) -> tuple[Floats, Floats]:
        """Points and unit tangents (m, 3) at stations of rods (m,), which go around rings and stop at open ends."""
        span, width, t = self._spans_at(rod, station)
        point, slope = self._hermite(span, width, t)
        return point, unit_vectors(slope)

    def _spans_at(self, rod: Ints, station: Floats) -> tuple[Ints, Floats, Floats]:
        """The span (m,) at stations of rods, its width in stations, and the part of it, from 0 to 1."""
        end = self.ends[rod]
        station = np.where(self.closed[rod], station % end, np.clip(station, 0.0, end))
        shift, key = self._keys
        span = np.searchsorted(key, rod * shift + station, side="right") - 1
        span = np.clip(span, self.offsets[:-1][rod], self.offsets[1:][rod] - 2)
        width = np.maximum(self.stations[span + 1] - self.stations[span], np.finfo(float).tiny)
        return span, width, np.clip((station - self.stations[span]) / width, 0.0, 1.0)

    def gaps(self, rods: Ints, stations: Floats, reach: Floats) -> Floats:
        """(m,) the least distance of two rods near a station of each.

        Parameters
        ----------
        rods : (m, 2) int64
        stations : (m, 2) float64
            Where the search begins.
        reach : (m, 2) float64
            How far it goes along each rod.
        """
        (a, b), (s, t) = rods.T, stations.T.copy()
        low, high = (stations - reach).T, (stations + reach).T
        least = np.full(len(rods), np.inf)
        for _ in range(_NEAREST_ROUNDS):
            (p, u), (q, v) = self.at(a, s), self.at(b, t)
            apart = q - p
            least = np.minimum(least, np.sqrt(dots(apart, apart)))
            cosine, along, across = dots(u, v), dots(u, apart), dots(v, apart)
            sine = 1.0 - cosine**2
            move = np.divide(along - cosine * across, sine, out=np.zeros(len(s)), where=sine > _NEARLY_PARALLEL)
            move = np.clip(s + move, low[0], high[0]) - s
            other = np.clip(t + cosine * move - across, low[1], high[1]) - t
            # One end of the reach may stop the other rod's nearest point short of its own.
            s, t = np.clip(s + along + cosine * other, low[0], high[0]), t + other
        return least
