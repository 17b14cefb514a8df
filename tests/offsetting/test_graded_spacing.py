"""Spacings graded by points with factors: what the field is, and where the rings lie that it moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import TooMuchWork, Unsupported
from weavecore.model import Latitudes, SurfaceMesh
from weavecore.offsetting.graded_spacing import SpacingField, spacing_field

RADIUS, HEIGHT, COLUMNS = 100.0, 600.0, 96
REACH = 200.0


@pytest.fixture(scope="module")
def tube() -> SurfaceMesh:
    """An upright tube, whose rings are circles at their distance from the lower border."""
    turn = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    circle = RADIUS * np.c_[np.cos(turn), np.sin(turn)]
    rows = np.linspace(0.0, HEIGHT, 61)
    vertices = np.concatenate([np.c_[circle, np.full(COLUMNS, z)] for z in rows])
    r, j = (part.ravel() for part in np.meshgrid(np.arange(len(rows) - 1), np.arange(COLUMNS), indexing="ij"))
    a, b = r * COLUMNS + j, r * COLUMNS + (j + 1) % COLUMNS
    return SurfaceMesh(vertices, np.concatenate([np.c_[a, b, b + COLUMNS], np.c_[a, b + COLUMNS, a + COLUMNS]]))


def graded(surface: SurfaceMesh, *factors: Any, **options: Any) -> Latitudes:
    lowest = int(np.argmin([surface.vertices[loop][:, 2].mean() for loop in surface.borders]))
    return pipeline.offset(surface, borders=[lowest], factors=factors, **{"spacing": 40.0, "reach": REACH, **options})


def means_on_circles(field: SpacingField, z: np.ndarray) -> np.ndarray:
    """The mean of a field around the tube at each height."""
    turn = 2 * np.pi * np.arange(360) / 360
    places = [np.c_[RADIUS * np.cos(turn), RADIUS * np.sin(turn), np.full(len(turn), height)] for height in z]
    return field.at(np.concatenate(places)).reshape(len(z), -1).mean(axis=1)


def graded_distance(field: SpacingField, to: np.ndarray) -> np.ndarray:
    z = np.linspace(0.0, HEIGHT, 2001)
    slope = 1.0 / means_on_circles(field, z)
    along = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(z))])
    return np.interp(to, z, along)


def test_the_field_is_the_factor_at_its_point_its_root_at_the_reach_and_1_far_away() -> None:
    field = SpacingField(np.array([[0.0, 0, 0]]), np.array([0.25]), 10.0)
    places = np.array([[0.0, 0, 0], [10.0, 0, 0], [0, 1000.0, 0]])
    assert field.at(places) == pytest.approx([0.25, 0.5, 1.0], rel=1e-6)
    two = SpacingField(np.array([[0.0, 0, 0], [3.0, 0, 0]]), np.array([0.25, 4.0]), 10.0)
    assert two.at(np.array([[3.0, 0, 0], [1.5, 0, 0]])) == pytest.approx([4.0, 1.0])


@pytest.mark.parametrize("place", [(0.0, 0.0, 300.0), (RADIUS, 0.0, 300.0)], ids=["on the axis", "on the tube"])
@pytest.mark.parametrize("method", pipeline.METHODS)
def test_rings_lie_where_the_mean_of_the_factor_along_them_puts_them(
    tube: SurfaceMesh, place: tuple[float, float, float], method: str
) -> None:
    latitudes = graded(tube, (place, 0.4), method=method)
    field = spacing_field(tube, [(place, 0.4)], REACH)
    assert field is not None
    expected = 40.0 * latitudes.generation
    assert graded_distance(field, latitudes.distance) == pytest.approx(expected, abs=0.005 * 40.0)
    steps = latitudes.steps
    assert steps.min() < 0.8 * steps[0] < 40.0
    assert pipeline.validate(latitudes).broken == ()
    z = [latitudes.polylines.polyline(p)[:, 2] for p in range(len(latitudes))]
    assert max(float(np.ptp(heights)) for heights in z) < 1e-3, "rings stay parallel"


def test_only_a_factor_that_varies_along_a_ring_is_noted(tube: SurfaceMesh) -> None:
    on_axis = graded(tube, ((0.0, 0.0, 300.0), 0.4)).surface.notes
    assert [note for note in on_axis if note.code == "GRADED"] == []
    (note,) = (one for one in graded(tube, ((RADIUS, 0, 300.0), 0.4)).surface.notes if one.code == "GRADED")
    numbers = dict(note.numbers)
    assert 1.5 < numbers["ratio"] < 2.5
    assert 0.4 < numbers["mean"] < 0.9
    assert not note.is_doubt


def test_several_spacings_are_graded_one_after_the_other(tube: SurfaceMesh) -> None:
    everywhere = ((0.0, 0.0, 300.0), 0.5)
    steps = graded(tube, everywhere, spacing=[40.0, 60.0, 80.0], reach=1e6).steps
    assert steps[:3] == pytest.approx([20.0, 30.0, 40.0], rel=1e-3)
    assert steps[3:] == pytest.approx(np.full(len(steps) - 3, 40.0), rel=1e-3)


def test_without_points_and_at_a_factor_of_1_nothing_changes(tube: SurfaceMesh) -> None:
    plain = graded(tube)
    neutral = graded(tube, ((0.0, 0.0, 300.0), 1.0))
    assert np.allclose(plain.distance, neutral.distance, rtol=0, atol=1e-9)
    assert len(plain.steps) == len(neutral.steps) == 1


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (((0, 0), 0.5), "the point (0, 0)"),
        (((0, 0, np.nan), 0.5), "the point (0, 0, nan)"),
        (("abc", 0.5), "'abc' with 0.5"),
        (((0, 0, 0), "half"), "'half'"),
        (((0, 0, 0), 0.0), "the factor 0.0"),
        (((0, 0, 0), -1), "the factor -1"),
        (((0, 0, 0), np.inf), "the factor inf"),
    ],
)
def test_what_is_no_point_or_no_factor_is_refused_in_words(tube: SurfaceMesh, factor: Any, words: str) -> None:
    with pytest.raises(Unsupported, match="needs a point of three numbers and a positive factor") as refused:
        graded(tube, factor)
    assert words in str(refused.value)


def test_a_reach_that_is_no_length_and_a_factor_that_gives_too_many_rings_are_refused(tube: SurfaceMesh) -> None:
    with pytest.raises(Unsupported, match="The reach must be positive"):
        graded(tube, ((0, 0, 0), 0.5), reach=-1.0)
    with pytest.raises(TooMuchWork):
        graded(tube, ((0, 0, 300.0), 1e-12), reach=1e6)
