"""Eigenvectors of many symmetric 3 × 3 matrices by Jacobi's rotations.

They take sums, products, quotients and square roots alone, which every processor rounds alike; the last bits of LAPACK
differ from one to another.  All matrices are rotated at once: O(n).

Source: Golub and Van Loan 2013, *Matrix Computations*, §8.5.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats

_SWEEPS = 6
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
    # Entries in arrays of their own, one value a matrix: several times as fast as short rows.
    rotated, vectors = np.ascontiguousarray(matrices.transpose(1, 2, 0)), np.zeros((3, 3, len(matrices)))
    vectors[[0, 1, 2], [0, 1, 2]] = 1.0
    for _ in range(_SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            # The smaller of the two angles that bring the entry beside the diagonal to 0.
            difference, double = rotated[q, q] - rotated[p, p], 2.0 * rotated[p, q]
            sign = np.where(difference < 0, -1.0, 1.0)
            size = np.abs(difference) + np.sqrt(difference * difference + double * double)
            tangent = sign * double / np.where(size == 0, 1.0, size)
            cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
            sine = tangent * cosine
            for columns in (rotated, rotated.transpose(1, 0, 2), vectors):
                one, other = columns[:, p].copy(), columns[:, q].copy()
                columns[:, p] = cosine * one - sine * other
                columns[:, q] = sine * one + cosine * other
    least = np.argmin(rotated[[0, 1, 2], [0, 1, 2]], axis=0)
    return np.ascontiguousarray(np.take_along_axis(vectors, least[None, None], axis=1)[:, 0].T)
