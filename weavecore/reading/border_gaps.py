"""Borders that run beside each other: a seam that was not welded, as its sides are further apart than the tolerance.

A vertex of a border is *beside* another border where an edge of that is nearer than a part of the median border edge.
Both are taken for sides of a seam if five vertices of a border are, or half of them.  The two sides of a narrow strip
are not meant: an edge of the mesh joins the vertex with an end of that edge.  Where a seam of sides that were divided
differently closed in part, what stays open are narrow borders: their vertices are beside their own edges.  A k-d tree
finds the edges: O(n log n) in the border vertices.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.model import Note, SurfaceMesh
from weavecore.model.notes import at
from weavecore.reading.pieces import border_lengths, spanned_area
from weavecore.reading.raw import counted

_CLOSE = 0.05
"""Of the median border edge: a vertex that is nearer to an edge of another border is beside that border."""

_ROUNDING = 1e-9
"""Of the reach: what is nearer is in the same place."""

_MANY, _SHARE = 5, 0.5
"""Vertices of a border, or their part, that are beside another one where the two are sides of a seam."""


def note_gaps(surface: SurfaceMesh) -> SurfaceMesh:
    """Note borders that run beside each other.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    SurfaceMesh
        With a note GAP where there are such borders and none is noted yet.
    """
    if len(surface.borders) < 2 or any(note.code == "GAP" for note in surface.notes):
        return surface
    offsets = offsets_of([len(border) for border in surface.borders])
    vertex, border = np.concatenate(surface.borders), rows_of(offsets)
    gap = _gaps(surface, vertex, offsets, _are_narrow(surface))
    count = np.bincount(border, np.isfinite(gap))
    is_seam = count >= np.minimum(_MANY, _SHARE * np.diff(offsets))
    beside = np.flatnonzero(np.isfinite(gap) & is_seam[border])
    if len(beside) == 0:
        return surface
    n, furthest, where = len(np.unique(border[beside])), float(gap[beside].max()), surface.vertices[vertex[beside]]
    text = f"{counted(n, 'border')} up to {furthest:.3g} beside others, first at {at(where[0])}: if they are sides of "
    text += f"one seam, --weld {1.01 * furthest:.3g} closes it."
    note = Note("GAP", text, {"count": n, "vertices": len(beside), "gap": furthest}, where)
    return surface.with_notes((*surface.notes, note))


def _are_narrow(surface: SurfaceMesh) -> Bools:
    """Whether each border (B,) is what a seam that was stitched in part left open."""
    if not any(note.code == "STITCHED" for note in surface.notes):
        return np.zeros(len(surface.borders), bool)
    loops = [surface.vertices[border] for border in surface.borders]
    median = np.array([np.median(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)) for loop in loops])
    narrow: Bools = 2 * np.array([spanned_area(loop) for loop in loops]) < _CLOSE * median * border_lengths(surface)
    return narrow


def _gaps(surface: SurfaceMesh, vertex: Ints, offsets: Ints, is_narrow: Bools) -> Floats:
    """(n,) how far the border is that each border vertex is beside; infinite where it is beside none."""
    from scipy.spatial import cKDTree

    border, head = rows_of(offsets), next_in_loop(offsets)
    points = surface.vertices[vertex]
    along = points[head] - points
    length = np.linalg.norm(along, axis=1)
    reach = _CLOSE * float(np.median(length))
    near = cKDTree(points).query_ball_point(points + along / 2, length / 2 + reach)
    edge = np.repeat(np.arange(len(near)), [len(one) for one in near])
    place = np.fromiter(chain.from_iterable(near), np.int64, len(edge))
    is_other = border[place] != border[edge]
    is_own = ~is_other & is_narrow[border[place]] & (place != edge) & (place != head[edge])
    a = vertex[place]
    is_joined = _are_joined(surface, a, vertex[edge]) | _are_joined(surface, a, vertex[head[edge]])
    to = points[place] - points[edge]
    t = (to * along[edge]).sum(axis=1) / np.maximum(length[edge] ** 2, np.finfo(float).tiny)
    apart = np.linalg.norm(to - np.clip(t, 0, 1)[:, None] * along[edge], axis=1)
    # Vertices in the same place were split apart, as parts of the surface touch there: no weld joins them.
    is_beside = (apart > _ROUNDING * reach) & (apart <= reach) & (is_own | (is_other & ~is_joined))
    gaps: Floats = np.full(len(vertex), np.inf)
    np.minimum.at(gaps, place[is_beside], apart[is_beside])
    return gaps


def _are_joined(surface: SurfaceMesh, a: Ints, b: Ints) -> Bools:
    """Whether an edge of the mesh joins each pair of vertices (k,)."""
    if len(a) == 0:
        return np.zeros(0, bool)
    n, is_end = surface.n_vertices, np.zeros(surface.n_vertices, bool)
    is_end[a] = is_end[b] = True
    tail, head = halfedge_ends(surface.faces[is_end[surface.faces].sum(1) > 1])
    edges = np.minimum(tail, head) * np.int64(n) + np.maximum(tail, head)
    joined: Bools = np.isin(np.minimum(a, b) * np.int64(n) + np.maximum(a, b), edges)
    return joined
