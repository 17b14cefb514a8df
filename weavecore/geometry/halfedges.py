r"""Halfedges of a triangle mesh, and what follows from them: borders, components, manifoldness.

Halfedge ``h = 3 * face + k`` runs from corner ``k`` of its face to corner ``k + 1``.  Its *twin* runs the other way
in the neighbouring face, or is -1 on the border.  A *border loop* runs with the surface on its left::

             c                   face f = (a, b, c), counter-clockwise seen from outside
      3f+2  / \  3f+1           3f: a -> b, 3f + 1: b -> c, 3f + 2: c -> a
           a---b                 next_halfedge(3f) = 3f + 1, previous_halfedge(3f) = 3f + 2
            3f

Work: linear in the faces, and one sort for the twins.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from weavecore.errors import NonManifold
from weavecore.geometry.arrays import Bools, Ints, connected
from weavecore.polling import poll

NO_TWIN = -1


def halfedge_ends(faces: Ints) -> tuple[Ints, Ints]:
    """Ends of all halfedges.

    Parameters
    ----------
    faces : (F, 3) int64

    Returns
    -------
    tail, head : (3F,) int64
    """
    poll()
    return faces.ravel(), faces[:, [1, 2, 0]].ravel()


def next_halfedge(h: Ints) -> Ints:
    """Following halfedge in the same face.

    Parameters
    ----------
    h : int64, any shape

    Returns
    -------
    int64, same shape
    """
    following: Ints = h + 1 - 3 * (h % 3 == 2)
    return following


def previous_halfedge(h: Ints) -> Ints:
    """Preceding halfedge in the same face.

    Parameters
    ----------
    h : int64, any shape

    Returns
    -------
    int64, same shape
    """
    preceding: Ints = h - 1 + 3 * (h % 3 == 0)
    return preceding


def find_twins(faces: Ints, n_vertices: int, *, known: Optional[Ints] = None) -> Ints:
    """Find the twin of every halfedge.

    Parameters
    ----------
    faces : (F, 3) int64
        Consistently oriented and manifold.
    n_vertices : int
    known : (3F,) int64, optional
        Twins that are known, -1 where none is: only among those halfedges others are looked for.

    Returns
    -------
    (3F,) int64
        -1 on the border.

    Raises
    ------
    NonManifold
        If an edge has three faces, or two that run the same way along it.
    """
    tail, head = halfedge_ends(faces)
    twins = np.full(len(tail), NO_TWIN, np.int64) if known is None else known.copy()
    alone = np.flatnonzero(twins == NO_TWIN)
    key = np.minimum(tail[alone], head[alone]) * np.int64(n_vertices) + np.maximum(tail[alone], head[alone])
    order = np.argsort(key)  # which of two equal keys comes first does not matter
    key = key[order]
    order = alone[order]
    same = key[1:] == key[:-1]
    triple = same[1:] & same[:-1]
    first, second = order[:-1][same], order[1:][same]
    clash = tail[first] == tail[second]
    if triple.any() or clash.any():
        bad = np.concatenate([order[1:-1][triple], first[clash]])
        raise NonManifold(
            "Edges with more than two faces, or with two that run the same way",
            remedy="Remove the extra faces, or unify the orientation of the mesh.",
            ids=np.unique(bad // 3).tolist(),
            kind="face",
        )
    twins[first], twins[second] = second, first
    return twins


def border_loops(faces: Ints, twins: Ints) -> list[Ints]:
    """Find the border loops.

    Parameters
    ----------
    faces : (F, 3) int64
    twins : (3F,) int64

    Returns
    -------
    list of (n,) int64
        Vertices with the surface on the left.  Each loop begins at its least vertex; loops are ordered by that vertex.

    Raises
    ------
    NonManifold
        If a vertex lies on the border twice.
    """
    border = np.flatnonzero(twins == NO_TWIN)
    tail, head = halfedge_ends(faces)
    tails, heads = tail[border], head[border]
    unique, count = np.unique(tails, return_counts=True)
    if (count > 1).any():
        raise _pinched(unique[count > 1])
    follower = dict(zip(tails.tolist(), heads.tolist()))
    loops = []
    for start in unique.tolist():
        if start not in follower:
            continue
        loop, v = [], start
        while v in follower:
            loop.append(v)
            v = follower.pop(v)
        loops.append(np.array(loop, np.int64))
    return loops


def _pinched_vertices(faces: Ints, twins: Ints, n_vertices: int) -> Ints:
    """Find vertices at which two or more fans of faces touch.

    Turning about a vertex from one of its corners, the first of its fan where that is open, meets all corners of that
    fan; if the vertex has more, they belong to another one.

    Parameters
    ----------
    faces : (F, 3) int64
    twins : (3F,) int64
    n_vertices : int

    Returns
    -------
    (k,) int64
    """
    corners = faces.ravel()
    first = np.full(n_vertices, NO_TWIN)
    first[corners] = np.arange(len(corners))
    border = np.flatnonzero(twins == NO_TWIN)
    first[corners[border]] = border
    start = first[first != NO_TWIN]
    at, met = start, np.zeros(n_vertices, np.int64)
    while len(at):
        met[corners[at]] += 1
        at = twins[previous_halfedge(at)]
        going = (at != NO_TWIN) & (at != start)
        at, start = at[going], start[going]
    return np.flatnonzero(met != np.bincount(corners, minlength=n_vertices))


def components(twins: Ints, barrier: Bools | None = None) -> tuple[int, Ints]:
    """Connected components of the faces.

    Parameters
    ----------
    twins : (3F,) int64
    barrier : (3F,) bool, optional
        Halfedges that do not connect.

    Returns
    -------
    count : int
    label : (F,) int64
    """
    open_ = twins != NO_TWIN
    if barrier is not None:
        open_ &= ~barrier
    h = np.flatnonzero(open_)
    return connected(h // 3, twins[h] // 3, len(twins) // 3)


def _pinched(vertices: Ints) -> NonManifold:
    return NonManifold(
        "Fans of faces that touch in a single vertex",
        remedy="Pull the touching parts apart, or join them along an edge.",
        ids=vertices.tolist(),
        kind="vertex",
    )


def check_manifold_vertices(faces: Ints, twins: Ints, n_vertices: int) -> None:
    """Refuse a mesh in which two fans of faces touch in one vertex.

    Parameters
    ----------
    faces : (F, 3) int64
    twins : (3F,) int64
    n_vertices : int

    Raises
    ------
    NonManifold
    """
    bad = _pinched_vertices(faces, twins, n_vertices)
    if len(bad):
        raise _pinched(bad)
