from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from weavecore.geometry.arrays import offsets_of
from weavecore.geometry.splines import DEGREE, as_b_splines, b_spline_points, fit_splines


def test_points_of_b_splines_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    counts = [2, 5, 9, 4]
    closed = np.array([False, False, True, True])
    points, offsets = rng.normal(size=(sum(counts), 3)), offsets_of(counts)
    fitted = fit_splines(points, offsets, closed)
    splines = as_b_splines(fitted, points, offsets, closed)
    row = np.repeat(np.arange(4), 50)
    at = rng.uniform(0.0, 1.0, len(row)) * fitted.ends[row]
    at[::50], at[49::50] = 0.0, fitted.ends
    found = b_spline_points(splines, row, at)
    for r in range(4):
        knots = splines.knots[splines.knot_offsets[r] : splines.knot_offsets[r + 1]]
        controls = splines.controls[splines.control_offsets[r] : splines.control_offsets[r + 1]]
        np.testing.assert_allclose(found[row == r], BSpline(knots, controls, DEGREE)(at[row == r]), atol=1e-12)
