"""`Ladder`: how far from the borders each generation lies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Union

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.geometry.refine import refine_faces
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.tolerances import LEVEL_REACHED

Spacing = Union[float, Sequence[float], Floats]
"""One distance from each generation to the next, or one after the other, of which the last goes on."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """Distances of the generations.

    A *height* counts generations: 2.5 lies halfway between the second and the third.

    Parameters
    ----------
    rungs : (n + 1,) float64
        Distances of generations 0 to n, from 0.
    step : float
        From each generation after those to the next.
    """

    rungs: Floats
    step: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rungs", frozen(self.rungs, np.float64, (-1,)))

    @staticmethod
    def of(spacing: Spacing) -> Ladder:
        """The ladder of one spacing or of several.

        Raises
        ------
        Unsupported
            When one is not a positive number, or there is none.
        """
        steps = np.atleast_1d(np.asarray(spacing, np.float64))
        if steps.ndim != 1 or len(steps) == 0:
            raise Unsupported("No spacing is given", remedy="Give one positive length, or several.")
        wrong = steps[~(np.isfinite(steps) & (steps > 0))]
        if len(wrong):
            raise Unsupported(
                f"A spacing of {wrong[0]:g} is no distance", remedy="Give a positive length in the surface's unit."
            )
        return Ladder(np.concatenate([[0.0], np.cumsum(steps[:-1])]), float(steps[-1]))

    @property
    def steps(self) -> Floats:
        """(n + 1,) what it was made of."""
        return np.append(np.diff(self.rungs), self.step)

    @property
    def least(self) -> float:
        """The narrowest step."""
        return float(self.steps.min())

    def widest(self, n_generations: int) -> float:
        """The widest step up to the one beyond the last of so many generations."""
        return float(self.steps[:n_generations].max())

    def step_after(self, generation: int) -> float:
        """From a generation to the next."""
        return float(self.steps[min(generation, len(self.rungs) - 1)])

    def height(self, distance: Floats) -> Floats:
        """How many generations each distance lies from the borders."""
        top = len(self.rungs) - 1
        beyond: Floats = (distance - self.rungs[-1]) / self.step
        if top == 0:
            return beyond
        within = np.interp(distance, self.rungs, np.arange(top + 1.0))
        return np.where(distance < self.rungs[-1], within, top + beyond)

    def distance(self, height: Floats) -> Floats:
        """The distance at each height; the other way of `height`."""
        top = len(self.rungs) - 1
        beyond: Floats = self.rungs[-1] + (height - top) * self.step
        if top == 0:
            return beyond
        within = np.interp(height, np.arange(top + 1.0), self.rungs)
        return np.where(height < top, within, beyond)

    def count_below(self, distance: Floats) -> Ints:
        """Number of generations at or below each distance."""
        return np.floor(self.height(distance) + LEVEL_REACHED).astype(np.int64)


# ----------------------------------------------------------------------
# A sensible spacing where none is asked for.

N_GENERATIONS = 15
"""How many generations the deepest part of a surface gets: enough to read its shape, few enough to build."""

FEWEST_GENERATIONS = 5
"""A mesh too coarse for that gets a wider spacing, but never so wide that fewer than these fit."""

EDGES_PER_SPACING = 3.0
"""A spacing of fewer mean edges than this would show the facets of the mesh rather than its shape."""

MOST_BEND = 1.5
"""Radians that the surface may turn over one spacing, on the mean: more, and the rings would cut through its tubes."""

_FEW_FACES = 2000  # such a mesh may be coarser than the surface is deep
_FEWEST_EDGES = 12  # across a square of the surface's area

_FRIENDLY = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


def suggest_spacing(surface: SurfaceMesh) -> float:
    """A spacing that fills the surface with some fifteen generations, as a round number.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    float
        In the model's unit.
    """
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    mean_edge = math.sqrt(areas.mean() * 4 / math.sqrt(3))
    if surface.n_faces < _FEW_FACES:
        depth = _depth_of_few_faces(surface, longest=math.sqrt(areas.sum()) / _FEWEST_EDGES)
    else:
        depth = _depth_along_edges(surface)
    if depth == 0:  # All vertices lie on borders still: as deep as the circle in the widest face.
        depth = 2 * float((areas / surface.edge_lengths.reshape(-1, 3).sum(1)).max())
    wanted = min(depth / N_GENERATIONS, MOST_BEND * _mean_radius(surface, float(areas.sum())))
    return round_friendly(max(wanted, min(EDGES_PER_SPACING * mean_edge, depth / FEWEST_GENERATIONS)))


def _mean_radius(surface: SurfaceMesh, area: float) -> float:
    """One over the mean of the curvature over the surface: the turn at each edge, times its length, over the area."""
    halfedge = np.flatnonzero(surface.twins > np.arange(len(surface.twins)))
    one, other = surface.face_normals[halfedge // 3], surface.face_normals[surface.twins[halfedge] // 3]
    turn = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(1))
    bend = float((turn * surface.edge_lengths[halfedge]).sum())
    return area / bend if bend > 0 else math.inf


def spacing_for_edges(edge_length: float) -> float:
    """The spacing at which edges of that length make equilateral triangles: the height of one."""
    return edge_length * math.sqrt(3) / 2


def round_friendly(length: float) -> float:
    """The number nearest in proportion among 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 and their decimal multiples."""
    exponent = math.floor(math.log10(length))
    mantissa = length / 10.0**exponent
    nearest = _FRIENDLY[np.argmin(np.abs(np.log(_FRIENDLY / mantissa)))]
    return float(f"{nearest:g}e{exponent}")


def _depth_along_edges(surface: SurfaceMesh) -> float:
    """Distance of the farthest vertex from the borders and cuts, along edges: some percent too long, and cheap."""
    tail, head = halfedge_ends(surface.faces)
    n = surface.n_vertices
    graph = coo_matrix((surface.edge_lengths, (tail, head)), shape=(n, n)).tocsr()
    # Where two halfedges share an edge the sum of both would be stored; each runs its own way, so none do.
    sources = surface.origins.vertices()
    distance: Floats = dijkstra(graph, directed=False, indices=sources, min_only=True)
    return float(distance[np.isfinite(distance)].max())


def _depth_of_few_faces(surface: SurfaceMesh, *, longest: float) -> float:
    """The same where edges may be as long as the surface is deep, or no vertex lies off the borders."""
    fine = refine_faces(
        surface.vertices, surface.faces, longest=longest, protected=surface.is_cut, yielding=surface.is_selvedge
    )
    distance = measure_distance(replace(surface, vertices=fine.vertices, faces=fine.faces)).distance
    return float(distance[np.isfinite(distance)].max())
