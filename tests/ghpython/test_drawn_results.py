"""What the components draw: of surfaces on which origins were chosen, and of lattices whose rings rods leave."""

from __future__ import annotations

import sys
from base64 import b64decode, b64encode
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rhino3dm

from open_cloth import CLOTHS
from weavecore.canvas.results import draw_lattice, draw_surface
from weavecore.model import LATITUDINAL
from weavecore.rhino_geometry import Drawing
from weavecore.rhino_geometry.mesh_archive import mesh_archive
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


def test_a_mesh_of_whole_arrays_is_the_one_of_single_points(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    for n in (5, 70_000):
        points, quads = rng.normal(size=(n, 3)) * 1e5 + 1 / 3, rng.integers(0, n, (40, 4))
        whole = Drawing(rhino3dm).mesh(points, quads, colour=(10, 200, 30))
        with monkeypatch.context() as patch:
            patch.setattr("weavecore.rhino_geometry.drawing.mesh_archive", lambda _: None)
            single = Drawing(rhino3dm).mesh(points, quads, colour=(10, 200, 30))
        assert whole.Encode() == single.Encode()
    assert len(Drawing(rhino3dm).mesh(np.zeros((0, 3)), np.zeros((0, 4), np.int64)).Vertices) == 0


def test_an_archive_that_is_laid_out_otherwise_is_not_written() -> None:
    mesh = rhino3dm.Mesh

    def encode(self: Any) -> dict[str, Any]:
        encoded = mesh.Encode(self)
        content = b64decode(encoded["data"])
        return {**encoded, "data": b64encode(content[:56] + b"0" + content[56:]).decode()}

    def library(**content: Any) -> ModuleType:
        made = ModuleType("library")
        vars(made).update(content)
        return made

    longer = type("Mesh", (mesh,), {"Encode": encode})
    assert mesh_archive(rhino3dm) is not None
    assert mesh_archive(library(Mesh=longer, CommonObject=rhino3dm.CommonObject)) is None
    assert mesh_archive(library(Mesh=SimpleNamespace)) is None


def test_stubs_for_editors_are_not_taken_for_rhino(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("Rhino", "Rhino.Geometry"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    assert isinstance(Drawing().polyline(np.eye(3), is_closed=True), rhino3dm.Curve)
