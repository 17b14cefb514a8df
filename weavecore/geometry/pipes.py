"""Pipes: watertight meshes of round rods about curves.

A ring of points is placed about each sample of the curve, in the plane across its tangent, and turned by a given
direction that changes smoothly; neighbouring rings are joined by quads.  Work: linear in the samples and sides.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.splines import CurveSamples

_AXES = np.eye(3)  # one of them lies across any direction
_MIN_SINE = 1e-6  # of the direction to the rod: less gives no plane


def pipe_mesh(
    samples: CurveSamples, closed: Bools, normals: Floats, radius: Floats, *, sides: int = 12
) -> tuple[Floats, Ints, Ints]:
    """Mesh round rods, one for each curve, facing outwards.

    Parameters
    ----------
    samples : CurveSamples
    closed : (R,) bool
        Closed curves become rings; the others get flat ends.
    normals : (N, 3) float64
        A direction across the curve at each sample that changes smoothly; it keeps the pipe from twisting.
    radius : (R,) float64
        Of each rod.
    sides : int
        Of the cross-section.

    Returns
    -------
    points : (P, 3) float64
    offsets, corners : ragged int64
        Quads, and a polygon at each end of an open curve.
    """
    row = rows_of(samples.offsets)
    is_repeated = np.zeros(len(row), bool)
    is_repeated[samples.offsets[1:] - 1] = closed
    kept = np.flatnonzero(~is_repeated)
    tangent = samples.tangents[kept]
    along = (normals[kept] * tangent).sum(1, keepdims=True)
    across = normals[kept] - along * tangent
    # Where the direction runs along the rod, any other will do.
    weak = np.linalg.norm(across, axis=1) < _MIN_SINE
    spare = _AXES[np.abs(tangent[weak]).argmin(1)]
    across[weak] = spare - (spare * tangent[weak]).sum(1, keepdims=True) * tangent[weak]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    beside = np.cross(tangent, across)
    turn = 2.0 * np.pi * np.arange(sides) / sides
    circle = np.cos(turn)[:, None] * across[:, None] + np.sin(turn)[:, None] * beside[:, None]
    points = (samples.points[kept][:, None] + radius[row[kept], None, None] * circle).reshape(-1, 3)
    offsets, corners = _faces(offsets_of(np.bincount(row[kept], minlength=len(closed))), closed, sides)
    return points, offsets, corners


def _faces(rings: Ints, closed: Bools, sides: int) -> tuple[Ints, Ints]:
    """Quads between the rings of points of each pipe, then the ends of the open ones."""
    n = rings[-1]
    after = np.arange(1, n + 1)
    last = rings[1:] - 1
    after[last] = np.where(closed, rings[:-1], -1)
    ring = np.flatnonzero(after >= 0)
    k = np.arange(sides)
    next_k = (k + 1) % sides
    low, high = sides * ring[:, None], sides * after[ring][:, None]
    quads = np.stack([low + k, low + next_k, high + next_k, high + k], axis=2).reshape(-1)
    starts, ends = rings[:-1][~closed], last[~closed]
    caps = np.concatenate([sides * starts[:, None] + k[::-1], sides * ends[:, None] + k]).reshape(-1)
    counts = np.concatenate([np.full(len(quads) // 4, 4), np.full(len(caps) // sides, sides)])
    return offsets_of(counts), np.concatenate([quads, caps])
