"""Small loads against a linear frame program: PyNite (https://github.com/JWock82/Pynite), where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from weavecore.simulating.elements import Bends, Stretches, TieElements, tie_values
from weavecore.simulating.newton import find_equilibrium
from weavecore.simulating.structure import Structure

N, GAP, EA, EI, LOAD = 24, 0.01, 1e6, 10.0, 0.05
AT = (8, 16)  # Points of each rod at which it crosses the two others.


def grillage() -> tuple[Structure, np.ndarray]:
    """Two rods along x under two along y, pinned at their ends, with a load on one of the four crossings."""
    along = np.linspace(0.0, 1.0, N + 1)
    rods = [np.c_[along, np.full(N + 1, y), np.zeros(N + 1)] for y in (1 / 3, 2 / 3)]
    rods += [np.c_[np.full(N + 1, x), along, np.full(N + 1, GAP)] for x in (1 / 3, 2 / 3)]
    x = np.concatenate(rods)
    first = np.arange(4)[:, None] * (N + 1)
    start = (first + np.arange(N)).ravel()
    inner = (first + np.arange(1, N)).ravel()
    step = 1.0 / N
    crossings = [(i * (N + 1) + AT[j], (2 + j) * (N + 1) + AT[i]) for i in (0, 1) for j in (0, 1)]
    ties = np.array([[a, b, a - 1, a + 1, b - 1, b + 1] for a, b in crossings])
    fixed, loads = np.zeros((len(x), 3), bool), np.zeros((len(x), 3))
    fixed[first.ravel()] = fixed[first.ravel() + N] = True
    loads[crossings[0][1], 2] = -LOAD
    structure = Structure(
        len(x),
        Bends(np.stack([inner - 1, inner, inner + 1], axis=1), np.full(len(inner), EI / step)),
        Stretches(np.stack([start, start + 1], axis=1), np.full(len(start), step), np.full(len(start), EA / step)),
        TieElements(ties, tie_values(x, ties)[0], np.full((4, 3), EA)),
        loads,
        fixed,
    )
    return structure, x


def linear_deflections(structure: Structure, x: np.ndarray, program: Any) -> np.ndarray:
    """(n,) deflections by the frame program, with the ties as springs along their gaps."""
    model = program.FEModel3D()
    model.add_material("rod", 1.0, 1.0, 0.3, 0.0)
    model.add_section("rod", EA, EI, EI, EI)
    for k, point in enumerate(x):
        model.add_node(f"N{k}", *point)
    for k, (a, b) in enumerate(structure.stretches.points):
        model.add_member(f"M{k}", f"N{a}", f"N{b}", "rod", "rod")
    for k, (a, b) in enumerate(structure.ties.points[:, :2]):
        model.add_spring(f"S{k}", f"N{a}", f"N{b}", EA)
    ends = np.flatnonzero(structure.is_fixed[:, 0])
    for k in ends:
        turns_about_x = x[k, 2] == 0  # Rods along x do not turn about their axis, nor those along y about theirs.
        model.def_support(f"N{k}", True, True, True, turns_about_x, not turns_about_x, False)
    for k in np.flatnonzero(structure.loads[:, 2]):
        model.add_node_load(f"N{k}", "FZ", float(structure.loads[k, 2]))
    model.analyze_linear()
    return np.array([next(iter(model.nodes[f"N{k}"].DZ.values())) for k in range(len(x))])


def test_small_deflections_of_a_tied_grillage_are_those_of_a_linear_frame() -> None:
    program = pytest.importorskip("Pynite")
    structure, x = grillage()
    found = find_equilibrium(structure, x)
    expected = linear_deflections(structure, x, program)
    moved = found.points[:, 2] - x[:, 2]
    assert found.is_converged
    assert 1e-6 < np.abs(expected).max() < 1e-3
    assert np.abs(moved - expected).max() < 0.01 * np.abs(expected).max()
