"""`Springs`: a weave as lines between joints, for form finding and frame programs.

Each rod becomes straight lines from joint to joint with the length between its marks, `L`, and the stiffness `EA / L`;
each tie a line between the axes that it holds, as long as their gap.  A program adds bending itself from `EI`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen, next_in_loop, rows_of
from weavecore.model.weave import Weave


@dataclass(frozen=True, eq=False)
class Springs:
    """Lines along the rods (M), and lines of the ties (C), as drawn.

    Parameters
    ----------
    starts, ends : (M, 3) float64
        On the axes of the rods, in the model's unit.
    rod : (M,) int64
        The rod of each line; the lines of a rod follow one another.
    rest_length : (M,) float64
        Distance of the marks along the drawn axis.
    stiffness : (M,) float64
        In N for one unit of length.
    tie_starts, tie_ends : (C, 3) float64
        On the lower and on the upper rod.
    tie_stiffness : float
        In N for one unit of length: that of a median line.
    bending_stiffness : (S,) float64
        `EI` of each rod, in N times the unit of length squared.
    """

    starts: Floats
    ends: Floats
    rod: Ints
    rest_length: Floats
    stiffness: Floats
    tie_starts: Floats
    tie_ends: Floats
    tie_stiffness: float
    bending_stiffness: Floats

    def __post_init__(self) -> None:
        m, c = len(self.rest_length), len(self.tie_starts)
        for name, dtype, shape in (
            ("starts", np.float64, (m, 3)),
            ("ends", np.float64, (m, 3)),
            ("rod", np.int64, (m,)),
            ("rest_length", np.float64, (m,)),
            ("stiffness", np.float64, (m,)),
            ("tie_starts", np.float64, (c, 3)),
            ("tie_ends", np.float64, (c, 3)),
            ("bending_stiffness", np.float64, (-1,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))


def springs_of(weave: Weave, *, metres: float) -> Springs:
    """The lines of a weave.

    Parameters
    ----------
    weave : Weave
    metres : float
        In one unit of the model.

    Returns
    -------
    Springs
    """
    axes, strands, joints = weave.axes, weave.strands, weave.joints
    visit = np.arange(len(strands.nodes))
    after, rod = next_in_loop(strands.offsets), rows_of(strands.offsets)
    goes_on = strands.closed[rod] | (after > visit)
    start, stop = visit[goes_on], after[goes_on]
    end_station = np.where(stop > start, axes.stations[stop], axes.lengths[rod[start]] + axes.stations[stop])
    length = end_station - axes.stations[start]
    diameters, modulus = weave.diameters * metres, weave.material.modulus * 1e9
    stiffness = modulus * np.pi * diameters[rod[start]] ** 2 / 4 / length
    lower, upper = joints.visit[joints.contacts].reshape(-1, 2).T
    return Springs(
        starts=axes.points[start],
        ends=axes.points[stop],
        rod=rod[start],
        rest_length=length,
        stiffness=stiffness,
        tie_starts=axes.points[lower],
        tie_ends=axes.points[upper],
        tie_stiffness=float(np.median(stiffness)),
        bending_stiffness=modulus * np.pi * diameters**4 / 64 / metres**2,
    )
