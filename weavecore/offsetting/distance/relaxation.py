r"""Source relaxation: vertices take over a shorter path that a neighbour knows.

Every vertex keeps the direction, as an angle among its outgoing halfedges, in which it sees its source, and the
curvature k of its front.  Laid flat about a vertex a, its source is also seen by a neighbour c across the last face of
the path (a, c, b)::

         source  *                        d_a       distance of a, along the line from the source
                  \  .                    length    |ac|
                   \    .                 turn      angle at a between the source and c
              d_a   \      .              corner    angle of the face at a
                     \        .           seen      angle at c between a and the source
                      a --------+-- b     place     |a+|, where the path enters the face
                       \ ) turn  /
               length   \       /         forward = −length cos(turn)     along the path through a,
                         \ seen           lateral =  length sin(turn)     and at right angles to it
                          \  /
                           c

    d_c  = d_a + |(1/k + forward, lateral)| − 1/k              the front at a is a circle of radius 1/k
    seen = angle between (forward, lateral) and the direction of the path at c
    k_c  = k / |(1 + k forward, k lateral)|                    the same circle seen from c
    |a+| = length sin(seen) / sin(corner + seen)               law of sines: at most |ab|, or the path misses the edge
    d_c >= d(+) + length sin(corner) / sin(corner + seen)      with d linear between a and b

Where turn ≥ π on both sides, c lies in the shadow of a: the path goes through a, d_c = d_a + length and k_c = 1/length.

This reconstructs a virtual source per update as Novotni and Klein do (*Computing geodesic distances on triangular
meshes*, WSCG 2002, §3), with the distance and angle of an arrival in place of the distances of two vertices; a saddle
is a pseudo-source as in Mitchell, Mount and Papadimitriou 1987.  Updates are label correcting: heads of halfedges whose
tails changed are tried again until nothing improves.  Work: linear in the updates; few faces need any.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, ranges
from weavecore.geometry.elementary import arctangents, sines_and_cosines
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN, next_halfedge, previous_halfedge
from weavecore.offsetting.distance.rays import NO_HALFEDGE, TentativeDistances, front_distance

MAX_SQUARED_SLOPE = 1.1
"""Squared slope of the distance on a face from which its corners are tried again: a distance has slope 1 at most, and
linear interpolation of a round front exceeds it by some percent."""

MIN_GAIN = 0.02
"""Mean edge lengths by which an update must be shorter: what unfolding past a corner may err, and what keeps the
updates finite, since each lowers a distance by at least this."""

MAX_CONVERGENCE = 0.2
"""Bound of the curvature of a front that converges, per mean edge length: the estimate is noisy near ridges, and a
centre nearer than five edges ahead would be passed."""

_MAX_ROUNDS = 500  # never reached but by a mesh with paths of more than 500 corrected vertices
_ALONG_EDGE = 1e-6  # radians: a path that arrives along the edge itself has no face to enter
_LEAST_SINE = 1e-12
_LEAST_STRETCH = 1e-9


def relax_sources(frames: Unfolding, tentative: TentativeDistances) -> Floats:
    """Shorten distances through neighbours, in place, and reach the vertices that no ray has reached.

    Parameters
    ----------
    frames : Unfolding
    tentative : TentativeDistances
        Its distances are changed.

    Returns
    -------
    (V, 3) float64
        Direction in which each path arrives: unit vectors tangent to a face at the vertex, zero at sources.
    """
    gradient = np.zeros((len(frames.vertices), 3))
    known = np.flatnonzero(tentative.halfedge != NO_HALFEDGE)
    for k in blocks(len(known)):
        v = known[k]
        gradient[v] = frames.directions(tentative.halfedge[v], tentative.ux[v], tentative.uy[v])
    faces = _steep_faces(frames, tentative.distance)
    if len(faces):
        relaxation = _Relaxation(frames, tentative)
        changed = relaxation.run((3 * faces[:, None] + np.arange(3)).ravel())
        gradient[changed] = relaxation.directions(changed)
    return gradient


def _steep_faces(frames: Unfolding, distance: Floats) -> Ints:
    """Faces on which the distance rises faster than the way is long, or is not known."""
    is_steep = np.zeros(len(frames.faces), bool)
    for k in blocks(len(is_steep)):
        start, end, apex = distance[frames.faces[k]].T
        first = slice(3 * k.start, 3 * k.stop, 3)
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # unreached corners, flat faces: no number
            along = (end - start) / frames.length[first]
            up = (apex - start - along * frames.apex_x[first]) / frames.apex_y[first]
            is_steep[k] = ~(along * along + up * up <= MAX_SQUARED_SLOPE)
    return np.flatnonzero(is_steep)


def front_curvature(frames: Unfolding, distance: Floats) -> Floats:
    """Curvature of the front at each vertex: the Laplacian of a distance is the curvature of its level sets.

    With cotangent weights and a third of the area of its faces for each vertex (Meyer, Desbrun, Schröder and Barr 2003,
    §3); bounded by `MAX_CONVERGENCE` below and one over the mean edge length above.

    Parameters
    ----------
    frames : Unfolding
    distance : (V,) float64
        Infinite where unknown; the curvature is 0 beside such vertices.

    Returns
    -------
    (V,) float64
    """
    n, flow = len(distance), np.empty(len(frames.tail))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # flat faces and unreached vertices: 0 below
        for k in blocks(len(flow)):
            length, apex_x, apex_y = frames.length[k], frames.apex_x[k], frames.apex_y[k]
            across = apex_x * (apex_x - length) + apex_y * apex_y
            flow[k] = across / (length * apex_y) * (distance[frames.head[k]] - distance[frames.tail[k]]) / 2
        total = np.bincount(frames.tail, flow, n) - np.bincount(frames.head, flow, n)
        sixth = np.multiply(frames.length, frames.apex_y, out=flow)
        sixth /= 6
        curvature = total / np.bincount(frames.tail, sixth, n)
    curvature = np.where(np.isfinite(curvature), curvature, 0.0)
    bounded: Floats = np.clip(curvature, -MAX_CONVERGENCE / frames.mean_length, 1 / frames.mean_length)
    return bounded


class _Relaxation:
    """Distance, direction to the source and curvature of the front at every vertex, while they are corrected."""

    def __init__(self, frames: Unfolding, tentative: TentativeDistances) -> None:
        self.frames = frames
        self.distance = tentative.distance
        self.angle_of = _outgoing_angles(frames)
        self.source_angle = self._source_angles(tentative)
        self.curvature = front_curvature(frames, tentative.distance)
        self._order, self._offsets = frames.outgoing

    def _source_angles(self, tentative: TentativeDistances) -> Floats:
        """Angle of the direction back along each arrival; not a number where there is none."""
        f = self.frames
        v = np.flatnonzero(tentative.halfedge != NO_HALFEDGE)
        h, x, y = tentative.halfedge[v], -tentative.ux[v], -tentative.uy[v]
        at_tail, at_head = f.tail[h] == v, f.head[h] == v
        out = np.select((at_tail, at_head), (h, next_halfedge(h)), previous_halfedge(h))
        (next_x, next_y), (previous_x, previous_y) = f.next_direction(h), f.previous_direction(h)
        cx = np.select((at_tail, at_head), (1.0, next_x), previous_x)
        cy = np.select((at_tail, at_head), (0.0, next_y), previous_y)
        angle = np.full(len(f.vertices), np.nan)
        angle[v] = self.angle_of[out] + arctangents(y * cx - x * cy, x * cx + y * cy)
        return angle

    def run(self, halfedges: Ints) -> Ints:
        """Relax along halfedges, then on from the vertices that changed; gives all that did."""
        f = self.frames
        changed = np.zeros(len(self.distance), bool)
        for _ in range(_MAX_ROUNDS):
            fixed = f.on_boundary[f.tail[halfedges]] | f.on_boundary[f.head[halfedges]]
            h = halfedges[~fixed & np.isfinite(self.source_angle[f.tail[halfedges]])]
            better = self._relax(h)
            if len(better) == 0:
                break
            changed[better] = True
            halfedges = self._leaving(better)
        self._reach_the_rest(changed)
        return np.flatnonzero(changed)

    def _relax(self, h: Ints) -> Ints:
        """Offer the head of each halfedge the path that its tail knows; the heads that took one (see the figure)."""
        f = self.frames
        a, c, length = f.tail[h], f.head[h], f.length[h]
        turn = np.mod(self.angle_of[h] - self.source_angle[a], f.total_angle[a])
        by_right = turn <= f.total_angle[a] - turn  # the source lies clockwise: the last face is the one right of h
        turn = np.minimum(turn, f.total_angle[a] - turn)
        in_shadow = turn >= np.pi
        sine, cosine = sines_and_cosines(turn)
        forward, lateral = -length * cosine, length * sine
        rise, ahead, aside = front_distance(self.curvature[a], forward, lateral)
        seen = arctangents(np.abs(forward * aside - lateral * ahead), forward * ahead + lateral * aside)
        seen[in_shadow] = 0.0
        offered = self.distance[a] + np.where(in_shadow, length, rise)
        offered, enters = self._through_last_face(h, by_right, seen, in_shadow, offered)
        m = np.flatnonzero(enters & (offered < self.distance[c] - MIN_GAIN * f.mean_length[c]))
        np.minimum.at(self.distance, c[m], offered[m])
        m = m[offered[m] == self.distance[c[m]]]
        self.source_angle[c[m]] = self.angle_of[f.twin[h[m]]] + np.where(by_right[m], seen[m], -seen[m])
        k = self.curvature[a[m]]
        stretch = np.sqrt((1 + k * forward[m]) ** 2 + (k * lateral[m]) ** 2)
        self.curvature[c[m]] = np.where(in_shadow[m], 1 / length[m], k / np.maximum(stretch, _LEAST_STRETCH))
        return np.unique(c[m])

    def _through_last_face(
        self, h: Ints, by_right: Bools, seen: Floats, in_shadow: Bools, offered: Floats
    ) -> tuple[Floats, Bools]:
        """Bound offers from below by the distance at which the path enters its last face; and whether it enters it."""
        f, twin = self.frames, self.frames.twin[h]
        a, length = f.tail[h], f.length[h]
        corner = np.where(by_right, f.angle[next_halfedge(twin)], f.angle[h])
        beside = np.where(by_right, f.length[next_halfedge(twin)], f.length[previous_halfedge(h)])
        b = np.where(by_right, f.apex[twin], f.apex[h])
        sine = np.maximum(sines_and_cosines(corner + seen)[0], _LEAST_SINE)
        place = length * sines_and_cosines(seen)[0] / sine
        along_edge = in_shadow | (seen < _ALONG_EDGE)
        enters = along_edge | ((corner + seen < np.pi) & (place <= beside))
        part = np.clip(place / beside, 0, 1)
        with np.errstate(invalid="ignore"):  # an unreached b, with part 0: not taken
            entry = self.distance[a] * (1 - part) + np.where(part > 0, self.distance[b] * part, 0.0)
        bound = entry + length * sines_and_cosines(corner)[0] / sine
        return np.where(along_edge, offered, np.maximum(offered, bound)), enters

    def _leaving(self, vertex: Ints) -> Ints:
        """The halfedges that leave vertices."""
        start = self._offsets[vertex]
        halfedges: Ints = self._order[ranges(start, self._offsets[vertex + 1] - start)]
        return halfedges

    def _reach_the_rest(self, changed: Bools) -> None:
        """Reach what is left along edges."""
        f = self.frames
        h = np.arange(len(f.tail)) if np.isinf(self.distance).any() else np.zeros(0, np.int64)
        while True:
            h = h[np.isfinite(self.distance[f.tail[h]]) & np.isinf(self.distance[f.head[h]])]
            if len(h) == 0:
                return
            np.minimum.at(self.distance, f.head[h], self.distance[f.tail[h]] + f.length[h])
            h = h[self.distance[f.tail[h]] + f.length[h] == self.distance[f.head[h]]]
            inner = h[f.twin[h] != NO_TWIN]
            self.source_angle[f.head[inner]] = self.angle_of[f.twin[inner]]
            changed[f.head[inner]] = True
            h = np.sort(self._leaving(np.unique(f.head[h])))

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
            onward = f.twin[previous_halfedge(first)]
            first = np.where(over & (onward != NO_TWIN), onward, first)
        angle = angle - self.angle_of[first]
        found[sees] = -f.directions(first, *sines_and_cosines(angle)[::-1])
        return found


def _outgoing_angles(frames: Unfolding) -> Floats:
    """Angle (3F,) of each halfedge around its tail, counter-clockwise from the first one there."""
    f = frames
    order, offsets = f.outgoing
    first = np.full(len(f.vertices), NO_HALFEDGE)
    is_used = offsets[1:] > offsets[:-1]
    first[is_used] = order[offsets[:-1][is_used]]
    boundary = np.flatnonzero(f.twin == NO_TWIN)
    first[f.tail[boundary]] = boundary
    start = first[first >= 0]
    at, angle = start, np.zeros(len(start))
    angles = np.zeros(len(f.tail))
    while len(at):
        angles[at] = angle
        angle, at = angle + f.angle[at], f.twin[previous_halfedge(at)]
        going = (at != NO_TWIN) & (at != start)
        at, angle, start = at[going], angle[going], start[going]
    return angles
