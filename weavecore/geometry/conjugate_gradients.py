"""Conjugate gradients for sparse symmetric systems, in one thread.

BLAS divides an inner product of more than ten thousand numbers among threads, which in a loop of short products wait
for each other longer than they work; and its sums depend on the number of threads and on its kernels.  Here each is
summed in one thread (`arrays.inner`): fast, and with the same last bit on every machine.

Source: Hestenes and Stiefel 1952; Nocedal and Wright 2006, *Numerical Optimization*, algorithm 5.3.
"""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np
from scipy.sparse import csr_matrix

from weavecore.geometry.arrays import Floats, inner
from weavecore.polling import each


def conjugate_gradients(
    matrix: csr_matrix,
    right: Floats,
    *,
    tolerance: float,
    most_iterations: int,
    precondition: Optional[Callable[[Floats], Floats]] = None,
) -> tuple[Floats, bool]:
    """Solve a system whose matrix is symmetric and positive definite, beginning from 0.

    Parameters
    ----------
    matrix : (n, n) csr_matrix
    right : (n,) float64
    tolerance : float
        Norm of the residual over that of the right-hand side at which the iteration ends.
    most_iterations : int
    precondition : callable, optional
        Multiplies a vector by about the inverse of the matrix.

    Returns
    -------
    solution : (n,) float64
    is_solved : bool
        Whether the tolerance was reached.
    """
    solution, residual = np.zeros(len(right)), right.copy()
    limit = tolerance * np.sqrt(inner(right, right))
    direction, last = np.zeros(len(right)), 1.0
    for _ in each(range(most_iterations)):
        if np.sqrt(inner(residual, residual)) <= limit:
            return solution, True
        preconditioned = residual if precondition is None else precondition(residual)
        size = inner(residual, preconditioned)
        direction = preconditioned + (size / last) * direction
        image = matrix @ direction
        step_length = size / inner(direction, image)
        solution += step_length * direction
        residual -= step_length * image
        last = size
    return solution, bool(np.sqrt(inner(residual, residual)) <= limit)
