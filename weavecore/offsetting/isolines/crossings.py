"""Tracing level sets: where they cross the edges, and the loops that the crossings make.

A *crossing* is where one level meets one edge.  It is named by the *descending* halfedge of
that edge, the one that runs from the deeper to the shallower end: a polyline with the deeper
side on its left enters a face across a descending halfedge and leaves it across the opposite of
another one.  So each crossing has exactly one successor, or none where a polyline ends on
the border, and all levels are traced at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge
from weavecore.offsetting.isolines.cut_mesh import Sheet
from weavecore.offsetting.isolines.simplify import Regions
from weavecore.offsetting.spacing import Ladder
from weavecore.tolerances import LEVEL_FROM_VERTEX

NO_CROSSING = -1


@dataclass(frozen=True, eq=False)
class Crossings:
    """All crossings of levels and edges, by halfedge and from the shallow end to the deep one.

    Parameters
    ----------
    halfedge : (N,) int64
        The descending halfedge; the polyline goes on through its face.
    level : (N,) int64
        Which level crosses there, from 1.
    after : (N,) int64
        The next crossing along the polyline, -1 where it ends.
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


@dataclass(frozen=True, eq=False)
class Loops:
    """The polylines that the crossings make, by level, then by the crossing with which each begins.

    A closed one begins with its least crossing.

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


def count_crossings(sheet: Sheet, band: Ints) -> int:
    """Number of crossings, without allocating them."""
    return int(np.abs(band[sheet.tail[sheet.edges]] - band[sheet.head[sheet.edges]]).sum())


def find_crossings(sheet: Sheet, band: Ints) -> Crossings:
    """All crossings of an edge with a level.

    Parameters
    ----------
    sheet : Sheet
    band : (n,) int64
        Number of levels at or below each node.
    """
    tail, head = sheet.tail, sheet.head
    count = np.maximum(band[tail] - band[head], 0)
    first = np.cumsum(count) - count
    falling = np.flatnonzero(count)
    halfedge = np.repeat(falling, count[falling])
    shallow = head[halfedge]
    level = band[shallow] + 1 + (np.arange(len(halfedge)) - first[halfedge])
    inner = np.flatnonzero(halfedge < len(sheet.twins))
    before, behind = next_halfedge(halfedge[inner]), previous_halfedge(halfedge[inner])
    apex_is_deeper = band[tail[behind]] >= level[inner]
    across = sheet.opposite[np.where(apex_is_deeper, before, behind)]
    after = np.full(len(halfedge), NO_CROSSING)
    after[inner] = first[across] + level[inner] - band[head[across]] - 1
    return Crossings(halfedge, level, after, tail[halfedge], shallow)


def chain_loops(crossings: Crossings) -> Loops:
    """Order the crossings along the polylines that they make.

    Closed ones are opened before their first crossing, and all are strung one behind the other, so
    that one walk, in compiled code, orders them all.
    """
    n = len(crossings)
    if n == 0:
        return Loops(np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, bool))
    index = np.arange(n)
    is_end = crossings.after == NO_CROSSING
    onward = np.where(is_end, index, crossings.after)
    count, label = connected_components(_pointers(onward), directed=False)
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
    order = breadth_first_order(_pointers(onward), first[rank[0]], return_predecessors=False)
    return Loops(order.astype(np.int64), offsets_of(np.bincount(label, minlength=count)[rank]), closed[rank])


def _pointers(after: Ints) -> csr_matrix:
    n = len(after)
    return csr_matrix((np.ones(n, np.int8), after, np.arange(n + 1)), shape=(n, n))


# ----------------------------------------------------------------------
# Where along an edge a level lies.
#
# The distance is known at both ends of an edge, and how steeply it rises there.  Where both ends belong to
# one front a cubic through these four numbers is exact but for the fourth order of the edge.
# Where two fronts meet on the edge the distance has a kink, which no smooth curve follows:
# there it is the lesser of the two straight continuations.

KINK = 0.25
"""Slopes at both ends that differ by more than this belong to two fronts."""
_LEAST_FLAT = 0.25
"""A gradient that stands steeper on the surface than this, squared, has lost its direction."""
_LEAST_SLOPE, _NEAR, _MOST_STEPS = 0.01, 1e-9, 60


def place_crossings(sheet: Sheet, regions: Regions, crossings: Crossings, *, ladder: Ladder) -> Floats:
    """(N,) where each crossing lies on its halfedge: 0 at its deep end, 1 at its shallow end.

    Positions on one edge keep the order of their levels, apart from each other and from the ends.
    """
    deep, shallow = crossings.deep, crossings.shallow
    low, high = regions.distance[shallow], regions.distance[deep]
    rise = np.maximum(high - low, np.finfo(float).tiny)
    height = np.clip((ladder.distance(crossings.level.astype(np.float64)) - low) / rise, 0.0, 1.0)
    along = sheet.points[deep] - sheet.points[shallow]
    normal = sheet.edge_normals(crossings.halfedge)
    start, is_start = slope_along(sheet.gradient[shallow], along, normal)
    end, is_end = slope_along(sheet.gradient[deep], along, normal)
    is_kept = regions.distance == sheet.distance
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
    """How much the distance would rise over each whole edge, and whether that is known.

    Parameters
    ----------
    gradient : (N, 3) float64
        In the plane of some face at an end of the edge.
    along : (N, 3) float64
        The edge from end to end.
    normal : (N, 3) float64
        Of the surface at the edge: into its plane the gradient is turned.
    """
    flat = 1.0 - np.einsum("ij,ij->i", gradient, normal) ** 2
    rise = np.einsum("ij,ij->i", gradient, along) / np.sqrt(np.maximum(flat, _LEAST_FLAT))
    return rise, (gradient != 0).any(1) & (flat > _LEAST_FLAT)


def invert_cubic(height: Floats, start: Floats, end: Floats) -> Floats:
    """Where the monotone cubic from (0, 0) to (1, 1) with the given end slopes reaches a height.

    Newton's method, kept inside a bracket; only what has not arrived goes on.
    """
    start, end = np.clip(start, 0.0, 3.0), np.clip(end, 0.0, 3.0)
    reached = height.copy()
    going = np.arange(len(height))
    part, least, most = height.copy(), np.zeros_like(height), np.ones_like(height)
    for _ in range(_MOST_STEPS):
        a, b, c = (start + end - 2.0)[going], (3.0 - 2.0 * start - end)[going], start[going]
        off = ((a * part + b) * part + c) * part - height[going]
        on = np.abs(off) > _NEAR
        reached[going] = part
        if not on.any():
            break
        slope = (3.0 * a * part + 2.0 * b) * part + c
        least, most = np.where(off < 0, part, least), np.where(off < 0, most, part)
        step = part - np.divide(off, slope, out=np.full_like(part, 2.0), where=slope > _LEAST_SLOPE)
        part = np.where((step >= least) & (step <= most), step, 0.5 * (least + most))
        going, part, least, most = going[on], part[on], least[on], most[on]
    return reached


def invert_kink(height: Floats, start: Floats, end: Floats) -> Floats:
    """Where the lesser of the two straight continuations reaches a height."""
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
