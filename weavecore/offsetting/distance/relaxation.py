"""Settling what the rays found: vertices that a neighbour knows a shorter way to.

Around its vertex every direction has an angle, counted counter-clockwise from the first
outgoing halfedge.  A vertex knows the angle at which it sees its source; laid flat, the source
is seen by the vertices around as well, through the faces between.  Where that gives a
shorter distance than the one recorded, by more than what unfolding past a corner may err, it is
taken over; so are distances for vertices that no ray has reached.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.distance.rays import NO_HALFEDGE, Records, front_distance

STEEP = 1.1  # squared slope of a face from which on its corners are looked at again
LEAST_GAIN = 0.02  # mean edge lengths by which a neighbour must know better
ROUNDEST = 0.2  # bound of the curvature of a front that closes, per mean edge length
_MOST_ROUNDS = 500


def settle(frames: Unfolding, records: Records) -> Floats:
    """Improve the records, and give the direction (V, 3) of each path's arrival.

    Directions are unit vectors tangent to a face at the vertex, zero at sources.
    """
    gradient = _directions(frames, records)
    with np.errstate(all="ignore"):
        faces = _steep_faces(frames, records.distance)
        if len(faces):
            sight = _Sight(frames, records)
            changed = sight.improve((3 * faces[:, None] + np.arange(3)).ravel())
            gradient[changed] = sight.directions(changed)
    return gradient


def _directions(frames: Unfolding, records: Records) -> Floats:
    known = np.flatnonzero(records.halfedge != NO_HALFEDGE)
    gradient = np.zeros((len(frames.vertices), 3))
    gradient[known] = frames.directions(records.halfedge[known], records.ux[known], records.uy[known])
    return gradient


def _steep_faces(frames: Unfolding, distance: Floats) -> Ints:
    """Faces on which the distance rises faster than the way is long, or is not known."""
    start, end, apex = distance[frames.faces].T
    along = (end - start) / frames.length[0::3]
    up = (apex - start - along * frames.apex_x[0::3]) / frames.apex_y[0::3]
    return np.flatnonzero(~(along * along + up * up <= STEEP))


class _Sight:
    """What every vertex sees of its source, and how its neighbours see it through it."""

    def __init__(self, frames: Unfolding, records: Records) -> None:
        self.frames = frames
        self.distance = records.distance
        self.angle_of = _outgoing_angles(frames)
        self.source_angle = self._source_angles(records)
        self.curvature = self._curvatures()
        self._order = np.argsort(frames.tail, kind="stable")
        self._offsets = np.searchsorted(frames.tail[self._order], np.arange(len(frames.vertices) + 1))

    def _source_angles(self, records: Records) -> Floats:
        f = self.frames
        v = np.flatnonzero(records.halfedge != NO_HALFEDGE)
        h, x, y = records.halfedge[v], -records.ux[v], -records.uy[v]
        at_tail, at_head = f.tail[h] == v, f.head[h] == v
        out = np.select((at_tail, at_head), (h, f.next[h]), f.previous[h])
        cx = np.select((at_tail, at_head), (1.0, f.next_x[h]), f.previous_x[h])
        cy = np.select((at_tail, at_head), (0.0, f.next_y[h]), f.previous_y[h])
        angle = np.full(len(f.vertices), np.nan)
        angle[v] = self.angle_of[out] + np.arctan2(y * cx - x * cy, x * cx + y * cy)
        return angle

    def _curvatures(self) -> Floats:
        """Curvature of the front at each vertex: the Laplacian of the distance (cotangent weights)."""
        f, n = self.frames, len(self.distance)
        double_area = f.length * f.apex_y
        cotangent = (f.apex_x * (f.apex_x - f.length) + f.apex_y * f.apex_y) / double_area
        flow = cotangent * (self.distance[f.head] - self.distance[f.tail]) / 2
        total = np.bincount(f.tail, flow, n) - np.bincount(f.head, flow, n)
        curvature = total / np.bincount(f.tail, double_area / 6, n)
        curvature = np.where(np.isfinite(curvature), curvature, 0.0)
        clipped: Floats = np.clip(curvature, -ROUNDEST / f.mean_length, 1 / f.mean_length)
        return clipped

    def improve(self, halfedges: Ints) -> Ints:
        """Let tails tell heads along halfedges, then on from those that changed; returns all that did."""
        f = self.frames
        changed = np.zeros(len(self.distance), bool)
        for _ in range(_MOST_ROUNDS):
            fixed = f.on_wall[f.tail[halfedges]] | f.on_wall[f.head[halfedges]]
            h = halfedges[~fixed & np.isfinite(self.source_angle[f.tail[halfedges]])]
            better = self._tell(h)
            if len(better) == 0:
                break
            changed[better] = True
            count = self._offsets[better + 1] - self._offsets[better]
            shift = np.repeat(self._offsets[better] - (np.cumsum(count) - count), count)
            halfedges = self._order[shift + np.arange(count.sum())]
        self._walk_to_the_rest(changed)
        return np.flatnonzero(changed)

    def _tell(self, h: Ints) -> Ints:
        f = self.frames
        a, c, length = f.tail[h], f.head[h], f.length[h]
        turn = np.mod(self.angle_of[h] - self.source_angle[a], f.total_angle[a])
        by_right = turn <= f.total_angle[a] - turn  # counter-clockwise, so last through the face right of h
        turn = np.minimum(turn, f.total_angle[a] - turn)
        shadow = turn >= np.pi
        forward, lateral = -length * np.cos(turn), length * np.sin(turn)
        rise, ahead, aside = front_distance(self.curvature[a], forward, lateral)
        seen = np.arctan2(np.abs(forward * aside - lateral * ahead), forward * ahead + lateral * aside)
        seen[shadow] = 0.0
        offered = self.distance[a] + np.where(shadow, length, rise)
        offered, valid = self._through_edge(h, by_right, seen, shadow, offered)
        better = valid & (offered < self.distance[c] - LEAST_GAIN * f.mean_length[c])
        m = np.flatnonzero(better)
        np.minimum.at(self.distance, c[m], offered[m])
        m = m[offered[m] == self.distance[c[m]]]
        self.source_angle[c[m]] = self.angle_of[f.twin[h[m]]] + np.where(by_right[m], seen[m], -seen[m])
        bent = np.hypot(1 + self.curvature[a[m]] * forward[m], self.curvature[a[m]] * lateral[m])
        self.curvature[c[m]] = np.where(shadow[m], 1 / length[m], self.curvature[a[m]] / np.maximum(bent, 1e-9))
        return np.unique(c[m])

    def _through_edge(
        self, h: Ints, by_right: Bools, seen: Floats, shadow: Bools, offered: Floats
    ) -> tuple[Floats, Bools]:
        """Bound the offers by what is known where the path enters the last face, and drop those that miss it."""
        f, twin = self.frames, self.frames.twin[h]
        a, length = f.tail[h], f.length[h]
        corner = np.where(by_right, f.angle[f.next[twin]], f.angle[h])
        beside = np.where(by_right, f.length[f.next[twin]], f.length[f.previous[h]])
        b = np.where(by_right, f.apex[twin], f.apex[h])
        across = np.maximum(np.sin(corner + seen), 1e-12)
        place = length * np.sin(seen) / across
        straight_on = shadow | (seen < 1e-6)
        valid = straight_on | ((corner + seen < np.pi) & (place <= beside))
        part = np.clip(place / beside, 0, 1)
        there = self.distance[a] * (1 - part) + np.where(part > 0, self.distance[b] * part, 0.0)
        bound = there + length * np.sin(corner) / across
        return np.where(straight_on, offered, np.maximum(offered, bound)), valid

    def _walk_to_the_rest(self, changed: Bools) -> None:
        """Reach what is left along edges."""
        f = self.frames
        while True:
            to_new = np.isfinite(self.distance[f.tail]) & np.isinf(self.distance[f.head])
            h = np.flatnonzero(to_new)
            if len(h) == 0:
                return
            np.minimum.at(self.distance, f.head[h], self.distance[f.tail[h]] + f.length[h])
            h = h[self.distance[f.tail[h]] + f.length[h] == self.distance[f.head[h]]]
            inner = h[f.twin[h] != NO_TWIN]
            self.source_angle[f.head[inner]] = self.angle_of[f.twin[inner]]
            changed[f.head[inner]] = True

    def directions(self, vertex: Ints) -> Floats:
        """Unit vectors (n, 3) away from the sources that the vertices see; zero where they see none."""
        f = self.frames
        found = np.zeros((len(vertex), 3))
        sees = np.flatnonzero(np.isfinite(self.source_angle[vertex]))
        v = vertex[sees]
        first = self._order[self._offsets[v]]
        angle = np.mod(self.source_angle[v], f.total_angle[v])
        for _ in range(int(np.diff(self._offsets).max())):
            over = (angle >= self.angle_of[first] + f.angle[first]) | (angle < self.angle_of[first])
            if not over.any():
                break
            onward = f.twin[f.previous[first]]
            first = np.where(over & (onward != NO_TWIN), onward, first)
        angle = angle - self.angle_of[first]
        found[sees] = -f.directions(first, np.cos(angle), np.sin(angle))
        return found


def _outgoing_angles(frames: Unfolding) -> Floats:
    """Angle (3F,) of each halfedge around its tail, counter-clockwise from the first one there."""
    f = frames
    onward = f.twin[f.previous]
    first = np.full(len(f.vertices), -1)
    backwards = np.arange(len(f.tail))[::-1]
    first[f.tail[backwards]] = backwards
    walls = np.flatnonzero(f.twin == NO_TWIN)
    first[f.tail[walls]] = walls
    start = first[first >= 0]
    at, angle = start, np.zeros(len(start))
    angles = np.zeros(len(f.tail))
    while len(at):
        angles[at] = angle
        angle, at = angle + f.angle[at], onward[at]
        going = (at != NO_TWIN) & (at != start)
        at, angle, start = at[going], angle[going], start[going]
    return angles
