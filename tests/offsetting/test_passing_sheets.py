"""Parts of a surface that pass through each other are noted, with places; those that do not are not."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore import pipeline


def strip(n: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """A sheet of 16 by 4 in the plane."""
    u, v = np.meshgrid(np.arange(4 * n + 1) * 4.0 / n, np.arange(n + 1) * 4.0 / n, indexing="ij")
    a = (np.arange(4 * n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.c_[a, a + n + 1, a + n + 2], np.c_[a, a + n + 2, a + 1]])
    return np.c_[u.ravel(), v.ravel(), np.zeros(u.size)], faces


def two_sheets(tilt: float, apart: float) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = strip()
    x, y, _ = (vertices - vertices.mean(0)).T
    turned = np.stack([0.7 * x + 0.1, 0.7 * y * np.cos(tilt) + 0.07, 0.7 * y * np.sin(tilt) + apart], axis=1)
    return np.concatenate([np.stack([x, y, 0 * x], axis=1), turned]), np.concatenate([faces, faces + len(vertices)])


@pytest.mark.parametrize(("tilt", "apart"), [(0.5, 0.0), (0.0, 0.02)])
def test_sheets_that_pass_through_or_touch_each_other_are_noted_with_places(tilt: float, apart: float) -> None:
    surface = pipeline.surface_from(two_sheets(tilt, apart))
    latitudes = pipeline.offset(surface, spacing=0.6)
    note = next(note for note in latitudes.surface.notes if note.code == "CROSSING")
    assert note.is_doubt
    assert dict(note.numbers)["count"] >= len(note.points) > 0
    assert np.abs(np.array(note.points)[:, 2]).max() < 0.3


@pytest.mark.parametrize(("tilt", "apart"), [(0.5, 3.0), (0.0, 2.0)])
def test_sheets_that_keep_apart_are_not_noted(tilt: float, apart: float) -> None:
    surface = pipeline.surface_from(two_sheets(tilt, apart))
    latitudes = pipeline.offset(surface, spacing=0.6)
    assert "CROSSING" not in {note.code for note in latitudes.surface.notes}


def test_a_sheet_that_crosses_itself_is_noted_where_it_does() -> None:
    flat, faces = strip()
    turn = (flat[:, 0] / 16 - 0.5) * 2.6 * np.pi
    # Rolled up by more than a turn: the ends pass through each other at the side x > 0.
    radius = 2.0 + 0.1 * turn * (flat[:, 1] - 2.0) / 2.0
    vertices = np.stack([-radius * np.cos(turn), radius * np.sin(turn), flat[:, 1]], axis=1)
    latitudes = pipeline.offset(pipeline.surface_from((vertices, faces)), spacing=0.6)
    note = next(note for note in latitudes.surface.notes if note.code == "CROSSING")
    assert np.array(note.points)[:, 0].min() > 0
