"""`Records`: for every vertex the best path found so far.

A *candidate* is a distance that a ray offers to a vertex beside its way.  Rays that pass
nearer know better, so candidates are compared by a *score*: the distance plus a penalty that
grows with the square of the lateral offset.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, sorted_unique
from weavecore.geometry.unfolding import Unfolding

LATERAL_PENALTY = 0.4  # per mean edge length, of the squared lateral offset

NO_HALFEDGE = -1


class Records:
    """Best candidate of each vertex: its distance, and the direction of the path's arrival.

    The direction is kept in the frame of the halfedge by which the ray came in.
    """

    def __init__(self, frames: Unfolding, sources: Ints) -> None:
        n = len(frames.vertices)
        self.frames = frames
        self.score = np.full(n, np.inf)
        self.distance = np.full(n, np.inf)
        self.halfedge = np.full(n, NO_HALFEDGE, np.int64)
        self.ux, self.uy = np.zeros(n), np.zeros(n)
        self.score[sources] = -np.inf
        self.distance[sources] = 0.0
        self._penalty = LATERAL_PENALTY / frames.mean_length
        self._reached: list[Ints] = [sources]

    def offer(self, vertex: Ints, distance: Floats, lateral: Floats, halfedge: Ints, ux: Floats, uy: Floats) -> None:
        """Keep the candidates (n,) that beat what their vertices have."""
        score = distance + self._penalty[vertex] * lateral * lateral
        better = np.flatnonzero(score < self.score[vertex])
        if len(better) == 0:
            return
        first = better[np.isinf(self.score[vertex[better]])]
        if len(first):
            self._reached.append(vertex[first])
        while len(better):  # where one vertex got several, the last one written need not be the best
            v = vertex[better]
            self.score[v] = score[better]
            self.distance[v] = distance[better]
            self.halfedge[v] = halfedge[better]
            self.ux[v], self.uy[v] = ux[better], uy[better]
            better = better[score[better] < self.score[v]]

    def newly_reached(self) -> Ints:
        """Vertices that got their first candidate since the last call."""
        reached = sorted_unique(np.concatenate(self._reached)) if self._reached else np.zeros(0, np.int64)
        self._reached = []
        return reached

    def along(self, halfedge: Ints, weights: Floats) -> Floats:
        """Distance interpolated linearly in faces; weights (n, 3) of tail, head and apex."""
        f = self.frames
        corners = np.stack([f.tail[halfedge], f.head[halfedge], f.apex[halfedge]], axis=1)
        distance: Floats = (self.distance[corners] * weights).sum(1)
        return distance
