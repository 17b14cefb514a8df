"""Plates that are offset from chosen origins, so that the other borders cut the polylines: for tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.linking.link import link_pattern
from weavecore.model import Latitudes, Origins, SurfaceMesh, Weave
from weavecore.offsetting.level_sets import offset_levels
from weavecore.weaving.weave import weave_lattice

COLUMNS, ROWS, EDGE = 24, 16, 10.0
SPACING = 23.0


def plate(keep: Callable[[Floats], Ints] | None = None) -> SurfaceMesh:
    """A flat grid of 24 by 16 squares, each cut in two, of which the faces with certain middles (F, 3) are kept.

    Middles are told in squares, as are the places of `path_through`.
    """
    x, y = np.meshgrid(np.arange(COLUMNS + 1.0), np.arange(ROWS + 1.0))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    column, row = (k.ravel() for k in np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)))
    a = row * (COLUMNS + 1) + column
    b, c, d = a + 1, a + COLUMNS + 2, a + COLUMNS + 1
    even = ((row + column) % 2 == 0)[:, None]
    one = np.where(even, np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    other = np.where(even, np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    faces = np.stack([one, other], axis=1).reshape(-1, 3)
    if keep is not None:
        faces = faces[keep(vertices[faces].mean(1))]
    used, faces = np.unique(faces, return_inverse=True)
    return SurfaceMesh(vertices[used] * EDGE, faces.reshape(-1, 3), unit="Millimeters")


def path_through(surface: SurfaceMesh, *places: tuple[float, float]) -> Ints:
    """Vertices in rows of the grid from each place to the next."""
    number = {(x, y): v for v, (x, y, _) in enumerate((surface.vertices / EDGE).tolist())}
    path = [number[places[0]]]
    for (x, y), (u, v) in zip(places, places[1:]):
        n = int(max(abs(u - x), abs(v - y)))
        path += [number[x + (u - x) * k / n, y + (v - y) * k / n] for k in range(1, n + 1)]
    return np.array(path)


def started(surface: SurfaceMesh, *paths: Ints, closed: bool = False) -> SurfaceMesh:
    """The surface with distances that start at these paths alone."""
    return replace(surface, starts=Origins(paths, np.full(len(paths), closed)))


def _around_a_hole(middle: Floats) -> Ints:
    return np.abs(middle[:, :2] - (11.0, 7.0)).max(1) > 3.0


def from_side() -> SurfaceMesh:
    """From the left side; the three others are selvedges."""
    surface = plate()
    return started(surface, path_through(surface, (0, ROWS), (0, 0)))


def from_side_with_hole() -> SurfaceMesh:
    """From the left side, past a square hole that is a selvedge too."""
    surface = plate(_around_a_hole)
    return started(surface, path_through(surface, (0, ROWS), (0, 0)))


def from_hole() -> SurfaceMesh:
    """From the square hole outwards; the outer border is a selvedge."""
    surface = plate(_around_a_hole)
    hole = min(surface.borders, key=len)
    return started(surface, hole, closed=True)


def from_slit() -> SurfaceMesh:
    """From a path inside, on both sides and around both of its ends."""
    surface = plate()
    return started(surface, path_through(surface, (8, 8), (16, 8)))


def from_half() -> SurfaceMesh:
    """From a path that begins on the border and ends inside."""
    surface = plate()
    return started(surface, path_through(surface, (12, 0), (12, 8)))


def from_path_across() -> SurfaceMesh:
    """From a path that parts the plate in two."""
    surface = plate()
    return started(surface, path_through(surface, (9, 0), (9, ROWS)))


def from_two_sides() -> SurfaceMesh:
    """From the left side and the right side, so that two families of open polylines meet."""
    surface = plate()
    sides = path_through(surface, (0, ROWS), (0, 0)), path_through(surface, (COLUMNS, 0), (COLUMNS, ROWS))
    return started(surface, *sides)


def from_three_sides() -> SurfaceMesh:
    """From all sides but the upper one, so that the front turns two corners."""
    surface = plate()
    return started(surface, path_through(surface, (0, ROWS), (0, 0), (COLUMNS, 0), (COLUMNS, ROWS)))


def from_ring_inside() -> SurfaceMesh:
    """From a closed path inside, inwards and outwards."""
    surface = plate()
    loop = path_through(surface, (6, 4), (16, 4), (16, 12), (6, 12), (6, 4))[:-1]
    return started(surface, loop, closed=True)


CLOTHS: dict[str, Callable[[], SurfaceMesh]] = {
    "side": from_side,
    "side with hole": from_side_with_hole,
    "hole": from_hole,
    "slit": from_slit,
    "half": from_half,
    "path across": from_path_across,
    "two sides": from_two_sides,
    "three sides": from_three_sides,
    "ring inside": from_ring_inside,
}


@cache
def cloth_latitudes(name: str) -> Latitudes:
    """The latitudes of one of the plates."""
    return offset_levels(CLOTHS[name](), spacing=SPACING)


@cache
def woven_cloth(name: str, pattern: str) -> Weave:
    """The weave on the latitudes of one of the plates."""
    return weave_lattice(link_pattern(cloth_latitudes(name), pattern=pattern))
