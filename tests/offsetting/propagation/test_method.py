"""The method as a whole on surfaces whose offsets are known (Yan et al. 2016, §4.3 to §4.6)."""

import numpy as np
import pytest

from flat_fields import distance_at, flat_surface
from planar_meshes import circle, rectangle
from tough_register import grid
from weavecore.errors import SpacingTooLarge, TooMuchWork, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.offsetting.propagation.method import offset_fronts
from weavecore.validating import validate


def hold(latitudes):
    report = validate(latitudes)
    assert report.holds, f"\n{report}"
    return latitudes


def tube(length, radius=1.0, around=60):
    """A cylinder with two borders, that far apart."""
    n = max(2, round(length / (2 * np.pi * radius / around))) + 1
    angle, z = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0, length, n), indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)
    return SurfaceMesh(points, grid(around, n, wrap_u=True))


def errors(surface, latitudes):
    """How far the points of all children are from their distance, on a plane."""
    owner = latitudes.polylines.owner
    children = latitudes.generation[owner] > 0
    distance, _ = distance_at(surface, latitudes.polylines.points[children])
    return np.abs(distance - latitudes.distance[owner[children]]) / latitudes.spacing


DUMBBELL = np.array([[-6, -3], [-1.5, -3], [-1, -0.8], [1, -0.8], [1.5, -3], [6, -3]], float)
DUMBBELL = np.concatenate([DUMBBELL, -DUMBBELL])


@pytest.mark.parametrize(
    ("loops", "spacing", "counts"),
    [
        ([circle(5.0, n=120)], 0.7, [1] * 8),  # a plain circle (Fig. 3, left)
        ([DUMBBELL], 0.5, [1, 1, 2, 2, 2, 2]),  # a border that pinches itself (Fig. 3, middle)
        ([rectangle(12, 12), circle(1.5, (-2, 0.2), n=60), circle(1.5, (2.1, 0), n=60)], 0.7, [3, 2, 2]),
    ],
)
def test_plates_are_covered_and_every_point_is_as_far_as_its_generation(loops, spacing, counts):
    surface = flat_surface(loops, 0.25)
    latitudes = hold(offset_fronts(surface, spacing=spacing))
    assert np.bincount(latitudes.generation).tolist()[: len(counts)] == counts
    off = errors(surface, latitudes)
    assert off.mean() < 0.005
    assert off.max() < 0.03


def test_fronts_of_two_borders_that_meet_have_a_common_child():
    surface = flat_surface([rectangle(12, 12), circle(1.5, (-1.9, 0.2), n=60), circle(1.5, (1.9, 0), n=60)], 0.25)
    latitudes = hold(offset_fronts(surface, spacing=0.5))
    children = latitudes.parents[latitudes.parents[:, 0] > 0]
    both = [set(children[children[:, 1] == c, 0].tolist()) for c in np.unique(children[:, 1])]
    assert {1, 2} in both


@pytest.mark.parametrize("length", [2.1, 2.3, 2.9, 3.1, 3.5, 3.95])
def test_parallel_fronts_that_pass_each_other_on_a_tube_have_no_child(length):
    # The second steps never cross: they change places.
    latitudes = hold(offset_fronts(tube(length), spacing=0.99))
    assert np.bincount(latitudes.generation).tolist() == [2, 2]


@pytest.mark.parametrize(("beyond", "n_rings"), [(0.02, 2), (0.12, 4)])
def test_a_pocket_shallower_than_the_least_cap_gets_no_rings(beyond, n_rings):
    latitudes = hold(offset_fronts(tube(4.0 + 2 * beyond), spacing=1.0))
    assert np.bincount(latitudes.generation).tolist() == [2] * (n_rings // 2 + 1)


def test_a_front_that_shrinks_to_a_point_does_not_come_out_on_the_other_side():
    for radius in (2.5, 2.02, 2.96):
        latitudes = hold(offset_fronts(flat_surface([circle(radius, n=90)], 0.15), spacing=1.0))
        assert np.bincount(latitudes.generation).tolist() == [1, 1, 1] if radius > 2.04 else [1, 1]


def test_a_closed_surface_is_offset_from_both_sides_of_its_cut():
    vertices = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[k, (k + 1) % 4, 4] for k in range(4)] + [[(k + 1) % 4, k, 5] for k in range(4)])
    latitudes = hold(offset_fronts(SurfaceMesh(vertices, faces, cuts=(np.arange(4),)), spacing=0.2))
    assert np.array_equal(latitudes.polylines.polyline(0), vertices[:4])
    assert np.bincount(latitudes.generation).tolist() == [1] + [2] * 6


def test_two_triangles_are_refined_until_the_fronts_fit():
    square = SurfaceMesh([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]], unit="Meters", name="a")
    latitudes = hold(offset_fronts(square, spacing=0.6))
    assert np.bincount(latitudes.generation).tolist() == [1, 1, 1, 1]
    assert (latitudes.surface.unit, latitudes.surface.name) == ("Meters", "a")
    assert errors(latitudes.surface, latitudes).max() < 0.01


def test_a_moved_and_scaled_surface_gives_the_same_rings_moved_and_scaled():
    surface = flat_surface([DUMBBELL], 0.3)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = SurfaceMesh(40.0 * surface.vertices @ turn.T + [100.0, -30.0, 7.0], surface.faces)
    here, there = offset_fronts(surface, spacing=0.5), offset_fronts(moved, spacing=20.0)
    assert here.generation.tolist() == there.generation.tolist()
    assert here.parents.tolist() == there.parents.tolist()
    np.testing.assert_allclose(there.polylines.lengths, 40.0 * here.polylines.lengths, rtol=1e-3)


def test_the_same_surface_gives_the_same_bytes():
    surface = flat_surface([DUMBBELL], 0.3)
    one, other = offset_fronts(surface, spacing=0.5), offset_fronts(surface, spacing=0.5)
    assert one.polylines.points.tobytes() == other.polylines.points.tobytes()


@pytest.mark.parametrize("spacing", [0, -1.0, float("nan"), float("inf")])
def test_a_spacing_that_is_no_length_is_refused(spacing):
    with pytest.raises(Unsupported, match="positive"):
        offset_fronts(flat_surface([circle(1.0)], 0.4), spacing=spacing)


def test_a_spacing_too_large_or_too_small_is_refused():
    surface = flat_surface([rectangle(2, 2)], 0.3)
    with pytest.raises(SpacingTooLarge) as caught:
        offset_fronts(surface, spacing=50.0)
    recommended = float(caught.value.remedy.split()[4])
    assert offset_fronts(surface, spacing=recommended).generation.max() >= 1
    with pytest.raises(TooMuchWork):
        offset_fronts(surface, spacing=1e-5)


def test_progress_is_reported_and_can_cancel():
    class Cancelled(Exception):
        pass

    reported = []

    def stop(fraction, label):
        reported.append((fraction, label))
        if len(reported) > 1:
            raise Cancelled

    with pytest.raises(Cancelled):
        offset_fronts(flat_surface([circle(5.0, n=120)], 0.3), spacing=0.7, progress=stop)
    assert all(0 <= fraction <= 1 and label for fraction, label in reported)
    assert reported[0][0] < reported[1][0]
