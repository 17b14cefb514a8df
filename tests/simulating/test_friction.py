"""Ties that slide along rods when the force there reaches their friction."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Optional

import numpy as np
import pytest

from single_rods import rod
from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.model import Equilibrium
from weavecore.simulating.elements import Bends, Stretches, TieElements
from weavecore.simulating.newton import find_equilibrium
from weavecore.simulating.structure import Structure
from woven_rods import woven_tube

FRICTION, ROD_STIFFNESS, TIE_STIFFNESS = 3.0, 500.0, 2000.0


def pulled_past_a_tie(force: float, friction: float) -> tuple[np.ndarray, np.ndarray]:
    """A rod along x, held at its start, is pulled at its end past a rod along y that is held: points and tie forces.

    Both have segments of 0.1 m; the tie is at the middle of both, and two segments, in a row as stiff as
    `ROD_STIFFNESS`, lead from the start to it.
    """
    along = 0.1 * np.arange(5)
    x = np.concatenate([np.c_[0 * along, along - 0.2, 0 * along], np.c_[along - 0.2, 0 * along, 0 * along + 0.01]])
    one = rod(5, 0.1, stretching=2 * ROD_STIFFNESS * 0.1)
    fixed, loads = np.ones((10, 3), bool), np.zeros((10, 3))
    fixed[6:, 0] = False
    loads[9, 0] = force
    ties = TieElements(
        np.array([[2, 7, 1, 3, 6, 8]]), np.array([[0.01, 0, 0]]), np.full((1, 3), TIE_STIFFNESS), np.array([friction])
    )
    both = Structure(
        10,
        Bends(np.concatenate([one.bends.points, one.bends.points + 5]), np.tile(one.bends.stiffness, 2)),
        Stretches(
            np.concatenate([one.stretches.points, one.stretches.points + 5]),
            np.tile(one.stretches.rest, 2),
            np.tile(one.stretches.stiffness, 2),
        ),
        ties,
        loads,
        fixed,
    )
    start = replace(ties, rest=np.array([[-0.01, 0, 0]]))  # a x b looks down, away from the upper rod.
    found = find_equilibrium(replace(both, ties=start), x)
    assert found.is_converged
    assert found.n_negative == 0
    return found.points - x, replace(both, ties=start).forces(found.points).tie[0]


def test_a_tie_holds_up_to_its_friction_and_beyond_it_slides_with_exactly_that_force() -> None:
    slips_at = FRICTION * (ROD_STIFFNESS + TIE_STIFFNESS) / TIE_STIFFNESS
    for force in (0.5 * slips_at, 0.99 * slips_at):
        move, tie = pulled_past_a_tie(force, FRICTION)
        assert move[7, 0] == pytest.approx(force / (ROD_STIFFNESS + TIE_STIFFNESS), rel=1e-6)
        assert np.abs(tie).max() < FRICTION
    for force in (1.01 * slips_at, 3 * slips_at):
        move, tie = pulled_past_a_tie(force, FRICTION)
        assert move[7, 0] == pytest.approx((force - FRICTION) / ROD_STIFFNESS, rel=1e-6)
        assert np.abs(tie).max() == pytest.approx(FRICTION, rel=1e-12)


def test_a_tie_without_friction_leaves_the_rod_to_itself() -> None:
    move, tie = pulled_past_a_tie(5.0, 0.0)
    assert move[7, 0] == pytest.approx(5.0 / ROD_STIFFNESS, rel=1e-6)
    assert np.abs(tie[1:]).max() == 0.0


@cache
def released(friction: Optional[float]) -> Equilibrium:
    return pipeline.simulate(woven_tube("triangular"), supports="none", tie_friction=friction)


def test_ties_of_a_weave_slide_only_where_their_friction_is_below_the_force() -> None:
    held = released(None)
    most = float(np.abs(held.tie_force[:, 1:]).max())
    firm, loose = released(2 * most), released(most / 4)
    assert np.abs(firm.tie_force[:, 1:]).max() < 2 * most
    assert firm.departure_mean == pytest.approx(held.departure_mean, rel=0.1)
    assert np.abs(loose.tie_force[:, 1:]).max() == pytest.approx(most / 4, rel=1e-12)
    assert loose.is_stable
    assert sum(loose.energies.values()) < sum(firm.energies.values()) < sum(held.energies.values())


@pytest.mark.parametrize("friction", [-1.0, np.nan, np.inf])
def test_frictions_that_are_not_numbers_from_0_up_are_refused(friction: float) -> None:
    with pytest.raises(Unsupported, match="friction"):
        pipeline.simulate(woven_tube("triangular"), tie_friction=friction)
