"""Chord embedding: straight segments between places on the surface, cut at every edge that they cross (§4.2).

A chord is the section of the mesh by the plane that holds both its ends a, b and the mean normal of their faces::

        side(v) = ((b - a) × n) · (v - a)

It crosses the edges whose ends lie on different sides; all chords advance together, one face at a time.  So a child
is a curve on the surface, and whether two of them cross can be asked face by face.  Where the section does not come to
b (a border is in the way, or the mesh is as rough as its edges are long) the chord follows the shortest path from
face to face, by A* (Hart, Nilsson and Raphael 1968).

The time is linear in the faces crossed.  `remove_folds` leaves out vertices at which a child folds over itself.
"""

from __future__ import annotations

import heapq

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.geodesics import on_halfedge
from weavecore.geometry.halfedges import NO_TWIN, next_halfedge, previous_halfedge
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves, next_along

_MOST_FACES = 200
"""Faces that a section may cross: a chord spans a gap between rays, a few faces; others go the wrong way."""

_OFF_THE_CORNER = 1e-4
"""Parts of an edge: a chord crosses it no nearer to its ends, so that no crossing falls on a vertex."""

_OFF_THE_ROUTE = 0.02
"""The same where a chord follows a path from face to face: there it goes around corners, clear of their vertices."""

_MOST_DETOUR = 2.0
"""Lengths of the straight line: a section that is longer leads around the surface the wrong way."""

_Row = tuple[Ints, Ints, Floats, Floats]
"""Segments of chords: the chord of each, its face, and both its ends in barycentric coordinates."""


def embed_chords(domain: Domain, from_face: Ints, from_: Floats, to_face: Ints, to: Floats) -> _Row:
    """Embed the chords between pairs of places.

    Parameters
    ----------
    domain : Domain
    from_face, to_face : (n,) int64
    from_, to : (n, 3) float64
        Barycentric coordinates of both ends in their faces.

    Returns
    -------
    chord : (m,) int64
        The chord of each segment, rising.
    face : (m,) int64
    start, end : (m, 3) float64
        Barycentric coordinates of both ends of the segment in its face.
    """
    chords = np.arange(len(from_face))
    same = from_face == to_face
    rows: list[_Row] = [(chords[same], from_face[same], from_[same], to[same])]
    far = np.flatnonzero(~same)
    a, b = domain.points(from_face[far], from_[far]), domain.points(to_face[far], to[far])
    section = _NormalSections(domain, a, b, domain.normals[from_face[far]] + domain.normals[to_face[far]])
    local, found = section.walk(from_face[far], from_[far], to_face[far], to[far])
    rows += [(far[row[0]], *row[1:]) for row in local]
    for lost in np.flatnonzero(~found).tolist():
        route = _find_route(domain, int(from_face[far[lost]]), int(to_face[far[lost]]))
        rows.append(_follow_route(domain, far[lost], route, a[lost], b[lost], from_[far[lost]], to[far[lost]]))
    chord, face, start, end = (np.concatenate(column) for column in zip(*rows))
    order = np.argsort(chord, kind="stable")
    return chord[order], face[order], start[order], end[order]


def measure_chords(domain: Domain, from_face: Ints, from_: Floats, to_face: Ints, to: Floats) -> Floats:
    """Lengths of chords on the mesh: upper bounds of the geodesic distances.

    Parameters
    ----------
    domain : Domain
    from_face, to_face : (n,) int64
    from_, to : (n, 3) float64
        Barycentric coordinates of both ends in their faces.

    Returns
    -------
    (n,) float64
        Infinite where a section does not arrive.
    """
    a, b = domain.points(from_face, from_), domain.points(to_face, to)
    length = np.linalg.norm(b - a, axis=1)
    far = np.flatnonzero(from_face != to_face)
    section = _NormalSections(domain, a[far], b[far], domain.normals[from_face[far]] + domain.normals[to_face[far]])
    rows, found = section.walk(from_face[far], from_[far], to_face[far], to[far])
    length[far] = np.where(found, section.lengths(rows), np.inf)
    return np.asarray(length)


class _NormalSections:
    """Sections of the mesh by planes through pairs of points, upright on the surface between them.

    Parameters
    ----------
    domain : Domain
    a, b : (n, 3) float64
    up : (n, 3) float64
        Sum of the normals at both.
    """

    def __init__(self, domain: Domain, a: Floats, b: Floats, up: Floats) -> None:
        self.domain, self.a, self.along = domain, a, b - a
        self.normal = np.cross(self.along, up)

    def walk(self, face: Ints, start: Floats, last_face: Ints, last: Floats) -> tuple[list[_Row], Bools]:
        """Segments of the sections that arrive by a way not much longer than the straight line, and which do."""
        rows: list[_Row] = []
        found = np.zeros(len(face), bool)
        chord, at, here = np.arange(len(face)), face, start
        exit_, goes = self._first_exits(chord, face)
        chord, at, here, exit_ = chord[goes], at[goes], here[goes], exit_[goes]
        for _ in range(_MOST_FACES):
            if len(chord) == 0:
                break
            part = self._crossing_parts(chord, exit_)
            rows.append((chord, at, here, on_halfedge(exit_, part)))
            twin = self.domain.twins[exit_]
            goes = twin != NO_TWIN
            chord, twin, part = chord[goes], twin[goes], 1.0 - part[goes]
            at, here = twin // 3, on_halfedge(twin, part)
            arrives = at == last_face[chord]
            found[chord[arrives]] = True
            rows.append((chord[arrives], at[arrives], here[arrives], last[chord[arrives]]))
            chord, at, here, twin = chord[~arrives], at[~arrives], here[~arrives], twin[~arrives]
            tail_side = self._sides(chord, self.domain.faces.ravel()[twin]) >= 0
            apex_side = self._sides(chord, self.domain.faces.ravel()[previous_halfedge(twin)]) >= 0
            exit_ = np.where(tail_side == apex_side, next_halfedge(twin), previous_halfedge(twin))
        found &= self.lengths(rows) < _MOST_DETOUR * np.linalg.norm(self.along, axis=1)
        return [(c[found[c]], f[found[c]], s[found[c]], e[found[c]]) for c, f, s, e in rows], found

    def lengths(self, rows: list[_Row]) -> Floats:
        """Length of each section along its segments."""
        total = np.zeros(len(self.a))
        for chord, face, start, end in rows:
            total[chord] += np.linalg.norm(self.domain.points(face, end - start), axis=1)
        return total

    def _sides(self, chord: Ints, vertex: Ints) -> Floats:
        """How far vertices (k,) lie to one side of the planes of chords (k,), times the length of the normals."""
        away = self.domain.vertices[vertex] - self.a[chord]
        return np.asarray(np.einsum("ij,ij->i", away, self.normal[chord]))

    def _first_exits(self, chord: Ints, face: Ints) -> tuple[Ints, Bools]:
        """The halfedge by which each chord leaves the face that it starts in, and whether there is one."""
        best, forward = np.full(len(face), NO_TWIN), np.full(len(face), -np.inf)
        corners = self.domain.faces[face]
        for k in range(3):
            tail, head = corners[:, k], corners[:, (k + 1) % 3]
            s, t = self._sides(chord, tail), self._sides(chord, head)
            crosses = (s >= 0) != (t >= 0)
            part = np.divide(s, s - t, out=np.zeros(len(s)), where=crosses)[:, None]
            place = self.domain.vertices[tail] * (1 - part) + self.domain.vertices[head] * part
            onward = np.einsum("ij,ij->i", place - self.a[chord], self.along[chord])
            better = crosses & (onward > forward)
            best[better], forward[better] = 3 * face[better] + k, onward[better]
        return best, best != NO_TWIN

    def _crossing_parts(self, chord: Ints, halfedge: Ints) -> Floats:
        """Where chords (k,) cross halfedges (k,), in 0 to 1."""
        corners = self.domain.faces.ravel()
        s = self._sides(chord, corners[halfedge])
        t = self._sides(chord, corners[next_halfedge(halfedge)])
        part = np.divide(s, s - t, out=np.full(len(s), 0.5), where=s != t)
        return _keep_off_ends(part, _OFF_THE_CORNER)


def _keep_off_ends(part: Floats, least: float) -> Floats:
    """Parts of edges moved to between least and 1 - least; different ones stay different, and in their order."""
    low = least / (1.0 + np.maximum(least - part, 0.0) / least)
    high = 1.0 - least / (1.0 + np.maximum(part - 1.0 + least, 0.0) / least)
    return np.asarray(np.where(part < least, low, np.where(part > 1.0 - least, high, part)))


def _find_route(domain: Domain, start: int, goal: int) -> list[int]:
    """Halfedges by which faces are left on the shortest path, from centroid to centroid, between two faces."""
    centres, twins, target = domain.vertices[domain.faces], domain.twins, domain.vertices[domain.faces[goal]].mean(0)
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


def _follow_route(
    domain: Domain, chord: int, route: list[int], a: Floats, b: Floats, from_: Floats, to: Floats
) -> _Row:
    """Segments of a chord that crosses the halfedges of a route, each as near to the line ab as it can."""
    h = np.array(route, np.int64)
    corners = domain.faces.ravel()
    tail, head = domain.vertices[corners[h]], domain.vertices[corners[next_halfedge(h)]]
    up = domain.normals[h // 3] + domain.normals[domain.twins[h] // 3]
    normal = np.cross(b - a, up)
    s, t = np.einsum("ij,ij->i", tail - a, normal), np.einsum("ij,ij->i", head - a, normal)
    part = _keep_off_ends(np.divide(s, s - t, out=np.full(len(s), 0.5), where=s != t), _OFF_THE_ROUTE)
    leave, enter = on_halfedge(h, part), on_halfedge(domain.twins[h], 1.0 - part)
    face = np.concatenate([h // 3, domain.twins[h[-1:]] // 3])
    start, end = np.concatenate([from_[None], enter]), np.concatenate([leave, to[None]])
    return np.full(len(face), chord), face, start, end


# ----------------------------------------------------------------------
# Folds: where a child turns back over itself without crossing itself.
#
# On a rough surface the ends of two neighbouring rays may change places.  The child then runs forth, back and forth
# again, with one sharp turn to each side.  A front that diverges never turns right so sharply, for it has a fan there:
# the vertices that do are left out.

SHARPEST_FAN = 1.0
"""Radians: a child that turns right by more has folded.  A fan's vertices turn by `FAN_ANGLE`, a tenth of that."""

FEWEST_VERTICES = 4
"""A polyline keeps at least so many vertices: three enclose something, and one more may go."""

_MOST_ROUNDS = 5
"""Rounds of leaving vertices out: each shortens the folds of the one before."""


def remove_folds(domain: Domain, curves: SurfaceCurves) -> SurfaceCurves:
    """The curves without the vertices at which they fold, and with new chords across these.

    Parameters
    ----------
    domain : Domain
    curves : SurfaceCurves

    Returns
    -------
    SurfaceCurves
        The same object where nothing folds.
    """
    vertex = np.flatnonzero(curves.is_vertex)
    kept = vertex
    for _ in range(_MOST_ROUNDS):
        counts = np.bincount(curves.owner[kept], minlength=len(curves))
        turn, _ = measure_turns(domain, curves.face[kept], curves.points[kept], offsets_of(counts), curves.closed)
        folds = (turn < -SHARPEST_FAN) & (counts[curves.owner[kept]] > FEWEST_VERTICES)
        if not folds.any():
            break
        kept = kept[~folds]
    return curves if len(kept) == len(vertex) else _join_vertices(domain, curves, vertex, kept)


def measure_turns(domain: Domain, face: Ints, points: Floats, offsets: Ints, closed: Bools) -> tuple[Floats, Floats]:
    """Turning angles of polylines, each in the plane of the vertex's face.

    Parameters
    ----------
    domain : Domain
    face : (n,) int64
    points : (n, 3) float64
        The vertices, polyline after polyline.
    offsets : (C+1,) int64
    closed : (C,) bool

    Returns
    -------
    turn : (n,) float64
        Radians to the left; 0 at the ends of open polylines.
    heading : (n,) float64
        Direction of the segment before, in the frame of the face's first halfedge, in radians.
    """
    after = next_along(offsets, closed)
    before = np.arange(len(after))
    onward = after != before
    before[after[onward]] = np.flatnonzero(onward)
    ax, ay = domain.plane_directions(face, points - points[before])
    bx, by = domain.plane_directions(face, points[after] - points)
    first, last = before == np.arange(len(after)), ~onward
    ax[first], ay[first] = bx[first], by[first]
    bx[last], by[last] = ax[last], ay[last]
    return np.arctan2(ax * by - ay * bx, ax * bx + ay * by), np.arctan2(ay, ax)


def _join_vertices(domain: Domain, curves: SurfaceCurves, vertex: Ints, kept: Ints) -> SurfaceCurves:
    """The curves through some of their vertices: old chords where both ends stay, new ones elsewhere."""
    next_vertex = _next_vertices(curves, vertex)
    next_kept = _next_vertices(curves, kept)
    stays = next_kept == next_vertex[np.searchsorted(vertex, kept)]
    chord, rank = _find_chords(curves, vertex)
    place = np.full(len(curves.face), -1)
    place[kept[stays]] = np.flatnonzero(stays)
    old = np.flatnonzero(place[chord] >= 0)
    at, to = kept[~stays], next_kept[~stays]
    new, face, start, end = embed_chords(domain, curves.face[at], curves.start[at], curves.face[to], curves.start[to])
    row = np.concatenate([place[chord[old]], np.flatnonzero(~stays)[new]])
    order = np.lexsort((np.concatenate([rank[old], np.arange(len(new))]), row))
    face = np.concatenate([curves.face[old], face])[order]
    start = np.concatenate([curves.start[old], start])[order]
    end = np.concatenate([curves.end[old], end])[order]
    row = row[order]
    is_vertex = np.ones(len(row), bool)
    is_vertex[1:] = row[1:] != row[:-1]
    return SurfaceCurves(
        offsets=offsets_of(np.bincount(curves.owner[kept[row]], minlength=len(curves))),
        closed=curves.closed,
        face=face,
        start=start,
        end=end,
        is_vertex=is_vertex,
        is_corner=is_vertex & curves.is_corner[kept[row]],
        points=domain.points(face, start),
    )


def _next_vertices(curves: SurfaceCurves, vertex: Ints) -> Ints:
    """For each of these vertices (n,) the next one of the same curve."""
    offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
    following: Ints = vertex[next_along(offsets, curves.closed)]
    return following


def _find_chords(curves: SurfaceCurves, vertex: Ints) -> tuple[Ints, Ints]:
    """For each segment (m,) the vertex with which its chord begins, and its rank in the chord."""
    n = len(curves.face)
    row = np.searchsorted(vertex, np.arange(n), side="right") - 1
    first = np.searchsorted(vertex, curves.offsets[:-1])
    last = np.searchsorted(vertex, curves.offsets[1:]) - 1
    # What comes before the first vertex of a curve belongs to the chord from its last one.
    row = np.where(row < first[curves.owner], last[curves.owner], row)
    chord = vertex[row]
    around = np.diff(curves.offsets)[curves.owner]
    return chord, (np.arange(n) - chord) % around
