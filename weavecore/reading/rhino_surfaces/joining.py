"""Breps made one where their edges coincide, before they are meshed.

Edges that run alike become one edge with the trims of both, so that both sides share its vertices as the
faces of a polysurface do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.rhino_surfaces.paths import EdgePath, edge_path
from weavecore.reading.rhino_surfaces.shape import NO_EDGE, BrepShape, FaceShape, TrimCurve

_SHARES = np.array([0.25, 0.5, 0.75])


def join_shapes(shapes: Sequence[BrepShape], tolerance: float) -> BrepShape:
    """One shape of several: vertices nearer than ``tolerance`` are one, and edges that coincide."""
    n_vertices = np.cumsum([0] + [len(s.vertices) for s in shapes])
    n_edges = np.cumsum([0] + [len(s.edges) for s in shapes])
    vertices = np.concatenate([s.vertices for s in shapes])
    place = _clusters(vertices, tolerance)
    ends = place[np.concatenate([s.edge_vertices + first for s, first in zip(shapes, n_vertices)])]
    edges = [edge for s in shapes for edge in s.edges]
    trims = np.concatenate([s.edge_trims for s in shapes])
    same, against = _coinciding([edge_path(e) for e in edges], ends, trims, tolerance)
    faces = [
        _renamed(face, place, same, against, int(v), int(e))
        for s, v, e in zip(shapes, n_vertices, n_edges)
        for face in s.faces
    ]
    counts = np.bincount(same, trims, minlength=len(edges)).astype(np.int64)
    return BrepShape(vertices, tuple(edges), ends, counts, tuple(faces))


def _clusters(points: Floats, tolerance: float) -> Ints:
    """For each point the first of those that hang together with it."""
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    n = len(points)
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    place: Ints = first[label]
    return place


def _coinciding(paths: Sequence[EdgePath], ends: Ints, trims: Ints, tolerance: float) -> tuple[Ints, Ints]:
    """For each edge the first that it coincides with, and whether it runs against that one.

    Only edges with a single trim are joined, and only two by two.
    """
    same, against = np.arange(len(paths)), np.zeros(len(paths), np.int64)
    by_ends: dict[tuple[int, int], list[int]] = {}
    for i in np.flatnonzero(trims == 1).tolist():
        key = (int(ends[i].min()), int(ends[i].max()))
        rivals = by_ends.setdefault(key, [])
        for j in rivals:
            ways = [way for way in (0, 1) if _lies_on(paths[i], paths[j], way, tolerance)]
            ways = [way for way in ways if ends[i, way] == ends[j, 0]]
            if ways:
                same[i], against[i] = j, ways[0]
                rivals.remove(j)
                break
        else:
            rivals.append(i)
    return same, against


def _lies_on(path: EdgePath, other: EdgePath, against: int, tolerance: float) -> bool:
    """Whether two edges are near to each other at equal shares of their lengths."""
    shares = 1.0 - _SHARES if against else _SHARES
    apart = np.linalg.norm(path.at(shares * path.length) - other.at(_SHARES * other.length), axis=1)
    slack = tolerance + abs(path.length - other.length)
    return bool(abs(path.length - other.length) <= 4 * tolerance + 1e-3 * other.length and (apart <= slack).all())


def _renamed(face: FaceShape, place: Ints, same: Ints, against: Ints, vertex: int, edge: int) -> FaceShape:
    def renamed(trim: TrimCurve) -> TrimCurve:
        a, b = trim.vertices
        ends = int(place[a + vertex]), int(place[b + vertex])
        if trim.edge == NO_EDGE:
            return replace(trim, vertices=ends)
        index = trim.edge + edge
        return replace(
            trim, vertices=ends, edge=int(same[index]), against_edge=trim.against_edge != bool(against[index])
        )

    return replace(face, loops=tuple(tuple(renamed(trim) for trim in loop) for loop in face.loops))
