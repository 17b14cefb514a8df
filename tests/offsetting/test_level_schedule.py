"""Level schedule: distances of the generations, of one spacing or several."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bound_rings import check_weave, cylinder, hemisphere
from weavecore import pipeline
from weavecore.errors import SpacingTooLarge, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.offsetting.level_sets import offset_levels
from weavecore.offsetting.spacing import LevelSchedule
from weavecore.validating import validate

STEPS = st.lists(st.floats(0.01, 100.0), min_size=1, max_size=6)


@given(steps=STEPS, heights=st.lists(st.floats(0.0, 12.0), min_size=1))
def test_a_level_index_gives_its_distance_and_back(steps: list[float], heights: list[float]) -> None:
    schedule = LevelSchedule.of(steps)
    there = schedule.distance_of(np.array(heights))
    np.testing.assert_allclose(schedule.level_index(there), heights, atol=1e-9)


@given(steps=STEPS)
def test_each_generation_lies_one_step_beyond_the_one_before_and_the_last_step_goes_on(steps: list[float]) -> None:
    schedule = LevelSchedule.of(steps)
    distance = schedule.distance_of(np.arange(len(steps) + 4.0))
    np.testing.assert_allclose(np.diff(distance), steps + 3 * steps[-1:])
    assert schedule.levels_below(distance).tolist() == list(range(len(distance)))
    assert schedule.levels_below(distance[1:] - 1e-3 * min(steps)).tolist() == list(range(len(distance) - 1))


@pytest.mark.parametrize("wrong", [[], [1.0, 0.0], [1.0, -2.0], [float("nan")], 0.0, float("inf")])
def test_what_is_no_spacing_is_refused(wrong: object) -> None:
    with pytest.raises(Unsupported):
        LevelSchedule.of(wrong)  # type: ignore[arg-type]


def test_rings_of_a_tube_lie_at_the_distances_that_were_asked_for() -> None:
    surface = SurfaceMesh(*cylinder())
    depth = float(np.ptp(surface.vertices[:, 2])) / 2
    steps = [0.1 * depth, 0.2 * depth, 0.15 * depth]
    latitudes = offset_levels(surface, spacing=steps)
    wanted = np.array([0.0, 0.1, 0.3, 0.45, 0.6, 0.75, 0.9]) * depth
    np.testing.assert_allclose(np.unique(np.round(latitudes.distance, 12)), wanted)
    low, high = surface.vertices[:, 2].min(), surface.vertices[:, 2].max()
    for p in range(len(latitudes)):
        z = latitudes.polylines.polyline(p)[:, 2]
        np.testing.assert_allclose(np.minimum(z - low, high - z), latitudes.distance[p], atol=1e-4 * depth)
    assert latitudes.spacing == pytest.approx(0.2 * depth)


def test_the_spacing_that_follows_the_last_generation_counts() -> None:
    surface = SurfaceMesh(*cylinder())
    depth = float(np.ptp(surface.vertices[:, 2])) / 2
    latitudes = offset_levels(surface, spacing=[0.4 * depth, 0.7 * depth])
    assert latitudes.generation.max() == 1
    assert latitudes.spacing == pytest.approx(0.7 * depth)
    # What lies beyond the last polyline is deeper than the one spacing before it.
    assert validate(latitudes).holds, str(validate(latitudes))


def test_several_spacings_give_a_lattice_that_holds() -> None:
    latitudes = offset_levels(SurfaceMesh(*hemisphere()), spacing=[0.05, 0.1, 0.2, 0.12])
    assert validate(latitudes).holds, str(validate(latitudes))
    check_weave(pipeline.link(latitudes))


def test_the_same_spacing_several_times_is_that_spacing() -> None:
    one, several = (offset_levels(SurfaceMesh(*hemisphere()), spacing=spacing) for spacing in (0.125, [0.125, 0.125]))
    np.testing.assert_allclose(several.polylines.points, one.polylines.points, atol=1e-12)
    assert several.spacing == one.spacing


def test_a_first_spacing_that_leaves_no_room_is_too_large_whatever_follows() -> None:
    with pytest.raises(SpacingTooLarge):
        offset_levels(SurfaceMesh(*hemisphere()), spacing=[5.0, 0.1])


def test_both_methods_take_several_spacings_and_agree() -> None:
    surface = SurfaceMesh(*hemisphere())
    levels, fronts = (pipeline.offset(surface, spacing=[0.1, 0.2, 0.15], method=m) for m in ("levels", "fronts"))
    np.testing.assert_allclose(fronts.distance, levels.distance)
    assert fronts.spacing == levels.spacing
    assert validate(fronts).holds, str(validate(fronts))
    for p in range(len(levels)):
        heights = [latitudes.polylines.polyline(p)[:, 2].mean() for latitudes in (levels, fronts)]
        assert heights[0] == pytest.approx(heights[1], abs=2e-3)
