"""One rod as a structure: the cases with a known solution."""

from __future__ import annotations

from typing import Optional

import numpy as np

from weavecore.simulating.elements import Bends, Scissors, Stretches, TieElements
from weavecore.simulating.structure import Structure

NO_TIES = TieElements(np.zeros((0, 6), np.int64), np.zeros((0, 3)), np.zeros((0, 3)))


def rod(
    n: int,
    step: float,
    *,
    bending: float = 1.0,
    stretching: float = 1e8,
    fixed: Optional[np.ndarray] = None,
    loads: Optional[np.ndarray] = None,
    closed: bool = False,
) -> Structure:
    """A rod of n points with segments of the same rest length; EI in N·m², EA in N."""
    index = np.arange(n)
    after = (index + 1) % n
    segments = np.stack([index, after], axis=1)[: n if closed else n - 1]
    triples = np.stack([(index - 1) % n, index, after], axis=1)
    triples = triples if closed else triples[1:-1]
    return Structure(
        n,
        Bends(triples, np.full(len(triples), bending / step)),
        Stretches(segments, np.full(len(segments), step), np.full(len(segments), stretching / step)),
        NO_TIES,
        np.zeros((n, 3)) if loads is None else loads,
        np.zeros((n, 3), bool) if fixed is None else fixed,
    )


def crossing_rods(seed: int = 0, *, friction: Optional[float] = None) -> tuple[Structure, np.ndarray]:
    """Two bent rods that are tied twice, loaded and held at one point, with points off rest; one tie may slide."""
    draw = np.random.default_rng(seed)
    along = np.linspace(0.0, 1.0, 8)
    a = np.c_[along, 0.2 * np.sin(3 * along), 0.0 * along]
    b = np.c_[0.4 + 0.1 * along, along - 0.5, 0.1 + 0.0 * along]
    x = np.concatenate([a, b]) + 0.03 * draw.normal(size=(16, 3))
    first = np.r_[np.arange(7), np.arange(8, 15)]
    inner = np.r_[np.arange(1, 7), np.arange(9, 15)]
    ties = np.array([[3, 11, 2, 4, 10, 12], [0, 15, 0, 1, 14, 15]])
    fixed = np.zeros((16, 3), bool)
    fixed[5] = True
    return (
        Structure(
            16,
            Bends(np.stack([inner - 1, inner, inner + 1], axis=1), draw.uniform(0.5, 2.0, 12)),
            Stretches(np.stack([first, first + 1], axis=1), draw.uniform(0.1, 0.2, 14), draw.uniform(5.0, 50.0, 14)),
            TieElements(
                ties,
                draw.normal(size=(2, 3)),
                draw.uniform(5.0, 50.0, (2, 3)),
                None if friction is None else np.array([friction, 1e3]),
            ),
            draw.normal(size=(16, 3)),
            fixed,
            Scissors(ties[:, 2:], np.array([0.3, -0.2]), draw.uniform(1.0, 5.0, 2)),
        ),
        x,
    )
