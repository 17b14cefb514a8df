"""Proximal Newton method for stiff rods: the equilibrium of a `Structure`, and whether it is stable.

A rod is some thousand times stiffer along its axis than across it.  Plain Newton creeps: a step across stretches the
segments to second order, and the axial forces of that error spoil the next Hessian.  The *mixed* method (Magisano,
Leonetti and Garcea 2017, "How to improve efficiency and robustness of the Newton method in geometrically non-linear
structural problem discretized via displacement-based finite elements", CMAME 313, 986-1005) takes the forces ``m`` of
the stiff elements as unknowns of their own and eliminates them again::

    H(x, m) dx = -grad E(x),    H = K_bend + sum s dc dc^T + m ddc        x <- x + dx
    m <- s (c(x) + dc . dx - r)                                        forces by the linear elongations

It costs the same and ends in the same equilibria.  From the drawing most weaves take 4 to 9 such iterations.  Where H
is indefinite because rods are compressed on the way, compression and the forces of ties are left out of ``m ddc``, a
modified Newton step (Nocedal and Wright 2006, §3.4); the last iteration has the exact H.  A weave that shears has far
to go along a curved valley of the energy, where this does not suffice.  There the search takes steps of the proximal
point method (Rockafellar 1976; implicit Euler steps of the gradient flow), each by mixed Newton iterations with the
exact H::

    x+ = argmin_y  E(y) + d |y - x|^2 / 2,    d = damping times EI / l^3 of a median segment

A step that does not converge or whose Hessian is indefinite ends there, or where it began if that has less energy, and
the next one has more damping; after a good one there is less, and none at the end.  No step raises the energy.  Where a
step with damping stays in place after another met negative eigenvalues, the equilibrium is a saddle: the points are
moved along its softest mode (inverse iteration), and the search goes on.

SuperLU in its symmetric mode without pivoting, in the order of `Structure.free`, gives the inertia by the signs of U's
diagonal (Sylvester).  The factorisation dominates: O(n^1.5) for rods on a surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np
from scipy.sparse import csc_matrix, identity

from weavecore.geometry.arrays import Floats
from weavecore.simulating.factors import Factors, factorise
from weavecore.simulating.structure import Forces, Structure

Progress = Callable[[float, str], None]

_MOST_STEPS = 300
"""Factorisations: the slowest sample needs 161 (docs/structure.md)."""

_TURN = 0.5
"""No segment turns by more than this, in radians, in one iteration: the linear elongations hold up to there."""

_SHIFT = 1e-10
"""Least damping: rods that are free to move as a whole stay where they are, and all others are hardly hindered."""

_STEP_DONE = 1e-7
"""Done when no point moves by more than this part of a median segment; the last steps converge quadratically."""

_MOST_ITERATIONS = 6
"""Of a step with damping; the step is shortened rather than followed further."""

_MOST_UNDAMPED = 12
"""Of a step without: searches that end so take up to 9."""

_CLOSE = 0.1
"""A step with damping is accurate enough when its last iteration moves by less than this part of it."""

_FIRST_DAMPING = 1e-2
_MORE = 8.0
_LESS = {1: 0.03, 2: 0.03, 3: 0.1, 4: 0.3}
"""Factor on the damping after a step of so many iterations; after longer ones it stays."""

_LEAST_DAMPING = 1e-8
"""Below this there is none: it would slow nothing."""

_MARGIN = 2.0
"""The next step has at least so many times the damping that failed last, once: the Hessian has changed little."""

_STILL = 1e-3
"""A step with damping that moves by less than this part of a median segment stays where it is."""

_NUDGE = 0.05
"""Move along the softest mode of a saddle, in median segments: far enough for the energy's fall to exceed rounding."""

_INVERSE_ITERATIONS = 8

_ROUNDING = 1e-12
"""Energy may rise by this part of the elastic one: it is no more exact."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solver ended.

    Parameters
    ----------
    points : (n, 3) float64
    is_converged : bool
    n_steps : int
        Factorisations.
    n_negative : int
        Negative eigenvalues of the Hessian; the equilibrium is stable where there are none.
    residual : float
        Largest component of force that is left on a free point, in N.
    factors : Factors
        Of the Hessian at ``points``, with a small shift.
    """

    points: Floats
    is_converged: bool
    n_steps: int
    n_negative: int
    residual: float
    factors: Factors


@dataclass(frozen=True, eq=False)
class _Trial:
    """End of a step: points, forces of the stiff elements, iterations, last iteration's move in median segments."""

    points: Floats
    forces: Forces
    iterations: int
    last: float
    is_good: bool
    is_lower: bool
    is_indefinite: bool


def stiffness_scale(structure: Structure) -> float:
    """Bending stiffness of a median segment in N/m: ``EI / l^3``."""
    rest = float(np.median(structure.stretches.rest))
    return float(np.median(structure.bends.stiffness)) / rest**2 if len(structure.bends.stiffness) else 1.0 / rest


def factorised(structure: Structure, hessian: csc_matrix, damping: float = _SHIFT) -> tuple[Factors, int]:
    """Factors of the Hessian with a damping on its diagonal, and the number of its negative eigenvalues."""
    shift = max(damping, _SHIFT) * stiffness_scale(structure)
    shifted = (hessian + shift * identity(hessian.shape[0], format="csc")).tocsc()
    factors = factorise(shifted)
    return factors, factors.n_negative


def find_equilibrium(
    structure: Structure,
    start: Floats,
    *,
    forces: Optional[Forces] = None,
    most_steps: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Solution:
    """Find a state of rest near ``start`` (n, 3), or the state that was reached when steps ran out.

    Parameters
    ----------
    structure : Structure
    start : (n, 3) float64
    forces : Forces, optional
        Of the stiff elements in the first iteration, by default those at ``start``.  Where rest lengths have changed
        since, those of the equilibrium before are nearer to the ones that are sought.
    most_steps : int, optional
        Factorisations after which the search ends, 300 at most.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Solution
    """
    search = _Search(structure, _MOST_STEPS if most_steps is None else min(most_steps, _MOST_STEPS), progress)
    x, forces = start, structure.forces(start) if forces is None else forces
    damping, failed, was_indefinite, is_converged = 0.0, 0.0, False, False
    median = float(np.median(structure.stretches.rest))
    none = Forces(0.0 * forces.axial, 0.0 * forces.tie)
    while not is_converged and search.count < search.most_steps:
        trial = search.step(x, forces, damping)
        if not trial.is_good:
            # Where a step ended early, the axial forces are far from those of the equilibrium, and none serve better.
            x, forces = (trial.points, none) if trial.is_lower else (x, structure.forces(x))
            failed, was_indefinite = damping, trial.is_indefinite
            damping = max(_MORE * damping, _LEAST_DAMPING) if damping else search.restart
            continue
        moved = float(np.abs(trial.points - x).max(initial=0.0)) / median
        x, forces = trial.points, trial.forces
        is_converged = trial.last < _STEP_DONE and damping == 0.0
        if moved < _STILL and was_indefinite and damping > 0.0:
            x = x + search.softest_mode(x, damping) * _NUDGE * median
            forces = structure.forces(x)
        search.restart = damping or search.restart
        damping = max(damping * _LESS.get(trial.iterations, 1.0), min(damping, _MARGIN * failed))
        failed, was_indefinite = 0.0, False
        damping = damping if damping > _LEAST_DAMPING else 0.0
    factors, n_negative = factorised(structure, structure.hessian(x))
    residual = float(np.abs(structure.gradient(x).ravel()[structure.free]).max(initial=0.0))
    return Solution(x, is_converged, search.count, n_negative, residual, factors)


class _Search:
    """Steps of the search, with the count of their factorisations and the damping from which failed ones go on."""

    def __init__(self, structure: Structure, most_steps: int, progress: Optional[Progress]) -> None:
        self.structure, self.most_steps, self.progress = structure, most_steps, progress
        self.count = 0
        self.restart = _FIRST_DAMPING
        self._scale = stiffness_scale(structure)

    def step(self, x: Floats, forces: Forces, damping: float) -> _Trial:
        """Minimise the energy with a damping on the way from ``x`` by mixed Newton iterations."""
        structure, rest = self.structure, self.structure.stretches.rest
        median, (a, b) = float(np.median(rest)), structure.stretches.points.T
        y, weight, last, k = x, damping * self._scale, np.inf, 0
        is_close = is_indefinite = False
        most = _MOST_ITERATIONS if damping else _MOST_UNDAMPED
        while k < most and self.count < self.most_steps and not is_close:
            k += 1
            factors, n_negative = self._factorised(y, forces, damping)
            is_indefinite = n_negative > 0
            if is_indefinite and not damping:
                factors, n_negative = self._factorised(y, forces.without_compression(), damping)
            if n_negative:
                break
            move = self._solve(factors, -structure.gradient(y) - weight * (y - x))
            turn = float((np.linalg.norm(move[b] - move[a], axis=1) / rest).max(initial=0.0))
            if not np.isfinite(turn):
                break
            part = min(1.0, _TURN / max(turn, np.finfo(float).tiny))
            forces = structure.forces_after(y, part * move)
            y = y + part * move
            last = float(np.abs(move).max(initial=0.0)) / median
            self._report(last)
            limit = _CLOSE * float(np.abs(y - x).max(initial=0.0)) / median if damping else 0.0
            is_final = damping > 0.0 or not is_indefinite
            is_close = part == 1.0 and is_final and last < max(limit, _STEP_DONE)
        energy = structure.energy(y) + weight * float(((y - x) ** 2).sum()) / 2
        is_lower = bool(energy <= structure.energy(x) + _ROUNDING * structure.elastic_energy(y))
        return _Trial(y, forces, k, last, is_close and is_lower, is_lower, is_indefinite)

    def softest_mode(self, x: Floats, damping: float) -> Floats:
        """(n, 3) the mode of the least eigenvalue, its largest component 1, by inverse iteration with a damping."""
        factors, _ = self._factorised(x, self.structure.forces(x), damping)
        mode = np.random.default_rng(0).normal(size=x.shape)
        for _ in range(_INVERSE_ITERATIONS):
            mode = self._solve(factors, mode)
            mode /= np.abs(mode).max()
        return mode

    def _factorised(self, x: Floats, forces: Forces, damping: float) -> tuple[Factors, int]:
        self.count += 1
        return factorised(self.structure, self.structure.hessian(x, forces), damping)

    def _solve(self, factors: Factors, force: Floats) -> Floats:
        moved = np.zeros(force.size)
        moved[self.structure.free] = factors.solve(force.ravel()[self.structure.free])
        return moved.reshape(-1, 3)

    def _report(self, last: float) -> None:
        if self.progress:
            # Iterations shrink quadratically: how far there is to go shows in their logarithm.
            part = float(np.clip(np.log10(max(last, 1e-300)) / np.log10(_STEP_DONE), 0.0, 0.99))
            self.progress(part, f"step {self.count}")
