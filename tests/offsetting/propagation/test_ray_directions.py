"""Where fronts are offset from, and in which direction (Yan et al. 2016, §4.1 and §4.2)."""

import numpy as np
import pytest

from drawn_curves import draw, square_domain
from flat_fields import distance_at, flat_surface
from planar_meshes import circle, rectangle
from weavecore.model import SurfaceMesh
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.offset_vertices import cast_rays, offset_vertices
from weavecore.offsetting.propagation.ray_directions import start_on_boundary, start_on_curves

PLATE = [rectangle(10, 10), circle(1.5, (2.0, 1.0), n=60), rectangle(2, 2, (-2.5, -2.0))]


def ends_of(domain, starts, spacing):
    rays = cast_rays(domain, starts, spacing=spacing)
    return rays, offset_vertices(domain, rays).points


def test_all_borders_are_offset_into_the_surface_whichever_way_their_indices_ran():
    surface = flat_surface(PLATE, 0.3)
    for faces in (surface.faces, surface.faces[:, [1, 0, 2]]):  # seen from above, seen from below
        turned = SurfaceMesh(surface.vertices, faces)
        domain = Domain(turned)
        rays, ends = ends_of(domain, start_on_boundary(domain, step=0.05 / domain.scale), 0.4 / domain.scale)
        free = np.isinf(rays.stop)
        points = ends * domain.scale + turned.vertices.mean(0)
        distance, _ = distance_at(turned, points[free])
        # At the corners of the square the rays of one side end nearer to the other.
        assert np.mean(np.abs(distance - 0.4) < 1e-3) > 0.9
        assert distance.max() < 0.4 + 1e-3


def test_a_corner_that_opens_has_a_fan_and_one_that_closes_has_none():
    surface = flat_surface(PLATE, 0.3)
    domain = Domain(surface)
    starts = start_on_boundary(domain, step=0.5 / domain.scale)
    rays = cast_rays(domain, starts, spacing=0.3 / domain.scale)
    start = rays.start * domain.scale + surface.vertices.mean(0)
    outer = np.linalg.norm(np.abs(start[:, :2]) - 5, axis=1) < 1e-3
    inner = np.linalg.norm(np.abs(start[:, :2] + [2.5, 2.0]) - 1, axis=1) < 1e-3
    assert not outer.any()
    assert inner.sum() == 4 * (np.ceil(np.pi / 2 / 0.1) + 1)


def test_seeds_keep_the_step_while_rings_grow_and_shrink():
    domain = square_domain()
    for radius in (2.0, 5.0):
        for n in (40, 500):  # vertices far apart, and crowded
            ring = draw(domain, circle(radius, n=n))
            starts = start_on_curves(domain, ring, step=0.4)
            start = cast_rays(domain, starts, spacing=0.1).start
            gaps = np.linalg.norm(np.roll(start, -1, axis=0) - start, axis=1)
            assert gaps.min() > 0.2
            assert gaps.max() < 0.4 * 1.31


def test_a_ring_moves_to_its_left():
    domain = square_domain()
    for ring, radius in ((circle(4.0, n=100), 3.0), (circle(4.0, n=100)[::-1], 5.0)):
        _, ends = ends_of(domain, start_on_curves(domain, draw(domain, ring), step=0.3), 1.0)
        np.testing.assert_allclose(np.linalg.norm(ends[:, :2], axis=1), radius, atol=0.01)


def test_a_small_ring_has_vertices_enough_to_be_round():
    domain = square_domain()
    starts = start_on_curves(domain, draw(domain, circle(0.8, n=60)), step=3.0)
    assert len(starts.halfedge) == pytest.approx(40, abs=20)
