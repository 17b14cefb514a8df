"""Laying the children on the mesh: closed curves of chords between the ends of the steps (Yan et al. 2016, §4.2)."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import offsets_of
from weavecore.offsetting.fronts.chords import lay_chords
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.rays import Ends, Rays


def lay_children(ground: Ground, rays: Rays, ends: Ends) -> Curves:
    """The closed curves through the ends of the rays of each front, before anything is taken out."""
    n, after = len(rays), rays.after
    chord, face, start, end = lay_chords(ground, ends.face, ends.weights, ends.face[after], ends.weights[after])
    counts = np.bincount(chord, minlength=n)
    is_vertex = np.ones(len(chord), bool)
    is_vertex[1:] = chord[1:] != chord[:-1]
    per_front = np.bincount(rays.owner, counts, minlength=len(rays.offsets) - 1).astype(np.int64)
    is_corner = np.zeros(len(chord), bool)
    return Curves(offsets_of(per_front), face, start, end, is_vertex, is_corner, ground.points(face, start))
