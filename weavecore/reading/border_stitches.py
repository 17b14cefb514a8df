"""Vertices of a border inserted into the border edges that they lie on (T-junctions).

Two sides of a seam that were divided differently leave slits without area, which would be borders::

      ──a─────────────b──            ──a─────────────b──
                                         ╲    │    ╱         the triangle on ab becomes a fan
      ──a──p──────q───b──    ──▶       ──a──p─┴──q──b──

A vertex lies on an edge if it is nearer than the tolerance plus the chord error there, which follows from the
turning angle θ of the border: an edge of length L on a curve has the sagitta L θ / 8, and at t from 0 to 1 along it
leaves the curve by 4 t (1 - t) times as much.  Vertices within the tolerance come first.  Insertions after which
nothing is closed, or an edge has more than two faces, are undone.  A k-d tree finds the vertices: O(n log n) in the
border.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.reading.nurbs_mesher.stitching import fan_with_inserted
from weavecore.reading.orientation import NO_PARTNER, pair_edges

_CORNER = 0.5
"""Radians.  A border that turns by more has a corner there, which says nothing of its curvature."""

_CHORDS = 0.25
"""Of edge length times turning angle: twice the sagitta 1/8, because both sides leave the curve."""

_ALONG = 0.9
"""Least cosine between the edge and the border at the vertex: a border that only touches the edge stays."""

_MOST_ROUNDS = 6
"""Rounds in which insertions are undone; each undoes all that close nothing."""


@dataclass(frozen=True, eq=False)
class Stitches:
    """Faces with vertices inserted.

    Parameters
    ----------
    faces : (G, 3) int64
    row : (G,) int64
        The face that each comes from.
    where : (k,) int64
        Vertices that were inserted into an edge.
    """

    faces: Ints
    row: Ints
    where: Ints


@dataclass(frozen=True, eq=False)
class _Insertions:
    """Vertices to insert: the halfedge, the place along it from 0 to 1, and the vertex of each, in order."""

    halfedge: Ints
    t: Floats
    vertex: Ints

    def without(self, halfedges: Ints) -> _Insertions:
        keep = ~np.isin(self.halfedge, halfedges)
        return _Insertions(self.halfedge[keep], self.t[keep], self.vertex[keep])


def stitch_borders(vertices: Floats, faces: Ints, weld: Ints, tolerance: float) -> Stitches:
    """Insert vertices of borders into the border edges that they lie on.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    weld : (V,) int64
        The least vertex of the place of each vertex.
    tolerance : float
        How far from an edge a vertex may lie, besides the chord error.

    Returns
    -------
    Stitches
    """
    alone = _alone(faces, weld)
    exact = _stitch(vertices, faces, weld, alone, tolerance, chords=0.0)
    alone = alone if exact.faces is faces else _alone(exact.faces, weld)
    curved = _stitch(vertices, exact.faces, weld, alone, tolerance, chords=_CHORDS)
    return Stitches(curved.faces, exact.row[curved.row], np.union1d(exact.where, curved.where))


def _alone(faces: Ints, weld: Ints) -> Ints:
    """The halfedges of borders."""
    partner, crowded = pair_edges(faces, weld)
    return np.setdiff1d(np.flatnonzero(partner == NO_PARTNER), crowded)


def _stitch(vertices: Floats, faces: Ints, weld: Ints, alone: Ints, tolerance: float, chords: float) -> Stitches:
    found = _find(vertices, faces, weld, alone, tolerance, chords)
    for _ in range(_MOST_ROUNDS):
        if len(found.halfedge) == 0:
            break
        made, row = _insert(faces, found)
        useless = _useless(faces, made, weld, found)
        if len(useless) == 0:
            return Stitches(made, row, np.unique(weld[found.vertex]))
        found = found.without(useless)
    return Stitches(faces, np.arange(len(faces)), np.zeros(0, np.int64))


def _find(vertices: Floats, faces: Ints, weld: Ints, alone: Ints, tolerance: float, chords: float) -> _Insertions:
    """Border vertices that lie on border edges."""
    from scipy.spatial import cKDTree

    nothing = np.zeros(0, np.int64)
    if len(alone) < 2:
        return _Insertions(nothing, np.zeros(0), nothing)
    tail, head = (weld[end[alone]] for end in halfedge_ends(faces))
    along = vertices[head] - vertices[tail]
    length = np.linalg.norm(along, axis=1)
    along = along / np.maximum(length, np.finfo(float).tiny)[:, None]
    chord = chords * length * _turning(tail, head, along, len(vertices))
    border = np.unique(np.concatenate([tail, head]))
    near = cKDTree(vertices[border]).query_ball_point((vertices[tail] + vertices[head]) / 2, length / 2)
    edge = np.repeat(np.arange(len(alone)), [len(one) for one in near])
    vertex = border[np.fromiter(chain.from_iterable(near), np.int64, len(edge))]
    to = vertices[vertex] - vertices[tail[edge]]
    at = np.einsum("ij,ij->i", to, along[edge])
    apart = np.linalg.norm(to - at[:, None] * along[edge], axis=1)
    t = at / length[edge]
    keep = (apart <= tolerance + 4 * t * (1 - t) * chord[edge]) & (at > tolerance) & (at < length[edge] - tolerance)
    keep &= (vertex != tail[edge]) & (vertex != head[edge])
    edge, vertex, at = edge[keep], vertex[keep], at[keep]
    runs = _runs_along(tail, head, along, vertex, edge, len(vertices))
    edge, vertex, at = edge[runs], vertex[runs], at[runs]
    order = np.lexsort([at, edge])
    return _Insertions(alone[edge[order]], at[order] / length[edge[order]], vertex[order])


def _turning(tail: Ints, head: Ints, along: Floats, n: int) -> Floats:
    """The turning angle (B,) of the border at the ends of each edge, the larger one that is not of a corner.

    Where several borders pass a place, the edge that turns least continues it.
    """
    edge = np.arange(len(tail))
    turning = np.zeros(len(tail))
    for place, others in ((head, tail), (tail, head)):
        cosine = np.full(len(tail), -1.0)
        for pair, other in _edges_at(others, place, n):
            cosine[pair] = np.maximum(cosine[pair], np.einsum("ij,ij->i", along[edge[pair]], along[other]))
        angle = np.arccos(np.clip(cosine, -1, 1))
        turning = np.maximum(turning, np.where(angle < _CORNER, angle, 0.0))
    return turning


def _runs_along(tail: Ints, head: Ints, along: Floats, vertex: Ints, edge: Ints, n: int) -> Ints:
    """Positions of pairs (vertex, edge) where a border edge at the vertex runs along the edge."""
    best = np.zeros(len(vertex))
    for end in (tail, head):
        for pair, other in _edges_at(end, vertex, n):
            cosine = np.abs(np.einsum("ij,ij->i", along[other], along[edge[pair]]))
            best[pair] = np.maximum(best[pair], np.where(other == edge[pair], 0.0, cosine))
    return np.flatnonzero(best >= _ALONG)


def _edges_at(end: Ints, place: Ints, n: int) -> Iterator[tuple[Ints, Ints]]:
    """Positions in ``place``, and of each an edge with its ``end`` there; all edges one after the other."""
    order = np.argsort(end, kind="stable")
    count = np.bincount(end, minlength=n)
    first = np.cumsum(count) - count
    for k in range(int(count.max(initial=0))):
        has = np.flatnonzero(count[place] > k)
        yield has, order[first[place[has]] + k]


def _insert(faces: Ints, found: _Insertions) -> tuple[Ints, Ints]:
    """The faces with the vertices inserted, and the row that each comes from."""
    by_face: dict[int, tuple[list[int], list[int], list[int]]] = {}
    for halfedge, vertex in zip(found.halfedge.tolist(), found.vertex.tolist()):
        by_face.setdefault(halfedge // 3, ([], [], []))[halfedge % 3].append(vertex)
    fresh, rows = [], []
    for face, inserted in by_face.items():
        fan = fan_with_inserted(faces[face].tolist(), inserted)
        fresh += fan
        rows += [face] * len(fan)
    kept = np.delete(np.arange(len(faces)), sorted(by_face))
    made = np.concatenate([faces[kept], np.array(fresh, np.int64).reshape(-1, 3)])
    row = np.concatenate([kept, np.array(rows, np.int64)])
    order = np.argsort(row, kind="stable")
    return made[order], row[order]


def _useless(faces: Ints, made: Ints, weld: Ints, found: _Insertions) -> Ints:
    """Halfedges whose insertions close nothing, or make an edge with more than two faces."""
    partner, crowded = pair_edges(made, weld)
    tail, head = (weld[end] for end in halfedge_ends(made))
    n = np.int64(len(weld))
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    is_new = np.r_[True, found.halfedge[1:] != found.halfedge[:-1]]
    which = np.cumsum(is_new) - 1
    first, last = np.flatnonzero(is_new), np.r_[np.flatnonzero(is_new)[1:] - 1, len(which) - 1]
    start, end = (weld[side[found.halfedge[first]]] for side in halfedge_ends(faces))
    inner = weld[found.vertex]
    a = np.concatenate([np.where(is_new, start[which], np.roll(inner, 1)), inner[last]])
    b = np.concatenate([inner, end])
    owner = np.concatenate([which, np.arange(len(first))])
    part = np.minimum(a, b) * n + np.maximum(a, b)
    is_open = np.isin(part, key[partner == NO_PARTNER])
    n_closed = np.bincount(owner, ~is_open, len(first))
    n_crowded = np.bincount(owner, np.isin(part, key[crowded]), len(first))
    bad: Ints = found.halfedge[first][(n_closed == 0) | (n_crowded > 0)]
    return bad
