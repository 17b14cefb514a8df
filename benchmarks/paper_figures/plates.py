"""Flat plates for the drawings, and one step of the paper's offset on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.path import Path as Outline
from scipy.optimize import brentq
from scipy.spatial import Delaunay, cKDTree

from weavecore.model import SurfaceMesh
from weavecore.offsetting.propagation.child_curves import embed_children
from weavecore.offsetting.propagation.child_filter import find_room_for_grandchildren, stop_at_fronts
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import (
    Intersections,
    find_intersections,
    find_intersections_with,
)
from weavecore.offsetting.propagation.method import VERTICES_PER_SPACING, propagate_fronts
from weavecore.offsetting.propagation.offset_vertices import FrontRays, cast_rays, offset_vertices
from weavecore.offsetting.propagation.ray_directions import start_on_boundary, start_on_curves
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves
from weavecore.offsetting.propagation.uncrossing import reconnect_at_crossings

_OFF_THE_BORDER = 0.7


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0), *, edge: float) -> np.ndarray:
    """A regular polygon (n, 2), counter-clockwise."""
    n = int(2 * np.pi * radius / edge)
    turn = 2 * np.pi * np.arange(n) / n
    return np.array(centre) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def dumbbell(length: float, lobes: tuple[float, float], neck: float, *, edge: float) -> np.ndarray:
    """Two round lobes, ``length`` apart, and a neck of half the width ``neck`` (n, 2): arcs without a corner."""
    (left, right), half = lobes, length / 2

    def hollow(radius: float) -> tuple[float, float]:
        """The middle of the upper arc that touches both lobes."""
        x = ((left + radius) ** 2 - (right + radius) ** 2) / (2 * length)
        return x, float(np.sqrt((left + radius) ** 2 - (x + half) ** 2))

    radius = brentq(
        lambda r: hollow(r)[1] - r - neck, 1.001 * max(half - (left + right) / 2, length / 1000), 100 * length
    )
    x, y = hollow(radius)
    from_left = np.arctan2(y, x + half)
    from_right = np.arctan2(y, x - half)
    arcs = [
        ((half, 0.0), right, -from_right, from_right),
        ((x, y), radius, from_right - np.pi, from_left - np.pi),
        ((-half, 0.0), left, from_left, 2 * np.pi - from_left),
        ((x, -y), radius, np.pi - from_left, np.pi - from_right),
    ]
    points = [
        np.array(centre) + size * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        for centre, size, begin, end in arcs
        for turn in [np.linspace(begin, end, 2000, endpoint=False)]
    ]
    return _evenly(np.concatenate(points), edge)


def _evenly(outline: np.ndarray, edge: float) -> np.ndarray:
    closed = np.concatenate([outline, outline[:1]])
    station = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    wanted = np.linspace(0, station[-1], int(station[-1] / edge), endpoint=False)
    return np.stack([np.interp(wanted, station, closed[:, k]) for k in range(2)], axis=1)


def make_plate(loops: list[np.ndarray], edge: float) -> SurfaceMesh:
    """The plane surface inside of a smooth outline and outside of smooth holes."""
    border = np.concatenate(loops)
    low, high = border.min(0), border.max(0)
    x, y = np.meshgrid(np.arange(low[0], high[0], edge), np.arange(low[1], high[1], edge * np.sqrt(0.75)))
    x[1::2] += edge / 2
    grid = np.stack([x.ravel(), y.ravel()], axis=1)
    grid = grid[_inside(grid, loops) & (cKDTree(border).query(grid)[0] > _OFF_THE_BORDER * edge)]
    points = np.concatenate([border, grid])
    faces = Delaunay(points).simplices
    faces = faces[_inside(points[faces].mean(1), loops)]
    u, v = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    turned = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
    faces[turned] = faces[turned][:, ::-1]
    used, faces = np.unique(faces, return_inverse=True)
    return SurfaceMesh(np.c_[points[used], np.zeros(len(used))], faces.reshape(-1, 3))


def _inside(points: np.ndarray, loops: list[np.ndarray]) -> np.ndarray:
    return np.sum([Outline(loop).contains_points(points) for loop in loops], axis=0) % 2 == 1


@dataclass(frozen=True, eq=False)
class Step:
    """One offset, step for step: what is drawn of it.

    Attributes
    ----------
    parents : SurfaceCurves or None
        None where they are the borders.
    start, end : (n, 2) float64
        Where the vertices are moved from and to.
    raw : SurfaceCurves
        The children as they come (§4.2).
    crossings : Intersections
        All their crossings.
    loops : SurfaceCurves
        The same, reconnected (§4.3, §4.4).
    """

    parents: SurfaceCurves | None
    start: np.ndarray
    end: np.ndarray
    raw: SurfaceCurves
    crossings: Intersections
    loops: SurfaceCurves


@dataclass(frozen=True, eq=False)
class Judgement:
    """The grandchild test (§4.5) of the loops of a step.

    Attributes
    ----------
    grandchildren : SurfaceCurves
        One for each loop, as they come.
    crosses : (C,) bool
        Whether the grandchild crosses a parent of the loop.
    passes : (C,) bool
        Whether most of its way leads to a parent and beyond: the test by side.
    """

    grandchildren: SurfaceCurves
    crosses: np.ndarray
    passes: np.ndarray


class Plate:
    """A flat plate and the paper's offset on it, by the same code as ``method="fronts"``."""

    def __init__(self, loops: list[np.ndarray], *, spacing: float, edge: float) -> None:
        self.loops = loops
        self.surface = make_plate(loops, edge)
        self.spacing = spacing
        self._domain = Domain(self.surface)
        self._spacing = spacing / self._domain.scale
        self._middle = self.surface.vertices.mean(axis=0)

    def offset(self, generation: int) -> Step:
        """The step that makes a generation from the one before."""
        step = self._spacing / VERTICES_PER_SPACING
        if generation == 1:
            parents, starts = None, start_on_boundary(self._domain, step=step)
        else:
            parents = propagate_fronts(self._domain, spacing=self._spacing)[generation - 2]
            starts = start_on_curves(self._domain, parents, step=step)
        rays = cast_rays(self._domain, starts, spacing=self._spacing)
        if parents is not None:
            rays = stop_at_fronts(self._domain, rays, parents)
        raw = self._lay(rays, parents, freely=parents is not None)
        crossings = find_intersections(self._domain, raw)
        loops = reconnect_at_crossings(self._domain, raw, crossings).curves
        end = offset_vertices(self._domain, self._free(rays)).points
        return Step(parents, self.flat(rays.start), self.flat(end), raw, crossings, loops)

    def judge(self, step: Step) -> Judgement:
        """Offset the loops of a step once more, and see where that leads."""
        starts = start_on_curves(self._domain, step.loops, step=self._spacing / VERTICES_PER_SPACING)
        rays = cast_rays(self._domain, starts, spacing=self._spacing)
        grandchildren = self._lay(rays, None, freely=True)
        n = len(step.loops)
        if step.parents is None:
            return Judgement(grandchildren, np.zeros(n, bool), np.zeros(n, bool))
        met = find_intersections_with(self._domain, grandchildren, step.parents)
        crosses = np.bincount(grandchildren.owner[met.first], minlength=n) > 0
        _, passes = find_room_for_grandchildren(self._domain, rays, step.loops, step.parents)
        return Judgement(grandchildren, crosses, passes)

    def reduce(self, step: Step, n_crossings: int) -> tuple[SurfaceCurves, int]:
        """The children when the first few crossings are taken apart, and how many crossings are left."""
        order = np.argsort(step.crossings.first + step.crossings.on_first)[:n_crossings]
        names = ("first", "second", "on_first", "on_second", "turns_left")
        some = Intersections(*(getattr(step.crossings, name)[order] for name in names))
        curves = reconnect_at_crossings(self._domain, step.raw, some).curves
        return curves, len(find_intersections(self._domain, curves))

    def crossings(self, step: Step) -> np.ndarray:
        """Where (k, 2) the children of a step cross."""
        crossings, raw = step.crossings, step.raw
        part = crossings.on_first[:, None]
        weights = raw.start[crossings.first] * (1 - part) + raw.end[crossings.first] * part
        return self.flat(self._domain.points(raw.face[crossings.first], weights))

    def outlines(self, curves: SurfaceCurves) -> list[np.ndarray]:
        """Each curve as points (n, 2)."""
        return np.split(self.flat(curves.points), curves.offsets[1:-1])

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Points of the domain in the plane of the plate."""
        return (points * self._domain.scale + self._middle)[:, :2]

    def _lay(self, rays: FrontRays, parents: SurfaceCurves | None, *, freely: bool) -> SurfaceCurves:
        rays = self._free(rays) if freely else rays
        return embed_children(self._domain, rays, offset_vertices(self._domain, rays), None if freely else parents)[0]

    @staticmethod
    def _free(rays: FrontRays) -> FrontRays:
        """The same rays as far as the boundary lets them: whole steps are drawn, stopped by no ancestor."""
        return replace(rays, stop=np.where(rays.walks.is_blocked, rays.walks.far, np.inf))
