"""Laying the children on the mesh: closed curves of chords between the ends of the steps (Yan et al. 2016, §4.2)."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.walking import place_along
from weavecore.offsetting.fronts.chords import lay_chords
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.meeting import curves_meet
from weavecore.offsetting.fronts.rays import Ends, Rays

_BACK = (0.8, 0.6, 0.4, 0.22, 0.06)
_FORTH = (0.05, 0.2, 0.41, 0.61, 0.81)
"""Parts of two neighbouring steps by which a child goes back along the one and forth along the other."""


def lay_children(ground: Ground, rays: Rays, ends: Ends, parents: Curves | None = None) -> Curves:
    """The closed curves through the ends of the rays of each front, before anything is taken out.

    Where two neighbours part at a sharp feature of the surface, the chord between their ends may lead behind
    the feature and across the parent.  There the child goes back along one ray and forth along the other,
    inside what the step has covered: what is too much is taken out with all else that lies there.
    """
    children = _through(ground, rays, ends, np.zeros(len(rays), bool))
    if parents is None:
        return children
    crossing = curves_meet(ground, children, parents).first
    if len(crossing) == 0:
        return children
    lost = np.zeros(len(rays), bool)
    lost[np.cumsum(children.is_vertex)[crossing] - 1] = True
    return _through(ground, rays, ends, lost)


def _through(ground: Ground, rays: Rays, ends: Ends, lost: Bools) -> Curves:
    """The curves through the ends, by way of the places along the rays where a chord is lost."""
    faces, weights = [ends.face], [ends.weights]
    if lost.any():
        after = rays.after
        for parts, ray in ((_BACK, np.arange(len(rays))), (_FORTH, after)):
            for part in parts:
                face, weight = place_along(rays.walks, part * ends.far)
                faces.append(face[ray])
                weights.append(weight[ray])
    counts = np.where(lost, len(faces), 1)
    offsets = offsets_of(counts)
    row = rows_of(offsets)
    rank = np.arange(len(row)) - offsets[row]
    face, weight = np.stack(faces, axis=1)[row, rank], np.stack(weights, axis=1)[row, rank]
    per_front = _per_front(rays.owner[row], len(rays.offsets) - 1)
    onward = next_in_loop(offsets_of(per_front))
    chord, at, start, end = lay_chords(ground, face, weight, face[onward], weight[onward])
    is_vertex = np.ones(len(chord), bool)
    is_vertex[1:] = chord[1:] != chord[:-1]
    counts = _per_front(rays.owner[row[chord]], len(rays.offsets) - 1)
    is_corner = np.zeros(len(chord), bool)
    return Curves(offsets_of(counts), at, start, end, is_vertex, is_corner, ground.points(at, start))


def _per_front(owner: Ints, n_fronts: int) -> Ints:
    return np.bincount(owner, minlength=n_fronts)
