"""Which faces lie on both sides of an edge, before they are welded and turned alike.

The *mate* of a halfedge is the other halfedge along the same edge, whichever way it runs.
Faces that name the same two vertices are mates; of what is then left over, two halfedges
that lie in the same place are.  So only borders are welded: a vertex where two sheets
touch, or two bodies that lie against each other, stay as they are.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints
from weavecore.geometry.halfedges import halfedge_ends, next_halfedge

ALONE = -1


def find_mates(faces: Ints, place: Ints) -> tuple[Ints, Ints]:
    """Mates and crowded halfedges.

    Parameters
    ----------
    faces : (F, 3) int64
        No two corners of a face are in one place.
    place : (V,) int64
        The least vertex in the place of each vertex.

    Returns
    -------
    mates : (3F,) int64
        -1 where a halfedge has none.
    crowded : int64
        Halfedges of edges with more than two faces.
    """
    mates, crowded = _pair(faces, np.arange(3 * len(faces)), len(place))
    alone = np.flatnonzero(mates == ALONE)
    alone = np.setdiff1d(alone, crowded, assume_unique=True)
    found, more = _pair(place[faces], alone, len(place))
    both = found != ALONE
    mates[alone[both]] = alone[found[both]]
    return mates, np.concatenate([crowded, alone[more]])


def _pair(faces: Ints, halfedges: Ints, n_vertices: int) -> tuple[Ints, Ints]:
    """Positions in ``halfedges`` that share an edge two by two, and those of edges with more."""
    tail, head = (end[halfedges] for end in halfedge_ends(faces))
    key = np.minimum(tail, head) * np.int64(n_vertices) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    same = np.concatenate([[False], key[order][1:] == key[order][:-1], [False]])
    with_before, with_after = same[:-1], same[1:]
    mates = np.full(len(halfedges), ALONE, np.int64)
    begins = with_after & ~with_before
    first = np.flatnonzero(begins[:-1] & ~with_after[1:])
    mates[order[first]], mates[order[first + 1]] = order[first + 1], order[first]
    in_group = with_before | with_after
    crowded = order[in_group & (mates[order] == ALONE)]
    return mates, np.sort(crowded)


def same_way(faces: Ints, place: Ints, halfedges: Ints, mates: Ints) -> Bools:
    """Whether mates run the same way along their edge: their faces look to opposite sides."""
    tail = place[faces.ravel()]
    alike: Bools = tail[halfedges] == tail[mates]
    return alike


def fans_of_corners(faces: Ints, place: Ints, mates: Ints) -> Ints:
    """Label (3F,) of the fan of faces that each corner belongs to: corners joined across shared edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    h = np.flatnonzero(mates > np.arange(len(mates)))
    g = mates[h]
    alike = same_way(faces, place, h, g)
    start = np.concatenate([h, next_halfedge(h)])
    end = np.concatenate([np.where(alike, g, next_halfedge(g)), np.where(alike, next_halfedge(g), g)])
    n = len(mates)
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
