"""A published elastic gridshell: ten rods, straight and flat at first, that are pushed up into a hemisphere.

Baek, Sageman-Furnas, Jawed and Reis 2018 ("Form finding in elastic gridshells", PNAS 115, 75-80) cut the flat grid as
a Chebyshev net of a hemisphere: its rods do not stretch, and pinned at the equator they form the hemisphere.  Lengths,
feet and sections are those that Huang, Hao, Li, Tong, Guo, Zhang, Gao, Hsia and Liu publish with "A tutorial on
simulating nonlinear behaviors of flexible structures with the discrete differential geometry (DDG) method" (rod network
2): the longest rods are 2 m long, so that the radius is 2 m / pi.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from weavecore.simulating.elements import Bends, Stretches, TieElements
from weavecore.simulating.newton import Solution, find_equilibrium
from weavecore.simulating.structure import Structure

RADIUS = 2.0 / np.pi
SPACING = 1.0 / 3.0
HALF_LENGTHS = (0.5808, 0.8742, 1.0, 0.8742, 0.5808)
FEET = ((-0.46917, 0.43), (-0.29167, 0.56583), (0.0, 0.63667), (0.29167, 0.56583), (0.46917, 0.43))
MODULUS, SECTION_RADIUS = 100e6, 0.01
GAP = 0.001
"""Between the axes at a joint: small, so that they lie in one surface as the published ones do."""


def flat_rod(half: float, segments: int) -> np.ndarray:
    """Places along a rod: joints at multiples of the spacing, and the ends, with so many segments in a spacing."""
    n = int(half / SPACING)
    joints = np.unique(np.round(np.append(SPACING * np.arange(-n, n + 1), [-half, half]), 6))
    parts = [np.linspace(a, b, segments + 1)[:-1] for a, b in zip(joints, joints[1:])]
    return np.append(np.concatenate(parts), half)


def on_sphere(flat: np.ndarray) -> np.ndarray:
    """Flat places (n, 2) on the hemisphere, at the same distance along it from its pole."""
    distance = np.linalg.norm(flat, axis=1)
    unit = flat / np.maximum(distance, 1e-12)[:, None]
    angle = np.minimum(distance / RADIUS, np.pi / 2)
    return RADIUS * np.c_[np.sin(angle)[:, None] * unit, np.cos(angle)]


def crossings(flat: np.ndarray, half: int) -> np.ndarray:
    """(T, 2) points of the rods of one direction, numbered first, and those of the other that lie on them."""
    pairs = cKDTree(flat[:half]).query_ball_tree(cKDTree(flat[half:]), 1e-4)
    return np.array([(a, half + b) for a, found in enumerate(pairs) for b in found])


def elements(rods: list[np.ndarray], flat: np.ndarray) -> tuple[Bends, Stretches, TieElements]:
    """Round rods through their flat places, straight when free, and a tie at each crossing."""
    area, inertia = np.pi * SECTION_RADIUS**2, np.pi * SECTION_RADIUS**4 / 4
    segments = np.concatenate([np.stack([rod[:-1], rod[1:]], axis=1) for rod in rods])
    triples = np.concatenate([np.stack([rod[:-2], rod[1:-1], rod[2:]], axis=1) for rod in rods])
    rest = np.linalg.norm(flat[segments[:, 1]] - flat[segments[:, 0]], axis=1)
    width = np.bincount(segments.ravel(), np.repeat(rest / 2, 2))
    a, b = crossings(flat, len(flat) // 2).T
    ties = np.stack([a, b, a - 1, a + 1, b - 1, b + 1], axis=1)
    return (
        Bends(triples, MODULUS * inertia / width[triples[:, 1]]),
        Stretches(segments, rest, MODULUS * area / rest),
        TieElements(ties, np.tile([GAP, 0.0, 0.0], (len(a), 1)), np.full((len(a), 3), MODULUS * area / SPACING)),
    )


@cache
def gridshell(segments: int) -> Solution:
    """The flat grid, bent over the hemisphere and pinned at its feet, comes to rest."""
    halves = [flat_rod(half, segments) for half in HALF_LENGTHS]
    across = SPACING * np.arange(-2, 3)
    one = np.concatenate([np.c_[np.full(len(along), at), along] for at, along in zip(across, halves)])
    flat = np.concatenate([one, one[:, ::-1]])
    offsets = np.cumsum([0, *(len(along) for along in halves * 2)])
    rods = [np.arange(a, b) for a, b in zip(offsets, offsets[1:])]
    start, fixed = on_sphere(flat), np.zeros((len(flat), 3), bool)
    start[len(one) :] *= 1.0 + GAP / RADIUS
    for k, rod in enumerate(rods):
        x, y = FEET[k % 5]
        for point, foot in ((rod[0], (x, -y)), (rod[-1], (x, y))):
            start[point] = (*(foot if k < 5 else foot[::-1]), 0.0)
            fixed[point] = True
    structure = Structure(len(flat), *elements(rods, flat), np.zeros((len(flat), 3)), fixed)
    return find_equilibrium(structure, start)


def test_the_published_gridshell_stands_as_a_hemisphere() -> None:
    found = gridshell(4)
    assert found.is_converged
    assert found.n_negative == 0
    off = np.linalg.norm(found.points, axis=1) / RADIUS - 1.0
    assert np.sqrt((off**2).mean()) < 0.01
    assert np.abs(off).max() < 0.02
    assert found.points[:, 2].max() == pytest.approx(RADIUS, rel=0.015)


def test_its_height_hardly_changes_when_the_segments_are_halved() -> None:
    coarse, fine = (gridshell(n).points[:, 2].max() for n in (4, 8))
    assert coarse == pytest.approx(fine, rel=0.005)
