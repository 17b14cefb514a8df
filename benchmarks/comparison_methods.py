"""Ways from a mesh to polylines at given distances from its borders: weavecore's two and its peers'.

Each method takes the arrays of a mesh, its border loops and the spacing, and gives polylines; what it needs is imported
when it runs, so that one that is not installed hinders no other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable

import numpy as np
from scipy.spatial import cKDTree

Loops = list[np.ndarray]


@dataclass(frozen=True, eq=False)
class Mesh:
    """What a method is given.

    Attributes
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    borders : list of int arrays
        Vertex loops.
    spacing : float
    """

    vertices: np.ndarray
    faces: np.ndarray
    borders: Loops
    spacing: float

    @property
    def sources(self) -> list[int]:
        """The vertices of the borders."""
        return [int(v) for loop in self.borders for v in loop]

    def levels(self, farthest: float) -> list[float]:
        """The multiples of the spacing up to a distance."""
        return [self.spacing * k for k in range(1, int(farthest / self.spacing) + 1)]


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline: points (n, 3), the distance that they should have, and whether it is closed (no point repeated)."""

    points: np.ndarray
    distance: float
    closed: bool


def run_levels(mesh: Mesh) -> list[Line]:
    """``weavecore.offset``."""
    return _run_weavecore(mesh, "levels")


def run_fronts(mesh: Mesh) -> list[Line]:
    """``weavecore.offset(method="fronts")``, the paper's own way."""
    return _run_weavecore(mesh, "fronts")


def _run_weavecore(mesh: Mesh, method: str) -> list[Line]:
    import weavecore as wc

    latitudes = wc.offset(wc.SurfaceMesh(mesh.vertices, mesh.faces), spacing=mesh.spacing, method=method)
    lines = latitudes.polylines
    inner = np.flatnonzero(latitudes.generation > 0)
    return [Line(lines.polyline(p), float(latitudes.distance[p]), bool(lines.closed[p])) for p in inner]


def run_heat(mesh: Mesh) -> list[Line]:
    """The heat method of Crane et al. 2013 (potpourri3d) from the borders' vertices."""
    import potpourri3d as pp3d

    return march(
        mesh, pp3d.MeshHeatMethodDistanceSolver(mesh.vertices, mesh.faces).compute_distance_multisource(mesh.sources)
    )


def run_signed_heat(mesh: Mesh) -> list[Line]:
    """The signed heat method of Feng and Crane 2024 (potpourri3d) from the borders' edges."""
    import potpourri3d as pp3d

    solver = pp3d.MeshSignedHeatSolver(mesh.vertices, mesh.faces)
    distance = solver.compute_distance(_curves(mesh), level_set_constraint="ZeroSet")
    return march(mesh, np.abs(distance))


def run_fast_marching(mesh: Mesh) -> list[Line]:
    """Fast marching of Kimmel and Sethian 1998 (potpourri3d) from the borders' edges."""
    import potpourri3d as pp3d

    return march(mesh, pp3d.MeshFastMarchingDistanceSolver(mesh.vertices, mesh.faces).compute_distance(_curves(mesh)))


def run_exact(mesh: Mesh) -> list[Line]:
    """The exact polyhedral distance of Mitchell et al. 1987 (pygeodesic) from the borders' vertices."""
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    solver = PyGeodesicAlgorithmExact(mesh.vertices, mesh.faces)
    return march(mesh, solver.geodesicDistances(np.array(mesh.sources), None)[0])


def run_compas_cgal(mesh: Mesh) -> list[Line]:
    """``geodesic_isolines`` of compas_cgal: CGAL's heat method and its isolines."""
    from compas_cgal.geodesics import geodesic_isolines, heat_geodesic_distances

    given = (mesh.vertices, mesh.faces)
    distance = heat_geodesic_distances(given, mesh.sources)
    levels = mesh.levels(float(distance.max()))
    vertices = cKDTree(mesh.vertices)
    found = []
    for points in geodesic_isolines(given, mesh.sources, levels):
        closed = len(points) > 3 and bool(np.allclose(points[0], points[-1], rtol=0, atol=1e-9 * mesh.spacing))
        # It does not tell which level a line is of.
        level = round(float(np.median(distance[vertices.query(points)[1]])) / mesh.spacing) * mesh.spacing
        found.append(Line(np.asarray(points[:-1] if closed else points), level, closed))
    return found


METHODS: dict[str, tuple[str, Callable[[Mesh], list[Line]]]] = {
    "weavecore levels": ("weavecore", run_levels),
    "weavecore fronts": ("weavecore", run_fronts),
    "heat method": ("potpourri3d", run_heat),
    "signed heat": ("potpourri3d", run_signed_heat),
    "fast marching": ("potpourri3d", run_fast_marching),
    "exact from vertices": ("pygeodesic", run_exact),
    "compas_cgal": ("compas_cgal", run_compas_cgal),
}
"""The package that each comes with, and what runs it."""


def _curves(mesh: Mesh) -> list[list[tuple[int, list[float]]]]:
    return [[(int(v), []) for v in [*loop, loop[0]]] for loop in mesh.borders]


def march(mesh: Mesh, distance: np.ndarray) -> list[Line]:
    """The isolines of the linear interpolation (potpourri3d)."""
    import potpourri3d as pp3d

    marcher = pp3d.MeshMarchingTrianglesSolver(mesh.vertices, mesh.faces)
    tails, heads = _edges(mesh.faces)
    found = []
    for level in mesh.levels(float(distance.max())):
        for curve in marcher.marching_triangles(distance, level):
            closed = len(curve) > 3 and curve[0] == curve[-1]
            found.append(Line(_points(mesh.vertices, tails, heads, curve[:-1] if closed else curve), level, closed))
    return found


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both ends of the edges, in the order and direction in which faces name them first: geometry-central's."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    _, first = np.unique(np.sort(np.stack([tail, head], axis=1), axis=1), axis=0, return_index=True)
    first.sort()
    return tail[first], head[first]


def _points(vertices: np.ndarray, tails: np.ndarray, heads: np.ndarray, curve: Any) -> np.ndarray:
    """The points (n, 3) of a curve of vertices, without coordinates, and edges, with one."""
    is_edge = np.array([len(where) == 1 for _, where in curve])
    element = np.array([at for at, _ in curve])
    part = np.array([where[0] if len(where) == 1 else 0.0 for _, where in curve])[:, None]
    edge = np.where(is_edge, element, 0)
    on_edge = vertices[tails[edge]] * (1 - part) + vertices[heads[edge]] * part
    return np.where(is_edge[:, None], on_edge, vertices[np.where(is_edge, 0, element)])
