"""A triangulation of the plane into which single segments are brought by flips (Sloan 1993)."""

from __future__ import annotations

from collections import deque

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

_FLAT = 1e-14
_PATIENCE = 20


class TriangleFan:
    """Triangles as a table from each directed edge to the corner that faces it.

    It serves the few segments that a Delaunay triangulation lacks; walking from
    triangle to triangle has no array form.
    """

    def __init__(self, faces: Ints, points: Floats, segments: Ints) -> None:
        self._xy = points.tolist()
        self._segments = segments.tolist()
        self._of_edge = {(min(a, b), max(a, b)): i for i, (a, b) in enumerate(self._segments)}
        self._facing: dict[tuple[int, int], int] = {}
        self._neighbours: list[set[int]] = [set() for _ in self._xy]
        for a, b, c in faces.tolist():
            self._add(a, b, c)

    def faces(self) -> Ints:
        """The triangles (F, 3), each once, beginning at its least corner."""
        rows = [(a, b, c) for (a, b), c in self._facing.items() if a < b and a < c]
        return np.array(sorted(rows), np.int64).reshape(-1, 3)

    def bring_in(self, index: int) -> list[int]:
        """Make a segment an edge; gives the segments that stand in the way, itself among them, if it cannot be."""
        a, b = self._segments[index]
        if b in self._neighbours[a]:
            return []
        crossed = self._crossed_edges(a, b)
        if crossed is None:
            return [index]
        in_the_way = [self._of_edge[e] for e in crossed if e in self._of_edge and e[1] in self._neighbours[e[0]]]
        if in_the_way:
            return [index, *in_the_way]
        return [] if self._flip_away(a, b, crossed) else [index]

    def _add(self, a: int, b: int, c: int) -> None:
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            self._facing[p, q] = r
            self._neighbours[p].add(q)
            self._neighbours[q].add(p)

    def _side(self, a: int, b: int, p: int) -> float:
        (ax, ay), (bx, by), (px, py) = self._xy[a], self._xy[b], self._xy[p]
        return float((bx - ax) * (py - ay) - (by - ay) * (px - ax))

    def _crossed_edges(self, a: int, b: int) -> list[tuple[int, int]] | None:
        """Edges between a and b, least corner first; None where a corner lies on the segment."""
        start = None
        for right in sorted(self._neighbours[a]):
            left = self._facing.get((a, right))
            if left is None or self._side(a, b, right) > -_FLAT or self._side(a, b, left) < _FLAT:
                continue
            if self._side(right, left, b) < 0:  # b lies beyond the side that faces a
                start = (right, left)
        if start is None:
            return None
        crossed = []
        right, left = start
        while True:
            crossed.append((min(right, left), max(right, left)))
            tip = self._facing.get((left, right))
            if tip is None:
                return None
            if tip == b:
                return crossed
            side = self._side(a, b, tip)
            if abs(side) <= _FLAT or len(crossed) > len(self._xy):
                return None
            if side > 0:
                left = tip
            else:
                right = tip

    def _flip_away(self, a: int, b: int, crossed: list[tuple[int, int]]) -> bool:
        waiting = deque(crossed)
        patience = _PATIENCE * (len(crossed) + 1) ** 2
        while waiting and patience:
            patience -= 1
            p, q = waiting.popleft()
            r, s = self._facing[p, q], self._facing[q, p]
            if self._side(s, q, r) <= _FLAT or self._side(r, p, s) <= _FLAT:
                waiting.append((p, q))
                continue
            self._flip(p, q, r, s)
            apart = {r, s}.isdisjoint((a, b))
            if apart and (self._side(a, b, r) > 0) != (self._side(a, b, s) > 0):
                waiting.append((min(r, s), max(r, s)))
        return not waiting

    def _flip(self, p: int, q: int, r: int, s: int) -> None:
        """Put the edge r–s in the place of p–q."""
        del self._facing[p, q], self._facing[q, p]
        self._neighbours[p].discard(q)
        self._neighbours[q].discard(p)
        self._add(s, q, r)
        self._add(r, p, s)
