"""Adapters of the methods that are compared: from a mesh to the levels of its distance from the borders."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Callable

import numpy as np
import potpourri3d as pp3d

from exact import Places
from weavecore.model import SurfaceMesh
from weavecore.offsetting.level_sets import offset_levels


@dataclass(frozen=True)
class Run:
    """Processor seconds, and places on the levels."""

    seconds: float
    places: Callable[[], Places]


def run_weavecore(vertices: np.ndarray, faces: np.ndarray, spacing: float) -> Run:
    """Everything from the checks of the surface to the polylines, bands and parents."""
    begin = time.process_time()
    surface = SurfaceMesh(vertices, faces)
    latitudes = offset_levels(surface, spacing=spacing)
    end = time.process_time()

    def places() -> Places:
        polylines = latitudes.polylines
        inner = latitudes.generation[polylines.owner] > 0
        distance = latitudes.distance[polylines.owner]
        on = latitudes.surface  # refined, where the given mesh was too coarse for the spacing
        return Places(on.vertices, on.faces, polylines.face[inner], polylines.barycentric[inner], distance[inner])

    return Run(end - begin, places)


def run_heat_method(vertices: np.ndarray, faces: np.ndarray, spacing: float) -> Run:
    """Factorisation, solution from the border's vertices, marching triangles at each level."""
    sources = [v for loop in _borders(vertices, faces) for v in loop]

    def solve() -> np.ndarray:
        return pp3d.MeshHeatMethodDistanceSolver(vertices, faces).compute_distance_multisource(sources)

    return _run_peer(vertices, faces, spacing, solve)


def run_fast_marching(vertices: np.ndarray, faces: np.ndarray, spacing: float) -> Run:
    """Fast marching from the border's edges, marching triangles at each level."""
    curves = [[(v, []) for v in [*loop, loop[0]]] for loop in _borders(vertices, faces)]

    def solve() -> np.ndarray:
        return pp3d.MeshFastMarchingDistanceSolver(vertices, faces).compute_distance(curves)

    return _run_peer(vertices, faces, spacing, solve)


METHODS: dict[str, Callable[[np.ndarray, np.ndarray, float], Run]] = {
    "weavecore levels": run_weavecore,
    "heat method": run_heat_method,
    "fast marching": run_fast_marching,
}


def _borders(vertices: np.ndarray, faces: np.ndarray) -> list[list[int]]:
    return [loop.tolist() for loop in SurfaceMesh(vertices, faces).borders]


def _run_peer(vertices: np.ndarray, faces: np.ndarray, spacing: float, solve: Callable[[], np.ndarray]) -> Run:
    begin = time.process_time()
    distance = solve()
    marcher = pp3d.MeshMarchingTrianglesSolver(vertices, faces)
    for level in spacing * np.arange(1, int(distance.max() / spacing) + 1):
        marcher.marching_triangles(distance, level)
    end = time.process_time()
    return Run(end - begin, lambda: _cross_edges(vertices, faces, distance, spacing))


def _cross_edges(vertices: np.ndarray, faces: np.ndarray, distance: np.ndarray, spacing: float) -> Places:
    """Where the linear interpolation of a distance crosses its levels on the sides of the faces."""
    level = np.floor(distance / spacing)
    face, k = np.nonzero(level[faces] < level[faces[:, [1, 2, 0]]])
    low, high = distance[faces[face, k]], distance[faces[face, (k + 1) % 3]]
    wanted = (np.floor(low / spacing) + 1) * spacing
    part = (wanted - low) / (high - low)
    weights = np.zeros((len(face), 3))
    rows = np.arange(len(face))
    weights[rows, k], weights[rows, (k + 1) % 3] = 1 - part, part
    return Places(vertices, faces, face, weights, wanted)
