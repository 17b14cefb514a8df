"""Rods whose shape is known: what the solver finds must be what Euler and Kirchhoff found."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from single_rods import rod
from weavecore.simulating.buckling import first_buckling_factor
from weavecore.simulating.elements import half_angle_tangents
from weavecore.simulating.newton import factorised, find_equilibrium


def cantilever_tip(load: float) -> np.ndarray:
    """Tip of a cantilever of length 1 and EI = 1 along x with a load along -y: theta'' = load cos theta."""

    def shoot(curvature: float) -> np.ndarray:
        path = solve_ivp(
            lambda _, y: [y[1], load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])],
            (0, 1), [0, curvature, 0, 0], rtol=1e-11, atol=1e-12,
        )  # fmt: skip
        return path.y[:, -1]

    # At the clamp the moment is the load times a lever of 1 at most.
    root = brentq(lambda curvature: shoot(curvature)[1], -load, 0.0, xtol=1e-13)
    return shoot(root)[2:]


@pytest.mark.parametrize("load", [1.0, 2.0, 5.0, 10.0])
def test_cantilever_follows_the_elastica(load: float) -> None:
    n = 200
    step = 1 / (n - 0.5)  # The clamp is in the middle of the first segment, which is held.
    x = np.c_[step * (np.arange(n + 1) - 0.5), np.zeros((n + 1, 2))]
    fixed, loads = np.zeros((n + 1, 3), bool), np.zeros((n + 1, 3))
    fixed[:2] = True
    loads[-1, 1] = -load
    found = find_equilibrium(rod(n + 1, step, fixed=fixed, loads=loads), x)
    assert found.is_converged
    assert found.n_negative == 0
    assert np.abs(found.points[-1, :2] - cantilever_tip(load)).max() < 5e-5
    assert found.n_steps <= 25


@pytest.mark.parametrize("span", [0.9, 0.7, 0.5, 0.3, 0.2])
def test_pinned_rod_follows_the_elastica(span: float) -> None:
    k = np.sqrt(brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - span, 1e-6, 0.99))
    height, curvature = k / ellipk(k * k), 4 * k * ellipk(k * k)
    n = 400
    x = np.zeros((n + 1, 3))
    x[:, 0] = np.linspace(0, span, n + 1)
    x[:, 2] = height * np.sin(np.pi * np.linspace(0, 1, n + 1))
    fixed = np.zeros((n + 1, 3), bool)
    fixed[[0, -1]] = True
    fixed[:, 1] = True
    structure = rod(n + 1, 1 / n, fixed=fixed, stretching=1e9)
    found = find_equilibrium(structure, x)
    assert found.is_converged
    assert found.n_negative == 0
    assert found.points[:, 2].max() == pytest.approx(height, abs=1e-5)
    assert (half_angle_tangents(found.points, structure.bends) * n).max() == pytest.approx(curvature, rel=1e-4)


def test_closed_rod_springs_to_a_circle_with_its_energy() -> None:
    n = 128
    at = 2 * np.pi * np.arange(n) / n
    x = np.c_[1.3 * np.cos(at), 0.75 * np.sin(at), np.zeros(n)]
    fixed = np.zeros((n, 3), bool)
    fixed[:, 2] = True
    fixed[0], fixed[n // 2, 1] = True, True
    structure = rod(n, 1 / n, closed=True, fixed=fixed)
    found = find_equilibrium(structure, x / 6.5)
    assert found.is_converged
    centre = found.points.mean(0)
    radius = np.linalg.norm(found.points - centre, axis=1)
    assert np.ptp(radius) < 1e-8
    assert structure.elastic_energy(found.points) == pytest.approx(2 * np.pi**2, rel=4.1e-4)


@pytest.mark.parametrize(("part", "n_negative"), [(0.995, 0), (1.005, 2), (3.98, 2), (4.02, 4)])
def test_straight_rod_loses_stability_at_the_loads_of_euler(part: float, n_negative: int) -> None:
    n = 100
    load = part * np.pi**2
    fixed = np.zeros((n + 1, 3), bool)
    fixed[0], fixed[-1, 1:] = True, True
    structure = rod(n + 1, 1 / n, fixed=fixed)
    x = np.c_[np.linspace(0, 1 - load / 1e8, n + 1), np.zeros((n + 1, 2))]
    assert factorised(structure, structure.hessian(x))[1] == n_negative


def test_first_buckling_factor_of_a_straight_rod_is_that_of_euler() -> None:
    n = 100
    fixed, loads = np.zeros((n + 1, 3), bool), np.zeros((n + 1, 3))
    fixed[0], fixed[-1, 1:] = True, True
    loads[-1, 0] = -2.0
    structure = rod(n + 1, 1 / n, fixed=fixed, loads=loads)
    found = find_equilibrium(structure, np.c_[np.linspace(0, 1, n + 1), np.zeros((n + 1, 2))])
    assert first_buckling_factor(structure, found) == pytest.approx(np.pi**2 / 2, rel=1e-3)


def test_straight_rod_above_the_load_of_euler_leaves_its_saddle_for_a_stable_arch() -> None:
    n = 100
    fixed, loads = np.zeros((n + 1, 3), bool), np.zeros((n + 1, 3))
    fixed[0], fixed[-1, 1:], fixed[:, 1] = True, True, True
    loads[-1, 0] = -1.1 * np.pi**2
    found = find_equilibrium(
        rod(n + 1, 1 / n, fixed=fixed, loads=loads), np.c_[np.linspace(0, 1, n + 1), np.zeros((n + 1, 2))]
    )
    assert found.is_converged
    assert found.n_negative == 0
    # The elastica: load / pi^2 = (2 K / pi)^2 and height = k / K.
    m = brentq(lambda m: (2 * ellipk(m) / np.pi) ** 2 - 1.1, 1e-6, 0.9)
    assert np.abs(found.points[:, 2]).max() == pytest.approx(np.sqrt(m) / ellipk(m), rel=2e-3)
