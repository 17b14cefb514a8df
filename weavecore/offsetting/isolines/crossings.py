r"""Tracing of level sets: where levels cross edges, how crossings join into polylines, and where on an edge they lie.

A *crossing* is where one level meets one edge.  It belongs to the edge's *descending* halfedge, from the deeper to
the shallower end.  A polyline runs with the deeper side on its left: it enters a face across a descending halfedge
and leaves across the opposite of another one, so each crossing has one successor, or none where the polyline ends on
the border.  All levels are traced at once::

                 a  3.4            level 3 enters the face (a, b, c) across a -> b, which descends, and leaves it
                /\                 across c -> a, the opposite of the descending halfedge in the next face
         3 --> /--\ --> 3
              /    \
        2.6  b------c  2.3

Along an edge the distance is a cubic through its values and slopes at both ends, exact but for the fourth order of
the edge's length.  Where the two slopes belong to two fronts, the distance has a kink that no smooth curve follows:
there it is the lesser of the two straight continuations.

Work: linear in the edges and crossings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, connected, follow, offsets_of
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge
from weavecore.offsetting.isolines.cut_mesh import CutMesh
from weavecore.offsetting.isolines.simplify import LevelRegions
from weavecore.offsetting.spacing import LevelSchedule
from weavecore.tolerances import LEVEL_FROM_VERTEX

NO_CROSSING = -1


@dataclass(frozen=True, eq=False)
class Crossings:
    """All crossings of levels and edges, ordered by halfedge, then from the shallow end to the deep one.

    Parameters
    ----------
    halfedge : (N,) int64
        The descending halfedge; the polyline goes on through its face.
    level : (N,) int64
        Number of the level, from 1.
    after : (N,) int64
        Next crossing along the polyline, -1 where it ends.
    deep, shallow : (N,) int64
        Tail and head vertex of the halfedge.
    """

    halfedge: Ints
    level: Ints
    after: Ints
    deep: Ints
    shallow: Ints

    def __len__(self) -> int:
        return len(self.halfedge)

    def part(self, k: slice) -> Crossings:
        """Some of them, one after the other; ``after`` still counts all."""
        return Crossings(self.halfedge[k], self.level[k], self.after[k], self.deep[k], self.shallow[k])


@dataclass(frozen=True, eq=False)
class Loops:
    """Polylines of crossings, ordered by level, then by first crossing; a closed one begins with its least.

    Parameters
    ----------
    order : (N,) int64
        Crossings, polyline after polyline.
    offsets : (P+1,) int64
    closed : (P,) bool
    """

    order: Ints
    offsets: Ints
    closed: Bools


def count_crossings(mesh: CutMesh, band: Ints) -> int:
    """Count the crossings without allocating them.

    Parameters
    ----------
    mesh : CutMesh
    band : (n,) int64
        Number of levels at or below each node.

    Returns
    -------
    int
    """
    return int(np.abs(band[mesh.tail[mesh.edges]] - band[mesh.head[mesh.edges]]).sum())


def find_crossings(mesh: CutMesh, band: Ints) -> Crossings:
    """Find all crossings of levels and edges.

    Parameters
    ----------
    mesh : CutMesh
    band : (n,) int64
        Number of levels at or below each node.

    Returns
    -------
    Crossings
    """
    tail, head = mesh.tail, mesh.head
    count = np.maximum(band[tail] - band[head], 0)
    first = np.cumsum(count) - count
    falling = np.flatnonzero(count)
    halfedge = np.repeat(falling, count[falling])
    shallow = head[halfedge]
    level = band[shallow] + 1 + (np.arange(len(halfedge)) - first[halfedge])
    inner = np.flatnonzero(halfedge < len(mesh.twins))
    before, behind = next_halfedge(halfedge[inner]), previous_halfedge(halfedge[inner])
    apex_is_deeper = band[tail[behind]] >= level[inner]
    across = mesh.opposite[np.where(apex_is_deeper, before, behind)]
    after = np.full(len(halfedge), NO_CROSSING)
    after[inner] = first[across] + level[inner] - band[head[across]] - 1
    return Crossings(halfedge, level, after, tail[halfedge], shallow)


def chain_loops(crossings: Crossings) -> Loops:
    """Order the crossings along the polylines.

    Closed ones are opened before their first crossing and all are chained one behind the other, so that one
    breadth-first walk, in compiled code, orders them all.

    Parameters
    ----------
    crossings : Crossings

    Returns
    -------
    Loops
    """
    n = len(crossings)
    if n == 0:
        return Loops(np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, bool))
    index = np.arange(n)
    is_end = crossings.after == NO_CROSSING
    onward = np.where(is_end, index, crossings.after)
    count, label = connected(index, onward, n)
    first = np.empty(count, np.int64)
    first[label[::-1]] = index[::-1]
    before = np.full(n, NO_CROSSING)
    before[onward[~is_end]] = index[~is_end]
    starts, ends = np.flatnonzero(before == NO_CROSSING), np.flatnonzero(is_end)
    first[label[starts]] = starts
    last = before[first]
    last[label[ends]] = ends
    closed = np.ones(count, bool)
    closed[label[ends]] = False
    rank = np.lexsort((first, crossings.level[first]))
    onward[last[rank]] = np.roll(first[rank], -1)
    order = follow(onward, int(first[rank[0]]))
    return Loops(order, offsets_of(np.bincount(label, minlength=count)[rank]), closed[rank])


KINK = 0.25
"""Slopes at both ends of an edge that differ by more than this belong to two fronts: a single front would have a radius
of four edges or less."""

_MIN_TANGENTIAL = 0.25
"""Squared part of a gradient that must lie in the plane of the surface at the edge; else its direction is lost."""

_MIN_SLOPE = 0.01  # of the cubic: flatter, Newton's step is replaced by a bisection
_ARRIVED = 1e-9  # of the edge's rise
_MAX_STEPS = 60  # a bisection alone needs 30 for 1e-9


def place_crossings(mesh: CutMesh, regions: LevelRegions, crossings: Crossings, *, schedule: LevelSchedule) -> Floats:
    """Find where on its halfedge each crossing lies.

    Parameters
    ----------
    mesh : CutMesh
    regions : LevelRegions
    crossings : Crossings
    schedule : LevelSchedule

    Returns
    -------
    (N,) float64
        0 at the deep end, 1 at the shallow end; in the order of the levels, apart from each other and the ends.
    """
    is_kept = regions.distance == mesh.distance
    part = np.empty(len(crossings))
    for k in blocks(len(crossings)):
        part[k] = _places_of(crossings.part(k), mesh, regions, is_kept, schedule)
    return part


def _places_of(
    crossings: Crossings, mesh: CutMesh, regions: LevelRegions, is_kept: Bools, schedule: LevelSchedule
) -> Floats:
    """The same of some crossings; ``is_kept`` (n,) are the nodes whose distance was not changed."""
    deep, shallow = crossings.deep, crossings.shallow
    low, high = regions.distance[shallow], regions.distance[deep]
    rise = np.maximum(high - low, np.finfo(float).tiny)
    height = np.clip((schedule.distance_of(crossings.level.astype(np.float64)) - low) / rise, 0.0, 1.0)
    along = mesh.points[deep] - mesh.points[shallow]
    normal = mesh.edge_normals(crossings.halfedge)
    start, is_start = slope_along(mesh.gradient[shallow], along, normal)
    end, is_end = slope_along(mesh.gradient[deep], along, normal)
    stays = is_kept[deep] & is_kept[shallow]
    is_start, is_end = is_start & stays, is_end & stays
    start, end = start / rise, end / rise
    start, end = np.where(is_start, start, 2.0 - end), np.where(is_end, end, 2.0 - start)
    unknown = ~(is_start | is_end)
    start[unknown] = end[unknown] = 1.0
    length = np.sqrt(np.einsum("ij,ij->i", along, along))
    is_kink = (start - end) * rise > KINK * length
    part = np.where(is_kink & is_start & is_end, invert_kink(height, start, end), invert_cubic(height, start, end))
    return 1.0 - _kept_apart(part, regions.band, crossings)


def slope_along(gradient: Floats, along: Floats, normal: Floats) -> tuple[Floats, Bools]:
    """Slope of the distance along edges, times their lengths, and whether it is known.

    Parameters
    ----------
    gradient : (N, 3) float64
        In the plane of some face at an end of the edge.
    along : (N, 3) float64
        The edge from end to end.
    normal : (N, 3) float64
        Unit normal of the surface at the edge; the gradient is rotated into its plane.

    Returns
    -------
    rise : (N,) float64
    is_known : (N,) bool
    """
    flat = 1.0 - np.einsum("ij,ij->i", gradient, normal) ** 2
    rise = np.einsum("ij,ij->i", gradient, along) / np.sqrt(np.maximum(flat, _MIN_TANGENTIAL))
    return rise, (gradient != 0).any(1) & (flat > _MIN_TANGENTIAL)


def invert_cubic(height: Floats, start: Floats, end: Floats) -> Floats:
    """Solve the monotone cubic Hermite curve from (0, 0) to (1, 1), by Newton's method inside a bracket.

    Parameters
    ----------
    height : (N,) float64
        From 0 to 1.
    start, end : (N,) float64
        Slopes at both ends; limited to 0 … 3, which keeps the cubic monotone (Fritsch and Carlson 1980).

    Returns
    -------
    (N,) float64
        Where the curve reaches the height, from 0 to 1.
    """
    start, end = np.clip(start, 0.0, 3.0), np.clip(end, 0.0, 3.0)
    reached = height.copy()
    going = np.arange(len(height))
    part, least, most = height.copy(), np.zeros_like(height), np.ones_like(height)
    for _ in range(_MAX_STEPS):
        a, b, c = (start + end - 2.0)[going], (3.0 - 2.0 * start - end)[going], start[going]
        off = ((a * part + b) * part + c) * part - height[going]
        on = np.abs(off) > _ARRIVED
        reached[going] = part
        if not on.any():
            break
        slope = (3.0 * a * part + 2.0 * b) * part + c
        least, most = np.where(off < 0, part, least), np.where(off < 0, most, part)
        step = part - np.divide(off, slope, out=np.full_like(part, 2.0), where=slope > _MIN_SLOPE)
        part = np.where((step >= least) & (step <= most), step, 0.5 * (least + most))
        going, part, least, most = going[on], part[on], least[on], most[on]
    return reached


def invert_kink(height: Floats, start: Floats, end: Floats) -> Floats:
    """Solve the lesser of two straight lines, from (0, 0) with one slope and to (1, 1) with another.

    Parameters
    ----------
    height, start, end : (N,) float64
        As of `invert_cubic`.

    Returns
    -------
    (N,) float64
    """
    from_start = height / np.maximum(start, 1.0)
    from_end = 1.0 - np.divide(1.0 - height, end, out=np.ones_like(height), where=end > 0)
    return np.maximum(from_start, from_end)


def _kept_apart(part: Floats, band: Ints, crossings: Crossings) -> Floats:
    """Positions held off the ends of the edge and, in their order, off each other."""
    below = crossings.level - band[crossings.shallow]
    above = band[crossings.deep] + 1 - crossings.level
    least = np.minimum(LEVEL_FROM_VERTEX, 0.5 / (below + above))
    kept: Floats = np.clip(part, least * below, 1.0 - least * above)
    return kept
