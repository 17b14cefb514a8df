"""A triangle mesh that is split at single points, face by face and edge by edge.

Everything else in this package works on whole arrays; a path that is drawn over a mesh changes a few faces at a
time and must see each change at once.  Arrays grow by doubling, so that a split takes the same time in
a mesh of any size.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN

_SPARE = 64


class GrowingMesh:
    """The mesh while points are put into it; old vertices keep their numbers, new ones come after them.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Manifold and consistently oriented.
    twins : (3F,) int64
    """

    def __init__(self, vertices: Floats, faces: Ints, twins: Ints) -> None:
        self.n_vertices, self.n_faces = len(vertices), len(faces)
        self._points, self._tail, self._twin = (_with_room(a) for a in (vertices, faces.ravel(), twins))
        out = np.zeros(len(vertices), np.int64)
        out[faces.ravel()] = np.arange(3 * len(faces))
        self._out = _with_room(out)
        self._owner = _with_room(np.arange(len(faces)))
        self._pieces: dict[int, list[int]] = {}

    @property
    def vertices(self) -> Floats:
        """All vertices as they are now."""
        return self._points[: self.n_vertices]

    @property
    def faces(self) -> Ints:
        """All faces as they are now."""
        return self._tail[: 3 * self.n_faces].reshape(-1, 3)

    def point(self, vertex: int) -> Floats:
        """Place of a vertex."""
        place: Floats = self._points[vertex]
        return place

    def tail(self, halfedge: int) -> int:
        """Vertex at which a halfedge begins."""
        return int(self._tail[halfedge])

    def twin(self, halfedge: int) -> int:
        """The halfedge on the other side, -1 on the border."""
        return int(self._twin[halfedge])

    def head(self, halfedge: int) -> int:
        """Vertex at which a halfedge ends."""
        return int(self._tail[self.after(halfedge)])

    @staticmethod
    def after(halfedge: int) -> int:
        """The following halfedge of the same face."""
        return halfedge - 2 if halfedge % 3 == 2 else halfedge + 1

    @staticmethod
    def before(halfedge: int) -> int:
        """The preceding halfedge of the same face."""
        return halfedge + 2 if halfedge % 3 == 0 else halfedge - 1

    def border_halfedges(self) -> Ints:
        """The halfedges without a twin."""
        return np.flatnonzero(self._twin[: 3 * self.n_faces] == NO_TWIN)

    def corners(self, face: int) -> tuple[int, int, int]:
        """Vertices of a face."""
        a, b, c = self._tail[3 * face : 3 * face + 3].tolist()
        return a, b, c

    def pieces(self, face: int) -> list[int]:
        """The faces that one of the given faces has become."""
        return self._pieces.get(face, [face])

    def fan(self, vertex: int) -> list[int]:
        """The halfedges that begin at a vertex, one for each of its faces; counter-clockwise, but for a start
        inside an open fan.
        """
        start = at = int(self._out[vertex])
        around = []
        while True:
            around.append(at)
            at = self.twin(self.before(at))
            if at == start:
                return around
            if at == NO_TWIN:
                break
        at = self.twin(start)
        while at != NO_TWIN:
            at = self.after(at)
            around.append(at)
            at = self.twin(at)
        return around

    def split_edge(self, halfedge: int, place: Floats) -> int:
        """Put a vertex on an edge, and split the faces beside it; its number."""
        a, b = self.tail(halfedge), self.tail(self.after(halfedge))
        across = self.twin(halfedge)
        middle = self._add_vertex(place)
        second = self._halve(halfedge, middle)
        if across == NO_TWIN:
            self._twin[second] = NO_TWIN
        else:
            fourth = self._halve(across, middle)
            self._join(halfedge, fourth)
            self._join(second, across)
            self._out[b] = across
        self._out[a], self._out[middle] = halfedge, second
        self._out[b] = self.after(second)
        return middle

    def split_face(self, face: int, place: Floats) -> int:
        """Put a vertex inside a face, and split it in three; its number."""
        first = 3 * face
        _, b, c = self.corners(face)
        a = self.tail(first)
        middle = self._add_vertex(place)
        outer = [self.twin(first + 1), self.twin(first + 2)]
        self._tail[first + 2] = middle
        two, three = self._add_face(face, (b, c, middle)), self._add_face(face, (c, a, middle))
        for inner, beyond in zip((two, three), outer):
            self._twin[inner] = beyond
            if beyond != NO_TWIN:
                self._twin[beyond] = inner
        self._join(first + 1, two + 2)
        self._join(two + 1, three + 2)
        self._join(three + 1, first + 2)
        for vertex, halfedge in ((a, first), (b, two), (c, three), (middle, first + 2)):
            self._out[vertex] = halfedge
        return middle

    def _halve(self, halfedge: int, middle: int) -> int:
        """Split the face (a, b, c) of a halfedge a-b into (a, m, c) and a new (m, b, c); the new halfedge m-b."""
        after, before = self.after(halfedge), self.before(halfedge)
        b, c, beyond = self.tail(after), self.tail(before), self.twin(after)
        self._tail[after] = middle
        new = self._add_face(halfedge // 3, (middle, b, c))
        self._twin[new + 1] = beyond
        if beyond != NO_TWIN:
            self._twin[beyond] = new + 1
        self._join(after, new + 2)
        self._out[c] = before
        return new

    def _join(self, one: int, other: int) -> None:
        self._twin[one], self._twin[other] = other, one

    def _add_vertex(self, place: Floats) -> int:
        self._points = _with_room(self._points, self.n_vertices)
        self._out = _with_room(self._out, self.n_vertices)
        self._points[self.n_vertices] = place
        self.n_vertices += 1
        return self.n_vertices - 1

    def _add_face(self, beside: int, corners: tuple[int, int, int]) -> int:
        """Add a piece of the same given face as ``beside``; its first halfedge."""
        first = 3 * self.n_faces
        self._tail, self._twin = _with_room(self._tail, first), _with_room(self._twin, first)
        self._owner = _with_room(self._owner, self.n_faces)
        self._tail[first : first + 3] = corners
        owner = int(self._owner[beside])
        self._owner[self.n_faces] = owner
        self._pieces.setdefault(owner, [owner]).append(self.n_faces)
        self.n_faces += 1
        return first


def _with_room(array: NDArray[Any], filled: int | None = None) -> NDArray[Any]:
    """The array with rows to spare, as it is where it has some."""
    if filled is not None and filled + 3 <= len(array):
        return array
    larger = np.empty((2 * len(array) + _SPARE, *array.shape[1:]), array.dtype)
    larger[: len(array)] = array
    return larger
