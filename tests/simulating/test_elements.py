from __future__ import annotations

from typing import Optional

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from single_rods import crossing_rods
from weavecore.simulating.structure import Forces

SMALL = 1e-6


FRICTIONS = [(0, None), (1, None), (2, None), (0, 2.0), (1, 2.0)]


@pytest.mark.parametrize(("seed", "friction"), FRICTIONS)
def test_gradient_is_the_derivative_of_the_energy(seed: int, friction: Optional[float]) -> None:
    structure, x = crossing_rods(seed, friction=friction)
    gradient = structure.gradient(x)
    for at in np.ndindex(*x.shape):
        step = np.zeros_like(x)
        step[at] = SMALL
        slope = (structure.energy(x + step) - structure.energy(x - step)) / (2 * SMALL)
        assert abs(slope - gradient[at]) < 1e-6 * np.abs(gradient).max()


@pytest.mark.parametrize(("seed", "friction"), FRICTIONS)
def test_hessian_is_the_derivative_of_the_gradient_on_free_coordinates(seed: int, friction: Optional[float]) -> None:
    structure, x = crossing_rods(seed, friction=friction)
    hessian = structure.hessian(x).toarray()
    assert hessian.shape == (45, 45)
    for column, coordinate in enumerate(structure.free):
        step = np.zeros(x.size)
        step[coordinate] = SMALL
        ahead, behind = (structure.gradient(x + sign * step.reshape(-1, 3)) for sign in (1, -1))
        slope = ((ahead - behind) / (2 * SMALL)).ravel()[structure.free]
        assert np.abs(slope - hessian[:, column]).max() < 1e-6 * np.abs(hessian).max()


def test_forces_after_a_step_are_exact_to_first_order() -> None:
    structure, x = crossing_rods()
    step = np.random.default_rng(9).normal(size=x.shape)
    errors = []
    for size in (1e-3, 1e-4):
        guess, exact = structure.forces_after(x, size * step), structure.forces(x + size * step)
        errors.append(max(np.abs(guess.axial - exact.axial).max(), np.abs(guess.tie - exact.tie).max()))
    assert errors[1] < errors[0] / 80


def test_hessian_takes_the_forces_that_are_passed() -> None:
    structure, x = crossing_rods()
    own = structure.forces(x)
    assert np.abs((structure.hessian(x) - structure.hessian(x, own)).toarray()).max() < 1e-12
    doubled = structure.hessian(x, Forces(2 * own.axial, 2 * own.tie)).toarray()
    none = structure.hessian(x, Forces(0 * own.axial, 0 * own.tie)).toarray()
    assert np.allclose(doubled - structure.hessian(x).toarray(), structure.hessian(x).toarray() - none, atol=1e-9)


def test_rigid_motion_changes_no_energy_and_turns_the_forces() -> None:
    structure, x = crossing_rods()
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    moved = x @ turn.T + [3.0, -2.0, 5.0]
    assert structure.elastic_energy(moved) == pytest.approx(structure.elastic_energy(x), rel=1e-12)
    inner, inner_moved = structure.gradient(x) + structure.loads, structure.gradient(moved) + structure.loads
    assert np.allclose(inner_moved, inner @ turn.T, atol=1e-9)
    # Inner forces are in balance, in force and in moment: also across the gaps of the ties.
    assert np.abs(inner.sum(0)).max() < 1e-9
    assert np.abs(np.cross(x, inner).sum(0)).max() < 1e-9


def test_convex_hessian_has_no_negative_eigenvalue_where_the_exact_one_has() -> None:
    structure, x = crossing_rods()
    assert np.linalg.eigvalsh(structure.hessian(x).toarray()).min() < -0.1
    assert np.linalg.eigvalsh(structure.hessian(x, convex=True).toarray()).min() > -1e-9
