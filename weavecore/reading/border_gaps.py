"""Borders that run beside each other: a seam that was not welded, as its sides are further apart than the tolerance.

A vertex of a border is *beside* another border where one of that border's vertices is nearer than a part of the median
border edge.  Both are taken for sides of a seam if five vertices of a border are, or half of them.  The two sides of a
narrow strip are not meant: an edge of the mesh joins them.  A k-d tree finds the neighbours: O(n log n) in the border
vertices.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.model import Note, SurfaceMesh
from weavecore.model.notes import at
from weavecore.reading.raw import counted

_CLOSE = 0.05
"""Of the median border edge: vertices of two borders that are nearer are beside each other."""

_MANY, _SHARE = 5, 0.5
"""Vertices of a border, or their part, that are beside another one where the two are sides of a seam."""

_NEIGHBOURS = 6
"""Nearest vertices that are looked at: those of the same border are among them."""


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
    gap = _gaps(surface, vertex, offsets)
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


def _gaps(surface: SurfaceMesh, vertex: Ints, offsets: Ints) -> Floats:
    """(n,) how far a vertex of another border is that is beside each border vertex; infinite where there is none."""
    from scipy.spatial import cKDTree

    points, border = surface.vertices[vertex], rows_of(offsets)
    reach = _CLOSE * float(np.median(np.linalg.norm(points[next_in_loop(offsets)] - points, axis=1)))
    distance, near = cKDTree(points).query(points, k=_NEIGHBOURS, distance_upper_bound=reach)
    found = np.isfinite(distance)
    near = np.where(found, near, 0)
    found &= border[near] != border[:, None]
    row, column = np.nonzero(found)
    joined = _are_joined(surface, vertex[row], vertex[near[row, column]])
    found[row[joined], column[joined]] = False
    gaps: Floats = np.where(found, distance, np.inf).min(axis=1)
    return gaps


def _are_joined(surface: SurfaceMesh, a: Ints, b: Ints) -> Bools:
    """Whether an edge of the mesh joins each pair of vertices (k,)."""
    n = surface.n_vertices
    tail, head = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    if len(a) == 0:
        return np.zeros(0, bool)
    edges = np.minimum(tail, head) * np.int64(n) + np.maximum(tail, head)
    joined: Bools = np.isin(np.minimum(a, b) * np.int64(n) + np.maximum(a, b), edges)
    return joined
