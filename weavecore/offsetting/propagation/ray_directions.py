"""Where the rays of a front start, and in which direction: resampling, and n × t at each vertex (§4.1, §4.2).

A front runs with the unswept surface on its left, so each vertex is offset along n × t, the surface's normal times the
front's tangent.  (Yan et al. 2016, §4.1, unify the index orders c of the borders and offset along c × n: their borders
run the other way.)  On the left of a front that runs to the right lies what it will sweep::

    left turn: no ray     straight: one ray     right turn: a fan

           ^                     ^                     | / _
           | front               |                     |/ _-
      ---->+                ---->+---->           ---->+----
                                                       | front
                                                       v

Where a front turns left by more than `SMOOTH` its sides converge: the children of both neighbours cross, and the
crossing, reconnected, is the child's corner.  Slight left turns have one ray, longer by 1/cos(turn / 2), so that its
end is as far from both sides.  Where it turns right its sides diverge, and a fan of rays fills the wedge.

The time is linear in the vertices of the front.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, ranks_in_rows, rows_of
from weavecore.geometry.geodesics import on_halfedge
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.distance.ray_seeds import find_sector
from weavecore.offsetting.propagation.chords import FEWEST_VERTICES, SHARPEST_FAN, measure_turns
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves, next_along

SMOOTH = 0.2
"""Radians: a right turn by more has a fan, a left turn by more no ray.  At this turn 1/cos(turn / 2) is 1.005."""

FAN_ANGLE = 0.1
"""Radians between the rays of a fan: a chord between two ends cuts the arc by 0.13% of the step."""

_OFF_THE_CORNER = 1e-6
"""Parts of a halfedge: a ray from a vertex starts so far from it, inside the face that holds its direction."""

_CROWDED, _SPARSE = 0.6, 1.3
"""Parts of the wanted gap between vertices: narrower ones are thinned, wider ones divided.

Neither undoes the other: two gaps of 0.6 make one of 1.2, and half of 1.3 is 0.65.
"""

_FEWEST_AROUND = 40
"""Vertices around a front at least, however short it is: so each turns a circle by less than `SMOOTH`."""

_WHOLE = 0.999
"""An edge that is longer than whole gaps by less than a thousandth of one gets no further ray."""


@dataclass(frozen=True, eq=False)
class RayStarts:
    """Where rays start: in the order of the curves, curve after curve.

    Parameters
    ----------
    curves : SurfaceCurves
        The fronts that are offset.
    offsets : (C+1,) int64
        The rays of each curve.
    halfedge : (n,) int64
    px, py, ux, uy : (n,) float64
        Place and unit direction in the frame of the halfedge.
    stretch : (n,) float64
        Length of the step in spacings: more than 1 where a front turns slightly left.
    station : (n,) float64
        Arc length of the start, summed over all curves in order.
    pivot : (n,) int64
        The boundary halfedge on which a ray starts, if that is at its tail or at the end of an open curve; else -1.
    place, angle : (n,) float64
        Length along the pivot, and direction counter-clockwise from it.  At the end of an open curve this may lead
        out of the surface.
    """

    curves: SurfaceCurves
    offsets: Ints
    halfedge: Ints
    px: Floats
    py: Floats
    ux: Floats
    uy: Floats
    stretch: Floats
    station: Floats
    pivot: Ints
    place: Floats
    angle: Floats

    @property
    def owner(self) -> Ints:
        """(n,) the curve of each ray."""
        return rows_of(self.offsets)


def start_on_boundary(domain: Domain, *, step: float) -> RayStarts:
    """Start rays along the borders and curves from which distances start; from cuts to both sides.

    Parameters
    ----------
    domain : Domain
    step : float
        Gap between neighbouring rays at most.

    Returns
    -------
    RayStarts
    """
    chains = _find_source_chains(domain)
    curves = _as_curves(domain, chains)
    total = domain.boundary.angle[chains.halfedge]
    n_at_node, n_on_edge = _count_rays(domain, chains, step)
    counts = n_at_node + n_on_edge
    offsets = offsets_of(counts)
    node, rank = rows_of(offsets), ranks_in_rows(counts)
    at_node = rank < n_at_node[node]
    place = (rank - n_at_node[node] + 1) / (n_on_edge[node] + 1) * domain.frames.length[chains.halfedge[node]]
    place[at_node] = 0.0
    # From straight across the edge before to straight across the edge after; at open ends across the one that is there.
    share = _shares_of_fan(rank, n_at_node[node])
    share[chains.is_end[node]] = 0.0
    angle = np.where(
        at_node & ~chains.is_start[node], total[node] - np.pi / 2 - (total[node] - np.pi) * share, np.pi / 2
    )
    is_inner = at_node & ~chains.is_start[node] & ~chains.is_end[node]
    halfedge, px, ux, uy = chains.halfedge[node], place.copy(), np.cos(angle), np.sin(angle)
    pivot = np.where(at_node, halfedge, NO_TWIN)
    k = np.flatnonzero(at_node)
    halfedge[k], px[k], ux[k], uy[k] = find_ray_frames(domain, pivot[k], place[k], angle[k])
    travelled = np.cumsum(curves.segment_lengths) - curves.segment_lengths
    return RayStarts(
        curves=curves,
        offsets=offsets[curves.offsets],
        halfedge=halfedge,
        px=px,
        py=np.zeros(len(node)),
        ux=ux,
        uy=uy,
        stretch=np.where(is_inner, _stretches((np.pi - total)[node]), 1.0),
        station=travelled[node] + place,
        pivot=pivot,
        place=place,
        angle=angle,
    )


@dataclass(frozen=True, eq=False)
class _SourceChains:
    """Chains of boundary halfedges from which distances start, as nodes: one at the tail of each halfedge.

    An open chain has one more node, where it ends and a free border begins::

        free border   --->o---->o---->o--->   free border
                    is_start        is_end: its halfedge is that of the free border

    Parameters
    ----------
    offsets : (C+1,) int64
        The nodes of each chain.
    closed : (C,) bool
    halfedge : (n,) int64
        The boundary halfedge whose tail the node is.
    is_start, is_end : (n,) bool
        First and last nodes of open chains.
    """

    offsets: Ints
    closed: Bools
    halfedge: Ints
    is_start: Bools
    is_end: Bools


def _find_source_chains(domain: Domain) -> _SourceChains:
    """The chains in the order of the boundary loops, each open one from where a free border ends."""
    boundary = domain.boundary
    loop, row = rows_of(boundary.offsets), np.arange(len(boundary.halfedges))
    is_free = domain.is_free_border[boundary.halfedges]
    follows_free = domain.is_free_border[boundary.before[boundary.halfedges]]
    begins = ~is_free & follows_free
    # A loop is turned to begin with its first open chain, so that none is split.
    first = boundary.offsets[:-1].copy()
    first[loop[begins][::-1]] = row[begins][::-1]
    turned = np.lexsort(((row - first[loop]) % np.diff(boundary.offsets)[loop], loop))
    kept = turned[~(is_free & follows_free)[turned]]
    heads = np.flatnonzero(begins[kept] | (kept == first[loop[kept]]))
    return _SourceChains(
        offsets=np.append(heads, len(kept)).astype(np.int64),
        closed=~begins[kept[heads]],
        halfedge=boundary.halfedges[kept],
        is_start=begins[kept],
        is_end=is_free[kept],
    )


def _as_curves(domain: Domain, chains: _SourceChains) -> SurfaceCurves:
    """The chains as curves: a segment for each node, of no length at the ends of open ones."""
    halfedge = np.where(chains.is_end, domain.boundary.before[chains.halfedge], chains.halfedge)
    face, is_vertex = halfedge // 3, np.ones(len(halfedge), bool)
    start, end = on_halfedge(halfedge, chains.is_end.astype(np.float64)), on_halfedge(halfedge, np.ones(len(halfedge)))
    return SurfaceCurves(
        chains.offsets, chains.closed, face, start, end, is_vertex, ~is_vertex, domain.points(face, start)
    )


def _count_rays(domain: Domain, chains: _SourceChains, step: float) -> tuple[Ints, Ints]:
    """How many rays start at each node, and how many between it and the next one."""
    n_at_node = _count_rays_at_turn(np.pi - domain.boundary.angle[chains.halfedge])
    n_at_node[chains.is_start | chains.is_end] = 1
    n_on_edge = np.ceil(domain.frames.length[chains.halfedge] / step * _WHOLE).astype(np.int64) - 1
    # Two corners without rays may follow each other: what lies between them has a child.
    n_on_edge[n_at_node == 0] = np.maximum(n_on_edge, 1)[n_at_node == 0]
    n_on_edge[chains.is_end] = 0
    return n_at_node, n_on_edge


def _count_rays_at_turn(turn: Floats) -> Ints:
    """How many rays (n,) leave vertices that turn left by so many radians (n,)."""
    fan = np.ceil(-turn / FAN_ANGLE).astype(np.int64) + 1
    return np.where(turn < -SMOOTH, fan, np.where(turn > SMOOTH, 0, 1))


def _shares_of_fan(rank: Ints, count: Ints) -> Floats:
    """Where in its fan each ray lies, from 0 to 1; a single ray in the middle."""
    shares: Floats = np.divide(rank, count - 1, out=np.full(len(rank), 0.5), where=count > 1)
    return shares


def _stretches(turn: Floats) -> Floats:
    """Length of the step in spacings at which the end is as far from both sides of a left turn."""
    longer: Floats = 1.0 / np.cos(np.clip(turn, 0.0, SMOOTH) / 2)
    return longer


def find_ray_frames(domain: Domain, pivot: Ints, place: Floats, angle: Floats) -> tuple[Ints, Floats, Floats, Floats]:
    """The faces into which rays leave the boundary.

    Parameters
    ----------
    pivot : (n,) int64
        Boundary halfedges.
    place : (n,) float64
        Length along each from its tail; 0 is the vertex itself.
    angle : (n,) float64
        Direction counter-clockwise from the pivot, in radians.

    Returns
    -------
    halfedge : (n,) int64
        The pivot, or at its tail that halfedge whose face holds the direction.
    px, ux, uy : (n,) float64
        Place along it, and unit direction in its frame.
    """
    halfedge, left = pivot.copy(), angle.copy()
    corner = np.flatnonzero(place == 0.0)
    halfedge[corner], left[corner] = find_sector(domain.frames, pivot[corner], angle[corner])
    px = np.where(place == 0.0, _OFF_THE_CORNER * domain.frames.length[halfedge], place)
    return halfedge, px, np.cos(left), np.sin(left)


def start_on_curves(domain: Domain, curves: SurfaceCurves, *, step: float) -> RayStarts:
    """Start rays along fronts: at their vertices, where these are neither crowded nor sparse (§4.2).

    Parameters
    ----------
    domain : Domain
    curves : SurfaceCurves
    step : float
        Wanted gap between neighbouring rays; they are 0.6 to 1.3 times that far apart.

    Returns
    -------
    RayStarts
    """
    segment, part, station, offsets = _resample(curves, step)
    face, weights = curves.interpolate(segment, part)
    turn, heading = measure_turns(domain, face, domain.points(face, weights), offsets, curves.closed)
    count = np.where(turn < -SHARPEST_FAN, 0, _count_rays_at_turn(turn))
    row = rows_of(offsets_of(count))
    share = _shares_of_fan(ranks_in_rows(count), count[row])
    angle = heading[row] + turn[row] * share + np.pi / 2
    xy = domain.plane_points(face, weights)[row]
    is_end = _are_ends(offsets, curves.closed)[row]
    pivot, place, off = _find_pivots(domain, face[row], weights[row], angle, is_end)
    return RayStarts(
        curves=curves,
        offsets=offsets_of(np.bincount(rows_of(offsets)[row], minlength=len(curves))),
        halfedge=3 * face[row],
        px=xy[:, 0],
        py=xy[:, 1],
        ux=np.cos(angle),
        uy=np.sin(angle),
        stretch=_stretches(turn[row]),
        station=station[row],
        pivot=pivot,
        place=place,
        angle=off,
    )


def _find_pivots(
    domain: Domain, face: Ints, weights: Floats, angle: Floats, is_end: Bools
) -> tuple[Ints, Floats, Floats]:
    """For ends of open curves the free-border halfedge that they lie on, the length along it, the angle from it."""
    halfedge, place = domain.find_free_borders(face, weights)
    axis = np.zeros(len(face))
    base, k, frames = 3 * face, halfedge % 3, domain.frames
    axis[k == 1] = np.arctan2(*frames.next_direction(base)[::-1])[k == 1]
    axis[k == 2] = np.arctan2(*frames.previous_direction(base)[::-1])[k == 2]
    off = (angle - axis + np.pi) % (2 * np.pi) - np.pi
    return np.where(is_end, halfedge, NO_TWIN), np.where(is_end, place, 0.0), off


def _resample(curves: SurfaceCurves, step: float) -> tuple[Ints, Floats, Floats, Ints]:
    """Vertices of the resampled curves: segments (n,), parts of them (n,) in 0 to 1, stations (n,), offsets (C+1,).

    A vertex that stays keeps its place, so that a front whose gaps are right is not resampled at all.
    """
    vertex = np.flatnonzero(curves.is_vertex)
    total = np.concatenate([[0.0], np.cumsum(curves.segment_lengths)])
    around = total[curves.offsets[1:]] - total[curves.offsets[:-1]]
    wanted = np.minimum(step, around / _FEWEST_AROUND)
    kept = _thin_vertices(total, curves, vertex, _CROWDED * wanted)
    offsets = offsets_of(np.bincount(curves.owner[kept], minlength=len(curves)))
    gaps = _measure_gaps(total, curves, kept, offsets)
    parts = gaps / wanted[curves.owner[kept]]
    n_parts = np.where(parts > _SPARSE, np.ceil(parts), 1).astype(np.int64)
    # Two corners without rays may follow each other: what lies between them has a child.
    after = next_along(offsets, curves.closed)
    between = curves.is_corner[kept] & curves.is_corner[kept[after]] & (after != np.arange(len(kept)))
    n_parts[between & (n_parts == 1)] = 2
    offsets = offsets_of(n_parts)
    row, rank = rows_of(offsets), ranks_in_rows(n_parts)
    owner = curves.owner[kept[row]]
    station = total[kept[row]] + gaps[row] * rank / n_parts[row]
    beyond = curves.closed[owner] & (station >= total[curves.offsets[owner + 1]])
    station = np.where(beyond, station - around[owner], station)
    segment, part = curves.locate(station, owner)
    segment[rank == 0] = kept[row[rank == 0]]
    part = np.where(rank == 0, 0.0, part)
    return segment, part, station, offsets_of(np.bincount(owner, minlength=len(curves)))


def _thin_vertices(total: Floats, curves: SurfaceCurves, vertex: Ints, least: Floats) -> Ints:
    """The vertices (n,) without crowded ones: of each run of short gaps every other one goes, until no gap is short.

    Those beside a corner go before it does; the ends of open curves stay.  ``total`` (m+1,) are the arc lengths at the
    segments, ``least`` (C,) the least gap of each curve.
    """
    offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
    near = _measure_gaps(total, curves, vertex, offsets) < least[curves.owner[vertex]]
    after, is_corner = next_along(offsets, curves.closed), curves.is_corner[vertex]
    near &= after != np.arange(len(after))
    beside = near & is_corner[after]
    beside[after[near & is_corner]] = True
    vertex = vertex[~beside | is_corner | _are_ends(offsets, curves.closed)]
    while True:
        goes = _find_crowded(total, curves, vertex, least)
        if not goes.any():
            return vertex
        vertex = vertex[~goes]


def _find_crowded(total: Floats, curves: SurfaceCurves, vertex: Ints, least: Floats) -> Bools:
    """Every other vertex (n,) of each run of vertices whose gap to the one before is short."""
    offsets = offsets_of(np.bincount(curves.owner[vertex], minlength=len(curves)))
    before = np.empty(len(vertex))
    before[next_in_loop(offsets)] = _measure_gaps(total, curves, vertex, offsets)
    is_end = _are_ends(offsets, curves.closed)
    filled = np.diff(offsets) > 0
    first, last = offsets[:-1][filled], offsets[1:][filled] - 1
    before[first[is_end[first]]] = np.inf
    owner = curves.owner[vertex]
    short = (before < least[owner]) & (np.diff(offsets)[owner] > FEWEST_VERTICES)
    row = np.arange(len(vertex))
    # The first of a curve begins a run whatever lies before it.
    is_head = ~short
    is_head[first] = True
    run = row - np.maximum.accumulate(np.where(is_head, row, 0))
    goes = short & (run % 2 == 1)
    goes[last] |= short[first] & ~goes[last - 1]
    # The end of an open curve stays, and the one before it goes instead.
    stuck = last[goes[last] & is_end[last]]
    goes[stuck], goes[stuck - 1] = False, True
    return np.asarray(goes)


def _measure_gaps(total: Floats, curves: SurfaceCurves, vertex: Ints, offsets: Ints) -> Floats:
    """Arc length (n,) from each vertex to the next of the same curve; 0 after the last of an open one."""
    after = vertex[next_along(offsets, curves.closed)]
    around = total[curves.offsets[1:]] - total[curves.offsets[:-1]]
    gap = total[after] - total[vertex]
    owner = curves.owner[vertex]
    gaps: Floats = np.where((after <= vertex) & curves.closed[owner], gap + around[owner], gap)
    return gaps


def _are_ends(offsets: Ints, closed: Bools) -> Bools:
    """(n,) which values of a ragged array are the first or the last of an open row."""
    is_end = np.zeros(offsets[-1], bool)
    is_open = ~closed & (np.diff(offsets) > 0)
    is_end[offsets[:-1][is_open]] = is_end[offsets[1:][is_open] - 1] = True
    return is_end
