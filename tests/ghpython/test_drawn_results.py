"""What the components draw of surfaces on which origins were chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rhino3dm

from open_cloth import CLOTHS
from weavecore.canvas.results import draw_surface
from weavecore.rhino_geometry import Drawing
from woven_tube import tube_surface


@pytest.fixture
def run() -> Any:
    return SimpleNamespace(drawing=Drawing(rhino3dm))


def drawn_points(curve: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in map(curve.Point, range(curve.PointCount))])


@pytest.mark.parametrize(("name", "closed"), [("side", [True]), ("hole", [True, True]), ("slit", [True, False])])
def test_borders_keep_their_places_and_origins_inside_follow(run: Any, name: str, closed: list[bool]) -> None:
    surface = CLOTHS[name]()
    borders, _ = draw_surface(run, surface)
    assert [curve.IsClosed for curve in borders] == closed
    for curve, loop in zip(borders, surface.borders):
        assert np.array_equal(drawn_points(curve)[:-1], surface.vertices[loop])
    if not closed[-1]:
        assert np.array_equal(drawn_points(borders[-1]), surface.vertices[surface.origins.paths[0]])
    assert len(draw_surface(run, tube_surface())[0]) == 2
