"""Chords: straight lines between two places, laid on the mesh and cut at every edge that they cross.

A chord is the section of the mesh by the plane through both vertices that stands upright on the
surface between them.  So a child is a curve on the surface, and whether two of them cross is
asked face by face.
"""

from __future__ import annotations

import heapq

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.geodesics import on_halfedge
from weavecore.geometry.halfedges import NO_TWIN, next_halfedge, previous_halfedge
from weavecore.offsetting.propagation.curves import Curves, Ground, next_along

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


# ----------------------------------------------------------------------
# Folds: where a child turns back over itself without crossing itself.
#
# On a rough surface the ends of two neighbouring rays may change places.  The child then runs forth, back and
# forth again; where it turns sharply to the right, which no front that opens does, the vertex is left out.

SHARPEST_FAN = 1.0
"""Radians: a child that turns to the right by more has folded."""

FEWEST = 4
"""A polyline keeps at least so many vertices."""

_MOST_ROUNDS = 5


def find_turns(ground: Ground, face: Ints, points: Floats, offsets: Ints, closed: Bools) -> tuple[Floats, Floats]:
    """How much polylines turn to the left at each point, and in which direction they come to it.

    Both as angles in the frames of the first halfedges of the faces.  Open ones go on straight at their ends.
    """
    after = next_along(offsets, closed)
    before = np.arange(len(after))
    onward = after != before
    before[after[onward]] = np.flatnonzero(onward)
    ax, ay = ground.aimed(face, points - points[before])
    bx, by = ground.aimed(face, points[after] - points)
    first, last = before == np.arange(len(after)), ~onward
    ax[first], ay[first] = bx[first], by[first]
    bx[last], by[last] = ax[last], ay[last]
    return np.arctan2(ax * by - ay * bx, ax * bx + ay * by), np.arctan2(ay, ax)


def unfold(ground: Ground, curves: Curves) -> Curves:
    """The curves without the vertices at which they fold, and with new chords across these."""
    vertex = np.flatnonzero(curves.is_vertex)
    kept = vertex
    for _ in range(_MOST_ROUNDS):
        counts = np.bincount(curves.owner[kept], minlength=len(curves))
        turn, _ = find_turns(ground, curves.face[kept], curves.points[kept], offsets_of(counts), curves.closed)
        folds = (turn < -SHARPEST_FAN) & (counts[curves.owner[kept]] > FEWEST)
        if not folds.any():
            break
        kept = kept[~folds]
    return curves if len(kept) == len(vertex) else _joined(ground, curves, vertex, kept)


def _joined(ground: Ground, curves: Curves, vertex: Ints, kept: Ints) -> Curves:
    """The curves through some of their vertices: old chords where both ends stay, new ones elsewhere."""
    next_vertex = _next(curves, vertex)
    next_kept = _next(curves, kept)
    stays = next_kept == next_vertex[np.searchsorted(vertex, kept)]
    chord, rank = _chords(curves, vertex)
    place = np.full(len(curves.face), -1)
    place[kept[stays]] = np.flatnonzero(stays)
    old = np.flatnonzero(place[chord] >= 0)
    at, to = kept[~stays], next_kept[~stays]
    new, face, start, end = lay_chords(ground, curves.face[at], curves.start[at], curves.face[to], curves.start[to])
    row = np.concatenate([place[chord[old]], np.flatnonzero(~stays)[new]])
    order = np.lexsort((np.concatenate([rank[old], np.arange(len(new))]), row))
    face = np.concatenate([curves.face[old], face])[order]
    start = np.concatenate([curves.start[old], start])[order]
    end = np.concatenate([curves.end[old], end])[order]
    row = row[order]
    is_vertex = np.ones(len(row), bool)
    is_vertex[1:] = row[1:] != row[:-1]
    counts = np.bincount(curves.owner[kept[row]], minlength=len(curves))
    is_corner = is_vertex & curves.is_corner[kept[row]]
    return Curves(offsets_of(counts), curves.closed, face, start, end, is_vertex, is_corner, ground.points(face, start))


def _next(curves: Curves, vertex: Ints) -> Ints:
    """For each of these vertices the next one of the same curve."""
    following: Ints = vertex[
        next_along(offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves))), curves.closed)
    ]
    return following


def _chords(curves: Curves, vertex: Ints) -> tuple[Ints, Ints]:
    """For each segment the vertex with which its chord begins, and its rank in the chord."""
    n = len(curves.face)
    row = np.searchsorted(vertex, np.arange(n), side="right") - 1
    first = np.searchsorted(vertex, curves.offsets[:-1])
    last = np.searchsorted(vertex, curves.offsets[1:]) - 1
    # What comes before the first vertex of a curve belongs to the chord from its last one.
    row = np.where(row < first[curves.owner], last[curves.owner], row)
    chord = vertex[row]
    around = np.diff(curves.offsets)[curves.owner]
    return chord, (np.arange(n) - chord) % around
