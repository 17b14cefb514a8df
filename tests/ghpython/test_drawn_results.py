"""What the components draw: of surfaces on which origins were chosen, and of lattices whose rings rods leave."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rhino3dm

from open_cloth import CLOTHS
from weavecore.canvas.results import draw_lattice, draw_surface
from weavecore.model import LATITUDINAL
from weavecore.rhino_geometry import Drawing
from weavecore.weaving.strands import find_strands
from woven_rods import woven_sample
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


def test_every_edge_along_a_latitude_is_drawn_with_the_rings_of_its_generation(run: Any) -> None:
    lattice = woven_sample("narrow_neck", "triangular").lattice
    along = lattice.edge_family == LATITUDINAL
    rods = find_strands(lattice)
    lengths = np.diff(rods.offsets) - ~rods.closed
    assert lengths[rods.family == LATITUDINAL].sum() < np.count_nonzero(along)
    run.tree = list
    rings = [curve for _, curves in draw_lattice(run, lattice).rings for curve in curves]
    assert sum(curve.PointCount - 1 for curve in rings) == np.count_nonzero(along)
