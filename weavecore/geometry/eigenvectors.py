"""Eigenvectors of many symmetric 3 × 3 matrices by Jacobi's rotations.

They take sums, products, quotients and square roots alone, which every processor rounds alike; the last bits of LAPACK
differ from one to another.  All matrices are rotated at once: O(n).

Source: Golub and Van Loan 2013, *Matrix Computations*, §8.5.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats

_SWEEPS = 8
"""Five are enough for the last bit: the method converges quadratically."""


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
    rotated, vectors = matrices.copy(), np.tile(np.eye(3), (len(matrices), 1, 1))
    for _ in range(_SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            # The smaller of the two angles that bring the entry beside the diagonal to 0.
            difference, double = rotated[:, q, q] - rotated[:, p, p], 2.0 * rotated[:, p, q]
            sign = np.where(difference < 0, -1.0, 1.0)
            size = np.abs(difference) + np.sqrt(difference * difference + double * double)
            tangent = sign * double / np.where(size == 0, 1.0, size)
            cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
            sine = tangent * cosine
            for columns in (rotated, rotated.transpose(0, 2, 1), vectors):
                one, other = columns[:, :, p].copy(), columns[:, :, q].copy()
                columns[:, :, p] = cosine[:, None] * one - sine[:, None] * other
                columns[:, :, q] = sine[:, None] * one + cosine[:, None] * other
    least = np.argmin(np.diagonal(rotated, axis1=1, axis2=2), axis=1)
    found: Floats = np.take_along_axis(vectors, least[:, None, None], axis=2)[:, :, 0]
    return found
