"""A SubD as a mesh of its limit surface: refined, then each vertex moved to where it tends."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from weavecore.errors import Degenerate, NonFinite, TooMuchWork
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.quads import split_quads
from weavecore.reading.rhino_surfaces.meshed import MeshedObject
from weavecore.reading.rhino_surfaces.sizing import DEFAULT_FINENESS, Fineness

_MOST_FACES = 400_000
_USUAL_FACES = 100_000
_NEXT_LEVEL = 4


def mesh_subd(
    subd: Any,
    *,
    wanted: Fineness = DEFAULT_FINENESS,
    transform: Floats | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh the limit surface of a ``rhino3dm.SubD``; see `mesh_object`.

    It is refined until the edges' median length is at most the edge target and the chord error is kept.
    What was not asked for is refined to 100,000 faces at most.
    """
    moved = np.eye(4) if transform is None else transform
    if subd.FaceCount == 0:
        raise Degenerate("The SubD has no faces", remedy="Give a surface that has an area.")
    level, more = 0, 1
    while more:
        level += more
        if progress is not None:
            progress(1 - 0.6 ** (level - 1), "Refining the SubD")
        refined = subd.Duplicate()
        refined.Subdivide(level)
        points, quads = _limit_quads(refined, moved)
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        error, length = _chord_error(points, quads), _median_edge(points, quads)
        asked = _levels(length, wanted.edge_target, error, wanted.chord)
        if len(quads) * _NEXT_LEVEL**asked > _MOST_FACES:
            raise TooMuchWork("The SubD would take too many faces", remedy="Give a longer edge target.")
        room = int(np.log(_USUAL_FACES / len(quads)) / np.log(_NEXT_LEVEL)) if len(quads) < _USUAL_FACES else 0
        limits = wanted.limits(extent)
        usual = _levels(length, limits.edge, error, limits.chord)
        more = max(asked, min(usual, room))
    faces = split_quads(points, quads).reshape(-1, 3)
    if np.linalg.det(moved[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return MeshedObject(points, faces, _border_loops(subd), error)


def _levels(length: float, edge_target: float | None, error: float, chord: float | None) -> int:
    """How many refinements are still wanted: each halves the lengths and quarters the error."""
    by_length = np.log2(length / edge_target) if edge_target else 0.0
    by_error = np.log2(max(error, 1e-300) / chord) / 2 if chord else 0.0
    return max(int(np.ceil(max(by_length, by_error) - 1e-9)), 0)


def _limit_quads(subd: Any, moved: Floats) -> tuple[Floats, Ints]:
    """Limit points (V, 3) and faces (Q, 4): after one refinement all faces have four corners."""
    index: dict[int, int] = {}
    points: list[tuple[float, float, float]] = []
    for vertex in subd.Vertices:
        index[vertex.Id] = len(points)
        limit = vertex.SurfacePoint
        points.append((limit.X, limit.Y, limit.Z))
    quads = [[index[face.Vertex(k).Id] for k in range(4)] for face in subd.Faces]
    limit_points = np.array(points, np.float64)
    if not np.isfinite(limit_points).all():
        raise NonFinite("Points of a SubD that are not finite", remedy="Repair the object in Rhino.")
    return limit_points @ moved[:3, :3].T + moved[:3, 3], np.array(quads, np.int64)


def _median_edge(points: Floats, quads: Ints) -> float:
    sides = points[np.roll(quads, -1, axis=1)] - points[quads]
    return float(np.median(np.linalg.norm(sides, axis=2)))


def _chord_error(points: Floats, quads: Ints) -> float:
    """How far the surface rises over the faces, from how much the normals turn: edge · angle / 8 at most."""
    corners = points[quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    tail, head = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    key = np.minimum(tail, head) * np.int64(len(points)) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    f, g = order[same] // 4, order[same + 1] // 4
    turn = np.linalg.norm(normal[f] - normal[g], axis=1)
    length = np.linalg.norm(corners[:, 2] - corners[:, 0], axis=1) / np.sqrt(2)
    # Creases turn however fine the mesh is: they are edges of the surface, not an error.
    smooth = turn < 0.5
    return float((turn * np.maximum(length[f], length[g]) / 8)[smooth].max(initial=0.0))


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
