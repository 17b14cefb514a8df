"""Faces turned so that all of a connected part look to the same side (Yan et al. 2016, §4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import NotOrientable
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.reading.mates import ALONE, same_way


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
