"""Faces turned so that all of a connected part look to the same side (Yan et al. 2016, §4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import NotOrientable
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import halfedge_ends, next_halfedge


@dataclass(frozen=True, eq=False)
class Turning:
    """Which faces to turn, and why.

    Parameters
    ----------
    odd : (F,) bool
        Faces that look to the other side than most of their part.
    inside_out : (F,) bool
        Faces of closed parts of which most look inwards.
    """

    odd: Bools
    inside_out: Bools

    def apply(self, faces: Ints) -> Ints:
        """The faces (F, 3), the turned ones with their last two corners exchanged."""
        turn = self.odd ^ self.inside_out
        return np.where(turn[:, None], faces[:, [0, 2, 1]], faces)


def unify_orientation(points: Floats, faces: Ints, place: Ints, mates: Ints, ids: Ints) -> Turning:
    """Find the faces to turn: each part keeps the side of most of its faces; closed parts look outwards.

    Where as many faces look to one side as to the other, the first face of the part decides.

    Raises
    ------
    NotOrientable
    """
    h = np.flatnonzero(mates > np.arange(len(mates)))
    f, g = h // 3, mates[h] // 3
    against = same_way(faces, place, h, mates[h])
    part, side = _parts_and_sides(f, g, against, len(faces), ids)
    n_parts = int(part.max(initial=-1)) + 1
    balance = np.bincount(part, 1.0 - 2.0 * side, minlength=n_parts)
    odd = side ^ (balance < 0)[part]
    is_open = np.zeros(n_parts, bool)
    is_open[part[np.flatnonzero(mates == ALONE) // 3]] = True
    volume = np.bincount(part, _volumes(points, faces) * (1.0 - 2.0 * odd), minlength=n_parts)
    return Turning(odd, (~is_open & (volume < 0))[part])


def _parts_and_sides(f: Ints, g: Ints, against: Bools, n_faces: int, ids: Ints) -> tuple[Ints, Bools]:
    """The connected part (F,) of each face and whether it looks to the other side than the part's first.

    Each face stands for two nodes, one a side; faces that look to opposite sides are joined
    crosswise.  A part whose two sides hang together has one side only.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    crossed = np.where(against, n_faces, 0)
    start, end = np.concatenate([f, f + n_faces]), np.concatenate([g + crossed, g + n_faces - crossed])
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(2 * n_faces, 2 * n_faces))
    _, label = connected_components(links, directed=False)
    front, back = label[:n_faces], label[n_faces:]
    if (front == back).any():
        raise _not_orientable(f, g, against, front == back, ids)
    part = np.minimum(front, back).astype(np.int64)
    first = np.full(int(part.max()) + 1, n_faces)
    np.minimum.at(first, part, np.arange(n_faces))
    return part, front != front[np.minimum(first, n_faces - 1)][part]


def _not_orientable(f: Ints, g: Ints, against: Bools, one_sided: Bools, ids: Ints) -> NotOrientable:
    """Name the faces along a line by which the first one-sided part would have to be slit."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order

    n = len(one_sided)
    links = csr_matrix((np.ones(2 * len(f)), (np.concatenate([f, g]), np.concatenate([g, f]))), shape=(n, n))
    order, before = breadth_first_order(links, int(np.argmax(one_sided)))
    odd = dict(zip(zip(f.tolist(), g.tolist()), against.tolist()))
    side = np.zeros(n, bool)
    for face in order[1:].tolist():
        p = int(before[face])
        side[face] = side[p] ^ odd[(p, face) if (p, face) in odd else (face, p)]
    reached = np.zeros(n, bool)
    reached[order] = True
    clash = reached[f] & ((side[f] ^ side[g]) != against)
    return NotOrientable(
        "The faces cannot be turned to look to one side: the surface is twisted like a Moebius strip",
        remedy="Cut it along these faces, or use a surface with two sides.",
        ids=np.unique(ids[np.concatenate([f[clash], g[clash]])]).tolist(),
        kind="face",
    )


def _volumes(points: Floats, faces: Ints) -> Floats:
    """Signed volume (F,) between each face and the middle of the points, six times, in units of their extent."""
    extent = float(np.ptp(points, axis=0).max())
    a, b, c = (((points - points.mean(0)) / extent)[faces[:, k]] for k in range(3))
    volumes: Floats = np.einsum("ij,ij->i", a, np.cross(b, c))
    return volumes


# ----------------------------------------------------------------------
# Which faces lie on both sides of an edge, before they are welded and turned alike.
#
# The *mate* of a halfedge is the other halfedge along the same edge, whichever way it runs.
# Faces that name the same two vertices are mates; of what is then left over, two halfedges
# that lie in the same place are.  So only borders are welded: a vertex where two sheets
# touch, or two bodies that lie against each other, stay as they are.

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
