r"""Refinement of a triangle mesh without a change of its surface or its borders.

Edges that are too long are bisected, the longest of a face first (Rivara 1984), so that no angle becomes much smaller
than half of what it was.  An edge of the border may not be bisected.  Its midpoint is replaced by a point a little
inside, on a flat *arch* over the edge; the triangle between the edge and that point is *sealed*, and the rest is
refined with the two sides of the arch as its border.  So a long border edge ends as a thin fan of sealed triangles,
with well-sized triangles behind it::

        \   |   /  |  \   |  /
         *--*--*---*---*--*         the arch after two rounds
       / __---- /     \ ----__ \    sealed triangles
      a -------------------------- b    border edge, as it was

Work: linear in the resulting faces; each round bisects an independent set of edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from weavecore.errors import TooFarFromOrigin, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, blocks
from weavecore.geometry.halfedges import NO_TWIN, find_twins, next_halfedge, previous_halfedge
from weavecore.polling import poll

MAX_FACES = 8_000_000
"""More faces than this are refused: an offset takes about 500 bytes a face, so these take 4 GB."""

_MAX_ARCH_OF_EDGE = 1 / 12  # height of the arch over a border edge, as a part of the edge
_MAX_ARCH_OF_LONGEST = 1 / 2  # and as a part of the longest edge: behind it faces have their ordinary size
_MAX_ARCH_OF_FACE = 1 / 4  # and as a part of the face's height above that edge
_FACE_AREA = 0.15  # of a refined face, in squares of the longest edge: halves of right angles are common
_NEEDLE_EXPONENT = np.log2(3.0)  # a needle becomes three needles of half its length
_MIN_ROUNDING_STEPS = 64.0  # of an edge: a shorter one has no midpoint between its ends
_ROUNDED = 22  # bits of a length left out of account, so that moving the surface changes no choice
_SCRAMBLE = np.int64(0x9E3779B97F4A7C15 & 0x7FFFFFFFFFFFFFFF)  # multiplier of Fibonacci hashing (Knuth)
_LOW_BITS = np.int64(0x7FFFFFFFFFFFFFFF)


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined mesh.

    Parameters
    ----------
    vertices : (V', 3) float64
        The old vertices first, bit for bit; then the new ones, each on an old face.
    faces : (F', 3) int64
        Row ``f`` is old face ``f``, or a part of it; parts beyond the first come after all old rows.
    parent_face : (F',) int64
        The old face that each face is part of.
    twins : (3F',) int64
        Twins of the halfedges of the faces, -1 on the border.
    """

    vertices: Floats
    faces: Ints
    parent_face: Ints
    twins: Ints


def refine_faces(
    vertices: Floats,
    faces: Ints,
    *,
    longest: float,
    protected: Bools | None = None,
    splittable: Bools | None = None,
    most_faces: int = MAX_FACES,
) -> Refinement:
    """Refine the faces that have an edge longer than ``longest``; leave all others alone.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Manifold and consistently oriented.
    longest : float
        In the unit of the vertices.
    protected : (3F,) bool, optional
        Halfedges whose edge may not be bisected, besides those of the border; one of the two is enough.
    splittable : (3F,) bool, optional
        Halfedges of the border whose edge may be bisected all the same.
    most_faces : int
        More are refused.

    Returns
    -------
    Refinement
        Edges of the border and protected edges are the same as before.  Every other edge is at most ``longest`` long,
        except for the sides of sealed triangles beside a border or protected edge that is longer itself.  Orientation
        is kept.

    Raises
    ------
    TooMuchWork
        If more than ``most_faces`` faces are to be expected.
    TooFarFromOrigin
        If ``longest`` is lost in the rounding of the coordinates.
    NonManifold
    """
    if not longest > 0:
        raise TooMuchWork(f"Edges no longer than {longest} cannot be made", remedy="Give a length above zero.")
    worked = _Bisection(vertices, faces, longest, protected, splittable)
    queue = worked.long_faces(np.arange(len(faces)))
    if len(queue) == 0:
        return Refinement(vertices, faces, np.arange(len(faces)), find_twins(faces, len(vertices)))
    _check_work(vertices, faces[queue], longest, most_faces)
    while len(queue):
        queue = worked.split(queue)
    return worked.result()


def _check_work(vertices: Floats, faces: Ints, longest: float, most_faces: int) -> None:
    largest = float(np.abs(vertices).max())
    if longest < _MIN_ROUNDING_STEPS * np.spacing(largest):
        raise TooFarFromOrigin(
            f"Edges of {longest:.3g} are lost in rounding at coordinates of {largest:.3g}",
            remedy="Move the surface to the origin, or use a larger spacing.",
        )
    a, b, c = (vertices[faces[:, k]] / longest for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    sides = np.sort([np.linalg.norm(q - p, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    halvings = np.log2(np.maximum(sides[2] / np.maximum(sides[0], 1.0), 1.0))
    needles = 2.0 ** (_NEEDLE_EXPONENT * halvings)
    # A face that is hardly too long becomes two or three; along one without area there is a face for each edge.
    each = np.maximum(area / _FACE_AREA, sides.sum(0)) + needles - 1.0
    expected = float(each.sum())
    if not expected <= most_faces:
        raise TooMuchWork(
            f"Refining the mesh to edges of {longest:.4g} would make about {expected:.2g} faces, more than "
            f"{most_faces:,}; {each.max():.2g} of them of the face between {_places(vertices[faces[each.argmax()]])}",
            remedy="Use a larger spacing, or remove a vertex that lies far off.",
        )


def _places(points: Floats) -> str:
    *first, last = (f"({x:.6g}, {y:.6g}, {z:.6g})" for x, y, z in points)
    return f"{', '.join(first)} and {last}"


class _Bisection:
    """The mesh while it is worked on: the faces not sealed, with their twins, and the sealed ones.

    Arrays have room for more rows than are used, so that a round takes time only for the faces that it cuts.
    """

    def __init__(
        self, vertices: Floats, faces: Ints, longest: float, protected: Bools | None, splittable: Bools | None
    ) -> None:
        self.n_vertices, self.n_faces, self.longest = len(vertices), len(faces), longest
        self.vertices = np.array(vertices, np.float64)
        self.faces = np.array(faces, np.int64)
        self.twins = find_twins(faces, len(vertices))
        if protected is not None:
            shut = protected.copy()
            shut[self.twins[protected & (self.twins != NO_TWIN)]] = True
            self.twins[shut] = NO_TWIN
        self.parent = np.arange(len(faces))
        self.splittable = np.zeros(3 * len(faces), bool) if splittable is None else splittable.copy()
        # Of a border halfedge: the arch's height over the square of the whole edge's length, in units of longest.
        border = np.flatnonzero((self.twins == NO_TWIN) & ~self.splittable)
        length = np.sqrt(self._squares(border // 3)[np.arange(len(border)), border % 3])
        arched, length = border[length > 1], length[length > 1]
        self.bend = np.zeros(3 * len(faces))
        self.bend[arched] = np.minimum(_MAX_ARCH_OF_EDGE * length, _MAX_ARCH_OF_LONGEST) / length**2
        self.marks = np.zeros(3 * len(faces), np.int64)  # of faces or halfedges: 0 but within a method
        self.sealed: list[Ints] = []
        self.sealed_parent: list[Ints] = []

    def _squares(self, face: Ints) -> Floats:
        """(n, 3) squared lengths of the edges of faces, in units of the longest that is allowed."""
        squares = np.empty((len(face), 3))
        for k in blocks(len(face)):
            corners = self.vertices[self.faces[face[k]]]
            along = (corners[:, [1, 2, 0]] - corners) / self.longest
            squares[k] = along[..., 0] ** 2 + along[..., 1] ** 2 + along[..., 2] ** 2
        return squares

    def long_faces(self, face: Ints) -> Ints:
        """Which of the given faces have an edge that is too long."""
        long_: Ints = face[self._squares(face).max(1, initial=0.0) > 1.0]
        return long_

    def split(self, queue: Ints) -> Ints:
        """Cut an independent set of the longest edges of the queued faces; give the next queue."""
        poll()
        chosen = self._choose(queue)
        added = self.n_faces + np.arange(len(chosen))
        self._cut(chosen, self._new_middles(chosen))
        self.marks[chosen // 3] = 1
        waiting = queue[self.marks[queue] == 0]
        self.marks[chosen // 3] = 0
        return np.concatenate([waiting, self.long_faces(np.concatenate([chosen // 3, added]))])

    def _choose(self, queue: Ints) -> Ints:
        """Halfedges that are the first of their face and, if they have a twin, of its face too.

        First is the longest, in classes of a fifth; within a class the order is scrambled, by the
        length: a fan of ever longer edges would else be cut one edge a round.
        """
        poll()
        square = self._squares(queue)
        mantissa, exponent = np.frexp(square)
        size_class = 2 * exponent.astype(np.int64) + (mantissa >= np.sqrt(0.5))
        corner, after = self.faces[queue], self.faces[queue][:, [1, 2, 0]]
        edge_id = np.minimum(corner, after) * np.int64(self.n_vertices) + np.maximum(corner, after)
        # An edge of just the length that is allowed shares the class of longer ones, and its other face may be done.
        is_first = (size_class == size_class.max(1, keepdims=True)) & (square > 1.0)
        for key in (square.view(np.int64) >> _ROUNDED, edge_id):
            rank = np.where(is_first, key * _SCRAMBLE & _LOW_BITS, -1)
            is_first &= rank == rank.max(1, keepdims=True)
        first = 3 * queue + np.argmax(is_first, axis=1)
        self.marks[queue] = first + 1
        twin = self.twins[first]
        chosen: Ints = first[(twin == NO_TWIN) | (self.marks[twin // 3] == twin + 1)]
        self.marks[queue] = 0
        return chosen

    def _new_middles(self, chosen: Ints) -> Ints:
        """Add a vertex for each chosen edge; give it for each chosen halfedge."""
        poll()
        twin = self.twins[chosen]
        leads = (twin == NO_TWIN) | (chosen < twin)
        new = self.n_vertices + np.arange(int(leads.sum()))
        paired = leads & (twin != NO_TWIN)
        self.marks[chosen[leads]] = new
        self.marks[twin[paired]] = self.marks[chosen[paired]]
        of_chosen = self.marks[chosen]
        self.marks[chosen] = 0
        a, b, c = self._corners(chosen[leads])
        middle = (self.vertices[a] + self.vertices[b]) / 2
        on_border = (twin[leads] == NO_TWIN) & ~self.splittable[chosen[leads]]
        a, b, c, sealing = a[on_border], b[on_border], c[on_border], new[on_border]
        middle[on_border] = self._arch_points(chosen[leads][on_border], a, b, c)
        self.vertices = _with_room(self.vertices, self.n_vertices, self.n_vertices + len(new))
        self.vertices[new] = middle
        self.n_vertices += len(new)
        self.sealed.append(np.stack([a, b, sealing], axis=1))
        self.sealed_parent.append(self.parent[chosen[leads][on_border] // 3])
        return of_chosen

    def _arch_points(self, halfedge: Ints, a: Ints, b: Ints, c: Ints) -> Floats:
        """The point of the arch over the middle of each border halfedge, towards the apex."""
        p, q, apex = self.vertices[a], self.vertices[b], self.vertices[c]
        middle, along = (p + q) / 2, (q - p) / self.longest
        length = np.linalg.norm(along, axis=1)
        height = np.linalg.norm(np.cross(along, (apex - p) / self.longest), axis=1) / length
        rise = self.bend[halfedge] * length**2
        limit = np.full(len(rise), _MAX_ARCH_OF_FACE)
        part = np.minimum(_MAX_ARCH_OF_FACE, np.divide(rise, height, out=limit, where=height > 0))
        points: Floats = middle + part[:, None] * (apex - middle)
        return points

    def _corners(self, halfedge: Ints) -> tuple[Ints, Ints, Ints]:
        flat = self.faces.ravel()
        return flat[halfedge], flat[next_halfedge(halfedge)], flat[previous_halfedge(halfedge)]

    def _cut(self, h: Ints, middle: Ints) -> None:
        """Cut the faces of halfedges ``h`` (a, b) from their middles to their apexes c: (a, m, c), (m, b, c)."""
        poll()
        a, b, c = self._corners(h)
        face, added = h // 3, self.n_faces + np.arange(len(h))
        self._add_faces(len(h))
        beyond = [next_halfedge(h), previous_halfedge(h)]  # (b, c) and (c, a) go to new places
        places = [3 * added + 1, 3 * face + 2]
        twin, outer = self.twins[h], [self.twins[s] for s in beyond]
        bend, splittable = ([of[s] for s in (*beyond, h)] for of in (self.bend, self.splittable))
        self.faces[face] = np.stack([a, middle, c], axis=1)
        self.faces[added] = np.stack([middle, b, c], axis=1)
        self.parent[added] = self.parent[face]
        for old, new in zip(beyond, places):
            self.marks[old] = new + 1
        for place, across in zip(places, outer):
            known = across != NO_TWIN
            moved = self.marks[across[known]] - 1
            moved = np.where(moved < 0, across[known], moved)
            self.twins[place] = NO_TWIN
            self.twins[place[known]], self.twins[moved] = moved, place[known]
        for old in beyond:
            self.marks[old] = 0
        self._join(3 * face + 1, 3 * added + 2)
        self.marks[face] = added
        beside = np.where(twin == NO_TWIN, 0, self.marks[twin // 3])
        self.marks[face] = 0
        self.twins[3 * face] = np.where(beside == 0, NO_TWIN, 3 * beside)
        self.twins[3 * added] = np.where(beside == 0, NO_TWIN, 3 * (twin // 3))
        for place, k in zip((*places, 3 * face, 3 * added), (0, 1, 2, 2)):
            self.bend[place], self.splittable[place] = bend[k], splittable[k]

    def _add_faces(self, n: int) -> None:
        """Count so many faces more, and make room for them."""
        before, self.n_faces = self.n_faces, self.n_faces + n
        self.faces = _with_room(self.faces, before, self.n_faces)
        self.parent = _with_room(self.parent, before, self.n_faces)
        self.twins = _with_room(self.twins, 3 * before, 3 * self.n_faces)
        self.bend = _with_room(self.bend, 3 * before, 3 * self.n_faces)
        self.splittable = _with_room(self.splittable, 3 * before, 3 * self.n_faces)
        self.marks = _with_room(self.marks, 0, 3 * self.n_faces)

    def _join(self, one: Ints, other: Ints) -> None:
        self.twins[one], self.twins[other] = other, one

    def result(self) -> Refinement:
        faces = np.concatenate([self.faces[: self.n_faces], *self.sealed])
        twins = np.full(faces.size, NO_TWIN, np.int64)
        twins[: 3 * self.n_faces] = self.twins[: 3 * self.n_faces]
        return Refinement(
            self.vertices[: self.n_vertices].copy(),
            faces,
            np.concatenate([self.parent[: self.n_faces], *self.sealed_parent]),
            find_twins(faces, self.n_vertices, known=twins),
        )


_Array = TypeVar("_Array", Floats, Ints, Bools)


def _with_room(rows: _Array, n_used: int, n_needed: int) -> _Array:
    """An array with so many rows at least, of which it keeps the used ones; the others are 0.

    It has twice the rows that are needed: the system gives memory only for those that are written.
    """
    if n_needed <= len(rows):
        return rows
    roomy = np.zeros((2 * n_needed, *rows.shape[1:]), rows.dtype)
    roomy[:n_used] = rows[:n_used]
    return roomy
