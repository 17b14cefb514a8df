"""`Scene`: what a picture shows of a stage's result, as coloured triangles and rods."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Union

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.polygon_mesh import fan_triangles
from weavecore.model import LATITUDINAL, LONGITUDINAL, POCKET, Equilibrium, Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.palette import FREE_BORDERS, LONGITUDES, POCKETS, WOVEN, latitude_colours, utilisation_colours
from weavecore.viewing.surface_paths import paths_of_surface

_RADIUS_PER_SPACING = 0.075
"""Radius of the lines of latitudes and lattices, in spacings: clearly apart, and visible in small pictures."""

_RADIUS_PER_SIZE = 0.003
"""Radius of the lines of a surface, in diagonals of its bounding box."""

_BORDER_FACTOR, _LONGITUDE_FACTOR = 1.45, 0.7
"""Radius of borders and of longitudes against that of the other lines."""

_DRAWN_FACTOR = 0.4
"""Radius of the rods as drawn against that of the rods at rest."""

_RADIUS_AT_REST_PER_SIZE = 0.0015
"""Least radius of the rods at rest, in diagonals of the bounding box: two pixels of a usual picture, so that colours
are visible."""

_STEP_PER_EDGE, _STEP_PER_SIZE = 0.08, 0.002
"""Rods of a weave are drawn in straight segments of the first part of an edge, but none shorter than the second part of
the diagonal of the surface: three pixels of a usual picture."""

_DIAMETERS_BACK = 4.0
"""How far the surface of a weave is set back, in diameters: more than the height of a stack of three rods."""

Drawable = Union[SurfaceMesh, Latitudes, Lattice, Weave]
Pictured = Union[SurfaceMesh, Latitudes, Lattice, Weave, Equilibrium]


@dataclass(frozen=True, eq=False)
class Scene:
    """Triangles and rods.

    Parameters
    ----------
    vertices : (V, 3) float64
    triangles : (T, 3) int64
    is_marked : (T,) bool
        Triangles in pockets, which have a tint of their own.
    starts, ends : (R, 3) float64
        The straight rods.
    colours : (R, 3) float64
        0…255.
    radius : (R,) float64
        In the model's unit.
    borders : (n, 3) float64
        Points of the borders, cuts and origins.
    set_back : float
        How far the triangles are set back from the eye, so that rods below them are visible.
    has_surface : bool
        Whether the triangles are drawn; else they serve to choose the view.
    """

    vertices: Floats
    triangles: Ints
    is_marked: Bools
    starts: Floats
    ends: Floats
    colours: Floats
    radius: Floats
    borders: Floats
    set_back: float = 0.0
    has_surface: bool = True

    @property
    def size(self) -> float:
        """Length of the diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))


def scene_of(value: Pictured) -> Scene:
    """The scene of a stage's result.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium

    Returns
    -------
    Scene
    """
    if isinstance(value, SurfaceMesh):
        return _of_surface(value)
    if isinstance(value, Latitudes):
        return _of_latitudes(value)
    if isinstance(value, Equilibrium):
        return _of_equilibrium(value)
    return _of_weave(value) if isinstance(value, Weave) else _of_lattice(value)


def _of_surface(surface: SurfaceMesh) -> Scene:
    paths = paths_of_surface(surface)
    starts, ends, is_free_border = paths.segments()
    n = len(starts)
    colours = latitude_colours(np.zeros(n), 1).astype(float)
    colours[is_free_border] = FREE_BORDERS
    return Scene(
        surface.vertices,
        surface.faces,
        np.zeros(surface.n_faces, bool),
        surface.vertices[starts],
        surface.vertices[ends],
        colours,
        np.full(n, surface.size * _RADIUS_PER_SIZE),
        paths.points,
    )


def _of_latitudes(latitudes: Latitudes) -> Scene:
    lines, surface = latitudes.polylines, latitudes.surface
    after = next_in_loop(lines.offsets)
    generation = latitudes.generation[lines.owner]
    factor = np.where(generation == 0, _BORDER_FACTOR, 1.0)
    drawn = lines.segment_lengths > 0
    paths = paths_of_surface(surface)
    a, b, is_free_border = paths.segments()
    a, b = a[is_free_border], b[is_free_border]
    radius = latitudes.spacing * _RADIUS_PER_SPACING
    return Scene(
        surface.vertices,
        surface.faces,
        np.zeros(surface.n_faces, bool),
        np.concatenate([lines.points[drawn], surface.vertices[a]]),
        np.concatenate([lines.points[after][drawn], surface.vertices[b]]),
        np.concatenate(
            [
                latitude_colours(generation, latitudes.n_generations).astype(float)[drawn],
                np.tile(np.array(FREE_BORDERS, float), (len(a), 1)),
            ]
        ),
        np.concatenate([(factor * latitudes.spacing * _RADIUS_PER_SPACING)[drawn], np.full(len(a), radius)]),
        paths.points,
    )


def _of_lattice(lattice: Lattice) -> Scene:
    latitudes = lattice.latitudes
    triangles, face = fan_triangles(lattice.face_offsets, lattice.face_nodes)
    a, b = lattice.edges.T
    family = lattice.edge_family
    polyline = np.maximum(lattice.node_latitude[a], 0)
    generation = latitudes.generation[polyline]
    colours = latitude_colours(generation, latitudes.n_generations).astype(float)
    colours[family == LONGITUDINAL] = LONGITUDES
    colours[family == POCKET] = POCKETS
    is_border = (family == LATITUDINAL) & (generation == 0)
    factor = np.where(is_border, _BORDER_FACTOR, np.where(family == LATITUDINAL, 1.0, _LONGITUDE_FACTOR))
    return Scene(
        lattice.nodes,
        triangles,
        _faces_with_edges(lattice, family == POCKET)[face],
        lattice.nodes[a],
        lattice.nodes[b],
        colours,
        factor * min(latitudes.spacing, lattice.edge_length) * _RADIUS_PER_SPACING,
        paths_of_surface(latitudes.surface).points,
    )


def _of_weave(weave: Weave) -> Scene:
    lattice = weave.lattice
    triangles, _ = fan_triangles(lattice.face_offsets, lattice.face_nodes)
    edge = min(lattice.latitudes.spacing, lattice.edge_length)
    samples = weave.axes.samples(max(_STEP_PER_EDGE * edge, _STEP_PER_SIZE * lattice.latitudes.surface.size))
    strand = rows_of(samples.offsets)
    start = np.flatnonzero(np.diff(strand) == 0)
    letters = np.array([name[0] for name in weave.ids])
    colours = np.array([WOVEN[letter] for letter in letters.tolist()], float).reshape(-1, 3)
    return Scene(
        lattice.nodes,
        triangles,
        np.zeros(len(triangles), bool),
        samples.points[start],
        samples.points[start + 1],
        colours[strand[start]],
        weave.diameters[strand[start]] / 2.0,
        paths_of_surface(lattice.latitudes.surface).points,
        set_back=_DIAMETERS_BACK * weave.rod_diameter,
    )


def _of_equilibrium(equilibrium: Equilibrium) -> Scene:
    """The rods at rest, coloured by utilisation, and the drawn ones thin and grey, without the surface.

    A surface would hide the rods that have moved behind it.
    """
    weave = equilibrium.weave
    start, stop = equilibrium.segments.T
    used = np.maximum(equilibrium.utilisation[start], equilibrium.utilisation[stop])
    scene = _of_weave(weave)
    grey = np.tile(np.array(FREE_BORDERS, float), (len(start), 1))
    radius = np.maximum(weave.diameters[equilibrium.rod[start]] / 2.0, _RADIUS_AT_REST_PER_SIZE * scene.size)
    return replace(
        scene,
        # The view takes in both shapes.
        vertices=np.concatenate([scene.vertices, weave.lattice.nodes + equilibrium.node_move]),
        starts=np.concatenate([equilibrium.points[start], equilibrium.drawn[start]]),
        ends=np.concatenate([equilibrium.points[stop], equilibrium.drawn[stop]]),
        colours=np.concatenate([utilisation_colours(used).astype(float), grey]),
        radius=np.concatenate([radius, _DRAWN_FACTOR * radius]),
        has_surface=False,
    )


def _faces_with_edges(lattice: Lattice, wanted: Bools) -> Bools:
    """(F,) whether a face has one of the edges for which ``wanted`` (E,) is true."""
    n = lattice.n_nodes
    corners, after = lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    key = np.minimum(corners, after) * n + np.maximum(corners, after)
    a, b = lattice.edges[wanted].T
    has = np.isin(key, np.minimum(a, b) * n + np.maximum(a, b))
    return np.logical_or.reduceat(has, lattice.face_offsets[:-1])
