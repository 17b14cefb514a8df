"""Joining triangles in pairs to quads, where the pattern wants quads and a band had to be filled with triangles."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.matching import ALONE, match_best
from weavecore.linking.cells import NO_CORNER, BandFaces
from weavecore.linking.splicing import are_among

WORST_CORNER = np.radians(50.0)
"""The corners of a quad differ from a right angle by no more than this."""
_NOT_REENTRANT = np.radians(85.0)
"""The same of a cell that is a quad for the sake of an even number of sides."""


def pair_triangles(faces: BandFaces, nodes: Floats, ring_edges: Ints, *, leave_few: bool) -> BandFaces:
    """The same faces with pairs of triangles joined where that makes a good quad.

    Parameters
    ----------
    faces : BandFaces
    nodes : (N, 3) float64
    ring_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    leave_few : bool
        Whether triangles that are left are joined even where the quad is not a good one.
    """
    faces = _paired(faces, nodes, ring_edges, WORST_CORNER)
    return _paired(faces, nodes, ring_edges, _NOT_REENTRANT) if leave_few else faces


def _paired(faces: BandFaces, nodes: Floats, ring_edges: Ints, worst: float) -> BandFaces:
    tail, head, face = faces.sides()
    is_open = (faces.corners[face, 3] == NO_CORNER) & ~are_among(tail, head, ring_edges)
    tail, head, face = tail[is_open], head[is_open], face[is_open]
    n = np.int64(len(nodes))
    order = np.argsort(tail * n + head)
    key = (tail * n + head)[order]
    at = np.minimum(np.searchsorted(key, head * n + tail), len(key) - 1) if len(key) else np.zeros(0, np.int64)
    h = np.flatnonzero((key[at] == head * n + tail) & (tail < head))
    t = order[at[h]]
    one, other = face[h], face[t]
    tips = faces.corners[:, :3].sum(1)
    quads = np.c_[tail[h], tips[other] - tail[h] - head[h], head[h], tips[one] - tail[h] - head[h]]
    cost = _worst_corner(nodes, quads)
    good = cost <= worst
    partner = match_best(one[good], other[good], cost[good], len(faces.corners))
    joined = good & (partner[one] == other)
    kept = partner == ALONE
    corners = np.concatenate([faces.corners[kept], quads[joined]])
    return BandFaces(corners, np.concatenate([faces.band[kept], faces.band[one[joined]]]))


def _worst_corner(nodes: Floats, quads: Ints) -> Floats:
    """How far (k,) the worst corner of each quad is from a right angle."""
    worst = np.zeros(len(quads))
    for k in range(4):
        corner = nodes[quads[:, k]]
        u, v = nodes[quads[:, (k + 1) % 4]] - corner, nodes[quads[:, (k + 3) % 4]] - corner
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1))
        worst = np.maximum(worst, np.abs(angle - np.pi / 2))
    return worst
