"""The border of a face in (u, v), made of the vertices that its edges were given once, in space.

An edge's vertices are numbered once, so that the faces on it share them without a tolerance; each
face finds them on its own trim curve, at the same share of the arc length.
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


@dataclass(frozen=True, eq=False)
class EdgeVertices:
    """The mesh vertices on all edges.

    Attributes
    ----------
    lengths : sequence of float arrays
        Arc lengths at which each edge is divided, its ends among them.
    names : sequence of int arrays
        Which mesh vertex is there; the Brep's own vertices come first.
    points : (B, 3)
        Positions of the vertices so named.
    """

    lengths: tuple[Floats, ...]
    names: tuple[Ints, ...]
    points: Floats


@dataclass(frozen=True, eq=False)
class FaceBorder:
    """A face's border: parameters (B, 2), names (B,), segments (S, 2), and what each of them lies on (S, 2).

    ``origin`` holds the edge and the number of the segment along it, or -1 on a singular side.
    """

    uv: Floats
    names: Ints
    segments: Ints
    origin: Ints


def number_vertices(shape: BrepShape, paths: Sequence[EdgePath], lengths: Sequence[Floats]) -> EdgeVertices:
    """Give each vertex on an edge its number and its place on the edge's curve."""
    points = [shape.vertices]
    names, n = [], len(shape.vertices)
    for path, along, (a, b) in zip(paths, lengths, shape.edge_vertices.tolist()):
        inner = len(along) - 2
        names.append(np.concatenate([[a], n + np.arange(inner), [b]]).astype(np.int64))
        points.append(path.at(along[1:-1]))
        n += inner
    return EdgeVertices(tuple(lengths), tuple(names), np.concatenate(points))


def bisect_segments(vertices: EdgeVertices, origin: Ints) -> list[Floats]:
    """The edges' arc lengths with the segments named by ``origin`` (S, 2) halved."""
    lengths = list(vertices.lengths)
    for edge in np.unique(origin[:, 0]).tolist():
        along = lengths[edge]
        segment = np.unique(origin[origin[:, 0] == edge, 1])
        lengths[edge] = np.sort(np.concatenate([along, (along[segment] + along[segment + 1]) / 2]))
    return lengths


def face_border(face: FaceShape, vertices: EdgeVertices) -> FaceBorder:
    """Place the edges' vertices along the trims of a face."""
    uv, names, segments, origin, n = [], [], [], [], 0
    for loop in face.loops:
        start = n
        for trim in loop:
            placed, called, lies_on = _place(trim, face, vertices)
            uv.append(placed[:-1])
            names.append(called[:-1])
            origin.append(lies_on)
            n += len(placed) - 1
        ring = np.arange(start, n)
        segments.append(np.column_stack([ring, np.roll(ring, -1)]))
    return _merged(np.concatenate(uv), np.concatenate(names), np.concatenate(segments), np.concatenate(origin))


def _place(trim: TrimCurve, face: FaceShape, vertices: EdgeVertices) -> tuple[Floats, Ints, Ints]:
    """Parameters and names of the vertices along a trim, and what each segment lies on."""
    if trim.edge == NO_EDGE:
        return _place_singular(trim)
    along, names = vertices.lengths[trim.edge], vertices.names[trim.edge]
    share = along / max(float(along[-1]), 1e-300)
    index = np.arange(len(along) - 1)
    if trim.against_edge:
        share, names, index = 1.0 - share[::-1], names[::-1], index[::-1]
    uv = _along(trim.uv, travelled_shares(face, trim), share)
    return uv, names, np.column_stack([np.full(len(index), trim.edge), index])


def travelled_shares(face: FaceShape, trim: TrimCurve) -> Floats:
    """Which share of its length in space a trim has travelled at each of its points (M,)."""
    steps = np.linalg.norm(np.diff(surface_points(face.surface, trim.uv), axis=0), axis=1)
    if steps.sum() == 0:
        steps = np.linalg.norm(np.diff(trim.uv, axis=0), axis=1)
    if steps.sum() == 0:  # A damaged trim may be a single place.
        steps = np.ones(len(steps))
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    shares: Floats = travelled / travelled[-1]
    return shares


def _place_singular(trim: TrimCurve) -> tuple[Floats, Ints, Ints]:
    """A side that is a point: its two ends, copies of one vertex.

    The triangle on this side collapses when the mesh is put together; the two edges beside it become one.
    """
    return trim.uv[[0, -1]], np.full(2, trim.vertices[0]), np.full((1, 2), NO_EDGE)


def _along(uv: Floats, share: Floats, wanted: Floats) -> Floats:
    return np.column_stack([np.interp(wanted, share, uv[:, 0]), np.interp(wanted, share, uv[:, 1])])


def _merged(uv: Floats, names: Ints, segments: Ints, origin: Ints) -> FaceBorder:
    """Make one of points that are the same vertex at the same place (slits, loops that touch)."""
    low, extent = uv.min(0), np.maximum(np.ptp(uv, axis=0), 1e-300)
    key = np.column_stack([names, np.round((uv - low) / extent / _SAME).astype(np.int64)])
    _, first, merged = np.unique(key, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    segments = place[merged.ravel()][segments]
    real = segments[:, 0] != segments[:, 1]
    kept = first[order]
    return FaceBorder(uv[kept], names[kept], segments[real], origin[real].astype(np.int64))
