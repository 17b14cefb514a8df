import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from distance_oracles import flat_distance, rolled, sector_distance, sector_sheet
from planar_meshes import circle, plate, rectangle
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.rays import front_distance
from weavecore.offsetting.distance.solver import measure_distance


def errors(surface, exact, field=None):
    """Errors at the vertices in mean edge lengths."""
    field = field or measure_distance(surface)
    assert np.isfinite(field.distance).all()
    return np.abs(field.distance - exact) / surface.edge_lengths.mean()


def shapes():
    star = np.array([[3, 0], [1, 0.8], [0, 3], [-0.6, 0.5], [-3, 0.2], [-0.8, -0.7], [0.3, -3], [0.9, -0.6]], float)
    return {
        "disc": [circle(1.0)],
        "rectangle": [rectangle(2.0, 1.0)],
        "star": [star],
        "annulus": [circle(1.0), circle(0.3, n=16)[::-1]],
        "plate with three holes": [rectangle(3, 2), *(circle(0.2, (x, 0.3 * x), n=9)[::-1] for x in (-0.9, 0, 0.9))],
        "plate with a slit": [rectangle(2, 2), rectangle(1.2, 0.01)[::-1]],
        "rooms": [np.array([[0, 0], [4, 0], [4, 3], [2.2, 3], [2.2, 1], [1.8, 1], [1.8, 3], [0, 3]], float)],
    }


@pytest.mark.parametrize("name", shapes())
def test_plane_surfaces_are_measured_to_a_hundredth_of_an_edge(name):
    loops = shapes()[name]
    size = np.ptp(loops[0], axis=0).max()
    surface = SurfaceMesh(*plate(loops, size / 30, jitter=0.25, rng=np.random.default_rng(1)))
    error = errors(surface, flat_distance(surface))
    assert error.mean() < 0.002
    assert np.quantile(error, 0.99) < 0.04


def test_directions_are_unit_tangents_away_from_the_border():
    surface = SurfaceMesh(*plate([circle(1.0)], 0.08))
    field = measure_distance(surface)
    inner = (field.distance > 0) & (np.linalg.norm(surface.vertices, axis=1) > 0.1)
    inward = -surface.vertices[inner] / np.linalg.norm(surface.vertices[inner], axis=1)[:, None]
    assert ((field.gradient[inner] * inward).sum(1) > 0.99).all()
    np.testing.assert_allclose(np.linalg.norm(field.gradient[inner], axis=1), 1.0, atol=1e-9)
    assert (field.gradient[field.distance == 0] == 0).all()


def test_rolling_a_plate_up_keeps_its_distances():
    vertices, faces = plate([rectangle(3, 2), circle(0.3, n=20)[::-1]], 0.08)
    flat = SurfaceMesh(vertices, faces)
    roll = SurfaceMesh(rolled(vertices, 0.8), faces)
    np.testing.assert_allclose(
        measure_distance(roll).distance, measure_distance(flat).distance, atol=0.05 * flat.edge_lengths.mean()
    )


def test_a_front_on_a_hemisphere_is_a_circle_of_latitude():
    vertices, faces = plate([circle(1.0, n=80)], 0.07)
    polar = np.linalg.norm(vertices, axis=1) * np.pi / 2
    ring = np.where(polar > 0, np.sin(polar) / np.maximum(polar * 2 / np.pi, 1e-12), 1.0)
    dome = np.stack([vertices[:, 0] * ring, vertices[:, 1] * ring, np.cos(polar)], axis=1)
    surface = SurfaceMesh(dome, faces)
    error = errors(surface, np.pi / 2 - polar)
    assert error.max() < 0.02 + np.pi**3 / 48 * (surface.edge_lengths.mean() ** 2) / surface.edge_lengths.mean()


@pytest.mark.parametrize("sectors", [3, 4, 5, 6, 8, 10])
def test_around_a_cone_point_or_saddle_distances_are_those_of_the_sectors_laid_flat(sectors):
    surface, polar = sector_sheet([1.0] * sectors, 12)
    assert errors(surface, sector_distance([1.0] * sectors, polar)).max() < 0.02


@pytest.mark.parametrize(
    "radii", [[1, 1, 3, 3, 3, 3, 3, 3], [1, 1, 3, 4, 4, 4, 4, 4, 4, 3], [1, 1, 2, 2], [1, 2, 1, 3, 2]]
)
def test_the_shadow_behind_a_saddle_is_reached_through_it(radii):
    surface, polar = sector_sheet(radii, 24)
    error = errors(surface, sector_distance(radii, polar))
    assert error.mean() < 0.02
    assert np.quantile(error, 0.99) < 0.15


def test_each_side_of_a_cut_is_measured_on_its_own():
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 41)[:-1], np.linspace(-1, 1, 17), indexing="ij")
    points = np.stack([np.cos(u), np.sin(u), v], axis=-1).reshape(-1, 3)
    cell = np.arange(40 * 17).reshape(40, 17)
    after = np.roll(cell, -1, axis=0)
    a, b, c, d = (x.ravel() for x in (cell[:, :-1], after[:, :-1], after[:, 1:], cell[:, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    cut = np.flatnonzero(points[:, 2] == 0.25)
    surface = SurfaceMesh(points, faces, cuts=(cut,))
    exact = np.minimum(np.minimum(1 - points[:, 2], points[:, 2] + 1), np.abs(points[:, 2] - 0.25))
    assert errors(surface, exact).max() < 1e-6


def test_the_front_opens_at_the_turns_of_a_cut():
    n = 33
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    cell = np.arange(n * n).reshape(n, n)
    a, b, c, d = (q.ravel() for q in (cell[:-1, :-1], cell[1:, :-1], cell[1:, 1:], cell[:-1, 1:]))
    low, high = 14, 18
    square = [cell[low, low:high], cell[low:high, high], cell[high, high:low:-1], cell[high:low:-1, low]]
    cut = np.concatenate(square)
    surface = SurfaceMesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), cuts=(cut,))
    side = points[cell[high, 0], 0]
    outside = np.maximum(np.abs(points[:, :2]) - side, 0)
    inside = side - np.abs(points[:, :2]).max(axis=1)
    to_cut = np.where(inside > 0, inside, np.hypot(*outside.T))
    exact = np.minimum(to_cut, 1 - np.abs(points[:, :2]).max(axis=1))
    assert errors(surface, exact).max() < 0.05


def test_needles_and_great_changes_of_scale_do_not_matter():
    x = np.concatenate([[0], np.cumsum(1.25 ** np.arange(24))])
    x = x / x[-1]
    u, v = np.meshgrid(x, np.linspace(0, 1, 9), indexing="ij")
    points = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3)
    cell = np.arange(25 * 9).reshape(25, 9)
    a, b, c, d = (q.ravel() for q in (cell[:-1, :-1], cell[1:, :-1], cell[1:, 1:], cell[:-1, 1:]))
    surface = SurfaceMesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    assert errors(surface, flat_distance(surface)).max() < 0.02


@given(st.integers(0, 2**31 - 1))
def test_rough_surfaces_get_no_distance_that_breaks_the_triangle_rule(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = plate([circle(1.0)], 0.13)
    vertices[:, 2] = rng.normal(0, 0.03, len(vertices))
    surface = SurfaceMesh(vertices, faces)
    distance = measure_distance(surface).distance
    rise = np.abs(distance[surface.faces] - np.roll(distance[surface.faces], -1, axis=1)).ravel()
    assert (rise <= 1.15 * surface.edge_lengths).all()


def test_the_same_surface_gives_the_same_bytes():
    surface = SurfaceMesh(*plate(shapes()["annulus"], 0.08))
    first, second = measure_distance(surface), measure_distance(surface)
    assert first.distance.tobytes() == second.distance.tobytes()
    assert first.gradient.tobytes() == second.gradient.tobytes()


def test_progress_rises_and_can_cancel():
    surface = SurfaceMesh(*plate([circle(1.0)], 0.08))
    seen = []
    measure_distance(surface, progress=lambda part, _: seen.append(part))
    assert seen == sorted(seen)
    assert seen[0] > 0
    assert seen[-1] <= 1

    class Cancelled(Exception):
        pass

    def cancel(part, label):
        raise Cancelled

    with pytest.raises(Cancelled):
        measure_distance(surface, progress=cancel)


@given(st.floats(0.05, 20), st.floats(0.01, 3), st.floats(-3, 3))
def test_distance_from_a_round_front_is_that_from_its_centre_less_its_radius(radius, forward, lateral):
    distance, ahead, aside = front_distance(np.array([1 / radius]), np.array([forward]), np.array([lateral]))
    far = np.hypot(radius + forward, lateral)
    assert distance[0] == pytest.approx(far - radius, abs=1e-9)
    assert (ahead[0], aside[0]) == pytest.approx(((radius + forward) / far, lateral / far), abs=1e-9)


def test_distance_from_flat_fronts_and_points():
    k, forward, lateral = np.array([0.0, np.inf]), np.array([2.0, 3.0]), np.array([5.0, 4.0])
    distance, ahead, aside = front_distance(k, forward, lateral)
    assert distance.tolist() == [2.0, 5.0]
    assert ahead.tolist() == [1.0, 0.6]
    assert aside.tolist() == [0.0, 0.8]
