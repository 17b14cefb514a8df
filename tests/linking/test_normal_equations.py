"""Normal equations of a fixed pattern: the same as assembled densely, and solved to the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.linking.normal_equations import BandTerm, NormalEquations
from weavecore.linking.rod_runs import RodRuns, find_runs

EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 8], [8, 1]])
N_NODES = 9
NO_CORNERS = np.zeros((3, 0), np.int64), np.zeros((3, 3, 0))


@pytest.fixture
def draw() -> np.random.Generator:
    return np.random.default_rng(5)


def short_ring_and_path() -> RodRuns:
    """Of four and of five edges: around the ring a stencil comes to the same node again."""
    partner = np.full(2 * len(EDGES), -1)
    for one, other in ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 8)):
        partner[2 * one + 1], partner[2 * other] = 2 * other, 2 * one + 1
    return find_runs(EDGES, partner)


def random_band(draw: np.random.Generator, runs: RodRuns) -> tuple[np.ndarray, BandTerm]:
    """Blocks (7, 2, 3, Q) of the residuals of joints by the coordinates of the places around."""
    blocks = draw.normal(size=(7, 2, 3, len(runs))) * runs.is_joint

    def rows(places: np.ndarray | None, directions: np.ndarray) -> np.ndarray:
        at = np.arange(len(runs)) if places is None else places
        found = np.zeros((7, len(directions), 2, len(at)))
        for s in range(7):
            for m, way in enumerate(directions):
                shifted = np.zeros_like(way)
                by = s - 3
                if by >= 0:
                    shifted[:, : len(at) - by] = way[:, by:]
                else:
                    shifted[:, -by:] = way[:, :by]
                found[s, m] = (blocks[s][:, :, at] * shifted).sum(1)
        return found

    return blocks, BandTerm(-3, rows)


def directions_of(draw: np.random.Generator, n_unknowns: list[int]) -> np.ndarray:
    return draw.normal(size=(N_NODES, 3, 2)) * (np.arange(2) < np.array(n_unknowns)[:, None])[:, None]


def dense(runs: RodRuns, blocks: np.ndarray, directions: np.ndarray, n_unknowns: list[int]) -> np.ndarray:
    counts = np.array(n_unknowns)
    ways = np.zeros((3 * N_NODES, counts.sum()))
    for node, first in enumerate(np.cumsum(counts) - counts):
        for k in range(counts[node]):
            ways[3 * node : 3 * node + 3, first + k] = directions[node, :, k]
    hessian = np.zeros((3 * N_NODES, 3 * N_NODES))
    for p in np.flatnonzero(runs.is_joint):
        slopes = np.zeros((2, 3 * N_NODES))
        for s in range(7):
            if 0 <= p + s - 3 < len(runs):
                node = runs.node[p + s - 3]
                slopes[:, 3 * node : 3 * node + 3] += blocks[s, :, :, p]
        hessian += slopes.T @ slopes
    return np.asarray(ways.T @ hessian @ ways)


@pytest.mark.parametrize("n_unknowns", [[2] * 9, [1] * 9, [2, 0, 1, 2, 1, 0, 2, 1, 2]], ids=["two", "one", "mixed"])
def test_the_system_is_the_one_assembled_densely(draw: np.random.Generator, n_unknowns: list[int]) -> None:
    runs = short_ring_and_path()
    blocks, term = random_band(draw, runs)
    directions = directions_of(draw, n_unknowns)
    equations = NormalEquations(runs, np.zeros((2, 0), np.int64), np.array(n_unknowns))
    hessian = equations.assemble([term], NO_CORNERS, directions)
    np.testing.assert_allclose(hessian.toarray(), dense(runs, blocks, directions, n_unknowns), atol=1e-12)


def test_second_unknowns_that_are_few_are_added_apart(draw: np.random.Generator) -> None:
    """A long path of which one node has two unknowns, against the same with all products made together."""
    n = 60
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    partner = np.full(2 * (n - 1), -1)
    partner[1:-1:2], partner[2::2] = np.arange(2, 2 * (n - 1), 2), np.arange(1, 2 * (n - 1) - 1, 2)
    runs = find_runs(edges, partner)
    _, term = random_band(draw, runs)
    counts = np.ones(n, np.int64)
    counts[23] = 2
    directions = draw.normal(size=(n, 3, 2)) * (np.arange(2) < counts[:, None])[:, None]
    equations = [NormalEquations(runs, np.zeros((2, 0), np.int64), count) for count in (counts, np.full(n, 2))]
    assert [len(one._passes) for one in equations] == [2, 1]
    few, all_ = (one.assemble([term], NO_CORNERS, directions).toarray() for one in equations)
    kept = np.flatnonzero((np.arange(2) < counts[:, None]).ravel())
    np.testing.assert_allclose(few, all_[np.ix_(kept, kept)], atol=1e-12)


def test_corners_add_the_products_of_their_nodes(draw: np.random.Generator) -> None:
    runs = short_ring_and_path()
    _, term = random_band(draw, runs)
    directions, counts = directions_of(draw, [2] * 9), np.full(9, 2)
    corners = np.array([[0], [1], [2]])
    slopes = draw.normal(size=(3, 3, 1))
    equations = NormalEquations(runs, np.array([[0], [2]]), counts)
    without, with_corner = (equations.assemble([term], some, directions) for some in (NO_CORNERS, (corners, slopes)))
    row = np.concatenate([directions[k].T @ slopes[k, :, 0] for k in range(3)])
    wanted = np.zeros((18, 18))
    wanted[:6, :6] = np.outer(row, row)
    np.testing.assert_allclose((with_corner - without).toarray(), wanted, atol=1e-12)


def test_a_step_solves_the_damped_system_to_a_hundredth(draw: np.random.Generator) -> None:
    runs = short_ring_and_path()
    n_unknowns = [2, 0, 1, 2, 1, 0, 2, 1, 2]
    equations = NormalEquations(runs, np.zeros((2, 0), np.int64), np.array(n_unknowns))
    hessian = equations.assemble([random_band(draw, runs)[1]], NO_CORNERS, directions_of(draw, n_unknowns))
    gradient, damping = draw.normal(size=sum(n_unknowns)), draw.uniform(0.1, 1.0, N_NODES)
    step = equations.solve(hessian, damping, -gradient)
    rest = hessian @ step + np.repeat(damping, n_unknowns) * step + gradient
    assert np.linalg.norm(rest) <= 0.01 * np.linalg.norm(gradient) * (1 + 1e-9)


def test_turned_directions_in_tangent_planes_give_the_same_step(draw: np.random.Generator) -> None:
    runs = short_ring_and_path()
    _, term = random_band(draw, runs)
    equations = NormalEquations(runs, np.zeros((2, 0), np.int64), np.full(N_NODES, 2))
    directions, by_nodes = directions_of(draw, [2] * 9), draw.normal(size=(N_NODES, 3))
    angle = draw.uniform(0, 2 * np.pi, N_NODES)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    steps = []
    for ways in (directions, directions @ turn):
        hessian, gradient = equations.assemble([term], NO_CORNERS, ways), equations.gradient(by_nodes, ways)
        step = equations.solve(hessian, np.full(N_NODES, 0.5), -gradient)
        steps.append((ways @ step.reshape(N_NODES, 2, 1))[..., 0])
    np.testing.assert_allclose(steps[1], steps[0], atol=1e-9)


def test_without_a_gradient_there_is_no_step(draw: np.random.Generator) -> None:
    runs = short_ring_and_path()
    equations = NormalEquations(runs, np.zeros((2, 0), np.int64), np.full(N_NODES, 2))
    hessian = equations.assemble([random_band(draw, runs)[1]], NO_CORNERS, directions_of(draw, [2] * 9))
    assert not equations.solve(hessian, np.full(N_NODES, 0.5), np.zeros(2 * N_NODES)).any()
