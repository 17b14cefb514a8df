r"""A triangle mesh that grows by single splits, of edges and of faces, and that can take them back.

The rest of this package works on whole arrays; a path that is drawn over a mesh changes a few faces at a time and must
see each change at once.  Splits, with the new vertex m::

            c                  c                      c                       c
           / \                /|\                    / \                     /|\
          /   \     ->       / | \                  /   \        ->         / m \
         a-----b            a--m--b                a-----b                 a-----b
          split_edge(a -> b), both faces             split_face: m joined to a, b and c

Arrays grow by doubling, so that a split takes constant time in a mesh of any size.  Each array logs the values that are
overwritten; `mark` and `undo` use the logs to restore an earlier state in time linear in what has changed since.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN

_SPARE_ROWS = 64  # of an array at first, so that a small mesh need not double for its first splits

Mark = tuple[tuple[int, int], ...]
"""Length and number of logged values of each array of a mesh."""


class _GrowingArray:
    """An array to whose end rows are added, and that can return to an earlier state."""

    def __init__(self, values: NDArray[Any]) -> None:
        self._rows = np.empty((2 * len(values) + _SPARE_ROWS, *values.shape[1:]), values.dtype)
        self._rows[: len(values)] = values
        self._length = len(values)
        self._log: list[tuple[int, Any]] = []

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: int) -> Any:
        return self._rows[index]

    def __setitem__(self, index: int, value: Any) -> None:
        self._log.append((index, self._rows[index]))
        self._rows[index] = value

    def filled(self) -> NDArray[Any]:
        """All rows, as a view."""
        return self._rows[: self._length]

    def add(self, *rows: Any) -> None:
        if self._length + len(rows) > len(self._rows):
            larger = np.empty((2 * len(self._rows), *self._rows.shape[1:]), self._rows.dtype)
            larger[: self._length] = self.filled()
            self._rows = larger
        self._rows[self._length : self._length + len(rows)] = rows
        self._length += len(rows)

    def mark(self) -> tuple[int, int]:
        return self._length, len(self._log)

    def undo(self, mark: tuple[int, int]) -> None:
        self._length, n_logged = mark
        while len(self._log) > n_logged:
            index, value = self._log.pop()
            self._rows[index] = value


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
        outgoing = np.zeros(len(vertices), np.int64)
        outgoing[faces.ravel()] = np.arange(3 * len(faces))
        self._points, self._tail, self._twin = (_GrowingArray(a) for a in (vertices, faces.ravel(), twins))
        self._outgoing = _GrowingArray(outgoing)
        self._owner = _GrowingArray(np.arange(len(faces)))
        self._arrays = (self._points, self._tail, self._twin, self._outgoing, self._owner)
        self._pieces: dict[int, list[int]] = {}

    @property
    def n_vertices(self) -> int:
        """How many vertices there are now."""
        return len(self._points)

    @property
    def n_faces(self) -> int:
        """How many faces there are now."""
        return len(self._owner)

    @property
    def vertices(self) -> Floats:
        """(V', 3) all vertices as they are now."""
        return self._points.filled()

    @property
    def faces(self) -> Ints:
        """(F', 3) all faces as they are now."""
        return self._tail.filled().reshape(-1, 3)

    def point(self, vertex: int) -> Floats:
        """(3,) place of a vertex."""
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
        """(b,) the halfedges without a twin."""
        return np.flatnonzero(self._twin.filled() == NO_TWIN)

    def corners(self, face: int) -> tuple[int, int, int]:
        """Vertices of a face."""
        return self.tail(3 * face), self.tail(3 * face + 1), self.tail(3 * face + 2)

    def pieces(self, face: int) -> list[int]:
        """The faces into which one of the original faces has been split."""
        return self._pieces.get(face, [face])

    def fan(self, vertex: int) -> list[int]:
        """The halfedges that begin at a vertex, one for each of its faces.

        Counter-clockwise; where the fan is open and the walk starts inside it, the rest follows clockwise.
        """
        start = at = int(self._outgoing[vertex])
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

    def mark(self) -> Mark:
        """The present state, for `undo`."""
        return tuple(array.mark() for array in self._arrays)

    def undo(self, mark: Mark) -> None:
        """Take back all splits since a mark, which must not itself have been taken back.

        Parameters
        ----------
        mark : Mark
            Of this mesh.
        """
        n_faces = mark[-1][0]
        for owner in self._owner.filled()[n_faces:][::-1].tolist():
            self._pieces[owner].pop()
            if len(self._pieces[owner]) == 1:
                del self._pieces[owner]
        for array, at in zip(self._arrays, mark):
            array.undo(at)

    def split_edge(self, halfedge: int, place: Floats) -> int:
        """Put a vertex on an edge, and split the faces beside it.

        Parameters
        ----------
        halfedge : int
        place : (3,) float64

        Returns
        -------
        int
            The new vertex.
        """
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
            self._outgoing[b] = across
        self._outgoing[a], self._outgoing[middle] = halfedge, second
        self._outgoing[b] = self.after(second)
        return middle

    def split_face(self, face: int, place: Floats) -> int:
        """Put a vertex inside a face, and split it in three.

        Parameters
        ----------
        face : int
        place : (3,) float64

        Returns
        -------
        int
            The new vertex.
        """
        first = 3 * face
        a, b, c = self.corners(face)
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
            self._outgoing[vertex] = halfedge
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
        self._outgoing[c] = before
        return new

    def _join(self, one: int, other: int) -> None:
        self._twin[one], self._twin[other] = other, one

    def _add_vertex(self, place: Floats) -> int:
        self._points.add(place)
        self._outgoing.add(NO_TWIN)
        return self.n_vertices - 1

    def _add_face(self, beside: int, corners: tuple[int, int, int]) -> int:
        """Add a piece of the same original face as ``beside``; its first halfedge."""
        owner = int(self._owner[beside])
        self._tail.add(*corners)
        self._twin.add(NO_TWIN, NO_TWIN, NO_TWIN)
        self._pieces.setdefault(owner, [owner]).append(self.n_faces)
        self._owner.add(owner)
        return 3 * (self.n_faces - 1)
