"""The spacing that is taken where none is asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tough_surfaces import TOUGH
from weavecore.model import SurfaceMesh
from weavecore.offsetting.level_sets import offset_levels
from weavecore.offsetting.spacing import round_length, suggest_spacing
from woven_tube import tube_surface


def disc(n_rings: int, radius: float = 1.0) -> SurfaceMesh:
    """A flat disc of rings of triangles about its middle."""
    points, faces = [[0.0, 0.0, 0.0]], []
    n = 6 * n_rings
    turn = 2 * np.pi * np.arange(n) / n
    for k in range(1, n_rings + 1):
        points += np.c_[np.cos(turn), np.sin(turn), 0 * turn].__mul__(radius * k / n_rings).tolist()
    for j in range(n):
        faces.append([0, 1 + j, 1 + (j + 1) % n])
        for k in range(n_rings - 1):
            a, b = 1 + k * n + j, 1 + k * n + (j + 1) % n
            faces += [[a, a + n, b + n], [a, b + n, b]]
    return SurfaceMesh(np.array(points), np.array(faces))


def test_a_fine_mesh_gets_some_fifteen_generations() -> None:
    assert 12 <= 1.0 / suggest_spacing(disc(60)) <= 20


def test_a_coarse_mesh_gets_wider_but_never_too_few() -> None:
    coarse = suggest_spacing(disc(6))
    assert coarse > suggest_spacing(disc(60))
    assert 4 <= 1.0 / coarse <= 8
    assert 2.5 / suggest_spacing(tube_surface()) >= 3


@pytest.mark.parametrize("name", ["one_triangle", "two_triangles", "strip", "ring_strip", "fan", "long_faced_tube"])
def test_a_mesh_with_no_vertex_off_its_borders_gets_a_spacing_that_fits(name: str) -> None:
    for seed in range(4):
        surface = SurfaceMesh(*TOUGH[name](seed))
        latitudes = offset_levels(surface, spacing=suggest_spacing(surface))
        assert 4 <= latitudes.n_generations <= 40


@given(st.integers(-6, 6))
def test_the_spacing_grows_with_the_surface(power: int) -> None:
    surface = disc(20)
    scaled = replace(surface, vertices=surface.vertices * 10.0**power)
    assert suggest_spacing(scaled) == pytest.approx(suggest_spacing(surface) * 10.0**power, rel=1e-12)


@given(st.floats(1e-9, 1e9))
def test_round_numbers_are_near_and_short(length: float) -> None:
    friendly = round_length(length)
    assert 1 / 1.16 < friendly / length < 1.16
    assert len(f"{friendly:e}".split("e")[0].rstrip("0").rstrip(".")) <= 3


def test_rings_do_not_jump_across_a_deep_thin_tube() -> None:
    """A fifteenth of the depth would be five radii."""
    turn, height = np.meshgrid(2 * np.pi * np.arange(24) / 24, np.linspace(0, 150, 301))
    points = np.c_[np.cos(turn).ravel(), np.sin(turn).ravel(), height.ravel()]
    here = np.arange(24 * 300)
    right = here // 24 * 24 + (here + 1) % 24
    faces = np.concatenate([np.c_[here, right, right + 24], np.c_[here, right + 24, here + 24]])
    assert suggest_spacing(SurfaceMesh(points, faces)) <= 1.6
