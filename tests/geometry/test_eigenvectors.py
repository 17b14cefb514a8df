"""Eigenvectors of small symmetric matrices."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.eigenvectors import least_eigenvectors


def test_the_least_eigenvectors_are_those_of_lapack() -> None:
    half = np.random.default_rng(1).standard_normal((500, 3, 3)) * 10.0 ** np.arange(-50, 50).repeat(5)[:, None, None]
    matrices = half + half.transpose(0, 2, 1)
    wanted = np.linalg.eigh(matrices)[1][:, :, 0]
    found = least_eigenvectors(matrices)
    assert np.abs(np.abs((found * wanted).sum(1)) - 1).max() < 1e-12
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=1e-14)


def test_matrices_without_one_least_eigenvalue_have_some_unit_vector() -> None:
    found = least_eigenvectors(np.stack([np.zeros((3, 3)), np.eye(3), np.diag([2.0, -1.0, -1.0])]))
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=1e-15)
    assert found[2, 0] == 0
