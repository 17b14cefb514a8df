"""NURBS curves and surfaces against circles, spheres and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weavecore.geometry.nurbs import (
    NurbsCurve,
    NurbsSurface,
    basis_functions,
    curve_points,
    greatest_curvature,
    surface_jet,
    surface_points,
)

W = math.sqrt(0.5)
QUARTER = np.array([[1, 0, 1], [W, W, W], [0, 1, 1]])
ARC_KNOTS = np.array([0, 0, 0, 1, 1, 1.0])


def octant(radius: float) -> NurbsSurface:
    """An eighth of a sphere: a quarter circle in height times a quarter circle around; its far side is the pole."""
    points = np.zeros((3, 3, 4))
    for j, (c, s, w) in enumerate(QUARTER):
        points[:, j, :2] = QUARTER[:, :2] * c * radius
        points[:, j, 2] = QUARTER[:, 2] * s * radius
        points[:, j, 3] = QUARTER[:, 2] * w
    return NurbsSurface((2, 2), (ARC_KNOTS, ARC_KNOTS), points)


def wavy(seed: int = 3) -> NurbsSurface:
    draw = np.random.default_rng(seed)
    points = np.ones((6, 5, 4))
    points[..., :3] = draw.uniform(-1, 1, (6, 5, 3))
    points[..., 3] = draw.uniform(0.5, 2, (6, 5))
    points[..., :3] *= points[..., 3:]
    return NurbsSurface(
        (3, 2), (np.array([0, 0, 0, 0, 1, 2, 3, 3, 3, 3.0]), np.array([0, 0, 0, 1, 1, 2, 2, 2.0])), points
    )


def grid(surface: NurbsSurface, n: int = 7) -> np.ndarray:
    ways = [np.linspace(*surface.domain(way), n + 2)[1:-1] + 1e-3 for way in (0, 1)]
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*ways)])


def test_basis_functions_add_up_to_one_and_their_derivatives_to_nothing():
    knots = np.array([0, 0, 0, 0, 1, 2.5, 2.5, 3, 4, 4, 4, 4.0])
    _, values = basis_functions(knots, 3, 8, np.linspace(0, 4, 41), 2)
    assert values[0].sum(1) == pytest.approx(1.0, abs=1e-14)
    assert np.abs(values[1:].sum(2)).max() <= 1e-11
    assert values[0].min() >= 0


def test_a_rational_quarter_is_a_circle():
    curve = NurbsCurve(2, ARC_KNOTS, QUARTER)
    points = curve_points(curve, np.linspace(0, 1, 50))
    assert np.hypot(*points.T) == pytest.approx(1.0, abs=1e-15)
    assert points[[0, -1]] == pytest.approx(np.array([[1, 0], [0, 1]]), abs=1e-15)


def test_parameters_beyond_the_domain_are_taken_to_its_ends():
    curve = NurbsCurve(2, ARC_KNOTS, QUARTER)
    assert curve_points(curve, np.array([-1.0, 2.0])) == pytest.approx(np.array([[1, 0], [0, 1]]), abs=1e-15)


def test_points_of_a_sphere_and_its_curvature():
    surface = octant(2.5)
    uv = grid(surface)
    assert np.linalg.norm(surface_points(surface, uv), axis=1) == pytest.approx(2.5, abs=1e-14)
    assert greatest_curvature(surface_jet(surface, uv, 2)) == pytest.approx(0.4, abs=1e-6)


def test_derivatives_are_those_of_finite_differences():
    surface = wavy()
    uv, h = grid(surface, 5), 1e-5
    jet = surface_jet(surface, uv, 2)
    right, left = (surface_jet(surface, uv + np.array([s * h, 0])) for s in (1, -1))
    above, below = (surface_jet(surface, uv + np.array([0, s * h])) for s in (1, -1))
    assert jet.du == pytest.approx((right.point - left.point) / (2 * h), abs=1e-6)
    assert jet.dv == pytest.approx((above.point - below.point) / (2 * h), abs=1e-6)
    assert jet.duu == pytest.approx((right.du - left.du) / (2 * h), abs=1e-5)
    assert jet.dvv == pytest.approx((above.dv - below.dv) / (2 * h), abs=1e-5)
    assert jet.duv == pytest.approx((above.du - below.du) / (2 * h), abs=1e-5)


def test_many_points_are_evaluated_as_one_is():
    surface = wavy()
    uv = np.random.default_rng(0).uniform(0, 2, (50_000, 2))
    assert surface_points(surface, uv)[-3:] == pytest.approx(surface_points(surface, uv[-3:]), abs=0)


def test_a_pole_has_no_curvature():
    surface = octant(1.0)
    uv = np.array([[0.3, 0.5], [0.3, 1.0]])
    curvature = greatest_curvature(surface_jet(surface, uv, 2))
    assert curvature == pytest.approx([1.0, 0.0], abs=1e-6)


def test_curvature_asks_for_second_derivatives():
    with pytest.raises(ValueError, match="second derivatives"):
        greatest_curvature(surface_jet(octant(1.0), np.array([[0.5, 0.5]])))
