"""From the axes of a weave to points, segments and ties.

Between two joints an axis is cut at equal steps of its parameter.  A segment's rest length is its chord, times the
ratio of the mark's distance to the drawn one: so a weave that is cut as drawn begins without axial force, and the error
of segments of finite length is of second order.  Points are numbered along the rods, one rod after the other.
Open rods are taken between their outermost joints: the straight parts beyond carry nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Optional

import numpy as np
from scipy.interpolate import BSpline

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.model import RodAxes, Weave
from weavecore.simulating.elements import Bends, Scissors, Stretches, TieElements, scissor_cosines, tie_values

_TIE_STIFFNESS = 1.0
"""Of a tie against that of the median segment: so a tie gives way by microns, and the Hessian is no worse for it."""


_MICRO_SLIP = 5e-4
"""Part of a median segment by which a tie gives way before it slides: stiffer ones hold and slide in turn, and the
search does not converge."""

_LEAST_SINE = 0.05
"""Squared sine of the angle of nearly parallel rods: their spring would be infinitely stiff, their distance unclear."""


@dataclass(frozen=True, eq=False)
class RodPoints:
    """Points along the rods of a weave, in metres.

    Parameters
    ----------
    points : (n, 3) float64
        As drawn.
    offsets : (S+1,) int64
        Points of rod ``s``: ``offsets[s]:offsets[s + 1]``.
    closed : (S,) bool
    of_visit : (M,) int64
        The point of each visit of a joint, as in ``strands.nodes``.
    scale : (n,) float64
        Distance of the marks on either side over the drawn one, for the segment that begins at a point.
    """

    points: Floats
    offsets: Ints
    closed: Bools
    of_visit: Ints
    scale: Floats

    @cached_property
    def rod(self) -> Ints:
        """(n,) the rod of each point."""
        return rows_of(self.offsets)

    @cached_property
    def _is_last(self) -> Bools:
        last = np.zeros(len(self.points), bool)
        last[self.offsets[1:][~self.closed] - 1] = True
        return last

    @cached_property
    def after(self) -> Ints:
        """(n,) the next point along the rod; the point itself at the end of an open one."""
        after = next_in_loop(self.offsets)
        return np.where(self._is_last, np.arange(len(after)), after)

    @cached_property
    def before(self) -> Ints:
        """(n,) the point before along the rod; the point itself at the start of an open one."""
        before = np.arange(len(self.points))
        start, stop = self.segments.T
        before[stop] = start
        return before

    @cached_property
    def segments(self) -> Ints:
        """(M, 2) points at the ends of each segment."""
        start = np.flatnonzero(~self._is_last)
        return np.stack([start, self.after[start]], axis=1)

    @cached_property
    def rest_lengths(self) -> Floats:
        """(M,) length of each segment without force."""
        a, b = self.segments.T
        lengths: Floats = np.linalg.norm(self.points[b] - self.points[a], axis=1) * self.scale[a]
        return lengths

    @cached_property
    def widths(self) -> Floats:
        """(n,) half the rest lengths of the segments at each point."""
        half = np.repeat(self.rest_lengths / 2, 2)
        widths: Floats = np.bincount(self.segments.ravel(), half, len(self.points)).astype(np.float64)
        return widths

    @cached_property
    def inner(self) -> Ints:
        """(B,) points that have a segment on both sides."""
        index = np.arange(len(self.points))
        return np.flatnonzero((self.before != index) & (self.after != index))


def place_points(axes: RodAxes, *, segments: int, metres: float, stations: Optional[Floats] = None) -> RodPoints:
    """Points along all axes.

    Parameters
    ----------
    axes : RodAxes
    segments : int
        Between two visits.
    metres : float
        In one unit of the model.
    stations : (M,) float64, optional
        Marks instead of the drawn ones; those of a closed rod may not wrap around.
    """
    m = len(axes.points)
    is_last = np.zeros(m, bool)
    is_last[axes.offsets[1:][~axes.closed] - 1] = True
    first = offsets_of(np.where(is_last, 1, segments))
    visit = rows_of(first)
    after = next_in_loop(axes.offsets)
    wraps = after <= np.arange(m)
    end = np.where(wraps, axes.ends[axes.strand], axes.parameters[after])
    part = (np.arange(first[-1]) - first[visit]) / segments
    at = axes.parameters[visit] + part * (end - axes.parameters)[visit]
    offsets = first[axes.offsets]
    points = np.concatenate(
        [BSpline(*axes.bspline(s), 3)(at[offsets[s] : offsets[s + 1]]) for s in range(len(axes))] or [np.zeros((0, 3))]
    )
    scale = np.ones(m)
    if stations is not None:
        drawn = np.where(wraps, axes.lengths[axes.strand], axes.stations[after]) - axes.stations
        marked = np.where(wraps, (axes.lengths[axes.strand] + stations[after]), stations[after]) - stations
        scale[~is_last] = (marked / drawn)[~is_last]
    return RodPoints(points * metres, offsets, axes.closed, first[:-1], scale[visit])


def tie_points(weave: Weave, rods: RodPoints) -> Ints:
    """(T, 6) points of each contact: that of the lower rod and of the upper one, and those before and after each."""
    a, b = rods.of_visit[weave.joints.visit[weave.joints.contacts]].reshape(-1, 2).T
    return np.stack([a, b, rods.before[a], rods.after[a], rods.before[b], rods.after[b]], axis=1)


def elements_of(weave: Weave, rods: RodPoints, *, diameter: Floats) -> tuple[Bends, Stretches, TieElements]:
    """Bends, segments and ties of round, full rods of diameters (n,) in metres."""
    modulus = weave.material.modulus * 1e9
    area, inertia = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    inner = rods.inner
    triples = np.stack([rods.before[inner], inner, rods.after[inner]], axis=1)
    bends = Bends(triples, modulus * inertia[inner] / rods.widths[inner])
    stretches = Stretches(rods.segments, rods.rest_lengths, modulus * area[rods.segments[:, 0]] / rods.rest_lengths)
    points = tie_points(weave, rods)
    rest, _ = tie_values(rods.points, points)
    stiff = _TIE_STIFFNESS * modulus * float(np.median(area)) / float(np.median(rods.rest_lengths))
    return bends, stretches, TieElements(points, rest, np.full(rest.shape, stiff))


def scissors_of(points: Floats, ties: TieElements, stiffness: float) -> Scissors:
    """Springs of a torsional stiffness in N·m/rad at all ties, without moment as drawn (n, 3); none where it is 0."""
    beside = ties.points[:, 2:] if stiffness else np.zeros((0, 4), np.int64)
    cosine = scissor_cosines(points, beside)
    return Scissors(beside, cosine, stiffness / np.maximum(1.0 - cosine**2, _LEAST_SINE))


def let_ties_slide(rods: RodPoints, ties: TieElements, friction: Optional[float]) -> TieElements:
    """Let ties slide along rods where the force reaches a friction.

    Parameters
    ----------
    rods : RodPoints
    ties : TieElements
    friction : float, optional
        In N; without it all ties hold.

    Returns
    -------
    TieElements
        Those of nearly parallel rods hold all the same.
    """
    if friction is None:
        return ties
    crosses = 1.0 - scissor_cosines(rods.points, ties.points[:, 2:]) ** 2 > _LEAST_SINE
    stiffness = ties.stiffness.copy()
    softest = friction / (_MICRO_SLIP * float(np.median(rods.rest_lengths))) if friction else np.inf
    stiffness[crosses, 1:] = np.minimum(stiffness[crosses, 1:], softest)
    slides = replace(ties, stiffness=stiffness, friction=np.where(crosses, friction, np.inf))
    return replace(slides, rest=tie_values(rods.points, ties.points, slides.slides)[0])
