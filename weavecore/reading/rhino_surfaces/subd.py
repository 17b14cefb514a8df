"""A SubD as a mesh of its limit surface: refined where it needs it, each vertex moved to where it tends."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any

import numpy as np

from weavecore.errors import Degenerate, NonFinite, TooMuchWork
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.quads import split_quads
from weavecore.reading.rhino_surfaces.bisecting import bisected
from weavecore.reading.rhino_surfaces.meshed import MeshedObject
from weavecore.reading.rhino_surfaces.sizing import DEFAULT_FINENESS, Fineness
from weavecore.reading.rhino_surfaces.strips import (
    LONGEST_SIDE,
    Division,
    divide_strips,
    finer_grid,
    picked_quads,
    strips_of,
)

_MOST_QUADS = 400_000
_USUAL_QUADS = 100_000


def mesh_subd(
    subd: Any,
    *,
    wanted: Fineness = DEFAULT_FINENESS,
    transform: Floats | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh the limit surface of a ``rhino3dm.SubD``; see `mesh_object`.

    It is refined, and of the refinement each strip of quads keeps as many divisions as its length and its bend ask
    for.  What was not asked for by name is refined to 100,000 quads at most before that.
    """
    moved = np.eye(4) if transform is None else transform
    if subd.FaceCount == 0:
        raise Degenerate("The SubD has no faces", remedy="Give a surface that has an area.")
    points, base = _refined(subd, 1, moved, progress)
    strips = strips_of(base)
    grid, cells, quads, level = base[:, [[0, 3], [1, 2]]], np.arange(len(base)).reshape(-1, 1, 1), base, 1
    steps = 1
    while steps:
        level += 1
        points, finer = _refined(subd, level, moved, progress)
        grid, cells = finer_grid(grid, cells, quads, finer)
        quads = finer
        limits = wanted.limits(float(np.linalg.norm(np.ptp(points, axis=0))))
        division = divide_strips(points[grid], strips, limits.edge, limits.chord)
        steps = _steps_to_go(division, len(quads), wanted)
    owner, places = picked_quads(grid, strips, division.times)
    split = split_quads(
        points[grid[owner[:, None], places[..., 0], places[..., 1]]].reshape(-1, 3), _counted(len(owner))
    )
    corners = places.reshape(-1, 2)[split].reshape(-1, 3, 2)
    faces, rise = bisected(points, grid, np.repeat(owner, 2), corners, LONGEST_SIDE * limits.edge, limits.chord)
    used, named = np.unique(faces, return_inverse=True)
    faces = named.reshape(-1, 3)
    if np.linalg.det(moved[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return MeshedObject(points[used], faces, _border_loops(subd), max(rise, division.rise_left))


def _steps_to_go(division: Division, n_quads: int, wanted: Fineness) -> int:
    """How many refinements are still wanted.

    Raises
    ------
    TooMuchWork
        Where what was asked for takes too many.
    """
    asked = max(
        division.steps_by_edge if wanted.edge_target else 0,
        division.steps_by_chord if wanted.chord else 0,
    )
    if asked and n_quads * 4**asked > _MOST_QUADS:
        raise TooMuchWork("The SubD would take too many faces", remedy="Give a longer edge target.")
    room = int(np.log(_USUAL_QUADS / n_quads) / np.log(4)) if n_quads < _USUAL_QUADS else 0
    return max(asked, min(max(division.steps_by_edge, division.steps_by_chord), room))


def _counted(n_quads: int) -> Ints:
    return np.arange(4 * n_quads).reshape(-1, 4)


def _refined(
    subd: Any, level: int, moved: Floats, progress: Callable[[float, str], None] | None
) -> tuple[Floats, Ints]:
    """Limit points and faces after so many refinements."""
    if progress is not None:
        progress(1 - 0.6 ** (level - 1), "Refining the SubD")
    refined = subd.Duplicate()
    refined.Subdivide(level)
    return _limit_quads(refined, moved)


def _limit_quads(subd: Any, moved: Floats) -> tuple[Floats, Ints]:
    """Limit points (V, 3) and faces (Q, 4): after one refinement all faces have four corners."""
    vertices = list(subd.Vertices)
    points = list(map(attrgetter("X", "Y", "Z"), [vertex.SurfacePoint for vertex in vertices]))
    limit_points = np.array(points, np.float64).reshape(-1, 3)
    if not np.isfinite(limit_points).all():
        raise NonFinite("Points of a SubD that are not finite", remedy="Repair the object in Rhino.")
    quads = _net_quads(subd)
    if quads is None or len(quads) == 0 or quads.min() < 0 or quads.max() >= len(vertices):
        index = {vertex.Id: k for k, vertex in enumerate(vertices)}
        quads = np.array([[index[face.Vertex(k).Id] for k in range(4)] for face in subd.Faces], np.int64)
    return limit_points @ moved[:3, :3].T + moved[:3, 3], quads


def _net_quads(subd: Any) -> Ints | None:
    """The faces by way of a mesh of the control net, which numbers all alike and is faster; else None."""
    import rhino3dm

    of_rhino: Any = rhino3dm
    if not isinstance(subd, of_rhino.SubD):
        return None
    mesh = of_rhino.Mesh.CreateFromSubDControlNet(subd, False)
    if mesh is None or len(mesh.Vertices) != len(subd.Vertices) or len(mesh.Faces) != len(subd.Faces):
        return None
    return np.array(list(mesh.Faces), np.int64).reshape(-1, 4)


def _border_loops(subd: Any) -> int:
    """Number of loops of the control net's edges that have one face."""
    root: dict[int, int] = {}

    def find(v: int) -> int:
        while root.setdefault(v, v) != v:
            root[v] = root[root[v]]
            v = root[v]
        return v

    for edge in subd.Edges:
        if edge.FaceCount == 1:
            root[find(edge.VertexId(0))] = find(edge.VertexId(1))
    return len({find(v) for v in list(root)})
