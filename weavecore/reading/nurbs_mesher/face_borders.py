"""The border of a face in (u, v), made of the vertices that its edges were given once, in space.

An edge's vertices are numbered once, so that the faces on it share them without a tolerance.  Each face finds them on
its own trim curve at the same share of the arc length::

    edge in space   a ──•────•─────•── b        shares 0, 0.2, 0.5, 0.9, 1 of its length
    trim in (u, v)  a ─•────•──────•─── b       at the same shares of the trim's length on the surface

Linear in the vertices and in the points of the trims.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import surface_points
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, BrepShape, FaceShape, TrimCurve
from weavecore.reading.nurbs_mesher.edge_paths import EdgePath

_SAME = 1e-8
"""Points of one vertex nearer than this part of the border's extent are in one place."""


@dataclass(frozen=True, eq=False)
class EdgeVertices:
    """The mesh vertices on all edges.

    Parameters
    ----------
    lengths : tuple of float64 arrays
        Arc lengths at which each edge is divided, its ends among them.
    vertex_ids : tuple of int64 arrays
        Which mesh vertex is there; the Brep's own vertices come first.
    points : (B, 3) float64
        Positions of these vertices.
    """

    lengths: tuple[Floats, ...]
    vertex_ids: tuple[Ints, ...]
    points: Floats


@dataclass(frozen=True, eq=False)
class FaceBorder:
    """A face's border.

    Parameters
    ----------
    uv : (B, 2) float64
        Parameters of its points.
    vertex_ids : (B,) int64
    segments : (S, 2) int64
        Between points.
    origin : (S, 2) int64
        The edge on which each segment lies and its number along it, or -1 on a singular side.
    """

    uv: Floats
    vertex_ids: Ints
    segments: Ints
    origin: Ints


def number_vertices(shape: BrepShape, paths: Sequence[EdgePath], lengths: Sequence[Floats]) -> EdgeVertices:
    """Number the vertices on the edges and place them on the edges' curves.

    Parameters
    ----------
    shape : BrepShape
    paths : sequence of EdgePath
    lengths : sequence of (K,) float64
        Arc lengths at which each edge is divided.

    Returns
    -------
    EdgeVertices
    """
    points = [shape.vertices]
    vertex_ids, n = [], len(shape.vertices)
    for path, along, (a, b) in zip(paths, lengths, shape.edge_vertices.tolist()):
        inner = len(along) - 2
        vertex_ids.append(np.concatenate([[a], n + np.arange(inner), [b]]).astype(np.int64))
        points.append(path.at(along[1:-1]))
        n += inner
    return EdgeVertices(tuple(lengths), tuple(vertex_ids), np.concatenate(points))


def bisect_segments(vertices: EdgeVertices, origin: Ints) -> list[Floats]:
    """Bisect segments of edges.

    Parameters
    ----------
    vertices : EdgeVertices
    origin : (S, 2) int64
        Edge and number of each segment.

    Returns
    -------
    list of float64 arrays
        The new arc lengths of each edge.
    """
    lengths = list(vertices.lengths)
    for edge in np.unique(origin[:, 0]).tolist():
        along = lengths[edge]
        segment = np.unique(origin[origin[:, 0] == edge, 1])
        lengths[edge] = np.sort(np.concatenate([along, (along[segment] + along[segment + 1]) / 2]))
    return lengths


def face_border(face: FaceShape, vertices: EdgeVertices) -> FaceBorder:
    """Place the edges' vertices along the trims of a face.

    Parameters
    ----------
    face : FaceShape
    vertices : EdgeVertices

    Returns
    -------
    FaceBorder
    """
    uv, vertex_ids, segments, origin, n = [], [], [], [], 0
    for loop in face.loops:
        start = n
        for trim in loop:
            placed, ids, lies_on = _place(trim, face, vertices)
            uv.append(placed[:-1])
            vertex_ids.append(ids[:-1])
            origin.append(lies_on)
            n += len(placed) - 1
        ring = np.arange(start, n)
        segments.append(np.column_stack([ring, np.roll(ring, -1)]))
    return _merged(np.concatenate(uv), np.concatenate(vertex_ids), np.concatenate(segments), np.concatenate(origin))


def _place(trim: TrimCurve, face: FaceShape, vertices: EdgeVertices) -> tuple[Floats, Ints, Ints]:
    """Parameters and vertex ids along a trim, and what each segment lies on."""
    if trim.edge == NO_EDGE:
        return _place_singular(trim)
    along, vertex_ids = vertices.lengths[trim.edge], vertices.vertex_ids[trim.edge]
    share = along / max(float(along[-1]), 1e-300)
    index = np.arange(len(along) - 1)
    if trim.against_edge:
        share, vertex_ids, index = 1.0 - share[::-1], vertex_ids[::-1], index[::-1]
    uv = _along(trim.uv, arc_length_shares(face, trim), share)
    return uv, vertex_ids, np.column_stack([np.full(len(index), trim.edge), index])


def arc_length_shares(face: FaceShape, trim: TrimCurve) -> Floats:
    """Share of the length in space of a trim up to each of its points.

    Parameters
    ----------
    face : FaceShape
    trim : TrimCurve

    Returns
    -------
    (M,) float64
        From 0 to 1.
    """
    steps = np.linalg.norm(np.diff(surface_points(face.surface, trim.uv), axis=0), axis=1)
    if steps.sum() == 0:
        steps = np.linalg.norm(np.diff(trim.uv, axis=0), axis=1)
    if steps.sum() == 0:  # A damaged trim may be a single place.
        steps = np.ones(len(steps))
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    shares: Floats = travelled / travelled[-1]
    return shares


def _place_singular(trim: TrimCurve) -> tuple[Floats, Ints, Ints]:
    """The two ends of a side that is a point in space: copies of one vertex.

    The triangle on this side collapses when the mesh is welded; its two other edges become one.
    """
    return trim.uv[[0, -1]], np.full(2, trim.vertices[0]), np.full((1, 2), NO_EDGE)


def _along(uv: Floats, share: Floats, wanted: Floats) -> Floats:
    return np.column_stack([np.interp(wanted, share, uv[:, 0]), np.interp(wanted, share, uv[:, 1])])


def _merged(uv: Floats, vertex_ids: Ints, segments: Ints, origin: Ints) -> FaceBorder:
    """The border with points merged that are the same vertex in the same place (slits, loops that touch)."""
    low, extent = uv.min(0), np.maximum(np.ptp(uv, axis=0), 1e-300)
    key = np.column_stack([vertex_ids, np.round((uv - low) / extent / _SAME).astype(np.int64)])
    _, first, merged = np.unique(key, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    segments = rank[merged.ravel()][segments]
    real = segments[:, 0] != segments[:, 1]
    kept = first[order]
    return FaceBorder(uv[kept], vertex_ids[kept], segments[real], origin[real].astype(np.int64))
