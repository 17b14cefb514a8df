"""Eigenvectors of many symmetric 3 × 3 matrices by Jacobi's rotations.

They take sums, products, quotients and roots alone, which every processor rounds alike: LAPACK's last bits differ from
one to another.  Source: Golub and Van Loan 2013, *Matrix Computations*, §8.5.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats

_SWEEPS = 8
"""The method converges quadratically: five are enough for the last bit."""


def least_eigenvectors(matrices: Floats) -> Floats:
    """Unit eigenvectors of the least eigenvalues.

    Parameters
    ----------
    matrices : (n, 3, 3) float64
        Symmetric.

    Returns
    -------
    (n, 3) float64
        Of either sign.
    """
    rest, vectors = matrices.copy(), np.tile(np.eye(3), (len(matrices), 1, 1))
    for _ in range(_SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            apart, double = rest[:, q, q] - rest[:, p, p], 2.0 * rest[:, p, q]
            way = np.where(apart < 0, -1.0, 1.0)
            size = np.abs(apart) + np.sqrt(apart * apart + double * double)
            tangent = way * double / np.where(size == 0, 1.0, size)
            cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
            sine = tangent * cosine
            for turned in (rest, rest.transpose(0, 2, 1), vectors):
                one, other = turned[:, :, p].copy(), turned[:, :, q].copy()
                turned[:, :, p] = cosine[:, None] * one - sine[:, None] * other
                turned[:, :, q] = sine[:, None] * one + cosine[:, None] * other
    least = np.argmin(np.diagonal(rest, axis1=1, axis2=2), axis=1)
    found: Floats = np.take_along_axis(vectors, least[:, None, None], axis=2)[:, :, 0]
    return found
