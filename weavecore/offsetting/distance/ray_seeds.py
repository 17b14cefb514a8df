r"""Where rays start: at right angles to the boundary halfedges, and in fans at the corners that open the front.

Boundary halfedges run with the surface on their left, so the offset direction is n × t (Yan et al. 2016, §4.1).
With Θ the angle of the surface at a corner between two of them, a corner of Θ ≤ π has no gap between the strips of rays
of its two edges; else the front is an arc of the angle Θ − π about the corner, and a fan of rays fills it::

        | | | | \  |  /              strip, fan of Θ − π, strip
        | | | |   \|/ __ __
        --------->--*  __ __          Θ > π: the surface lies above and to the right
                    |  __ __
                    v

Work: linear in the boundary halfedges and the rays, with log2 rounds of pointer doubling for their numbers.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, ranks_in_rows, rows_of
from weavecore.geometry.elementary import sines_and_cosines
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN, previous_halfedge
from weavecore.offsetting.distance.rays import GeodesicRays

SMOOTH, ROUGH = (0.002, 0.5), (0.006, 0.35)
"""Roughness of the surface (`Unfolding.roughness`), and the spacing of rays there in mean edge lengths nearby: on rough
surfaces rays see less, so they run closer together."""

LONG_EDGE = 2.0
"""In mean edge lengths nearby, or medians: a longer boundary edge is longer than the mesh behind it is fine."""

MAX_SEEDED_EDGES = 1000
"""Edges of median length along one boundary edge that rays are seeded for; bounds the rays of a very long edge."""

MIN_WEDGE = 0.02
"""Radians of a fan; a smaller wedge is left to the strips beside it."""

FAN_ANGLE = 0.1
"""Radians between the rays of a fan: half an edge apart five edges from the corner, where gaps are filled anyway."""

_OFF_CORNER = 1e-9  # of the edge: rays from a vertex start this far along it, so that they have an entry edge
_COUNT_SLACK = 0.999  # an edge of just a whole number of ray spacings gets that number, whatever the last bit says
_OVERLAP = 0.50005  # of the width between rays: pieces of the front overlap by a trifle, so that none is missed


def ray_spacing(frames: Unfolding) -> float:
    """Distance kept between rays, in mean edge lengths nearby.

    Parameters
    ----------
    frames : Unfolding

    Returns
    -------
    float
        Between those of `SMOOTH` and `ROUGH`, by the roughness.
    """
    at, spacing = zip(SMOOTH, ROUGH)
    return float(np.interp(frames.roughness, np.array(at), np.array(spacing)))


def seed_rays(frames: Unfolding) -> GeodesicRays:
    """Rays from all boundary halfedges, linked to their neighbours along the boundary.

    Parameters
    ----------
    frames : Unfolding

    Returns
    -------
    GeodesicRays
        At distance 0; strips first, then fans.
    """
    boundary = np.flatnonzero(frames.twin == NO_TWIN)
    corners = Corners(frames, boundary)
    rays, first, last = _strips(frames, boundary, corners.before)
    rays.links.after[last[corners.before]] = first
    wide = np.flatnonzero(corners.total > np.pi + MIN_WEDGE)
    if len(wide) == 0:
        return rays
    fans, begin, end = _fans(frames, boundary[wide], corners.total[wide])
    fans.links.after = len(rays) + 1 + np.arange(len(fans))
    fans.links.after[end] = first[wide]
    rays.links.after[last[corners.before[wide]]] = len(rays) + begin
    return rays.joined(fans)


class Corners:
    """Faces between two boundary halfedges, at the tail of each one.

    Attributes
    ----------
    total : (B,) their angle
    before : (B,) number of the boundary halfedge that ends there, along the same side
    """

    def __init__(self, frames: Unfolding, boundary: Ints) -> None:
        self.total = np.zeros(len(boundary))
        number = np.full(len(frames.twin), -1)
        number[boundary] = np.arange(len(boundary))
        incoming = np.zeros(len(boundary), np.int64)
        at, turning = boundary, np.arange(len(boundary))
        while len(turning):
            self.total[turning] += frames.angle[at]
            incoming[turning] = previous_halfedge(at)
            at = frames.twin[incoming[turning]]
            turning, at = turning[at != NO_TWIN], at[at != NO_TWIN]
        self.before = number[incoming]


def _strips(frames: Unfolding, boundary: Ints, before: Ints) -> tuple[GeodesicRays, Ints, Ints]:
    """Rays at right angles to boundary halfedges, with thinning priorities; and the first and last of each."""
    length = frames.length[boundary]
    nearby = _length_nearby(frames, boundary)
    count = np.maximum(1, np.ceil(length / (ray_spacing(frames) * nearby) * _COUNT_SLACK)).astype(np.int64)
    offsets, rank = offsets_of(count), ranks_in_rows(count)
    owner = rows_of(offsets)
    n, width = len(owner), (length / count)[owner]
    straight = np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n)  # direction, distance and curvature
    rays = GeodesicRays.starting(boundary[owner], (rank + 0.5) * width, *straight, width * _OVERLAP)
    rays.links.after = np.arange(1, n + 1)
    first_place = places_along(frames.vertices[frames.tail[boundary]], before, count)
    rays.links.priority = thinning_priority(first_place[owner] + rank)
    return rays, offsets[:-1], offsets[1:] - 1


def _length_nearby(frames: Unfolding, boundary: Ints) -> Floats:
    """Mean length of the edges that the rays of each boundary halfedge meet first.

    Refinement leaves long boundary edges whole, and fans of long edges lead from their ends: there the edges a step
    further in count, and the median of all (which is 1).
    """
    mean, a, b = frames.mean_length, frames.tail[boundary], frames.head[boundary]
    nearby: Floats = np.minimum(mean[a], mean[b])
    is_long = frames.length[boundary] > LONG_EDGE * np.minimum(nearby, 1.0)
    if is_long.any():
        least = mean.copy()
        np.minimum.at(least, frames.tail, mean[frames.head])
        np.minimum.at(least, frames.head, mean[frames.tail])
        median = np.maximum(1.0, frames.length[boundary] / MAX_SEEDED_EDGES)
        nearby[is_long] = np.minimum(median, np.minimum(least[a], least[b]))[is_long]
    return nearby


def _fans(frames: Unfolding, corner: Ints, total: Floats) -> tuple[GeodesicRays, Ints, Ints]:
    """Rays from corners that open the front, and the first and last of each.

    They run from the strip before to the strip after: clockwise seen from outside.
    """
    wedge = total - np.pi
    count = np.ceil(wedge / FAN_ANGLE).astype(np.int64)
    offsets, rank = offsets_of(count), ranks_in_rows(count)
    owner = rows_of(offsets)
    angle = total[owner] - np.pi / 2 - wedge[owner] * ((rank + 0.5) / count[owner])
    rays = rays_off_corner(frames, *find_sector(frames, corner[owner], angle))
    rays.links.priority = thinning_priority(1 + rank)
    return rays, offsets[:-1], offsets[1:] - 1


def rays_off_corner(frames: Unfolding, halfedge: Ints, angle: Floats) -> GeodesicRays:
    """Rays from the tails of halfedges, at distance 0.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
    angle : (n,) float64
        Of each ray to its halfedge, inside the face.

    Returns
    -------
    GeodesicRays
    """
    n = len(halfedge)
    start = _OFF_CORNER * frames.length[halfedge]
    wide = np.full(n, np.inf)
    sine, cosine = sines_and_cosines(angle)
    return GeodesicRays.starting(halfedge, start, cosine, sine, np.zeros(n), wide, wide.copy())


def find_sector(frames: Unfolding, halfedge: Ints, angle: Floats) -> tuple[Ints, Floats]:
    """Find the face at a vertex in which a direction lies.

    Parameters
    ----------
    frames : Unfolding
    halfedge : (n,) int64
        Outgoing halfedge from which the angle counts.
    angle : (n,) float64
        Counter-clockwise seen from outside.

    Returns
    -------
    halfedge : (n,) int64
        Outgoing halfedge of the face.
    angle : (n,) float64
        What is left of the angle, counted from there.
    """
    at, left = halfedge.copy(), angle.copy()
    active = np.flatnonzero(left >= frames.angle[at])
    while len(active):
        onward = frames.twin[previous_halfedge(at[active])]
        active, onward = active[onward != NO_TWIN], onward[onward != NO_TWIN]
        left[active] -= frames.angle[at[active]]
        at[active] = onward
        active = active[left[active] >= frames.angle[onward]]
    return at, np.minimum(left, frames.angle[at] * (1 - 1e-9))


# Thinning priorities do not depend on how the mesh is numbered: rays are counted from the point of a loop
# that is furthest from its centroid.

_AS_FAR = 1 - 1e-6
"""Points further from the centroid than this part of the furthest count as the furthest, against rounding."""

_ALWAYS_KEPT = 40
"""Priority of place 0, above that of any other ray: there are fewer than 2⁴⁰."""


def places_along(points: Floats, before: Ints, count: Ints) -> Ints:
    """Number the rays of each boundary loop, from the point furthest from the loop's centroid.

    Parameters
    ----------
    points : (B, 3) float64
        Where each boundary halfedge begins.
    before : (B,) int64
        The one before each around its loop.
    count : (B,) int64
        How many rays each has.

    Returns
    -------
    (B,) int64
        The number of each one's first ray.
    """
    loop, doublings = np.arange(len(before)), range(len(before).bit_length())
    jump = before
    for _ in doublings:
        loop, jump = np.minimum(loop, loop[jump]), jump[jump]
    start = _furthest_of_each(points, loop)
    jump, place = before.copy(), count[before]
    jump[start], place[start] = start, 0
    for _ in doublings:
        place, jump = place + place[jump], jump[jump]
    return place


def _furthest_of_each(points: Floats, loop: Ints) -> Ints:
    _, number = np.unique(loop, return_inverse=True)
    number = number.ravel()
    total = np.bincount(number)
    centroid = np.stack([np.bincount(number, weights=x) for x in points.T], axis=1) / total[:, None]
    far = np.linalg.norm(points - centroid[number], axis=1)
    furthest = np.zeros(len(total))
    np.maximum.at(furthest, number, far)
    candidates = np.flatnonzero(far >= _AS_FAR * furthest[number])
    _, first = np.unique(number[candidates], return_index=True)
    starts: Ints = candidates[first]
    return starts


def thinning_priority(place: Ints) -> Ints:
    """How often the number of a ray can be halved: 0 for every other ray, 1 for every fourth, and so on.

    Removing rays by rising priority leaves them evenly spread at every stage.

    Parameters
    ----------
    place : (n,) int64

    Returns
    -------
    (n,) int64
    """
    lowest = np.where(place > 0, place & -place, np.int64(1) << _ALWAYS_KEPT).astype(np.float64)
    return np.frexp(lowest)[1].astype(np.int64) - 1
