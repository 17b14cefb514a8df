"""The fewest ties are broken that rods can do with."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from weavecore.geometry.spanning import spread_signs
from weavecore.weaving.plain import UNTIED, ties_to_break

N = 4


def grid(split: tuple[int, ...]) -> Any:
    """A plate of 3 by 3 square cells on 4 by 4 joints, some of them split in two triangles."""
    faces: list[list[int]] = []
    for cell in range((N - 1) ** 2):
        a = cell // (N - 1) * N + cell % (N - 1)
        square = [a, a + 1, a + N + 1, a + N]
        faces += [square[:3], [square[0], square[2], square[3]]] if cell in split else [square]
    sides = {tuple(sorted(side)) for face in faces for side in zip(face, face[1:] + face[:1])}
    counts = [len(face) for face in faces]
    return SimpleNamespace(
        n_nodes=N * N,
        n_faces=len(faces),
        edges=np.array(sorted(sides)),
        face_nodes=np.concatenate([np.array(face) for face in faces]),
        face_offsets=np.concatenate([[0], np.cumsum(counts)]),
    )


def fewest_unmet(edges: np.ndarray, product: np.ndarray) -> int:
    """By trying all signs of the sixteen joints."""
    signs = 1 - 2 * ((np.arange(1 << (N * N - 1))[:, None] >> np.arange(N * N)) & 1)
    return int((signs[:, edges[:, 0]] * signs[:, edges[:, 1]] != product).sum(1).min())


def unmet_after(lattice: Any, tie: np.ndarray, product: np.ndarray) -> int:
    bent = product.copy()
    bent[ties_to_break(lattice, tie, product)] *= -1
    a, b = lattice.edges[tie != UNTIED].T
    signs = spread_signs(a, b, bent, N * N)
    return int((signs[a] * signs[b] != product).sum())


@pytest.mark.parametrize("split", [(), (4,), (0, 8), (0, 2, 6, 8), (1, 3, 5, 7), (0, 1, 2), (0, 4, 8)])
def test_as_few_ties_are_broken_as_can_be(split: tuple[int, ...]) -> None:
    lattice = grid(split)
    tie, product = np.arange(len(lattice.edges)), np.full(len(lattice.edges), -1)
    assert unmet_after(lattice, tie, product) == fewest_unmet(lattice.edges, product)


@pytest.mark.parametrize("seed", range(8))
def test_so_it_is_whatever_the_ties_ask_for(seed: int) -> None:
    lattice = grid((2, 6))
    product = np.random.default_rng(seed).choice([-1, 1], len(lattice.edges))
    assert unmet_after(lattice, np.arange(len(product)), product) == fewest_unmet(lattice.edges, product)


def test_edges_that_tie_nothing_join_the_cells_beside_them() -> None:
    lattice = grid((4,))
    diagonal = np.flatnonzero((lattice.edges == [5, 10]).all(1))
    tie = np.arange(len(lattice.edges))
    tie[diagonal] = UNTIED
    tie[diagonal[0] + 1 :] -= 1
    product = np.full(len(lattice.edges) - 1, -1)
    assert len(ties_to_break(lattice, tie, product)) == 0
