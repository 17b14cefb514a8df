"""Where fronts meet: one loop along a ridge, and nothing too narrow to weave."""

import numpy as np
import pytest

from flat_fields import flat_field, flat_surface, without_directions
from planar_meshes import circle, rectangle
from weavecore.offsetting.isolines.extract import trace_latitudes
from weavecore.validating import validate


def assert_holds(latitudes):
    report = validate(latitudes)
    assert report.holds, f"\n{report}"


def loops_per_generation(latitudes):
    return np.bincount(latitudes.generation).tolist()


@pytest.mark.parametrize("rise", [0.041, 0.1, 0.2, 0.4])
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_facing_borders_give_one_loop_however_little_the_ridge_rises_above_the_level(rise, seed):
    surface = flat_surface([rectangle(16, 6 + 2 * rise)], 0.25, seed)
    latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.0)
    assert loops_per_generation(latitudes) == [1, 1, 1, 1]
    assert_holds(latitudes)


def test_a_ridge_that_hardly_rises_above_a_level_gets_no_loop():
    surface = flat_surface([rectangle(16, 6.06)], 0.3)
    latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.0)
    assert loops_per_generation(latitudes) == [1, 1, 1]
    assert_holds(latitudes)


@pytest.mark.parametrize("neck", [1.8, 2.0, 2.06, 2.1, 2.2])
@pytest.mark.parametrize("directions", ["known", "unknown"])
def test_polylines_that_face_each_other_in_a_neck_keep_a_gap(neck, directions):
    left, right = circle(2.4, (-3.2, 0), 80), circle(2.4, (3.2, 0), 80)
    left, right = left[left[:, 0] < -3.2 + 2.1], right[right[:, 0] > 3.2 - 2.1]
    outline = np.concatenate([right, left, [[0, neck / 2], [0, -neck / 2]]])
    outline = outline[np.argsort(np.arctan2(outline[:, 1], outline[:, 0]))]
    surface = flat_surface([outline], 0.25, 3)
    field = flat_field(surface) if directions == "known" else without_directions(flat_field(surface))
    latitudes = trace_latitudes(surface, field, spacing=1.0)
    assert_holds(latitudes)
    first = np.flatnonzero(latitudes.generation == 1)
    assert len(first) in (1, 2)
    points = np.concatenate([latitudes.polylines.polyline(p) for p in first])
    near = points[np.abs(points[:, 0]) < 1.0]
    # Either two tips face each other along the neck, or the sides of one loop face across it.
    if len(first) == 2:
        tips = [latitudes.polylines.polyline(p)[:, 0] for p in first]
        assert max(t.min() for t in tips) - min(t.max() for t in tips) > 0.045
    else:
        assert near[near[:, 1] > 0][:, 1].min() - near[near[:, 1] < 0][:, 1].max() > 0.045


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_the_tip_of_a_narrow_tongue_is_cut_where_its_sides_come_too_near(seed):
    slope = np.tan(np.radians(5))
    surface = flat_surface([np.array([[0, 0], [30, 30 * slope], [34, 0], [30, -30 * slope]])], 0.25, seed)
    latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.0)
    assert_holds(latitudes)
    tongue = latitudes.polylines.polyline(1)
    tip = 1.0 / np.sin(np.radians(5))  # where both sides meet
    cut = 1.04 / np.sin(np.radians(5))
    assert tip + 0.1 < tongue[:, 0].min() < cut + 0.3
    above = tongue[:, 1] > 0
    assert (above != np.roll(above, 1)).sum() == 2
    near = np.abs(tongue[:, 0] - tongue[:, 0].min()) < 0.6
    sides = tongue[near & above][:, 1].max(), tongue[near & ~above][:, 1].min()
    assert sides[0] - sides[1] > 0.04


def test_a_corner_of_a_level_is_not_blunted():
    surface = flat_surface([rectangle(9, 9)], 0.3)
    latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.0)
    for level in (1, 2, 3, 4):
        square = latitudes.polylines.polyline(level)
        reach = np.abs(square[:, :2]).sum(1).max()
        assert reach > 2 * (4.5 - level) - 0.3
        off = np.abs(np.abs(square[:, :2]).max(1) - (4.5 - level))
        assert off.max() < 0.03
