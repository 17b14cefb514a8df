"""`BentRods`: splines of rods, and their curvatures at any diameter.

The axis is the spline through the ties, which is the curve that a thin rod takes between them (least bending energy, to
first order).  On a span the second derivative is linear, so the curvature is greatest at a tie or near the middle of
the span; it is sampled densely enough for both.

A thicker rod undulates more: at each tie the axis is shifted out of the surface by a multiple of the diameter.  The
spline is linear in the places that it goes through, ``r(t; f) = a(t) + f b(t)`` for diameters f times as large, so the
curvature as a function of f follows from one more fit.

Source: splines, de Boor 1978.  Linear in the visits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Optional, Union

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.splines import (
    SplineRows,
    fit_derivatives,
    polynomial_values,
    slope_polynomials,
    span_ends,
    squares_of,
)
from weavecore.model.bending import Material
from weavecore.polling import each

SAMPLES_PER_SPAN = 8
"""Samples of each span, its first end included: with 16 the least radius of the samples' rods moves by under 0.5 %.
The last end is the first of the next span, or the end of a rod, where it is straight."""

SPANS_AT_ONCE = 2048
"""Spans between two polls; their arrays fit into a processor's cache."""

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class BentRods:
    """Splines of rods, with what they change by as the rods grow thicker.

    Parameters
    ----------
    points : (M, 3) float64
        Of the axes at the visits.
    rows : SplineRows
        Through the points.
    shift : (M, 3) float64
        By which the points are out of the surface; it grows with the diameters.
    offsets : (S+1,) int64
    closed : (S,) bool
    diameters : (S,) float64
        Of the rods, in the model's unit.
    material : Material
    """

    points: Floats
    rows: SplineRows
    shift: Floats
    offsets: Ints
    closed: Bools
    diameters: Floats
    material: Material

    @cached_property
    def spans(self) -> tuple[Ints, Ints, Floats]:
        """First and last visit (n,) of each span, and its width by the parameter."""
        return span_ends(self.rows.parameters, self.offsets, self.closed, self.rows.ends)

    @cached_property
    def rod(self) -> Ints:
        """(n,) rod of each span."""
        return rows_of(self.offsets)[self.spans[0]]

    @cached_property
    def least_radius(self) -> Floats:
        """(S,) that the material allows."""
        return self.material.least_bend * self.diameters

    @cached_property
    def shift_slopes(self) -> Floats:
        """(M, 3) derivatives of the shifts, over the parameters of the axes."""
        start, _, width = self.spans
        chord = np.ones(len(self.points))
        chord[start] = width
        return fit_derivatives(self.shift, self.offsets, self.closed, chord)

    def curvatures(self, spans: Ints, grown: Optional[Floats] = None) -> Floats:
        """Curvatures (8, n) of the samples of some spans, of rods whose diameters have grown by (n,); 0 at standstill.

        The derivative of a cubic is of degree 2, the square of its length of degree 4, and so is that of its vector
        product with the second derivative.
        """
        start, stop, width = self.spans
        places, derivatives = np.ascontiguousarray(self.points.T), np.ascontiguousarray(self.rows.derivatives.T)
        shifts = None if grown is None else (np.ascontiguousarray(self.shift.T), self.shift_slopes.T.copy())
        squares = np.empty((SAMPLES_PER_SPAN, len(spans)))
        for begin in each(range(0, len(spans), SPANS_AT_ONCE)):
            part = slice(begin, begin + SPANS_AT_ONCE)
            some = spans[part]
            slopes = slope_polynomials(places, derivatives, start[some], stop[some], width[some])
            if grown is not None and shifts is not None:
                more = slope_polynomials(shifts[0], shifts[1], start[some], stop[some], width[some])
                slopes += (grown[part] - 1.0) * more
            one, two, three = slopes
            turns = squares_of(
                np.stack([cross_of_columns(one, two), 2.0 * cross_of_columns(one, three), cross_of_columns(two, three)])
            )
            speeds = squares_of(slopes)
            for k in range(SAMPLES_PER_SPAN):
                t = k / SAMPLES_PER_SPAN
                speed, turn = (np.maximum(polynomial_values(one, t), 0.0) for one in (speeds, turns))
                cube = np.maximum(speed * speed * speed, _TINY)
                squares[k, part] = np.where(speed > 0.0, turn / cube, 0.0)
            squares[:, part] /= width[some] ** 2
        return np.sqrt(squares)

    def halves_too_sharp(self, spans: Ints, factor: Floats) -> Bools:
        """Whether the halves (2, n) of some spans are bent too sharply when the diameters are ``factor`` (n,) times."""
        sharp = self.curvatures(spans, factor) * (self.least_radius[self.rod[spans]] * factor) > 1.0
        halves: Bools = np.logical_or.reduce(sharp.reshape(2, SAMPLES_PER_SPAN // 2, -1), axis=1)
        return halves

    def greatest_at_visits(self, halves: Union[Floats, Bools]) -> Any:
        """The greater of the values (2, n) of half spans on both sides of each visit (M,); 0 where there is none."""
        start, stop, _ = self.spans
        values = np.zeros(len(self.points), halves.dtype)
        for at, half in ((start, halves[0]), (stop, halves[1])):  # Each visit begins and ends one span at most.
            values[at] = np.maximum(values[at], half)
        return values


def cross_of_columns(a: Floats, b: Floats) -> Floats:
    """Cross products of vectors (3, n, k)."""
    product: Floats = np.stack([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])
    return product
