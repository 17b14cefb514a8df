"""Chords: straight lines between two places, laid on the mesh and cut at every edge that they cross.

A chord is the section of the mesh by the plane through both vertices that stands upright on the
surface between them.  So a child is a curve on the surface, and whether two of them cross is
asked face by face.
"""

from __future__ import annotations

import heapq

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.halfedges import NO_TWIN, next_halfedge, previous_halfedge
from weavecore.geometry.walking import on_halfedge
from weavecore.offsetting.fronts.ground import Ground

_MOST_FACES = 200
_OFF_THE_CORNER = 1e-4
"""A chord crosses an edge no nearer to its ends than this part of it."""

_OFF_THE_ROUTE = 0.02

_MOST_DETOUR = 2.0
"""A section so many times longer than straight on leads around the surface the wrong way."""

_Row = tuple[Ints, Ints, Floats, Floats]


def lay_chords(ground: Ground, from_face: Ints, from_: Floats, to_face: Ints, to: Floats) -> _Row:
    """Segments of the chords between places: the chord of each, its face and both its ends there."""
    chords = np.arange(len(from_face))
    same = from_face == to_face
    rows: list[_Row] = [(chords[same], from_face[same], from_[same], to[same])]
    far = np.flatnonzero(~same)
    a, b = ground.points(from_face[far], from_[far]), ground.points(to_face[far], to[far])
    section = _Section(ground, a, b, ground.normals[from_face[far]] + ground.normals[to_face[far]])
    local, found = section.walk(from_face[far], from_[far], to_face[far], to[far])
    rows += [(far[row[0]], *row[1:]) for row in local]
    for lost in np.flatnonzero(~found).tolist():
        route = _route(ground, int(from_face[far[lost]]), int(to_face[far[lost]]))
        rows.append(_along_route(ground, far[lost], route, a[lost], b[lost], from_[far[lost]], to[far[lost]]))
    chord, face, start, end = (np.concatenate(column) for column in zip(*rows))
    order = np.argsort(chord, kind="stable")
    return chord[order], face[order], start[order], end[order]


def measure_chords(ground: Ground, from_face: Ints, from_: Floats, to_face: Ints, to: Floats) -> Floats:
    """(n,) lengths of chords on the mesh, which no distance exceeds; infinite where a chord does not arrive."""
    a, b = ground.points(from_face, from_), ground.points(to_face, to)
    length = np.linalg.norm(b - a, axis=1)
    far = np.flatnonzero(from_face != to_face)
    section = _Section(ground, a[far], b[far], ground.normals[from_face[far]] + ground.normals[to_face[far]])
    rows, found = section.walk(from_face[far], from_[far], to_face[far], to[far])
    length[far] = np.where(found, section.lengths(rows), np.inf)
    return np.asarray(length)


class _Section:
    """Upright planes through pairs of points, and how the mesh is cut by them."""

    def __init__(self, ground: Ground, a: Floats, b: Floats, up: Floats) -> None:
        self.ground, self.a, self.along = ground, a, b - a
        self.normal = np.cross(self.along, up)

    def height(self, chord: Ints, vertex: Ints) -> Floats:
        """How far vertices lie to one side of the planes of chords."""
        away = self.ground.vertices[vertex] - self.a[chord]
        return np.asarray(np.einsum("ij,ij->i", away, self.normal[chord]))

    def first_exits(self, chord: Ints, face: Ints) -> tuple[Ints, Bools]:
        """The halfedge by which each chord leaves the face that it starts in, and whether there is one."""
        best, forward = np.full(len(face), NO_TWIN), np.full(len(face), -np.inf)
        corners = self.ground.faces[face]
        for k in range(3):
            tail, head = corners[:, k], corners[:, (k + 1) % 3]
            s, t = self.height(chord, tail), self.height(chord, head)
            crosses = (s >= 0) != (t >= 0)
            part = np.divide(s, s - t, out=np.zeros(len(s)), where=crosses)[:, None]
            place = self.ground.vertices[tail] * (1 - part) + self.ground.vertices[head] * part
            onward = np.einsum("ij,ij->i", place - self.a[chord], self.along[chord])
            better = crosses & (onward > forward)
            best[better], forward[better] = 3 * face[better] + k, onward[better]
        return best, best != NO_TWIN

    def walk(self, face: Ints, start: Floats, last_face: Ints, last: Floats) -> tuple[list[_Row], Bools]:
        """Segments of the sections, and which of them arrive by a way that is hardly longer than straight on."""
        rows: list[_Row] = []
        found = np.zeros(len(face), bool)
        chord, at, here = np.arange(len(face)), face, start
        exit_, goes = self.first_exits(chord, face)
        chord, at, here, exit_ = chord[goes], at[goes], here[goes], exit_[goes]
        for _ in range(_MOST_FACES):
            if len(chord) == 0:
                break
            part = self._part(chord, exit_)
            rows.append((chord, at, here, on_halfedge(exit_, part)))
            twin = self.ground.twins[exit_]
            goes = twin != NO_TWIN
            chord, twin, part = chord[goes], twin[goes], 1.0 - part[goes]
            at, here = twin // 3, on_halfedge(twin, part)
            arrives = at == last_face[chord]
            found[chord[arrives]] = True
            rows.append((chord[arrives], at[arrives], here[arrives], last[chord[arrives]]))
            chord, at, here, twin = chord[~arrives], at[~arrives], here[~arrives], twin[~arrives]
            tail_side = self.height(chord, self.ground.faces.ravel()[twin]) >= 0
            apex_side = self.height(chord, self.ground.faces.ravel()[previous_halfedge(twin)]) >= 0
            exit_ = np.where(tail_side == apex_side, next_halfedge(twin), previous_halfedge(twin))
        found &= self.lengths(rows) < _MOST_DETOUR * np.linalg.norm(self.along, axis=1)
        return [(c[found[c]], f[found[c]], s[found[c]], e[found[c]]) for c, f, s, e in rows], found

    def lengths(self, rows: list[_Row]) -> Floats:
        """Length of each section along its segments."""
        total = np.zeros(len(self.a))
        for chord, face, start, end in rows:
            total[chord] += np.linalg.norm(self.ground.points(face, end - start), axis=1)
        return total

    def _part(self, chord: Ints, halfedge: Ints) -> Floats:
        corners = self.ground.faces.ravel()
        s = self.height(chord, corners[halfedge])
        t = self.height(chord, corners[next_halfedge(halfedge)])
        part = np.divide(s, s - t, out=np.full(len(s), 0.5), where=s != t)
        return _held_off(part, _OFF_THE_CORNER)


def _held_off(part: Floats, least: float) -> Floats:
    """Places on edges pushed off the ends of the edge, or back onto it: different ones stay so, in their order."""
    low = least / (1.0 + np.maximum(least - part, 0.0) / least)
    high = 1.0 - least / (1.0 + np.maximum(part - 1.0 + least, 0.0) / least)
    return np.asarray(np.where(part < least, low, np.where(part > 1.0 - least, high, part)))


def _route(ground: Ground, start: int, goal: int) -> list[int]:
    """Halfedges by which faces are left on the shortest way, from middle to middle, between two faces.

    Few chords need it: those about a corner of a wall, or on a mesh as rough as its edges are long.
    """
    centres, twins, target = ground.vertices[ground.faces], ground.twins, ground.vertices[ground.faces[goal]].mean(0)
    came: dict[int, int] = {start: NO_TWIN}
    cost = {start: 0.0}
    queue = [(0.0, start)]
    while queue:
        _, face = heapq.heappop(queue)
        if face == goal:
            break
        centre = centres[face].mean(0)
        for h in range(3 * face, 3 * face + 3):
            beside = int(twins[h]) // 3
            if twins[h] == NO_TWIN:
                continue
            middle = centres[beside].mean(0)
            far = cost[face] + float(np.linalg.norm(middle - centre))
            if far < cost.get(beside, np.inf):
                cost[beside], came[beside] = far, h
                heapq.heappush(queue, (far + float(np.linalg.norm(target - middle)), beside))
    route: list[int] = []
    while goal != start:
        route.append(came[goal])
        goal = came[goal] // 3
    return route[::-1]


def _along_route(ground: Ground, chord: int, route: list[int], a: Floats, b: Floats, from_: Floats, to: Floats) -> _Row:
    """Segments of a chord that crosses these halfedges, each as near to the straight line as it can."""
    h = np.array(route, np.int64)
    corners = ground.faces.ravel()
    tail, head = ground.vertices[corners[h]], ground.vertices[corners[next_halfedge(h)]]
    up = ground.normals[h // 3] + ground.normals[ground.twins[h] // 3]
    normal = np.cross(b - a, up)
    s, t = np.einsum("ij,ij->i", tail - a, normal), np.einsum("ij,ij->i", head - a, normal)
    part = _held_off(np.divide(s, s - t, out=np.full(len(s), 0.5), where=s != t), _OFF_THE_ROUTE)
    leave, enter = on_halfedge(h, part), on_halfedge(ground.twins[h], 1.0 - part)
    face = np.concatenate([h // 3, ground.twins[h[-1:]] // 3])
    start, end = np.concatenate([from_[None], enter]), np.concatenate([leave, to[None]])
    return np.full(len(face), chord), face, start, end
