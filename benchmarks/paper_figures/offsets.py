"""Figures 2 and 3: what is kept by an offset of the borders, and three ways in which one turns out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import weavecore as wc
from paper_figures.drawing import (
    CHILD,
    INK,
    PARENT,
    WRONG,
    draw_loops,
    fill,
    generation_colour,
    make_panels,
    match_scales,
    save,
)
from paper_figures.pages import image, join, table
from paper_figures.plates import Plate, circle, dumbbell
from weavecore.geometry.geodesics import Walks, place_along, walk_far
from weavecore.model import Latitudes, SurfaceMesh
from weavecore.offsetting.propagation.domain import Domain

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"
SPACING = 100.0
_FAR = 1e4


def draw_comparison(folder: Path) -> str:
    """Figure 2: strips between geodesics, and latitudes, on the same shell."""
    surface = wc.read_surface(SAMPLES / "shell_2400x1600.3dm")
    geodesics = parallel_geodesics(surface, SPACING)
    latitudes = wc.offset(surface, spacing=SPACING)
    lines = latitudes.polylines
    figure, (left, right) = make_panels(
        ["strips between geodesics", "latitudes: the borders, offset"], width=8, height=2.9
    )
    borders = [surface.vertices[loop][:, :2] for loop in surface.borders]
    for panel in (left, right):
        fill(panel, borders)
    for line in geodesics:
        left.plot(*line[:, :2].T, color=WRONG, linewidth=0.9)
        left.plot(*line[[0, -1], :2].T, "o", color=WRONG, markersize=2.2)
    draw_loops(left, borders, INK, 1.0)
    for p in range(len(lines)):
        colour = generation_colour(int(latitudes.generation[p]), latitudes.n_generations)
        draw_loops(right, [lines.polyline(p)[:, :2]], colour, 1.5 if latitudes.generation[p] == 0 else 0.9)
    save(figure, folder / "figure_2.png")
    strips, rings = widths_of_strips(geodesics), widths_of_bands(latitudes)
    return join(
        image("figure_2", "Geodesic strips and latitudes on the shell, from above"),
        f"`shell_2400x1600.3dm` from above, with lines {SPACING:g} mm apart.",
        table(
            ["", "lines", "ends on a border", "distance to the next line, mm: least", "mean", "greatest"],
            [
                ["geodesics", len(geodesics), 2 * len(geodesics), *_three(strips)],
                ["latitudes", len(latitudes), 0, *_three(rings)],
            ],
        ),
    )


def _three(values: np.ndarray) -> list[str]:
    return [f"{value:.1f}" for value in (values.min(), values.mean(), values.max())]


def parallel_geodesics(surface: SurfaceMesh, spacing: float) -> list[np.ndarray]:
    """Straight lines (n, 3) that leave one straight line across the surface at right angles, ``spacing`` apart.

    That is the parallel transport of Pottmann et al. 2010 (*Geodesic patterns*) along a geodesic.
    """
    domain = Domain(surface)
    middle = domain.vertices[domain.faces].mean(1)
    face = np.array([np.linalg.norm(middle[:, :2] - middle[:, :2].mean(0) - [0.0, 0.0], axis=1).argmin()])
    weights = np.full((1, 3), 1 / 3)
    across = np.concatenate([_walk(domain, face, weights, np.array([[0.0, sign, 0.0]])) for sign in (-1, 1)])
    starts = [
        (walk, spacing / domain.scale * np.arange(k, int(walk.far[0] * domain.scale / spacing) + 1))
        for k, walk in enumerate(across)
    ]
    lines = []
    for walk, stations in starts:
        for station in stations:
            at, where = place_along(walk, np.array([station]))
            row = np.searchsorted(walk.finish, station)
            way = domain.points(walk.face[row : row + 1], (walk.end - walk.start)[row : row + 1])
            sideways = np.cross(domain.normals[at], way)
            there, back = (_walk(domain, at, where, sign * sideways)[0] for sign in (1, -1))
            lines.append(np.concatenate([_points(domain, back)[::-1], _points(domain, there)[1:]]) * domain.scale)
    offset = surface.vertices.mean(0)
    return [line + offset for line in lines]


def _walk(domain: Domain, face: np.ndarray, weights: np.ndarray, way: np.ndarray) -> list[Walks]:
    xy = domain.plane_points(face, weights)
    ux, uy = domain.plane_directions(face, way)
    return [walk_far(domain.frames, 3 * face, xy[:, 0], xy[:, 1], ux, uy, np.array([_FAR]))]


def _points(domain: Domain, walk: Walks) -> np.ndarray:
    return np.concatenate([domain.points(walk.face[:1], walk.start[:1]), domain.points(walk.face, walk.end)])


def widths_of_strips(lines: list[np.ndarray]) -> np.ndarray:
    """Distances from points of each line to the next one, where that is beside it."""
    dense = [_densely(line, SPACING / 20) for line in lines]
    found = []
    for one in dense:
        others = [other for other in dense if other is not one]
        trees = [cKDTree(other) for other in others]
        away, at = (np.array(x) for x in zip(*(tree.query(one) for tree in trees)))
        inside = (at > 0) & (at < np.array([len(other) - 1 for other in others])[:, None])
        nearest = np.where(inside, away, np.inf).min(0)
        found.append(nearest[nearest < 2 * SPACING])
    return np.concatenate(found)


def widths_of_bands(latitudes: Latitudes) -> np.ndarray:
    """Distances from points of each child to its nearest parent."""
    lines = latitudes.polylines
    found = []
    for child in np.unique(latitudes.parents[:, 1]):
        parents = latitudes.parents[latitudes.parents[:, 1] == child, 0]
        dense = np.concatenate([_densely(lines.polyline(p), SPACING / 100, closed=True) for p in parents])
        found.append(cKDTree(dense).query(lines.polyline(child))[0])
    return np.concatenate(found)


def _densely(line: np.ndarray, step: float, *, closed: bool = False) -> np.ndarray:
    if closed:
        line = np.concatenate([line, line[:1]])
    station = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0, station[-1], int(station[-1] / step) + 2)
    return np.stack([np.interp(wanted, station, line[:, k]) for k in range(3)], axis=1)


def draw_three_kinds(folder: Path) -> str:
    """Figure 3: a plain offset, one that crosses itself, two that cross each other."""
    edge = 0.2
    hole = circle(1.5, (1.55, 0.0), edge=edge)[::-1]
    cases = {
        "no event": ([circle(4.5, edge=edge)], 2),
        "self-intersection": ([dumbbell(8.4, (3.7, 3.2), 1.7, edge=edge)], 2),
        "mutual intersection": ([circle(4.7, edge=edge), hole], 1),
    }
    figure, panels = make_panels(list(cases), width=8, height=2.35)
    rows = []
    for panel, (name, (loops, generation)) in zip(panels, cases.items()):
        plate = Plate(loops, spacing=1.0, edge=edge)
        step = plate.offset(generation)
        latitudes = wc.offset(plate.surface, spacing=1.0, method="fronts")
        fill(panel, loops)
        lines = latitudes.polylines
        for p in range(len(lines)):
            g = latitudes.generation[p]
            draw_loops(panel, [lines.polyline(p)[:, :2]], PARENT if g == 0 else "#9db4c8", 1.6 if g == 0 else 0.7)
        draw_loops(panel, plate.outlines(step.raw), CHILD, 1.5)
        panel.plot(*plate.crossings(step).T, "o", color=WRONG, markersize=4, zorder=5)
        kept = int((latitudes.generation == generation).sum())
        family = f"{len(latitudes)} in {latitudes.n_generations} generations"
        rows.append([name, len(loops), len(step.raw), len(step.crossings), kept, family])
    match_scales(panels)
    save(figure, folder / "figure_3.png")
    return join(
        image("figure_3", "Three offsets of a border"),
        "The children of one generation as they come (blue), their crossings (red dots), and what covers the plate in\n"
        "the end (pale).",
        table(
            ["", "borders", "children as they come", "crossings", "polylines of that generation", "<polylines in all"],
            rows,
        ),
    )
