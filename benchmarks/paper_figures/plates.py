"""Flat plates for the drawings, and one step of the paper's offset on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.path import Path as Outline
from scipy.optimize import brentq
from scipy.spatial import Delaunay, cKDTree

from weavecore.model import SurfaceMesh
from weavecore.offsetting.propagation.child_curves import lay_children
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.propagation.filter import find_room, stop_at
from weavecore.offsetting.propagation.intersections import Meetings, curves_meet, meet_themselves, regroup
from weavecore.offsetting.propagation.method import STEPS_PER_SPACING, cover
from weavecore.offsetting.propagation.ray_directions import seed_curves, seed_walls
from weavecore.offsetting.propagation.steps import Rays, cast_rays, end_steps

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
    parents : Curves or None
        None where they are the borders.
    start, end : (n, 2) float64
        Where the vertices are moved from and to.
    raw : Curves
        The children as they come (§4.2).
    meetings : Meetings
        All their crossings.
    loops : Curves
        The same, regrouped (§4.3, §4.4).
    """

    parents: Curves | None
    start: np.ndarray
    end: np.ndarray
    raw: Curves
    meetings: Meetings
    loops: Curves


@dataclass(frozen=True, eq=False)
class Judgement:
    """The grandchild test (§4.5) of the loops of a step.

    Attributes
    ----------
    grandchildren : Curves
        One for each loop, as they come.
    crosses : (C,) bool
        Whether the grandchild crosses a parent of the loop.
    passes : (C,) bool
        Whether most of its way leads to a parent and beyond: the test by side.
    """

    grandchildren: Curves
    crosses: np.ndarray
    passes: np.ndarray


class Plate:
    """A flat plate and the paper's offset on it, by the same code as ``method="fronts"``."""

    def __init__(self, loops: list[np.ndarray], *, spacing: float, edge: float) -> None:
        self.loops = loops
        self.surface = make_plate(loops, edge)
        self.spacing = spacing
        self._ground = Ground(self.surface)
        self._spacing = spacing / self._ground.scale
        self._middle = self.surface.vertices.mean(axis=0)

    def offset(self, generation: int) -> Step:
        """The step that makes a generation from the one before."""
        step = self._spacing / STEPS_PER_SPACING
        if generation == 1:
            parents, seeds = None, seed_walls(self._ground, step=step)
        else:
            parents = cover(self._ground, spacing=self._spacing)[generation - 2]
            seeds = seed_curves(self._ground, parents, step=step)
        rays = cast_rays(self._ground, seeds, spacing=self._spacing)
        if parents is not None:
            rays = stop_at(self._ground, rays, parents)
        raw = self._lay(rays, parents, freely=parents is not None)
        meetings = meet_themselves(self._ground, raw)
        loops = regroup(self._ground, raw, meetings).curves
        end = end_steps(self._ground, self._free(rays)).points
        return Step(parents, self.flat(rays.start), self.flat(end), raw, meetings, loops)

    def judge(self, step: Step) -> Judgement:
        """Offset the loops of a step once more, and see where that leads."""
        seeds = seed_curves(self._ground, step.loops, step=self._spacing / STEPS_PER_SPACING)
        rays = cast_rays(self._ground, seeds, spacing=self._spacing)
        grandchildren = self._lay(rays, None, freely=True)
        n = len(step.loops)
        if step.parents is None:
            return Judgement(grandchildren, np.zeros(n, bool), np.zeros(n, bool))
        met = curves_meet(self._ground, grandchildren, step.parents)
        crosses = np.bincount(grandchildren.owner[met.first], minlength=n) > 0
        _, passes = find_room(self._ground, rays, step.loops, step.parents)
        return Judgement(grandchildren, crosses, passes)

    def reduce(self, step: Step, n_crossings: int) -> tuple[Curves, int]:
        """The children when the first few crossings are taken apart, and how many crossings are left."""
        order = np.argsort(step.meetings.first + step.meetings.on_first)[:n_crossings]
        names = ("first", "second", "on_first", "on_second", "turns_left")
        some = Meetings(*(getattr(step.meetings, name)[order] for name in names))
        curves = regroup(self._ground, step.raw, some).curves
        return curves, len(meet_themselves(self._ground, curves))

    def crossings(self, step: Step) -> np.ndarray:
        """Where (k, 2) the children of a step cross."""
        meetings, raw = step.meetings, step.raw
        part = meetings.on_first[:, None]
        weights = raw.start[meetings.first] * (1 - part) + raw.end[meetings.first] * part
        return self.flat(self._ground.points(raw.face[meetings.first], weights))

    def outlines(self, curves: Curves) -> list[np.ndarray]:
        """Each curve as points (n, 2)."""
        return np.split(self.flat(curves.points), curves.offsets[1:-1])

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Points of the ground in the plane of the plate."""
        return (points * self._ground.scale + self._middle)[:, :2]

    def _lay(self, rays: Rays, parents: Curves | None, *, freely: bool) -> Curves:
        rays = self._free(rays) if freely else rays
        return lay_children(self._ground, rays, end_steps(self._ground, rays), None if freely else parents)[0]

    @staticmethod
    def _free(rays: Rays) -> Rays:
        """The same rays as far as walls let them: drawn are whole steps, not what an ancestor leaves of them."""
        return replace(rays, stop=np.where(rays.walks.is_blocked, rays.walks.far, np.inf))
