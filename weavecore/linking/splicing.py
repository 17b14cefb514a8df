"""Putting a filling in the place of the parts of a zip that are no good.

A zip and a filling of the same band both cut it along links.  Along the links that they share the band
falls into *stretches*, each with the same pieces of the two rings on its border in either; so any stretch may
be taken from the one or from the other.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.linking.cells import BandFaces


def faces_with_long_links(faces: BandFaces, places: Floats, ring_edges: Ints, longest: float) -> Bools:
    """(k,) whether a face has a side, other than along its rings, that is longer than ``longest``."""
    tail, head, face = faces.sides()
    is_long = np.linalg.norm(places[head] - places[tail], axis=1) > longest
    is_long &= ~are_among(tail, head, ring_edges)
    flag = np.zeros(len(faces.corners), bool)
    flag[face[is_long]] = True
    return flag


def splice(zipped: BandFaces, bad: Bools, filled: BandFaces, ring_edges: Ints) -> BandFaces:
    """The faces of both, where each stretch is taken from the zip unless a face of it is bad.

    Parameters
    ----------
    zipped : BandFaces
        Of some bands.
    bad : (k,) bool
        Which of its faces are no good.
    filled : BandFaces
        Of bands that are not zipped, and of all those that have a bad face.
    ring_edges : (N, 2) int64
        The edges along the rings, the lesser node first.
    """
    both = BandFaces.of([zipped, filled])
    n_zipped, n = len(zipped.corners), len(both.corners)
    tail, head, face = both.sides()
    from_zip = face < n_zipped
    # Two bands share each ring, so sides are told apart by the band as well.
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    side = np.unique(np.c_[both.band[face], low, high], axis=0, return_inverse=True)[1].ravel()
    is_shared = np.isin(side, np.intersect1d(side[from_zip], side[~from_zip]))
    on_ring = are_among(tail, head, ring_edges)
    # Faces of one kind hang together across sides that only they have; the two kinds hang together along the rings.
    joins = on_ring == is_shared
    group = 3 * side + np.where(on_ring, 2, from_zip)
    stretch = _components(face[joins], group[joins], n)
    is_bad = np.zeros(stretch.max(initial=-1) + 1, bool)
    is_bad[stretch[:n_zipped][bad]] = True
    is_zipped = np.zeros(len(is_bad), bool)
    is_zipped[stretch[:n_zipped]] = True
    in_zip = np.arange(n) < n_zipped
    kept = np.where(in_zip, ~is_bad[stretch], is_bad[stretch] | ~is_zipped[stretch])
    # Around small rings two nodes may be joined on either side; then the two kinds do not go together.
    clashing = np.isin(both.band, _bands_with_double_sides(both.where(kept))) & np.isin(both.band, filled.band)
    return both.where(np.where(clashing, ~in_zip, kept))


def _bands_with_double_sides(faces: BandFaces) -> Ints:
    """Bands of the faces that have a side in common with another one, run the same way."""
    tail, head, face = faces.sides()
    _, side, times = np.unique(np.c_[tail, head], axis=0, return_inverse=True, return_counts=True)
    bands: Ints = np.unique(faces.band[face[times[side.ravel()] > 1]])
    return bands


def are_among(tail: Ints, head: Ints, edges: Ints) -> Bools:
    """Whether each side is one of the edges."""
    n = np.int64(max(tail.max(initial=0), head.max(initial=0), edges.max(initial=0)) + 1)
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    return np.isin(key, edges[:, 0] * n + edges[:, 1])


def _components(face: Ints, group: Ints, n: int) -> Ints:
    """Component (n,) of each face, where faces that have a group in common belong together."""
    names, place = np.unique(group, return_inverse=True)
    size = n + len(names)
    links = coo_matrix((np.ones(len(face), np.int8), (face, n + place)), shape=(size, size))
    return connected_components(links, directed=False)[1][:n].astype(np.int64)
