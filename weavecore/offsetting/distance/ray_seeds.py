"""Where rays start: strips beside the borders' edges, and fans at their turns.

The borders run with the surface on their left, so the offset direction is n x t (Yan et al.
2016, §4.1).  Where a border turns away from the surface the front opens: a fan of rays fills the
wedge between the strips of the two edges.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.distance.rays import Rays

SMOOTH, ROUGH = (0.002, 0.5), (0.006, 0.35)  # roughness, and the ray spacing there in mean edge lengths nearby
LONG_WALL = 2.0  # of that length, or of the median: such an edge of a wall is longer than the mesh behind it is fine
MOST_EDGES = 1000  # edges of median length along one edge of a wall that rays are seeded for
LEAST_WEDGE = 0.02  # radians; a smaller one is left to the strips beside it
FAN_ANGLE = 0.1  # radians between the rays of a fan
_OFF_THE_CORNER = 1e-9  # of the edge: rays from a vertex start this far along an edge


def ray_spacing(frames: Unfolding) -> float:
    """How far apart rays are kept, in mean edge lengths nearby: on rough surfaces nearer than on smooth ones."""
    at, spacing = zip(SMOOTH, ROUGH)
    return float(np.interp(frames.roughness, np.array(at), np.array(spacing)))


def seed_rays(frames: Unfolding) -> Rays:
    """Rays from all walls, linked to their neighbours along them."""
    wall = np.flatnonzero(frames.twin == NO_TWIN)
    corners = Corners(frames, wall)
    rays, first, last = _strips(frames, wall, corners.before)
    rays.after[last[corners.before]] = first
    wide = np.flatnonzero(corners.total > np.pi + LEAST_WEDGE)
    if len(wide) == 0:
        return rays
    fans, begin, end = _fans(frames, wall[wide], corners.total[wide])
    fans.after = len(rays) + 1 + np.arange(len(fans))
    fans.after[end] = first[wide]
    rays.after[last[corners.before[wide]]] = len(rays) + begin
    return rays.joined(fans)


class Corners:
    """The faces between two walls at the tail of each wall halfedge.

    Attributes
    ----------
    total : (W,) their angle
    before : (W,) number of the wall halfedge that ends there, along the same side of the wall
    """

    def __init__(self, frames: Unfolding, wall: Ints) -> None:
        self.total = np.zeros(len(wall))
        number = np.full(len(frames.twin), -1)
        number[wall] = np.arange(len(wall))
        incoming = np.zeros(len(wall), np.int64)
        at, open_ = wall, np.arange(len(wall))
        while len(open_):
            self.total[open_] += frames.angle[at]
            incoming[open_] = frames.previous[at]
            at = frames.twin[frames.previous[at]]
            open_, at = open_[at != NO_TWIN], at[at != NO_TWIN]
        self.before = number[incoming]


def _strips(frames: Unfolding, wall: Ints, before: Ints) -> tuple[Rays, Ints, Ints]:
    """Rays at right angles to the wall halfedges, graded around their loops, and the first and last of each."""
    length = frames.length[wall]
    nearby = _length_nearby(frames, wall)
    count = np.maximum(1, np.ceil(length / (ray_spacing(frames) * nearby) * 0.999)).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    n, width = len(owner), (length / count)[owner]
    place = (np.arange(n) - offsets[:-1][owner] + 0.5) * width
    rays = Rays.starting(wall[owner], place, np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n), width * 0.50005)
    rays.after = np.arange(1, n + 1)
    first_place = places_along(frames.vertices[frames.tail[wall]], before, count)
    rays.grade = grade_of(first_place[owner] + np.arange(n) - offsets[:-1][owner])
    return rays, offsets[:-1], offsets[1:] - 1


def _length_nearby(frames: Unfolding, wall: Ints) -> Floats:
    """Mean length of the edges that the rays of each wall halfedge will meet first.

    Where a mesh was refined, long edges of the wall were not, and fans of long edges lead from
    their ends: there the edges a step further in are what counts, and the median of all (which
    is 1).
    """
    mean, a, b = frames.mean_length, frames.tail[wall], frames.head[wall]
    nearby: Floats = np.minimum(mean[a], mean[b])
    long_ = frames.length[wall] > LONG_WALL * np.minimum(nearby, 1.0)
    if long_.any():
        least = mean.copy()
        np.minimum.at(least, frames.tail, mean[frames.head])
        np.minimum.at(least, frames.head, mean[frames.tail])
        median = np.maximum(1.0, frames.length[wall] / MOST_EDGES)
        nearby[long_] = np.minimum(median, np.minimum(least[a], least[b]))[long_]
    return nearby


def _fans(frames: Unfolding, corner: Ints, total: Floats) -> tuple[Rays, Ints, Ints]:
    """Rays from corners that open the front, and the first and last of each.

    They run from the strip before to the strip after: clockwise seen from outside.
    """
    wedge = total - np.pi
    count = np.ceil(wedge / FAN_ANGLE).astype(np.int64)
    offsets = offsets_of(count)
    owner = rows_of(offsets)
    part = (np.arange(len(owner)) - offsets[:-1][owner] + 0.5) / count[owner]
    angle = total[owner] - np.pi / 2 - wedge[owner] * part
    rays = start_off_corner(frames, *find_sector(frames, corner[owner], angle))
    rays.grade = grade_of(1 + np.arange(len(owner)) - offsets[:-1][owner])
    return rays, offsets[:-1], offsets[1:] - 1


def start_off_corner(frames: Unfolding, halfedge: Ints, angle: Floats) -> Rays:
    """Rays from the tails of halfedges, at angles to them."""
    n = len(halfedge)
    start = _OFF_THE_CORNER * frames.length[halfedge]
    wide = np.full(n, np.inf)
    return Rays.starting(halfedge, start, np.cos(angle), np.sin(angle), np.zeros(n), wide, wide.copy())


def find_sector(frames: Unfolding, halfedge: Ints, angle: Floats) -> tuple[Ints, Floats]:
    """The outgoing halfedge whose face holds a direction, and the angle that is left in it.

    ``angle`` counts counter-clockwise from the given outgoing halfedges.
    """
    at, left = halfedge.copy(), angle.copy()
    active = np.flatnonzero(left >= frames.angle[at])
    while len(active):
        onward = frames.twin[frames.previous[at[active]]]
        active, onward = active[onward != NO_TWIN], onward[onward != NO_TWIN]
        left[active] -= frames.angle[at[active]]
        at[active] = onward
        active = active[left[active] >= frames.angle[onward]]
    return at, np.minimum(left, frames.angle[at] * (1 - 1e-9))


# ----------------------------------------------------------------------
# An order among the rays of a wall that does not hang on how the mesh is numbered.

_AS_FAR = 1 - 1e-6
"""Points that are further from the middle than this part of the furthest count as the furthest."""


def places_along(points: Floats, before: Ints, count: Ints) -> Ints:
    """Number the rays of each loop of wall halfedges, from the point that is furthest from the loop's middle.

    Parameters
    ----------
    points : (W, 3) float64
        Where each wall halfedge begins.
    before : (W,) int64
        The wall halfedge before each around its loop.
    count : (W,) int64
        How many rays each has.

    Returns
    -------
    (W,) int64
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
    middle = np.stack([np.bincount(number, weights=x) for x in points.T], axis=1) / total[:, None]
    far = np.linalg.norm(points - middle[number], axis=1)
    furthest = np.zeros(len(total))
    np.maximum.at(furthest, number, far)
    candidates = np.flatnonzero(far >= _AS_FAR * furthest[number])
    _, first = np.unique(number[candidates], return_index=True)
    starts: Ints = candidates[first]
    return starts


def grade_of(place: Ints) -> Ints:
    """How often a place can be halved: every other one has grade 0, every fourth more than 1, and so on."""
    grades: Ints = np.log2(np.where(place > 0, place & -place, np.int64(1) << 40)).astype(np.int64)
    return grades
