r"""A path of edges drawn through given places on a mesh, splitting the edges that it crosses.

From a vertex the path goes straight towards the next place: in the plane through both, along the sum of their normals,
to the point where it leaves the faces about the vertex::

             link of the vertex      o-----o
                                    / \   / \        x  the plane crosses the link: the edge is split there, or an
                                   o---here--x--> goal   end of it that is near is taken
                                    \ /   \ /
                                     o-----o

What lies in the way (another path, the path itself, a border) is an *obstacle*, a value and not an exception.  Each
leg is a transaction: it is kept if it reaches its goal, or undone, with all splits, and tried by way of the middle.
A place that is not reached either way is undone as well; it may be left out if it need not be met exactly.

Work: linear in the faces that the path crosses.
"""

from __future__ import annotations

from typing import NamedTuple, Union

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_embedding.growing_mesh import GrowingMesh, Mark
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends

MOVABLE_REACH, EXACT_REACH = 0.04, 1e-3
"""Of the edges, or of the face's height there: a place that may be moved, or one that may not, is put on a vertex or an
edge nearer than this.  The first keeps slivers away, the second is below what a drawing shows."""

REACH_OF_ROOM = 0.2
"""Of the room beside the curve: no place moves further, so that stretches beside one another keep their order."""

REACH_OF_WAY = 0.25
"""Of the way from a crossing to either end of a step: no crossing moves further, so that the path does not
overshoot."""

MAX_HALVINGS = 8
"""Times that a leg is divided at its middle where the straight way is barred: pieces of a 256th."""

MAX_LEFT_OUT = 3
"""Places in a row that may be left out: more would lose the shape of the curve."""

_SAME = 1e-9  # of an edge: nearer than this there is no way between
_MAX_STEPS = 10_000  # faces that one leg may cross

ITSELF, OTHER, BORDER, OFF = (
    "crosses or touches itself",
    "crosses or touches another origin",
    "touches a border between its ends",
    "leaves the surface",
)
_REMEDY = {
    ITSELF: "Give a curve that keeps clear of itself, or split it and omit one part.",
    OTHER: "Omit one of both, or keep them apart.",
    BORDER: "Keep it clear of the border, or let it end there.",
    OFF: "Pull it onto the surface, and trim what overhangs.",
}


class Obstacle(NamedTuple):
    """What bars the way, and where."""

    what: str
    place: Floats

    def error(self) -> BadCurve:
        """The error to raise if there is no other way."""
        x, y, z = self.place.tolist()
        return BadCurve(f"The curve {self.what} near ({x:.6g}, {y:.6g}, {z:.6g})", remedy=_REMEDY[self.what])


Reached = Union[int, Obstacle]
"""A vertex, or what bars the way to it."""


class PathDrawing:
    """Draws one path into a mesh.

    Parameters
    ----------
    mesh : GrowingMesh
    fixed : (m, 2) int64
        Edges of other paths, which are not split, and whose vertices are not touched.
    """

    def __init__(self, mesh: GrowingMesh, fixed: Ints) -> None:
        self._mesh = mesh
        self._vertices, self._faces = mesh.vertices.copy(), mesh.faces.copy()
        self._others = set(fixed.ravel().tolist())
        self._fixed = {(min(a, b), max(a, b)) for a, b in fixed.tolist()}
        self._border = set[int]()
        tail, head = halfedge_ends(self._faces)
        rim = mesh.border_halfedges()
        self._border.update(tail[rim].tolist(), head[rim].tolist())
        self._path: list[int] = []
        self._order = dict[int, int]()
        self._added_to_border: list[int] = []

    def draw(
        self, places: Floats, faces: Ints, *, is_exact: Bools, room: Floats, on_border: Bools, is_closed: bool
    ) -> Ints:
        """Draw a path through places on faces of the mesh as it was given.

        Parameters
        ----------
        places : (n, 3) float64
        faces : (n,) int64
        is_exact : (n,) bool
            Whether a place may not be moved to what is near.
        room : (n,) float64
            Distance to what else must be kept clear of.
        on_border : (n,) bool
            Whether a place is meant to lie on the border.
        is_closed : bool

        Returns
        -------
        (k,) int64

        Raises
        ------
        BadCurve
        """
        reach = REACH_OF_ROOM * room
        skipped: list[Obstacle] = []
        for row in range(len(places)):
            start = self._mark()
            near = EXACT_REACH if is_exact[row] else MOVABLE_REACH
            vertex = self._put(places[row], int(faces[row]), near, float(reach[row]), bool(on_border[row]))
            obstacle = self._go_on(vertex, float(min(reach[row - 1], reach[row])))
            if obstacle is None:
                skipped.clear()
                continue
            self._undo(start)
            # Where sheets of the surface lie on one another, a place may have been found on the wrong one.
            skipped.append(obstacle)
            if is_exact[row] or row == 0 or len(skipped) > MAX_LEFT_OUT:
                raise skipped[0].error()
        if is_closed:
            obstacle = self._go_on(self._path[0], float(min(reach[0], reach[-1])))
            if obstacle is not None:
                raise obstacle.error()
            self._path.pop()
        return np.array(self._path, np.int64)

    def _mark(self) -> tuple[Mark, int, int]:
        """The present state of the mesh and the path."""
        return self._mesh.mark(), len(self._path), len(self._added_to_border)

    def _undo(self, mark: tuple[Mark, int, int]) -> None:
        """Take back what has been drawn since a mark, with all splits."""
        of_mesh, length, n_added = mark
        for vertex in self._path[length:]:
            if self._order.get(vertex, -1) >= length:
                del self._order[vertex]
        del self._path[length:]
        self._border.difference_update(self._added_to_border[n_added:])
        del self._added_to_border[n_added:]
        self._mesh.undo(of_mesh)

    def _go_on(self, vertex: Reached, reach: float) -> Obstacle | None:
        """Draw the path on to a vertex; what bars the way, if anything does."""
        if isinstance(vertex, Obstacle):
            return vertex
        if not self._path:
            self._append(vertex)
        elif vertex != self._path[-1]:
            return self._draw_leg(vertex, reach, MAX_HALVINGS)
        return None

    def _append(self, vertex: int) -> None:
        self._order.setdefault(vertex, len(self._path))
        self._path.append(vertex)

    def _draw_leg(self, goal: int, reach: float, halvings: int) -> Obstacle | None:
        """Draw the path straight on to a vertex, or by way of the middle where that is barred; all of it or nothing."""
        mark, start = self._mark(), self._path[-1]
        obstacle = self._walk(goal, reach)
        if obstacle is None:
            return None
        self._undo(mark)
        middle = self._middle(start, goal) if halvings else obstacle
        if isinstance(middle, Obstacle) or middle in (start, goal):
            self._undo(mark)
            return obstacle
        for end in (middle, goal):
            obstacle = self._draw_leg(end, reach, halvings - 1)
            if obstacle is not None:
                self._undo(mark)
                return obstacle
        return None

    def _middle(self, start: int, goal: int) -> Reached:
        """A vertex at the place on the surface that is nearest to the middle between two."""
        one, other = self._mesh.point(start), self._mesh.point(goal)
        middle, far = (one + other) / 2, float(np.linalg.norm(other - one))
        corners = self._vertices[self._faces]
        rows = np.flatnonzero(((corners.min(1) <= middle + far) & (corners.max(1) >= middle - far)).all(1))
        face, place = closest_faces(middle[None], self._vertices, self._faces[rows])
        return self._put(place[0], int(rows[face[0]]), EXACT_REACH, 0.0, on_border=False)

    def _walk(self, goal: int, reach: float) -> Obstacle | None:
        """Go straight on to a vertex, splitting the edges that are crossed."""
        far = 3 * float(np.linalg.norm(self._mesh.point(goal) - self._mesh.point(self._path[-1])))
        for _ in range(_MAX_STEPS):
            vertex = self._step(self._path[-1], goal, reach)
            if isinstance(vertex, Obstacle):
                return vertex
            self._append(vertex)
            if vertex == goal:
                return None
            place = self._mesh.point(vertex)
            if np.linalg.norm(self._mesh.point(goal) - place) > far:
                break
        return Obstacle(OFF, self._mesh.point(goal).copy())

    def _step(self, here: int, goal: int, reach: float) -> Reached:
        """The next vertex on the straight way to the goal."""
        mesh = self._mesh
        origin = mesh.point(here)
        fan, link = mesh.fan(here), self._link(here)
        if goal in link:
            return goal
        ahead = mesh.point(goal) - origin
        around = mesh.vertices[link] - origin
        normal = np.cross(around[:, 0], around[:, 1]).sum(0) + self._normal(goal)
        height = around @ np.cross(ahead, normal)
        best, found = 0.0, None
        for k, (one, other) in enumerate(height.tolist()):
            part = _crossing(one, other)
            if part is None:
                continue
            place = around[k, 0] + part * (around[k, 1] - around[k, 0])
            cosine = float(place @ ahead) / max(float(np.linalg.norm(place)), np.finfo(float).tiny)
            if cosine > best:
                best, found = cosine, (mesh.after(fan[k]), part, float(np.linalg.norm(place - ahead)), place)
        if found is None:
            return Obstacle(OFF, origin.copy())
        halfedge, part, left, place = found
        nearer = min(left, float(np.linalg.norm(place)))
        return self._cross(halfedge, part, min(reach, REACH_OF_WAY * nearer))

    def _cross(self, halfedge: int, part: float, reach: float) -> Reached:
        """The vertex where an edge is crossed: an end that is near, or a new one."""
        mesh = self._mesh
        a, b = mesh.tail(halfedge), mesh.head(halfedge)
        one, other = mesh.point(a), mesh.point(b)
        length = float(np.linalg.norm(other - one))
        near = max(min(MOVABLE_REACH, reach / length if length else 0.0), _SAME)
        for vertex, off in sorted(((a, part), (b, 1 - part)), key=lambda end: end[1]):
            barred = self._bar(vertex)
            if off <= near and barred is None:
                return vertex
            if off <= _SAME:
                return Obstacle(barred or OFF, mesh.point(vertex).copy())
        place = one + part * (other - one)
        barred = self._bar_of_edge(halfedge)
        if barred is not None:
            return Obstacle(barred, place)
        return mesh.split_edge(halfedge, place)

    def _bar_of_edge(self, halfedge: int, *, on_border: bool = False) -> str | None:
        """What an edge belongs to that the path may not cross."""
        a, b = self._mesh.tail(halfedge), self._mesh.head(halfedge)
        if (min(a, b), max(a, b)) in self._fixed:
            return OTHER
        if a in self._order and b in self._order and abs(self._order[a] - self._order[b]) == 1:
            return ITSELF
        return BORDER if self._mesh.twin(halfedge) == NO_TWIN and not on_border else None

    def _bar(self, vertex: int, *, on_border: bool = False) -> str | None:
        """What a vertex belongs to that the path may not touch."""
        if vertex in self._order:
            return ITSELF
        if vertex in self._others:
            return OTHER
        return BORDER if vertex in self._border and not on_border else None

    def _link(self, vertex: int) -> Ints:
        """The other corners (n, 2) of the faces at a vertex, in the order of its fan."""
        mesh = self._mesh
        return np.array([(mesh.head(h), mesh.tail(mesh.before(h))) for h in mesh.fan(vertex)], np.int64)

    def _normal(self, vertex: int) -> Floats:
        """The normal at a vertex, in squares of lengths."""
        around = self._mesh.vertices[self._link(vertex)] - self._mesh.point(vertex)
        normal: Floats = np.cross(around[:, 0], around[:, 1]).sum(0)
        return normal

    def _put(self, place: Floats, face: int, near: float, reach: float, on_border: bool) -> Reached:
        """The vertex at a place on a face of the given mesh: one that is near, or a new one."""
        mesh = self._mesh
        piece, weights = self._piece_at(face, place)
        corners = mesh.corners(piece)
        points = np.array([mesh.point(v) for v in corners])
        sides = np.linalg.norm(points[[1, 2, 0]] - points, axis=1)
        off = np.linalg.norm(points - place, axis=1)
        for k in np.argsort(off, kind="stable").tolist():
            size = min(sides[k], sides[k - 1])
            barred = self._bar(corners[k], on_border=on_border)
            if self._path and corners[k] == self._path[-1]:
                barred = None
            if off[k] <= max(min(near * size, reach), _SAME * size):
                if barred is None:
                    return corners[k]
                if off[k] <= _SAME * size:
                    return Obstacle(barred, place)
        return self._put_off_corners(place, piece, weights, near, reach, on_border)

    def _put_off_corners(
        self, place: Floats, piece: int, weights: Floats, near: float, reach: float, on_border: bool
    ) -> Reached:
        """A new vertex on the side that is near, or inside a face."""
        mesh = self._mesh
        # The weight of a corner is the distance from the side opposite, as a part of the corner's height above it.
        side = (int(np.argmin(weights)) + 1) % 3
        weight = float(weights.min())
        halfedge = 3 * piece + side
        one, other = mesh.point(mesh.tail(halfedge)), mesh.point(mesh.head(halfedge))
        along = other - one
        part = float(np.clip((place - one) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1))
        nearest = one + part * along
        barred = self._bar_of_edge(halfedge, on_border=on_border)
        is_near = weight <= near and np.linalg.norm(nearest - place) <= reach
        if (is_near or weight <= _SAME) and barred is None and _SAME < part < 1 - _SAME:
            vertex = mesh.split_edge(halfedge, nearest)
            if mesh.twin(halfedge) == NO_TWIN:
                self._border.add(vertex)
                self._added_to_border.append(vertex)
            return vertex
        if weight <= _SAME:
            return Obstacle(barred or OFF, place)
        return mesh.split_face(piece, place)

    def _piece_at(self, face: int, place: Floats) -> tuple[int, Floats]:
        """The piece of a face that a place lies in, and the place's weights there."""
        pieces = self._mesh.pieces(face)
        corners = np.array([[self._mesh.point(v) for v in self._mesh.corners(piece)] for piece in pieces])
        weights = _weights(place, corners)
        best = int(np.argmax(weights.min(1)))
        return pieces[best], weights[best]


def _crossing(one: float, other: float) -> float | None:
    """How far between two heights zero lies; None where it does not."""
    if one == other == 0:
        return 0.0
    if (one > 0) == (other > 0) and one != 0 and other != 0:
        return None
    return one / (one - other)


def _weights(place: Floats, corners: Floats) -> Floats:
    """Barycentric coordinates (n, 3) of a place in triangles (n, 3, 3); of one without area as far out as can be."""
    a, b, c = (corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(1)
    parts = [(np.cross(q - p, place - p) * normal).sum(1) for p, q in ((b, c), (c, a), (a, b))]
    weights = np.full((len(corners), 3), -np.inf)
    np.divide(np.stack(parts, axis=1), square[:, None], out=weights, where=square[:, None] > 0)
    return weights
