"""Faces oriented alike in each connected component (Yan et al. 2016, §4.1), before anything is welded.

*Edge pairing.*  The partner of a halfedge is the other halfedge on the same edge, whichever way it runs.  Faces that
name the same two vertices are paired first; of the halfedges left over, two that lie in the same place are paired.
So only borders are joined: a vertex where two components touch, or two bodies that lie against each other, stay
apart.

*Orientation.*  Two faces on an edge are oriented alike if their halfedges run against each other.  Take two nodes for
each face, one for either side, and join them straight across a pair that is oriented alike and crosswise otherwise::

      front f ──── front g           front f ─╮ ╭─ front g
                                                ╳              a Möbius strip joins the front of a face
      back  f ──── back  g           back  f ─╯ ╰─ back  g     to its own back: it is not orientable

Connected components of this graph are the sides of the components.  Sorting makes it O(n log n) in the faces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import NotOrientable
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import halfedge_ends, next_halfedge

NO_PARTNER = -1
"""Partner of a halfedge on a border."""


@dataclass(frozen=True, eq=False)
class Reversals:
    """Which faces are to be reversed, and why.

    Parameters
    ----------
    minority : (F,) bool
        Faces oriented against most faces of their component.
    inward : (F,) bool
        Faces of closed components of which most faces are oriented inwards.
    """

    minority: Bools
    inward: Bools

    def apply(self, faces: Ints) -> Ints:
        """The faces with the last two corners of the reversed ones exchanged.

        Parameters
        ----------
        faces : (F, 3) int64

        Returns
        -------
        (F, 3) int64
        """
        turn = self.minority ^ self.inward
        return np.where(turn[:, None], faces[:, [0, 2, 1]], faces)


def unify_orientation(vertices: Floats, faces: Ints, weld: Ints, partner: Ints, ids: Ints) -> Reversals:
    """Find the faces to reverse: each component keeps the orientation of most of its faces; closed ones face
    outwards.

    Where as many faces are oriented one way as the other, the first face of the component decides.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    weld : (V,) int64
        The least vertex in the same place as each vertex.
    partner : (3F,) int64
        As `pair_edges` returns it.
    ids : (F,) int64
        How errors number the faces.

    Returns
    -------
    Reversals

    Raises
    ------
    NotOrientable
    """
    h = np.flatnonzero(partner > np.arange(len(partner)))
    f, g = h // 3, partner[h] // 3
    opposed = runs_alike(faces, weld, h, partner[h])
    component, side = _components_and_sides(f, g, opposed, len(faces), ids)
    n_components = int(component.max(initial=-1)) + 1
    balance = np.bincount(component, 1.0 - 2.0 * side, minlength=n_components)
    minority = side ^ (balance < 0)[component]
    is_open = np.zeros(n_components, bool)
    is_open[component[np.flatnonzero(partner == NO_PARTNER) // 3]] = True
    volume = np.bincount(component, _volumes(vertices, faces) * (1.0 - 2.0 * minority), minlength=n_components)
    return Reversals(minority, (~is_open & (volume < 0))[component])


def _components_and_sides(f: Ints, g: Ints, opposed: Bools, n_faces: int, ids: Ints) -> tuple[Ints, Bools]:
    """The connected component (F,) of each face, and whether it is oriented against the component's first face.

    A face whose two nodes are connected is one-sided.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    crossed = np.where(opposed, n_faces, 0)
    start, end = np.concatenate([f, f + n_faces]), np.concatenate([g + crossed, g + n_faces - crossed])
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(2 * n_faces, 2 * n_faces))
    _, label = connected_components(links, directed=False)
    front, back = label[:n_faces], label[n_faces:]
    if (front == back).any():
        raise _not_orientable_error(f, g, opposed, front == back, ids)
    component = np.minimum(front, back).astype(np.int64)
    first = np.full(int(component.max()) + 1, n_faces)
    np.minimum.at(first, component, np.arange(n_faces))
    return component, front != front[np.minimum(first, n_faces - 1)][component]


def _not_orientable_error(f: Ints, g: Ints, opposed: Bools, is_one_sided: Bools, ids: Ints) -> NotOrientable:
    """The error that names the faces along which the first one-sided component would have to be cut."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order

    n = len(is_one_sided)
    links = csr_matrix((np.ones(2 * len(f)), (np.concatenate([f, g]), np.concatenate([g, f]))), shape=(n, n))
    order, before = breadth_first_order(links, int(np.argmax(is_one_sided)))
    is_opposed = dict(zip(zip(f.tolist(), g.tolist()), opposed.tolist()))
    side = np.zeros(n, bool)
    for face in order[1:].tolist():
        p = int(before[face])
        side[face] = side[p] ^ is_opposed[(p, face) if (p, face) in is_opposed else (face, p)]
    reached = np.zeros(n, bool)
    reached[order] = True
    contradicts = reached[f] & ((side[f] ^ side[g]) != opposed)
    return NotOrientable(
        "The faces cannot be oriented alike: the surface is one-sided, like a Moebius strip",
        remedy="Cut it along these faces, or use a two-sided surface.",
        ids=np.unique(ids[np.concatenate([f[contradicts], g[contradicts]])]).tolist(),
        kind="face",
    )


def _volumes(vertices: Floats, faces: Ints) -> Floats:
    """Six times the signed volume (F,) between each face and the vertices' mean, in units of their extent cubed."""
    extent = float(np.ptp(vertices, axis=0).max())
    a, b, c = (((vertices - vertices.mean(0)) / extent)[faces[:, k]] for k in range(3))
    volumes: Floats = np.einsum("ij,ij->i", a, np.cross(b, c))
    return volumes


def pair_edges(faces: Ints, weld: Ints) -> tuple[Ints, Ints]:
    """Pair the halfedges of each edge.

    Parameters
    ----------
    faces : (F, 3) int64
        No two corners of a face are in one place.
    weld : (V,) int64
        The least vertex in the same place as each vertex.

    Returns
    -------
    partner : (3F,) int64
        `NO_PARTNER` where a halfedge has none.
    non_manifold : (K,) int64
        Halfedges of edges with more than two faces.
    """
    tail, head = halfedge_ends(faces)
    partner, non_manifold = _pair(tail, head, len(weld))
    alone = np.flatnonzero(partner == NO_PARTNER)
    alone = np.setdiff1d(alone, non_manifold, assume_unique=True)
    found, more = _pair(weld[tail[alone]], weld[head[alone]], len(weld))
    both = found != NO_PARTNER
    partner[alone[both]] = alone[found[both]]
    return partner, np.concatenate([non_manifold, alone[more]])


def _pair(tail: Ints, head: Ints, n_vertices: int) -> tuple[Ints, Ints]:
    """Positions of the partners of halfedges among them, and the positions on edges with more than two."""
    key = np.minimum(tail, head) * np.int64(n_vertices) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    key = key[order]
    same = np.concatenate([[False], key[1:] == key[:-1], [False]])
    with_before, with_after = same[:-1], same[1:]
    partner = np.full(len(tail), NO_PARTNER, np.int64)
    begins = with_after & ~with_before
    first = np.flatnonzero(begins[:-1] & ~with_after[1:])
    partner[order[first]], partner[order[first + 1]] = order[first + 1], order[first]
    in_group = with_before | with_after
    non_manifold = order[in_group & (partner[order] == NO_PARTNER)]
    return partner, np.sort(non_manifold)


def runs_alike(faces: Ints, weld: Ints, halfedges: Ints, partner: Ints) -> Bools:
    """Whether partners run the same way along their edge, so that their faces are oriented against each other.

    Parameters
    ----------
    faces : (F, 3) int64
    weld : (V,) int64
    halfedges, partner : (K,) int64
        Halfedges and the partner of each.

    Returns
    -------
    (K,) bool
    """
    tail = weld[faces.ravel()]
    alike: Bools = tail[halfedges] == tail[partner]
    return alike


def label_fans(faces: Ints, weld: Ints, partner: Ints) -> Ints:
    """Label the fan of faces around a vertex that each corner belongs to: corners joined across paired edges.

    Parameters
    ----------
    faces : (F, 3) int64
    weld : (V,) int64
    partner : (3F,) int64

    Returns
    -------
    (3F,) int64
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    h = np.flatnonzero(partner > np.arange(len(partner)))
    g = partner[h]
    is_alike = runs_alike(faces, weld, h, g)
    start = np.concatenate([h, next_halfedge(h)])
    end = np.concatenate([np.where(is_alike, g, next_halfedge(g)), np.where(is_alike, next_halfedge(g), g)])
    n = len(partner)
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
