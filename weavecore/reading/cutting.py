"""A closed mesh cut along the zero line of a function of its vertices, so that the line is made of edges.

The *level* of a vertex is the value there: its height over a plane, say.  An edge whose ends lie on
both sides is *crossed*.  Where the line comes close to a vertex it goes through it, else a
new vertex is put on the crossed edge.  Nothing moves: the shape stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, border_loops, find_twins, halfedge_ends
from weavecore.reading.quads import split_quads
from weavecore.tolerances import CUT_FROM_VERTEX


@dataclass(frozen=True, eq=False)
class Cut:
    """A mesh with edges along the cut.

    Parameters
    ----------
    vertices : (V, 3) float64
        Those of the mesh before, then the new ones.
    faces : (F, 3) int64
        Those that are not crossed, in their order, then the parts of the others.
    loops : tuple of int arrays
        Closed vertex loops without a common vertex, with the side above zero on their left.
    """

    vertices: Floats
    faces: Ints
    loops: tuple[Ints, ...]


def cut_along(vertices: Floats, faces: Ints, twins: Ints, level: Floats) -> Cut:
    """Split the faces along the line where the level is 0.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Oriented and manifold; the line meets no border.
    twins : (3F,) int64
    level : (V,) float64
        Vertices of level 0 count as above where the line cannot go through them.
    """
    tail, head = halfedge_ends(faces)
    part = _crossing_part(level[tail], level[head])
    side = _sides(faces, twins, level, part)
    crossed = np.flatnonzero(side[tail] * side[head] < 0)
    first = crossed[crossed < twins[crossed]]
    at = np.clip(part[first], CUT_FROM_VERTEX, 1 - CUT_FROM_VERTEX)[:, None]
    new = vertices[tail[first]] * (1 - at) + vertices[head[first]] * at
    middle = np.full(len(tail), -1, np.int64)
    middle[first] = middle[twins[first]] = len(vertices) + np.arange(len(first))
    points = np.concatenate([vertices, new])
    parts = _split(points, faces, middle.reshape(-1, 3))
    return Cut(points, parts, _loops(parts, np.concatenate([side, np.zeros(len(new), np.int64)])))


def _crossing_part(a: Floats, b: Floats) -> Floats:
    """Where a level that goes from a to b is 0, as a part of the way."""
    part: Floats = np.divide(a, a - b, out=np.full(len(a), 0.5), where=a != b)
    return part


def _sides(faces: Ints, twins: Ints, level: Floats, part: Floats) -> Ints:
    """1 above, -1 below, 0 for vertices (V,) that the line goes through.

    The line may go through vertices that it comes close to where it then passes each just
    once, and neither branches nor ends; the others go back to their side.
    """
    tail, head = halfedge_ends(faces)
    sign = np.where(level >= 0, 1, -1)
    crossed = sign[tail] * sign[head] < 0
    near = np.zeros(len(level), bool)
    near[tail[crossed & (part < CUT_FROM_VERTEX)]] = True
    near[head[crossed & (part > 1 - CUT_FROM_VERTEX)]] = True
    while True:
        side = np.where(near, 0, sign)
        wrong = near & _branches(faces, twins, side)
        if not wrong.any():
            return side
        near &= ~wrong


def _branches(faces: Ints, twins: Ints, side: Ints) -> Bools:
    """Vertices (V,) on the line where other than no or two pieces of it meet.

    A face that lies in the line with all its corners counts as below.
    """
    tail, head = halfedge_ends(faces)
    opposite = faces[:, [2, 0, 1]].ravel()
    into_face = side[head] * side[opposite] < 0
    along_edge = (side[head] == 0) & ((side[opposite] > 0) != (side[opposite[twins]] > 0))
    pieces = np.bincount(tail[(side[tail] == 0) & (into_face | along_edge)], minlength=len(side))
    wrong: Bools = (pieces != 0) & (pieces != 2)
    return wrong


def _split(points: Floats, faces: Ints, middle: Ints) -> Ints:
    """Faces with those that have a vertex in the middle of one or two edges in parts.

    ``middle`` (F, 3) is that vertex for the edge from corner k to k + 1, or -1.
    """
    n_crossed = (middle >= 0).sum(1)
    one, two = np.flatnonzero(n_crossed == 1), np.flatnonzero(n_crossed == 2)
    k = middle[one].argmax(1)
    a, b, c = (faces[one, (k + i) % 3] for i in range(3))
    m = middle[one, k]
    halves = np.stack([np.stack([a, m, c], 1), np.stack([m, b, c], 1)], 1).reshape(-1, 3)
    k = (middle[two].argmin(1) + 2) % 3
    a, b, c = (faces[two, (k + i) % 3] for i in range(3))
    p, q = middle[two, k], middle[two, (k + 2) % 3]
    tips = np.stack([a, p, q], 1)
    rests = split_quads(points, np.stack([p, b, c, q], 1)).reshape(-1, 3)
    return np.concatenate([faces[n_crossed == 0], halves, tips, rests])


def _loops(faces: Ints, side: Ints) -> tuple[Ints, ...]:
    above = side[faces].sum(1) > 0
    twins = find_twins(faces, len(side))
    is_cut = np.repeat(above, 3) & ~above[twins // 3] & (twins != NO_TWIN)
    return tuple(border_loops(faces, np.where(is_cut, NO_TWIN, 0)))
