"""Rays: links over stopped ones, views, and the curvature that corrections start from."""

from __future__ import annotations

import numpy as np
import pytest

from planar_meshes import circle, plate
from weavecore.geometry.geodesics import Unfolding
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance import rays as rays_module
from weavecore.offsetting.distance.rays import DISTANCE, SIDE, GeodesicRays
from weavecore.offsetting.distance.relaxation import front_curvature


def in_a_row(n: int) -> GeodesicRays:
    """Rays of a closed front, each linked to the next."""
    one = np.ones(n)
    rays = GeodesicRays.starting(np.zeros(n, np.int64), one, 0 * one, one, one, 0 * one, one)
    rays.links.after = (np.arange(n) + 1) % n
    rays.links.gap = one.copy()
    return rays


@pytest.mark.parametrize("n_gone", [1, 2, 64, 65, 500])
def test_links_bridge_a_run_of_removed_rays_however_long(n_gone: int) -> None:
    rays = in_a_row(n_gone + 10)
    gone = np.zeros(len(rays), bool)
    gone[4 : 4 + n_gone] = True
    left = rays.without(gone)
    assert left.links.after.tolist() == [*range(1, 10), 0]
    assert np.flatnonzero(left.links.gap < 0).tolist() == [3]


def test_links_end_where_all_others_are_removed_or_none_follows() -> None:
    rays = in_a_row(5)
    assert rays.without(np.arange(5) > 0).links.after.tolist() == [-1]
    rays.links.after[2] = -1
    gone = np.array([False, True, True, False, False])
    assert rays.without(gone).links.after.tolist() == [-1, 2, 0]


def test_a_ray_has_no_blocker_because_another_one_has() -> None:
    rays = in_a_row(2)
    state = rays.state
    state.curvature[:] = 2.0  # as from a corner: the front's radius is less than its distance
    state.left[:, 0] = [0.5, 0.1, 0.6, 0.3]
    lateral, travel = np.array([0.3, 0.3]), np.array([1.5, 1.5])
    values = [np.array([x, x]) for x in (0.4, 0.9, 0.1)]
    is_left = np.array([True, True])
    behind = rays_module._around_blockers(state, is_left, travel, lateral, *values)
    alone = rays_module._around_blockers(state.take(np.array([1])), is_left[1:], travel[1:], lateral[1:], *values)
    assert behind[1] == alone[0]
    assert not behind[1]
    assert np.isinf(state.left[SIDE, 1])
    assert state.left[DISTANCE, 1] == 0


def test_the_curvature_of_a_round_front_is_one_over_its_radius() -> None:
    surface = SurfaceMesh(
        *plate([circle(1.0), circle(0.2, n=20)[::-1]], 0.05, jitter=0.2, rng=np.random.default_rng(3))
    )
    frames = Unfolding(surface.vertices, surface.faces, surface.twins)
    radius = np.linalg.norm(surface.vertices, axis=1)
    inner = ~frames.on_boundary & (radius > 0.35) & (radius < 0.9)
    outward = front_curvature(frames, radius)[inner] * radius[inner]
    assert np.median(outward) == pytest.approx(1.0, abs=0.02)
    assert np.abs(outward - 1.0).mean() < 0.1
    # Towards the centre the front converges: the curvature is negative, within its bound.
    inward = front_curvature(frames, 1.0 - radius)[inner] * radius[inner]
    assert np.median(inward) == pytest.approx(-1.0, abs=0.02)
