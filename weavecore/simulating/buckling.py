"""First buckling factor of the loads, from the stiffness without and with them.

At the loads times ``f`` the stiffness is about ``K0 + f (K1 - K0)``, with K0 at the equilibrium without loads and K1 at
that with them.  It loses its definiteness at the least positive ``f`` of ``K0 v = f (K0 - K1) v``: the inverse of the
largest eigenvalue of ``(K0 - K1) v = mu K0 v``, found by Lanczos iteration with the factors of K0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Callable, Optional

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from weavecore.simulating.newton import Solution, find_equilibrium
from weavecore.simulating.structure import Structure

_EXACT = 1e-6


def first_buckling_factor(
    structure: Structure, loaded: Solution, *, progress: Optional[Callable[[float, str], None]] = None
) -> Optional[float]:
    """The factor, infinite where the loads stiffen every mode; None where it cannot be found."""
    unloaded = replace(structure, loads=np.zeros_like(structure.loads))
    rest = find_equilibrium(unloaded, loaded.points, progress=progress)
    if not rest.is_converged or rest.n_negative:
        return None
    stiffness = structure.hessian(rest.points)
    change = stiffness - structure.hessian(loaded.points)
    n = stiffness.shape[0]
    inverse = LinearOperator((n, n), matvec=rest.factors.solve, dtype=np.float64)
    try:
        largest = eigsh(
            change, k=1, M=stiffness, Minv=inverse, which="LA", v0=np.ones(n), tol=_EXACT, return_eigenvectors=False
        )
    except ArpackNoConvergence:
        return None
    return float(1.0 / largest[0]) if largest[0] > 0 else float("inf")
