"""Newton's method for stiff rods: the equilibrium of a `Structure`, and whether it is stable.

A rod is some thousand times stiffer along its axis than across it.  Plain Newton creeps: a step across stretches the
segments to second order, and the axial forces of that error spoil the next Hessian.  The *mixed* method (Magisano,
Leonetti and Garcea 2017, "How to improve efficiency and robustness of the Newton method in geometrically non-linear
structural problem discretized via displacement-based finite elements", CMAME 313, 986-1005) takes the forces ``m`` of
the stiff elements as unknowns of their own and eliminates them again::

    H(x, m) dx = -grad E(x),    H = K_bend + sum s dc dc^T + m ddc        x <- x + dx
    m <- s (c(x) + dc . dx - r)                                        forces by the linear elongations

It costs the same, ends in the same equilibria, and takes 5 to 15 steps where plain Newton takes a hundred.  Where H is
not positive definite, ``H + t (H+ - H)`` takes its place, with the least of a few ``t`` that makes it so; H+ is H
without the negative eigenvalues of each element.  No segment turns by more than 0.3 radians in a step.

The energy may rise for some steps on a good way.  Where it stays above its least value, the search goes back there (the
watchdog of Chamberlain, Powell, Lemarechal and Pedersen 1982) and is careful for a while: steps are corrected for
what they stretched, by the same factors, and halved until the energy is no higher than that of the last few states
(Grippo, Lampariello and Lucidi 1986).

SuperLU in its symmetric mode without pivoting gives the inertia by the signs of U's diagonal (Sylvester).  The
factorisation dominates: O(n^1.5) for rods on a surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Optional

import numpy as np
from scipy.sparse import csc_matrix, identity
from scipy.sparse.linalg import splu

from weavecore.geometry.arrays import Floats
from weavecore.simulating.structure import Structure

Progress = Callable[[float, str], None]

_MOST_STEPS = 120
_TURN = 0.3
"""No segment turns by more than this, in radians, in one step: the linear elongations hold up to there."""

_SHIFT = 1e-10
"""Added to the diagonal, against the bending stiffness of a median segment: rods that are free to move as a whole stay
where they are, and all others move as good as unhindered."""

_STEP_DONE = 1e-7
"""Done when no point moves by more than this part of a median segment; the last steps converge quadratically."""

_CORRECTIONS = 2
"""Second-order corrections of each trial step, by the same factors: they take out what it stretched."""

_PATIENCE, _CAUTION = 5, 8
"""After so many steps above the least energy the search goes back there, and is careful for so many steps: the next
time for twice as many."""

_MEMORY = 3
"""The energy may rise to the highest of so many states: on a good way, the next step undoes what one stretched."""

_MOST_HALVINGS = 12
_GOOD_PART = 0.3
"""Where less of a step than this was good, the next one takes more convexity."""

_ROUNDING = 1e-12
"""Energy may rise by this part of the elastic one: it is no more exact."""

_EASING, _LEAST_BLEND = 0.4, 0.02
"""The part of convexity that is tried is so much of the last one, or none below the other."""

_FAR = 2.0
"""A convex step that would turn a segment by more than so many times the limit asks for more convexity."""

_FIRST_BLEND, _AGAIN = 0.1, 4.0
"""Where none does not suffice, the first is tried, then so many times more."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solver ended.

    Parameters
    ----------
    points : (n, 3) float64
    is_converged : bool
    n_steps : int
    n_negative : int
        Negative eigenvalues of the Hessian; the equilibrium is stable where there are none.
    residual : float
        Largest component of force that is left on a free point, in N.
    factors : SuperLU
        Of the Hessian at ``points``, with a small shift.
    """

    points: Floats
    is_converged: bool
    n_steps: int
    n_negative: int
    residual: float
    factors: Any


def stiffness_scale(structure: Structure) -> float:
    """Bending stiffness of a median segment in N/m: ``EI / l^3``."""
    rest = float(np.median(structure.stretches.rest))
    return float(np.median(structure.bends.stiffness)) / rest**2 if len(structure.bends.stiffness) else 1.0 / rest


def factorised(structure: Structure, hessian: csc_matrix) -> tuple[Any, int]:
    """Factors of the Hessian with its small shift, and the number of its negative eigenvalues."""
    shifted = (hessian + _SHIFT * stiffness_scale(structure) * identity(hessian.shape[0], format="csc")).tocsc()
    factors = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factors, int((factors.U.diagonal() < 0).sum())


def find_equilibrium(structure: Structure, start: Floats, *, progress: Optional[Progress] = None) -> Solution:
    """Find a state of rest near ``start`` (n, 3), or the state that was reached when steps ran out.

    Parameters
    ----------
    structure : Structure
    start : (n, 3) float64
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.
    """
    path = _Path(structure, start)
    step = np.inf
    count = 0
    for count in range(1, _MOST_STEPS + 1):
        step = path.advance()
        if progress:
            # Steps shrink quadratically: how far there is to go shows in their logarithm.
            progress(float(np.clip(np.log10(step) / np.log10(_STEP_DONE), 0.0, 0.99)), f"step {count}")
        if step < _STEP_DONE or not np.isfinite(step):
            break
    factors, n_negative = factorised(structure, structure.hessian(path.x))
    residual = float(np.abs(structure.gradient(path.x).ravel()[structure.free]).max(initial=0.0))
    return Solution(path.x, bool(step < _STEP_DONE), count, n_negative, residual, factors)


class _Path:
    """The state of the search: points, forces of the stiff elements, and how much convexity the last step needed."""

    def __init__(self, structure: Structure, start: Floats) -> None:
        self.structure = structure
        self.x = start
        self.energy = structure.energy(start)
        self.forces = structure.forces(start)
        self.blend = 0.0
        self._bounds = [self.energy]
        self._best, self._best_energy, self._rises = start, self.energy, 0
        self._careful, self._caution = 0, _CAUTION

    def advance(self) -> float:
        """Take one step; return the largest move of a whole step in median segments, infinite where none was found."""
        structure, rest = self.structure, self.structure.stretches.rest
        gradient = structure.gradient(self.x)
        factors, step, turn = self._step(gradient)
        size = float(np.abs(step).max() / np.median(rest))
        part = min(1.0, _TURN / max(turn, np.finfo(float).tiny))
        if self._careful > 0:
            self._careful -= 1
            return size if self._search(factors, gradient, part, step) else np.inf
        x = self.x + part * step
        self._take(x, structure.energy(x), part * step)
        self._watch()
        return size

    def _watch(self) -> None:
        """Go back to the best state, and on with care, where the energy has stayed above it for too long."""
        slack = _ROUNDING * self.structure.elastic_energy(self.x)
        if self.energy <= self._best_energy + slack:
            self._best, self._best_energy, self._rises = self.x, self.energy, 0
            return
        self._rises += 1
        if self._rises >= _PATIENCE:
            self.x, self.energy, self._rises = self._best, self._best_energy, 0
            self.forces = self.structure.forces(self.x)
            self._bounds = [self.energy]
            self._careful, self._caution = self._caution, 2 * self._caution

    def _take(self, x: Floats, energy: float, step: Floats) -> None:
        self.forces = self.structure.forces_after(self.x, step)
        self.x, self.energy = x, energy

    def _search(self, factors: Any, gradient: Floats, part: float, step: Floats) -> bool:
        """Take a part of the step that does not raise the energy above the last states'; whether there is one."""
        for _ in range(_MOST_HALVINGS):
            x, energy = self._corrected(factors, gradient, part, step)
            if energy <= self.bound:
                self._adapt(energy, part)
                self._take(x, energy, part * step)
                self._bounds = [*self._bounds[1 - _MEMORY :], energy]
                if energy <= self._best_energy:
                    self._best, self._best_energy = x, energy
                return True
            part /= 2.0
        was_convex, self.blend = self.blend >= 1.0, 1.0 / _EASING
        return not was_convex

    def _adapt(self, energy: float, part: float) -> None:
        """Choose how much convexity the next step begins with: less after a good step, more after a short one."""
        if part <= _GOOD_PART:
            self.blend = max(_AGAIN * self.blend, _FIRST_BLEND) / _EASING
        elif energy > self.energy:
            self.blend /= _EASING

    @property
    def bound(self) -> float:
        """What the energy may rise to: the highest of the last steps."""
        return max(self._bounds) + _ROUNDING * self.structure.elastic_energy(self.x)

    def _corrected(self, factors: Any, gradient: Floats, part: float, step: Floats) -> tuple[Floats, float]:
        """The state after a part of a step, with its second-order corrections where they lower the energy."""
        structure = self.structure
        best = trial = self.x + part * step
        least = structure.energy(best)
        for _ in range(_CORRECTIONS):
            trial = trial - self._solve(factors, structure.gradient(trial) - (1.0 - part) * gradient)
            energy = structure.energy(trial)
            if not energy < least:
                break
            best, least = trial, energy
        return best, least

    def _solve(self, factors: Any, force: Floats) -> Floats:
        moved = np.zeros(force.size)
        moved[self.structure.free] = factors.solve(force.ravel()[self.structure.free])
        return moved.reshape(-1, 3)

    def _step(self, gradient: Floats) -> tuple[Any, Floats, float]:
        """Factors of a Hessian that is positive definite, the step by it, and its largest turn of a segment."""
        exact = self.structure.hessian(self.x, self.forces)
        blend = min(1.0, self.blend * _EASING)
        blend = blend if blend > _LEAST_BLEND else 0.0
        convex: Optional[csc_matrix] = None
        a, b = self.structure.stretches.points.T
        while True:
            hessian = exact
            if blend > 0.0:
                convex = self.structure.hessian(self.x, self.forces, convex=True) if convex is None else convex
                hessian = exact * (1.0 - blend) + convex * blend
            factors, n_negative = factorised(self.structure, hessian)
            step = self._solve(factors, -gradient)
            turn = float((np.linalg.norm(step[b] - step[a], axis=1) / self.structure.stretches.rest).max())
            # Nearly singular is no better than indefinite: the step would leave what the Hessian describes.
            is_good = n_negative == 0 and (blend == 0.0 or turn < _FAR * _TURN)
            if is_good or blend >= 1.0:
                self.blend = blend
                return factors, step, turn
            blend = (
                min(1.0, self.blend) if blend < min(1.0, self.blend) else min(1.0, max(_AGAIN * blend, _FIRST_BLEND))
            )
