"""Files far from the origin, in tiny and in huge units: the same lattice, its coordinates moved and scaled."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rhino_shapes as make
from shell import make_shell
from weavecore.model import Lattice, Polylines
from weavecore.pipeline import link, offset, read_surface, surface_from, weave

r = pytest.importorskip("rhino3dm")

SPACING = 0.25
AT_THE_ORIGIN = (1.0, (0.0, 0.0, 0.0))
PLACES = {
    "ten million away": (1.0, (1e7, -1e7, 1e7)),
    "a millionth": (1e-6, (0.0, 0.0, 0.0)),
    "a million times": (1e6, (0.0, 0.0, 0.0)),
    "a millionth and far away": (1e-6, (3.0, -7.0, 5.0)),
}


SMOOTHED = 1e-5
"""Parts of the surface's unit: conjugate gradients of the smoothing make more of rounding errors, here up to 6e-6."""


def rounding(scale: float, shift: tuple[float, ...]) -> float:
    """How much the rounding of the input may show, in parts of the surface's unit: steps of the coordinates there."""
    return SMOOTHED + 1e4 * float(np.spacing(np.abs(shift).max())) / scale


def assert_same_but_moved(one: Lattice, other: Lattice, scale: float, shift: tuple[float, ...]) -> None:
    for name in ("edges", "face_offsets", "edge_family", "node_latitude"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert np.abs((other.nodes - shift) / scale - one.nodes).max() <= rounding(scale, shift)


def saved(folder: Path, name: str, scale: float, shift: tuple[float, ...]) -> Path:
    shape: Any = getattr(make, name)()
    shape = shape if isinstance(shape, r.Brep) else r.Brep.CreateFromSurface(shape)
    shape.Scale(scale)
    shape.Translate(r.Vector3d(*shift))
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    model.Objects.Add(shape, r.ObjectAttributes())
    path = folder / f"{name}.3dm"
    model.Write(str(path), 8)
    return path


def lattice_of(path: Path, scale: float) -> Lattice:
    return link(offset(read_surface(path), spacing=SPACING * scale))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", ["saddle", "bowl", "fan"])
def test_a_surface_gives_the_same_lattice_wherever_it_lies_and_whatever_its_unit(tmp_path, name, place):
    still = lattice_of(saved(tmp_path, name, *AT_THE_ORIGIN), 1.0)
    moved = lattice_of(saved(tmp_path, name, *PLACES[place]), PLACES[place][0])
    assert_same_but_moved(still, moved, *PLACES[place])


@cache
def shell() -> tuple[np.ndarray, np.ndarray]:
    return make_shell(1500)


@cache
def still_shell() -> Lattice:
    return link(offset(surface_from(shell()), spacing=0.13))


@pytest.mark.parametrize("place", ["a millionth", "a million times"])
def test_a_mesh_gives_the_same_lattice_and_rods_whatever_its_unit(place):
    scale, shift = PLACES[place]
    vertices, faces = shell()
    lattice = link(offset(surface_from((vertices * scale + shift, faces)), spacing=0.13 * scale))
    assert_same_but_moved(still_shell(), lattice, scale, shift)
    one, other = weave(still_shell()).strands, weave(lattice).strands
    assert np.array_equal(one.nodes, other.nodes)
    assert np.array_equal(one.offsets, other.offsets)


@pytest.mark.parametrize("place", ["ten million away", "a millionth and far away"])
def test_a_mesh_far_away_gives_a_lattice_of_the_same_rings(place):
    """Its vertices are rounded to parts of 1e-9: a point on a ridge may move by more, a ring may not."""
    scale, shift = PLACES[place]
    vertices, faces = shell()
    lattice = link(offset(surface_from((vertices * scale + shift, faces)), spacing=0.13 * scale))
    one, other = still_shell().latitudes, lattice.latitudes
    assert np.array_equal(one.generation, other.generation)
    assert np.array_equal(one.parents, other.parents)
    lengths = [ring_lengths(rings.polylines) for rings in (one, other)]
    assert lengths[1] / scale == pytest.approx(lengths[0], rel=1e-3)


def ring_lengths(rings: Polylines) -> np.ndarray:
    parts = [rings.polyline(p) for p in range(len(rings))]
    return np.array([np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum() for ring in parts])
