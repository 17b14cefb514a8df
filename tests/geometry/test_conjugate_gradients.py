"""Conjugate gradients: the solution to the tolerance, and the flag where there are too few iterations."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, diags

from weavecore.geometry.conjugate_gradients import conjugate_gradients

N = 200


def laplacian() -> csr_matrix:
    return csr_matrix(diags([np.full(N - 1, -1.0), np.full(N, 2.1), np.full(N - 1, -1.0)], [-1, 0, 1]))


def test_the_residual_is_within_the_tolerance_with_and_without_a_preconditioner() -> None:
    matrix, right = laplacian(), np.random.default_rng(3).normal(size=N)
    for precondition in (None, lambda rest: rest / 2.1):
        found, is_solved = conjugate_gradients(
            matrix, right, tolerance=1e-8, most_iterations=400, precondition=precondition
        )
        assert is_solved
        assert np.linalg.norm(matrix @ found - right) <= 1.01e-8 * np.linalg.norm(right)


def test_too_few_iterations_are_told() -> None:
    matrix, right = laplacian(), np.random.default_rng(3).normal(size=N)
    assert not conjugate_gradients(matrix, right, tolerance=1e-8, most_iterations=5)[1]


def test_a_right_hand_side_of_zeros_gives_zeros() -> None:
    found, is_solved = conjugate_gradients(laplacian(), np.zeros(N), tolerance=1e-8, most_iterations=5)
    assert is_solved
    assert not found.any()
