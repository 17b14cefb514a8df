"""Elementary functions made of exact operations, against those of NumPy."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.elementary import arctangents, logarithms, sines_and_cosines

DRAW = np.random.default_rng(1)


def assert_near(found: np.ndarray, wanted: np.ndarray, units: float) -> None:
    """Within so many units in the last place."""
    assert (np.abs(found - wanted) <= units * np.spacing(np.abs(wanted))).all()


def test_arc_tangents_of_all_directions() -> None:
    x, y = DRAW.normal(size=(2, 20_000)) * 10.0 ** DRAW.uniform(-8, 8, (2, 20_000))
    assert_near(arctangents(y, x), np.arctan2(y, x), 2)


def test_arc_tangents_along_the_axes() -> None:
    y, x = np.array([0.0, 0.0, 1.0, -1.0, 0.0]), np.array([1.0, -1.0, 0.0, 0.0, 0.0])
    assert arctangents(y, x).tolist() == [0.0, np.pi, np.pi / 2, -np.pi / 2, 0.0]


def test_logarithms_near_one_and_far_from_it() -> None:
    for reach in (1e-3, 1.0, 300.0):
        x = np.exp(DRAW.uniform(-reach, reach, 20_000))
        assert_near(logarithms(x), np.log(x), 2)
    assert logarithms(np.array([1.0])).tolist() == [0.0]


def test_sines_and_cosines_of_some_turns() -> None:
    angle = DRAW.uniform(-20, 20, 20_000)
    sine, cosine = sines_and_cosines(angle)
    assert np.abs(sine - np.sin(angle)).max() < 4e-16
    assert np.abs(cosine - np.cos(angle)).max() < 4e-16
    assert sines_and_cosines(np.array([0.0]))[1].tolist() == [1.0]
