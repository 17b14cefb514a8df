"""NURBS curves and surfaces against the recursion of Cox and de Boor, circles, spheres and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weavecore.geometry.nurbs import (
    NurbsCurve,
    NurbsSurface,
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


def cox_de_boor(knots: np.ndarray, degree: int, i: int, t: float) -> float:
    """Basis function ``i`` by its definition."""
    if degree == 0:
        return float(knots[i] <= t < knots[i + 1])
    left, right = knots[i + degree] - knots[i], knots[i + degree + 1] - knots[i + 1]
    value = 0.0
    if left > 0:
        value += (t - knots[i]) / left * cox_de_boor(knots, degree - 1, i, t)
    if right > 0:
        value += (knots[i + degree + 1] - t) / right * cox_de_boor(knots, degree - 1, i + 1, t)
    return value


def test_a_curve_and_a_surface_are_sums_of_basis_functions_by_their_definition():
    surface = wavy()
    uv = grid(surface, 4)
    for point, (u, v) in zip(surface_points(surface, uv), uv.tolist()):
        by_u = [cox_de_boor(surface.knots[0], 3, i, u) for i in range(6)]
        by_v = [cox_de_boor(surface.knots[1], 2, j, v) for j in range(5)]
        sums = np.einsum("i,j,ijc->c", by_u, by_v, surface.points)
        assert point == pytest.approx(sums[:3] / sums[3], abs=1e-13)
    knots = np.array([0, 0, 0, 0, 1, 2.5, 2.5, 3, 4, 4, 4, 4.0])
    curve = NurbsCurve(3, knots, np.random.default_rng(1).uniform(0.5, 1.5, (8, 3)))
    for t in np.linspace(0, 3.99, 30).tolist():
        sums = np.array([cox_de_boor(knots, 3, i, t) for i in range(8)]) @ curve.points
        assert curve_points(curve, np.array([t]))[0] == pytest.approx(sums[:2] / sums[2], abs=1e-13)


def test_basis_functions_add_up_to_one_and_their_derivatives_to_zero():
    knots = np.array([0, 0, 0, 0, 1, 2.5, 2.5, 3, 4, 4, 4, 4.0])
    weights = np.random.default_rng(2).uniform(0.5, 2, (8, 8, 1))
    surface = NurbsSurface((3, 3), (knots, knots), np.array([1.0, 2.0, 3.0, 1.0]) * weights)
    uv = np.column_stack([np.linspace(0, 4, 41), np.linspace(4, 0, 41)])
    jet = surface_jet(surface, uv, 2)
    assert jet.point == pytest.approx(np.tile([1.0, 2.0, 3.0], (41, 1)), abs=1e-14)
    for derivative in (jet.du, jet.dv, jet.duu, jet.duv, jet.dvv):
        assert np.abs(derivative).max() <= 1e-11


def test_derivatives_above_the_degree_are_zero():
    plane = NurbsSurface((1, 1), (np.array([0, 0, 1, 1.0]),) * 2, np.ones((2, 2, 4)))
    jet = surface_jet(plane, np.array([[0.3, 0.7]]), 2)
    assert (jet.duu == 0).all()
    assert (jet.dvv == 0).all()


def test_no_parameters_give_no_points():
    assert surface_points(wavy(), np.zeros((0, 2))).shape == (0, 3)
    assert curve_points(NurbsCurve(2, ARC_KNOTS, QUARTER), np.zeros(0)).shape == (0, 2)


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
