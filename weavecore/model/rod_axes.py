"""`RodAxes`: the centre line of every rod as a smooth curve, and where it passes the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen, rows_of
from weavecore.geometry.splines import CurveSamples, sample_curves


@dataclass(frozen=True, eq=False)
class RodAxes:
    """Cubic splines, one a strand, twice continuously differentiable, also where a ring closes.

    Visits are the entries of ``strands.nodes``; between two of them a curve is one cubic.

    Parameters
    ----------
    offsets : (S+1,) int64
        Visits of strand ``s``: ``offsets[s]:offsets[s + 1]``.
    closed : (S,) bool
    points : (M, 3) float64
        The axis at each visit.
    derivatives : (M, 3) float64
        Derivative there by the parameter.
    parameters : (M,) float64
        Rising from 0 along each strand.
    ends : (S,) float64
        Parameter at the end of each strand; of a closed one where it returns to its first visit.
    knot_offsets : (S+1,) int64
    knots : (…,) float64
        Knots of each strand's B-spline of degree 3 in full form, four more than control points.
    control_offsets : (S+1,) int64
    controls : (…, 3) float64
        Control points; of a closed strand the first three are repeated at the end.
    stations : (M,) float64
        Arc length from the start of the strand to each visit.
    lengths : (S,) float64
        Arc length of each strand, once around for a closed one.
    layer_offsets : (M,) float64
        Distance of the axis from the surface at each visit, along the node's normal.
    """

    offsets: Ints
    closed: Bools
    points: Floats
    derivatives: Floats
    parameters: Floats
    ends: Floats
    knot_offsets: Ints
    knots: Floats
    control_offsets: Ints
    controls: Floats
    stations: Floats
    lengths: Floats
    layer_offsets: Floats

    def __post_init__(self) -> None:
        n, m = len(self.offsets) - 1, len(self.points)
        for name, dtype, shape in (
            ("offsets", np.int64, (n + 1,)),
            ("closed", np.bool_, (n,)),
            ("points", np.float64, (m, 3)),
            ("derivatives", np.float64, (m, 3)),
            ("parameters", np.float64, (m,)),
            ("ends", np.float64, (n,)),
            ("knot_offsets", np.int64, (n + 1,)),
            ("knots", np.float64, (-1,)),
            ("control_offsets", np.int64, (n + 1,)),
            ("controls", np.float64, (-1, 3)),
            ("stations", np.float64, (m,)),
            ("lengths", np.float64, (n,)),
            ("layer_offsets", np.float64, (m,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def strand(self) -> Ints:
        """(M,) strand of each visit."""
        return rows_of(self.offsets)

    def bspline(self, s: int) -> tuple[Floats, Floats]:
        """Knots (k + 4,) in full form and control points (k, 3) of strand ``s``, degree 3."""
        knots = self.knots[self.knot_offsets[s] : self.knot_offsets[s + 1]]
        return knots, self.controls[self.control_offsets[s] : self.control_offsets[s + 1]]

    def samples(self, step: float) -> CurveSamples:
        """Points no further than ``step`` apart along every axis, all visits among them."""
        return sample_curves(
            self.points, self.derivatives, self.parameters, self.offsets, self.closed, self.ends, step=step
        )
