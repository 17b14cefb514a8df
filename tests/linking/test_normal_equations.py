"""Normal equations of a fixed pattern: the same as assembled densely, and solved to the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.linking.normal_equations import NormalEquations, Term

N_NODES = 9


@pytest.fixture
def draw() -> np.random.Generator:
    return np.random.default_rng(5)


def random_terms(draw: np.random.Generator) -> tuple[list[np.ndarray], list[Term]]:
    """Two terms, one with nodes that come twice in a stencil, one of whose rows are only a part of its stencils."""
    stencils = [draw.integers(0, N_NODES, (12, 4)), draw.integers(0, N_NODES, (7, 2))]
    rows = [np.arange(12), np.array([1, 2, 6])]
    terms = []
    for nodes, some, width in zip(stencils, rows, (3, 1)):
        blocks = draw.normal(size=(len(some), nodes.shape[1], width, 3))
        terms.append(Term(0.0, draw.normal(size=(N_NODES, 3)), blocks, some))
    return stencils, terms


def dense(
    stencils: list[np.ndarray], terms: list[Term], directions: np.ndarray, n_unknowns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    ways = np.zeros((3 * N_NODES, n_unknowns.sum()))
    for node, first in enumerate(np.cumsum(n_unknowns) - n_unknowns):
        for k in range(n_unknowns[node]):
            ways[3 * node : 3 * node + 3, first + k] = directions[node, :, k]
    hessian = np.zeros((3 * N_NODES, 3 * N_NODES))
    for nodes, term in zip(stencils, terms):
        for row, block in zip(term.rows, term.blocks):
            slopes = np.zeros((block.shape[1], 3 * N_NODES))
            for node, part in zip(nodes[row], block):
                slopes[:, 3 * node : 3 * node + 3] += part
            hessian += slopes.T @ slopes
    return ways.T @ hessian @ ways, ways.T @ sum(term.gradient for term in terms).ravel()


@pytest.mark.parametrize("n_unknowns", [[2] * 9, [1] * 9, [2, 0, 1, 2, 1, 0, 2, 1, 2]], ids=["two", "one", "mixed"])
def test_the_system_is_the_one_assembled_densely(draw: np.random.Generator, n_unknowns: list[int]) -> None:
    stencils, terms = random_terms(draw)
    directions, counts = draw.normal(size=(N_NODES, 3, 2)), np.array(n_unknowns)
    hessian, gradient = NormalEquations(stencils, counts).assemble(terms, directions)
    wanted = dense(stencils, terms, directions, counts)
    np.testing.assert_allclose(hessian.toarray(), wanted[0], atol=1e-12)
    np.testing.assert_allclose(gradient, wanted[1], atol=1e-12)


def test_a_step_solves_the_damped_system_to_a_hundredth(draw: np.random.Generator) -> None:
    stencils, terms = random_terms(draw)
    equations = NormalEquations(stencils, np.array([2, 0, 1, 2, 1, 0, 2, 1, 2]))
    hessian, gradient = equations.assemble(terms, draw.normal(size=(N_NODES, 3, 2)))
    step = equations.solve(hessian, 0.5, -gradient)
    rest = hessian @ step + 0.5 * step + gradient
    assert np.linalg.norm(rest) <= 0.01 * np.linalg.norm(gradient) * (1 + 1e-9)


def test_turned_directions_in_tangent_planes_give_the_same_step(draw: np.random.Generator) -> None:
    stencils, terms = random_terms(draw)
    equations = NormalEquations(stencils, np.full(N_NODES, 2))
    directions = draw.normal(size=(N_NODES, 3, 2))
    angle = draw.uniform(0, 2 * np.pi, N_NODES)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    steps = []
    for ways in (directions, directions @ turn):
        hessian, gradient = equations.assemble(terms, ways)
        steps.append((ways @ equations.solve(hessian, 0.5, -gradient).reshape(N_NODES, 2, 1))[..., 0])
    np.testing.assert_allclose(steps[1], steps[0], atol=1e-9)


def test_without_a_gradient_there_is_no_step(draw: np.random.Generator) -> None:
    stencils, terms = random_terms(draw)
    equations = NormalEquations(stencils, np.full(N_NODES, 2))
    hessian, gradient = equations.assemble(terms, draw.normal(size=(N_NODES, 3, 2)))
    assert not equations.solve(hessian, 0.5, 0.0 * gradient).any()
