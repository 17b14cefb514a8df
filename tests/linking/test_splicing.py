"""Whatever of a strip is replaced by a filling, the band stays a strip between its rings."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.linking.band_faces import BandFaces, faces_of_strip, splice
from weavecore.linking.ring_to_parent import Strip


def strip(draw: np.random.Generator, n: int, m: int) -> BandFaces:
    """A random triangulation between rings of n and m nodes, turned by up to a lap."""
    advance = np.bincount(draw.integers(0, n, m), minlength=n)
    apexes = np.cumsum(advance) + int(draw.integers(0, m))
    corners = faces_of_strip(Strip(0, 1, True, apexes), np.arange(n), n + np.arange(m), has_diagonals=True)
    return BandFaces(corners, np.zeros(len(corners), np.int64))


def directed_sides(faces: BandFaces) -> list[tuple[int, int]]:
    tail, head, _ = faces.sides()
    return list(zip(tail.tolist(), head.tolist()))


@pytest.mark.parametrize("seed", range(60))
def test_a_strip_with_bad_faces_stays_a_strip(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n, m = (int(k) for k in draw.integers(3, 8, 2))
    rings = [(i, (i + 1) % n) for i in range(n)] + [(n + k, n + (k + 1) % m) for k in range(m)]
    strips, filled = strip(draw, n, m), strip(draw, n, m)
    if any(len(set(sides)) < len(sides) for sides in map(directed_sides, (strips, filled))):
        pytest.skip("one of the two joins two nodes twice")
    bad = draw.random(len(strips.corners)) < 0.3
    faces, _ = splice(strips, bad, filled, np.sort(np.array(rings), axis=1), np.zeros(0, np.int64))
    sides = directed_sides(faces)
    assert len(set(sides)) == len(sides) == 3 * (n + m)
    naked = {(a, b) for a, b in sides if (b, a) not in set(sides)}
    assert naked == {(i, (i + 1) % n) for i in range(n)} | {(n + (k + 1) % m, n + k) for k in range(m)}
