"""Brep edges by arc length: where their mesh vertices lie, and which edges of several Breps coincide.

*Dividing.*  An edge with arc length s and wanted size h(s) gets vertices at equal steps of ∫ ds / h, kinks and ends
among them.  *Joining.*  Edges of different Breps that have the same ends and run within the tolerance of each other
become one edge with the trims of both, so that both sides share its vertices as the faces of a polysurface do.  O(n
log n) in the Breps' vertices, then pairwise among edges with the same ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import NurbsCurve, curve_points
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, BrepShape, FaceShape, TrimCurve, fine_parameters

_KINK = np.radians(20.0)
"""Turn between two steps of the fine polyline that is a kink; a smooth curve has 16 steps a span and turns less."""

_LEAST_CLOSED = 4
"""Segments of a closed edge: three have no doubled edges, four keep a small hole from being a single triangle."""

_LEAST_TWIN = 2
"""Segments of an edge that has the same ends as another: one each would coincide."""


_SHARES = np.array([0.25, 0.5, 0.75])
"""Shares of the length at which two edges are compared."""


@dataclass(frozen=True, eq=False)
class EdgePath:
    """An edge as a table: parameters, points and arc lengths (M,), curvature (M,), and where its kinks are."""

    curve: NurbsCurve
    parameters: Floats
    points: Floats
    lengths: Floats
    curvature: Floats
    kinks: Ints

    @property
    def length(self) -> float:
        """Arc length of the whole edge."""
        return float(self.lengths[-1])

    def at(self, lengths: Floats) -> Floats:
        """Points (K, 3) of the curve at arc lengths (K,)."""
        return curve_points(self.curve, np.interp(lengths, self.lengths, self.parameters))


def edge_path(curve: NurbsCurve) -> EdgePath:
    """Measure an edge.

    Parameters
    ----------
    curve : NurbsCurve

    Returns
    -------
    EdgePath
    """
    parameters = fine_parameters(curve)
    points = curve_points(curve, parameters)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    directions = np.diff(points, axis=0) / np.maximum(steps, 1e-300)[:, None]
    turn = 2 * np.arcsin(np.clip(np.linalg.norm(np.diff(directions, axis=0), axis=1) / 2, 0, 1))
    turn[(steps[1:] == 0) | (steps[:-1] == 0)] = 0.0
    curvature = np.zeros(len(points))
    curvature[1:-1] = np.where(turn < _KINK, 2 * turn / np.maximum(steps[1:] + steps[:-1], 1e-300), 0.0)
    if len(points) > 2:
        curvature[0], curvature[-1] = curvature[1], curvature[-2]
    return EdgePath(curve, parameters, points, lengths, curvature, np.flatnonzero(turn >= _KINK) + 1)


def least_segments(shape: BrepShape) -> Ints:
    """How many segments each edge must have so that no two of all segments join the same vertices.

    Parameters
    ----------
    shape : BrepShape

    Returns
    -------
    (E,) int64
    """
    ends = np.sort(shape.edge_vertices, axis=1)
    _, group, times = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(times[group.ravel()] > 1, _LEAST_TWIN, 1)
    least[ends[:, 0] == ends[:, 1]] = _LEAST_CLOSED
    return least.astype(np.int64)


def divide_path(path: EdgePath, sizes: Floats, least: int) -> Floats:
    """Divide an edge.

    Parameters
    ----------
    path : EdgePath
    sizes : (M,) float64
        Wanted edge lengths at the points of the table.
    least : int
        Least number of segments.

    Returns
    -------
    (K,) float64
        Arc lengths of the vertices, ends and kinks among them.
    """
    if path.length == 0:
        return np.linspace(0.0, 0.0, least + 1)
    density = 1.0 / sizes
    count = np.concatenate([[0.0], np.cumsum(np.diff(path.lengths) * (density[1:] + density[:-1]) / 2)])
    stops = np.concatenate([[0], path.kinks, [len(count) - 1]])
    pieces = []
    for i, j in zip(stops[:-1].tolist(), stops[1:].tolist()):
        n = max(round(float(count[j] - count[i])), -(-least // (len(stops) - 1)), 1)
        pieces.append(np.interp(np.linspace(count[i], count[j], n + 1)[:-1], count, path.lengths))
    return np.append(np.concatenate(pieces), path.length)


def join_shapes(shapes: Sequence[BrepShape], tolerance: float) -> BrepShape:
    """One shape of several.

    Parameters
    ----------
    shapes : sequence of BrepShape
    tolerance : float
        Vertices nearer than this are welded, and edges that coincide within it joined.

    Returns
    -------
    BrepShape
    """
    n_vertices = np.cumsum([0] + [len(s.vertices) for s in shapes])
    n_edges = np.cumsum([0] + [len(s.edges) for s in shapes])
    vertices = np.concatenate([s.vertices for s in shapes])
    weld = _clusters(vertices, tolerance)
    ends = weld[np.concatenate([s.edge_vertices + first for s, first in zip(shapes, n_vertices)])]
    edges = [edge for s in shapes for edge in s.edges]
    trims = np.concatenate([s.edge_trims for s in shapes])
    same, against = _coinciding([edge_path(e) for e in edges], ends, trims, tolerance)
    faces = [
        _renumbered(face, weld, same, against, int(v), int(e))
        for s, v, e in zip(shapes, n_vertices, n_edges)
        for face in s.faces
    ]
    counts = np.bincount(same, trims, minlength=len(edges)).astype(np.int64)
    return BrepShape(vertices, tuple(edges), ends, counts, tuple(faces))


def _clusters(points: Floats, tolerance: float) -> Ints:
    """For each point the first of those connected to it by steps within the tolerance."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    n = len(points)
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    weld: Ints = first[label]
    return weld


def _coinciding(paths: Sequence[EdgePath], ends: Ints, trims: Ints, tolerance: float) -> tuple[Ints, Ints]:
    """For each edge the first that it coincides with, and whether it runs against that one.

    Only edges with a single trim are joined, and only in pairs.
    """
    same, against = np.arange(len(paths)), np.zeros(len(paths), np.int64)
    by_ends: dict[tuple[int, int], list[int]] = {}
    for i in np.flatnonzero(trims == 1).tolist():
        key = (int(ends[i].min()), int(ends[i].max()))
        candidates = by_ends.setdefault(key, [])
        for j in candidates:
            ways = [way for way in (0, 1) if _lies_on(paths[i], paths[j], way, tolerance)]
            ways = [way for way in ways if ends[i, way] == ends[j, 0]]
            if ways:
                same[i], against[i] = j, ways[0]
                candidates.remove(j)
                break
        else:
            candidates.append(i)
    return same, against


def _lies_on(path: EdgePath, other: EdgePath, against: int, tolerance: float) -> bool:
    """Whether two edges are near to each other at equal shares of their lengths."""
    shares = 1.0 - _SHARES if against else _SHARES
    apart = np.linalg.norm(path.at(shares * path.length) - other.at(_SHARES * other.length), axis=1)
    slack = tolerance + abs(path.length - other.length)
    return bool(abs(path.length - other.length) <= 4 * tolerance + 1e-3 * other.length and (apart <= slack).all())


def _renumbered(face: FaceShape, weld: Ints, same: Ints, against: Ints, vertex: int, edge: int) -> FaceShape:
    def renumbered(trim: TrimCurve) -> TrimCurve:
        a, b = trim.vertices
        ends = int(weld[a + vertex]), int(weld[b + vertex])
        if trim.edge == NO_EDGE:
            return replace(trim, vertices=ends)
        index = trim.edge + edge
        return replace(
            trim, vertices=ends, edge=int(same[index]), against_edge=trim.against_edge != bool(against[index])
        )

    return replace(face, loops=tuple(tuple(renumbered(trim) for trim in loop) for loop in face.loops))
