"""Level schedule: the distance of each generation from the origins; and a default spacing.

Generation g lies at the distance d_g.  The *level index* counts generations continuously, and is linear between two of
them: 2.5 lies halfway between the second and the third.

    level index  0      1           2    3    4             d_0 = 0, then one spacing after the other; the last
    distance     |------|-----------|----|----|---          one is repeated
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Union

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from weavecore.errors import TooMuchWork, Unsupported
from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.geometry.elementary import arctangents, logarithms
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.geometry.refine import refine_faces
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.offsetting.phase import spacing_in_phase
from weavecore.tolerances import LEVEL_ROUNDING

Spacing = Union[float, Sequence[float], Floats]
"""One distance from each generation to the next, or one after the other, of which the last is repeated."""


@dataclass(frozen=True, eq=False)
class LevelSchedule:
    """Distances of the generations.

    Parameters
    ----------
    levels : (n + 1,) float64
        Distances of generations 0 to n, from 0, in the model's unit.
    last_spacing : float
        From each generation after those to the next.
    """

    levels: Floats
    last_spacing: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", frozen(self.levels, np.float64, (-1,)))

    @staticmethod
    def of(spacing: Spacing) -> LevelSchedule:
        """The schedule of one spacing or of several.

        Parameters
        ----------
        spacing : float or sequence of float
            In the model's unit.

        Raises
        ------
        Unsupported
            If one is not a positive number, or there is none.
        """
        spacings = np.atleast_1d(np.asarray(spacing, np.float64))
        if spacings.ndim != 1 or len(spacings) == 0:
            raise Unsupported("Missing spacing", remedy="Give one positive length, or several.")
        wrong = spacings[~(np.isfinite(spacings) & (spacings > 0))]
        if len(wrong):
            raise Unsupported(
                f"Spacing must be positive (got {wrong[0]:g})", remedy="Give a positive length in the surface's unit."
            )
        return LevelSchedule(np.concatenate([[0.0], np.cumsum(spacings[:-1])]), float(spacings[-1]))

    @property
    def spacings(self) -> Floats:
        """(n + 1,) the spacings that it was made of."""
        return np.append(np.diff(self.levels), self.last_spacing)

    @property
    def least_spacing(self) -> float:
        """The narrowest spacing."""
        return float(self.spacings.min())

    def widest_spacing(self, n_generations: int) -> float:
        """The widest of the spacings that follow so many generations, generation 0 among them.

        The one that follows the last generation counts: the surface goes on for up to that far beyond it.
        """
        return float(self.spacings[:n_generations].max())

    def spacing_after(self, generation: int) -> float:
        """From a generation to the next."""
        return float(self.spacings[min(generation, len(self.levels) - 1)])

    def level_index(self, distance: Floats) -> Floats:
        """Level index of each distance.

        Parameters
        ----------
        distance : (n,) float64

        Returns
        -------
        (n,) float64
        """
        top = len(self.levels) - 1
        beyond: Floats = (distance - self.levels[-1]) / self.last_spacing
        if top == 0:
            return beyond
        within = np.interp(distance, self.levels, np.arange(top + 1.0))
        return np.where(distance < self.levels[-1], within, top + beyond)

    def distance_of(self, level_index: Floats) -> Floats:
        """Distance of each level index: the inverse of `level_index`.

        Parameters
        ----------
        level_index : (n,) float64

        Returns
        -------
        (n,) float64
        """
        top = len(self.levels) - 1
        beyond: Floats = self.levels[-1] + (level_index - top) * self.last_spacing
        if top == 0:
            return beyond
        within = np.interp(level_index, np.arange(top + 1.0), self.levels)
        return np.where(level_index < top, within, beyond)

    def levels_below(self, distance: Floats) -> Ints:
        """Number of generations at or below each distance, generation 0 not counted.

        Parameters
        ----------
        distance : (n,) float64

        Returns
        -------
        (n,) int64
        """
        return np.floor(self.level_index(distance) + LEVEL_ROUNDING).astype(np.int64)


N_GENERATIONS = 15
"""Generations in the deepest part of a surface, where no spacing is asked for: enough to show its shape, few enough to
build."""

MIN_GENERATIONS = 5
"""A mesh too coarse for that gets a wider spacing, but never so wide that fewer than these fit."""

SUGGESTED_EDGES_PER_SPACING = 3.0
"""A suggested spacing is at least so many mean edges wide: a narrower one would show the facets of the mesh rather than
its shape.  (Where a narrower one is asked for the mesh is refined to two edges a spacing: see `preparation`.)"""

MAX_TURN_PER_SPACING = 1.5
"""Radians that the surface may turn over one spacing, on average: more, and the rings would cut through its tubes."""

_FEW_FACES = 2000  # such a mesh may be coarser than the surface is deep
_MIN_EDGES_ACROSS = 12  # a square of the surface's area
_MOST_FACES_FOR_DEPTH = 100_000  # twice what the most slender of ordinary surfaces is refined to
_MOST_STEPS_FOR_DEPTH = 5_000  # ordinary surfaces take 20 to 400

MOST_CELLS = 10_000
"""Squares of the spacing that the area of the surface holds at most at a suggested spacing, as long as
`FEWEST_GENERATIONS` fit: a long strip fifteen generations deep would be woven from many times as many nodes as anybody
builds, and takes as much longer to compute."""

FEWEST_GENERATIONS = 2
"""Generations that a spacing suggested for a long strip leaves."""

_ROUND_NUMBERS = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


def suggest_spacing(surface: SurfaceMesh) -> float:
    """Suggest a round spacing that fills the surface with about fifteen generations, and at which fronts meet in phase.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    float
        In the model's unit.
    """
    areas = surface.face_areas
    mean_edge = math.sqrt(areas.mean() * 4 / math.sqrt(3))
    if surface.n_faces < _FEW_FACES:
        depth = _depth_of_few_faces(surface, longest=math.sqrt(areas.sum()) / _MIN_EDGES_ACROSS)
    else:
        depth = _depth_along_edges(surface)
    if depth == 0:  # All vertices lie on borders still: as deep as the circle in the widest face.
        depth = 2 * float((areas / surface.edge_lengths.reshape(-1, 3).sum(1)).max())
    wanted = min(depth / N_GENERATIONS, MAX_TURN_PER_SPACING * _mean_radius(surface, float(areas.sum())))
    wanted = max(wanted, min(SUGGESTED_EDGES_PER_SPACING * mean_edge, depth / MIN_GENERATIONS))
    spacing = round_length(max(wanted, min(math.sqrt(float(areas.sum()) / MOST_CELLS), depth / FEWEST_GENERATIONS)))
    try:
        return spacing_in_phase(surface, measure_distance(surface, most_steps=_MOST_STEPS_FOR_DEPTH), spacing)
    except TooMuchWork:
        return spacing


def round_length(length: float) -> float:
    """Number nearest in proportion among 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 and their decimal multiples.

    Parameters
    ----------
    length : float
        Positive.

    Returns
    -------
    float
    """
    exponent = math.floor(math.log10(length))
    mantissa = length / 10.0**exponent
    nearest = _ROUND_NUMBERS[np.argmin(np.abs(logarithms(_ROUND_NUMBERS / mantissa)))]
    return float(f"{nearest:g}e{exponent}")


def _mean_radius(surface: SurfaceMesh, area: float) -> float:
    """Area over the total curvature: the turn at each edge times its length, summed."""
    halfedge = np.flatnonzero(surface.twins > np.arange(len(surface.twins)))
    one, other = surface.face_normals[halfedge // 3], surface.face_normals[surface.twins[halfedge] // 3]
    turn = arctangents(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(1))
    bend = float((turn * surface.edge_lengths[halfedge]).sum())
    return area / bend if bend > 0 else math.inf


def _depth_along_edges(surface: SurfaceMesh) -> float:
    """Distance of the farthest vertex from the origins along edges: some percent too long, and cheap."""
    tail, head = halfedge_ends(surface.faces)
    n = surface.n_vertices
    graph = coo_matrix((surface.edge_lengths, (tail, head)), shape=(n, n)).tocsr()
    # Where two halfedges share an edge the sum of both would be stored; each runs its own way, so none do.
    sources = surface.origins.vertices()
    distance: Floats = dijkstra(graph, directed=False, indices=sources, min_only=True)
    return float(distance[np.isfinite(distance)].max())


def _depth_of_few_faces(surface: SurfaceMesh, *, longest: float) -> float:
    """The same where edges may be as long as the surface is deep, or no vertex lies off the borders.

    Where that is too much work, as on a spike, it is measured along the edges as they are.
    """
    try:
        fine = refine_faces(
            surface.vertices,
            surface.faces,
            longest=longest,
            protected=surface.is_cut,
            splittable=surface.is_free_border,
            most_faces=_MOST_FACES_FOR_DEPTH,
        )
        distance = measure_distance(surface.refined(fine), most_steps=_MOST_STEPS_FOR_DEPTH).distance
    except TooMuchWork:
        return _depth_along_edges(surface)
    return float(distance[np.isfinite(distance)].max())
