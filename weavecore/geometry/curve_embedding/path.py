"""A path drawn over a mesh, from point to point, as edges of the mesh."""

from __future__ import annotations

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_embedding.growing_mesh import GrowingMesh
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends

_NEAR, _AT = 0.04, 1e-3
"""A point that may be moved, or one that may not, goes to a vertex or an edge nearer than this part of the edges
or of the face's height there."""

_NEAR_OTHERS = 0.2  # of the room beside the curve, so that what lies beside one another keeps its order
_NEAR_ENDS = 0.25  # of the way from a crossing to either end, so that the path does not overshoot
_SAME = 1e-9  # of an edge: nearer than this there is no way between
_MOST_HALVINGS = 8
_MOST_LEFT_OUT = 3  # points one after the other that may be moved, and need not be gone through
_MOST_STEPS = 10_000

_ITSELF, _OTHER, _BORDER, _OFF = (
    "crosses or touches itself",
    "crosses or touches another origin",
    "touches a border between its ends",
    "leaves the surface",
)
_REMEDY = {
    _ITSELF: "Give a curve that keeps clear of itself, or split it and leave one part away.",
    _OTHER: "Leave one of both away, or keep them apart.",
    _BORDER: "Keep it clear of the border, or let it end there.",
    _OFF: "Pull it onto the surface, and trim what hangs over.",
}


def _stuck(by: str, place: Floats) -> BadCurve:
    """What is told where the way is barred."""
    x, y, z = place.tolist()
    return BadCurve(f"The curve {by} near ({x:.6g}, {y:.6g}, {z:.6g})", remedy=_REMEDY[by])


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
        reach = _NEAR_OTHERS * room
        refused = list[BadCurve]()
        for row in range(len(places)):
            near = _AT if is_exact[row] else _NEAR
            try:
                vertex = self._put(places[row], int(faces[row]), near, float(reach[row]), bool(on_border[row]))
                self._go_on(vertex, float(min(reach[row - 1], reach[row])))
                refused.clear()
            except BadCurve as refusal:
                # Where sheets of the surface lie on one another, a point may have been found on the wrong one.
                refused.append(refusal)
                if is_exact[row] or row == 0 or len(refused) > _MOST_LEFT_OUT:
                    raise refused[0] from None
        if is_closed:
            self._go_on(self._path[0], float(min(reach[0], reach[-1])))
            self._path.pop()
        return np.array(self._path, np.int64)

    def _go_on(self, vertex: int, reach: float) -> None:
        """Draw the path on to a vertex."""
        if not self._path:
            self._append(vertex)
        elif vertex != self._path[-1]:
            self._draw_leg(vertex, reach, _MOST_HALVINGS)

    def _append(self, vertex: int) -> None:
        self._order.setdefault(vertex, len(self._path))
        self._path.append(vertex)

    def _draw_leg(self, goal: int, reach: float, halvings: int) -> None:
        """Draw the path straight on to a vertex; where the way is barred by way of the middle."""
        length, start = len(self._path), self._path[-1]
        try:
            self._walk(goal, reach)
        except BadCurve:
            for vertex in self._path[length:]:
                if self._order[vertex] >= length:
                    del self._order[vertex]
            del self._path[length:]
            middle = self._middle(start, goal) if halvings else None
            if middle is None or middle in (start, goal):
                raise
            self._draw_leg(middle, reach, halvings - 1)
            self._draw_leg(goal, reach, halvings - 1)

    def _middle(self, start: int, goal: int) -> int | None:
        """A vertex at the place on the surface that is nearest to the middle between two; None where it is barred."""
        one, other = self._mesh.point(start), self._mesh.point(goal)
        middle, far = (one + other) / 2, float(np.linalg.norm(other - one))
        corners = self._vertices[self._faces]
        rows = np.flatnonzero(((corners.min(1) <= middle + far) & (corners.max(1) >= middle - far)).all(1))
        face, place = closest_faces(middle[None], self._vertices, self._faces[rows])
        try:
            return self._put(place[0], int(rows[face[0]]), _AT, 0.0, on_border=False)
        except BadCurve:
            return None

    def _walk(self, goal: int, reach: float) -> None:
        """Go straight on to a vertex, splitting the edges that are crossed."""
        far = 3 * float(np.linalg.norm(self._mesh.point(goal) - self._mesh.point(self._path[-1])))
        for _ in range(_MOST_STEPS):
            vertex = self._step(self._path[-1], goal, reach)
            self._append(vertex)
            if vertex == goal:
                return
            place = self._mesh.point(vertex)
            if np.linalg.norm(self._mesh.point(goal) - place) > far:
                break
        raise _stuck(_OFF, self._mesh.point(goal))

    def _step(self, here: int, goal: int, reach: float) -> int:
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
            raise _stuck(_OFF, origin)
        halfedge, part, left, place = found
        nearer = min(left, float(np.linalg.norm(place)))
        return self._cross(halfedge, part, min(reach, _NEAR_ENDS * nearer))

    def _cross(self, halfedge: int, part: float, reach: float) -> int:
        """The vertex where an edge is crossed: an end that is near, or a new one."""
        mesh = self._mesh
        a, b = mesh.tail(halfedge), mesh.head(halfedge)
        one, other = mesh.point(a), mesh.point(b)
        length = float(np.linalg.norm(other - one))
        near = max(min(_NEAR, reach / length if length else 0.0), _SAME)
        for vertex, off in sorted(((a, part), (b, 1 - part)), key=lambda end: end[1]):
            barred = self._bar(vertex)
            if off <= near and barred is None:
                return vertex
            if off <= _SAME:
                raise _stuck(barred or _OFF, mesh.point(vertex))
        place = one + part * (other - one)
        barred = self._bar_of_edge(halfedge)
        if barred is not None:
            raise _stuck(barred, place)
        return mesh.split_edge(halfedge, place)

    def _bar_of_edge(self, halfedge: int, *, on_border: bool = False) -> str | None:
        """What an edge belongs to that the path may not cross."""
        a, b = self._mesh.tail(halfedge), self._mesh.head(halfedge)
        if (min(a, b), max(a, b)) in self._fixed:
            return _OTHER
        if a in self._order and b in self._order and abs(self._order[a] - self._order[b]) == 1:
            return _ITSELF
        return _BORDER if self._mesh.twin(halfedge) == NO_TWIN and not on_border else None

    def _bar(self, vertex: int, *, on_border: bool = False) -> str | None:
        """What a vertex belongs to that the path may not touch."""
        if vertex in self._order:
            return _ITSELF
        if vertex in self._others:
            return _OTHER
        return _BORDER if vertex in self._border and not on_border else None

    def _link(self, vertex: int) -> Ints:
        """The other corners (n, 2) of the faces at a vertex, in the order of its fan."""
        mesh = self._mesh
        return np.array([(mesh.head(h), mesh.tail(mesh.before(h))) for h in mesh.fan(vertex)], np.int64)

    def _normal(self, vertex: int) -> Floats:
        """The normal at a vertex, in squares of lengths."""
        around = self._mesh.vertices[self._link(vertex)] - self._mesh.point(vertex)
        normal: Floats = np.cross(around[:, 0], around[:, 1]).sum(0)
        return normal

    def _put(self, place: Floats, face: int, near: float, reach: float, on_border: bool) -> int:
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
                    raise _stuck(barred, place)
        return self._put_off_corners(place, piece, weights, near, reach, on_border)

    def _put_off_corners(
        self, place: Floats, piece: int, weights: Floats, near: float, reach: float, on_border: bool
    ) -> int:
        """A new vertex on the side that is near, or inside a face."""
        mesh = self._mesh
        # The weight of a corner is the distance from the side opposite, as a part of the corner's height above it.
        side = (int(np.argmin(weights)) + 1) % 3
        weight = float(weights.min())
        halfedge = 3 * piece + side
        one, other = mesh.point(mesh.tail(halfedge)), mesh.point(mesh.head(halfedge))
        along = other - one
        part = float(np.clip((place - one) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1))
        foot = one + part * along
        barred = self._bar_of_edge(halfedge, on_border=on_border)
        is_near = weight <= near and np.linalg.norm(foot - place) <= reach
        if (is_near or weight <= _SAME) and barred is None and _SAME < part < 1 - _SAME:
            vertex = mesh.split_edge(halfedge, foot)
            if mesh.twin(halfedge) == NO_TWIN:
                self._border.add(vertex)
            return vertex
        if weight <= _SAME:
            raise _stuck(barred or _OFF, place)
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
