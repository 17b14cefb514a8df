"""Marks: the polylines around some bands, as curves by which the mesh is cut.

A polyline of generation 0 runs along edges.  On the mesh opened along its cuts it is a border on
each of its sides, so it gives one curve a side; any other polyline gives one curve.  Selvedges
run along edges as well; the marks at their ends are those of the polylines that end there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cutting import NONE, Marks
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge
from weavecore.linking.division import index_at, points_at
from weavecore.linking.open_mesh import OpenMesh
from weavecore.linking.selvedges import Hem, points_on
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines

TICKS_PER_EDGE = 4
_ON_EDGE = 1e-9
_SAME_STATION = 1e-9


@dataclass(frozen=True, eq=False)
class Curves:
    """The curves of the polylines around some bands, then those of the selvedges.

    Parameters
    ----------
    marks : Marks
    points : (M, 3) float64
    offsets : (K+1,) int64
        Marks of each curve.
    polyline : (K,) int64
        Of a selvedge -1.
    is_left : (K,) bool
        Of a curve along edges: whether it is the left side of its polyline.
    index : (M,) int64
        Which node of its polyline or selvedge is nearest along it.
    border : (K,) int64
        Of a curve along edges: its first halfedge; of others -1.
    """

    marks: Marks
    points: Floats
    offsets: Ints
    polyline: Ints
    is_left: Bools
    index: Ints
    border: Ints


def curves_around(latitudes: Latitudes, mesh: OpenMesh, nodes: list[Floats], hem: Hem, sides: Ints) -> Curves:
    """The curves of these sides and of all selvedges, each with its points and ticks between them.

    Parameters
    ----------
    mesh : OpenMesh
    nodes : list of (n,) float64
        Stations of the nodes of each polyline.
    hem : Hem
    sides : (s,) int64
        Sides of `Bands`.
    """
    bands, polylines = latitudes.bands, latitudes.polylines
    polyline, is_left = bands.polyline[sides], bands.is_left[sides]
    on_edges = latitudes.generation[polyline] == 0
    _, first = np.unique(2 * polyline + (on_edges & ~is_left), return_index=True)
    polyline, is_left, on_edges = polyline[first], is_left[first], on_edges[first]
    start, station, index = [], [], []
    for p in polyline.tolist():
        k, s, j = _tick(polylines, p, nodes[p])
        start.append(k)
        station.append(s)
        index.append(j)
    offsets = offsets_of([len(s) for s in station])
    columns = (np.concatenate(start), np.concatenate(station), np.concatenate(index))
    return _with_selvedges(_make(latitudes, mesh, polyline, is_left, offsets, *columns), mesh, hem)


def _tick(polylines: Polylines, p: int, nodes: Floats) -> tuple[Ints, Floats, Ints]:
    """Points of a polyline and ticks between its nodes: the point at or before each, its station, the nearest node."""
    part = slice(polylines.offsets[p], polylines.offsets[p + 1])
    length, closed = float(polylines.lengths[p]), bool(polylines.closed[p])
    start, station, index = _between(polylines.stations[part], length, nodes, closed=closed)
    return start + polylines.offsets[p], station, index


def _between(known: Floats, length: float, nodes: Floats, *, closed: bool) -> tuple[Ints, Floats, Ints]:
    """Known stations and ticks between nodes: the known one at or before each, its station, the nearest node."""
    around = np.append(nodes, nodes[0] + length) if closed else nodes
    ticks = around[:-1, None] + np.diff(around)[:, None] * np.arange(TICKS_PER_EDGE) / TICKS_PER_EDGE
    ticks = np.sort(ticks.ravel() % length)
    at = np.searchsorted(known, ticks, side="right") - 1
    beyond = np.append(known, length)[at + 1]
    least = _SAME_STATION * length
    ticks = ticks[(ticks - known[at] > least) & (beyond - ticks > least)]
    station = np.concatenate([known, ticks])
    is_tick = np.arange(len(station)) >= len(known)
    order = np.argsort(station, kind="stable")
    station = station[order]
    start = np.cumsum(~is_tick[order]) - 1
    index = np.floor(index_at(nodes, length, station, closed=closed) + 0.5).astype(np.int64) % len(nodes)
    return start, station, index


def _with_selvedges(curves: Curves, mesh: OpenMesh, hem: Hem) -> Curves:
    """The same curves, and those of the selvedges without the marks at their ends."""
    if not hem.selvedges:
        return curves
    n_marks = len(curves.index)
    parts: list[tuple[Ints, Ints, Floats, Floats, Ints]] = []
    for selvedge, nodes in zip(hem.selvedges, hem.stations):
        start, station, index = _between(selvedge.stations, selvedge.length, nodes, closed=selvedge.closed)
        is_point = np.diff(start, prepend=NONE) > 0
        if not selvedge.closed:
            start, station, index, is_point = start[1:-1], station[1:-1], index[1:-1], is_point[1:-1]
        halfedge = selvedge.halfedge[start]
        size = np.diff(np.append(selvedge.stations, selvedge.length))[start]
        # The halfedge on which the last segment lies ends beyond it, as the first may begin before.
        ends = np.append(selvedge.part[1:], 1.0)[start]
        ends = np.where(ends > selvedge.part[start], ends, 1.0)
        share = selvedge.part[start] + (ends - selvedge.part[start]) * (station - selvedge.stations[start]) / size
        points = points_on(selvedge, station)
        vertex = np.where(is_point, mesh.faces.ravel()[halfedge], NONE)
        parts.append((vertex, np.where(is_point, NONE, halfedge), np.where(is_point, 0.0, share), points, index))
    offsets = offsets_of([len(part[0]) for part in parts])
    vertex, halfedge, share, points, index = (np.concatenate(column) for column in zip(*parts))
    vertex[vertex == NONE] = (len(mesh.vertices) + n_marks + np.arange(len(vertex)))[vertex == NONE]
    after, before = _around(offsets)
    nowhere = np.full(len(vertex), NONE, np.int64)
    old = curves.marks
    return Curves(
        Marks(
            np.concatenate([old.after, n_marks + after]),
            np.concatenate([old.before, n_marks + before]),
            np.concatenate([old.vertex, vertex]),
            np.concatenate([old.halfedge, halfedge]),
            np.concatenate([old.part, share]),
            np.concatenate([old.face, nowhere]),
        ),
        np.concatenate([curves.points, points]),
        np.concatenate([curves.offsets, n_marks + offsets[1:]]),
        np.concatenate([curves.polyline, np.full(len(parts), NONE)]),
        np.concatenate([curves.is_left, np.ones(len(parts), bool)]),
        np.concatenate([curves.index, index]),
        np.concatenate([curves.border, [selvedge.halfedge[0] for selvedge in hem.selvedges]]),
    )


def _around(offsets: Ints) -> tuple[Ints, Ints]:
    """The mark after and the one before each, around its curve."""
    after = next_in_loop(offsets)
    before = np.empty(len(after), np.int64)
    before[after] = np.arange(len(after))
    return after, before


def _make(
    latitudes: Latitudes,
    mesh: OpenMesh,
    polyline: Ints,
    is_left: Bools,
    offsets: Ints,
    start: Ints,
    station: Floats,
    index: Ints,
) -> Curves:
    polylines = latitudes.polylines
    curve = rows_of(offsets)
    n = len(start)
    after, before = _around(offsets)
    is_point = start != np.where(before < np.arange(n), start[before], NONE)
    is_point[offsets[:-1]] = True
    vertex = len(mesh.vertices) + np.arange(n)
    halfedge = np.full(n, NONE, np.int64)
    part = np.zeros(n)
    face = np.full(n, NONE, np.int64)

    on_edges = (latitudes.generation[polyline] == 0)[curve]
    at = np.flatnonzero(on_edges)
    # The end of an open one lies on the halfedge before it.
    is_end = start[at] == np.where(polylines.closed, NONE, polylines.offsets[1:] - 1)[polylines.owner[start[at]]]
    along, forth = _border_halfedges(latitudes, mesh, start[at] - is_end, is_left[curve[at]])
    point = is_point[at]
    border = np.full(n, NONE, np.int64)
    border[at] = along
    corner = np.where(forth != is_end, along, next_halfedge(along))
    vertex[at[point]] = mesh.faces.ravel()[corner[point]]
    halfedge[at[~point]] = along[~point]
    share = (station - polylines.stations[start]) / np.maximum(polylines.segment_lengths[start], np.finfo(float).tiny)
    part[at[~point]] = np.where(forth, share[at], 1.0 - share[at])[~point]

    at = np.flatnonzero(~on_edges)
    segment_face, splits, split_part = _segment_faces(polylines, mesh.twins)
    face[at] = segment_face[start[at]]
    face[offsets[1:][~polylines.closed[polyline]] - 1] = NONE
    own = at[is_point[at]]
    crossing = own[face[own] != face[before[own]]]
    halfedge[crossing] = splits[start[crossing]]
    part[crossing] = split_part[start[crossing]]
    marks = Marks(after, before, vertex, halfedge, part, face)
    points = points_at(polylines, polyline[curve], station)
    return Curves(marks, points, offsets, polyline, is_left, index, border[offsets[:-1]])


def _border_halfedges(latitudes: Latitudes, mesh: OpenMesh, start: Ints, is_left: Bools) -> tuple[Ints, Bools]:
    """For segments of generation 0 the halfedge on the wanted side, and whether it runs along with the segment."""
    polylines, surface = latitudes.polylines, latitudes.surface
    point = np.arange(polylines.offsets[int((latitudes.generation == 0).sum())])
    row = polylines.barycentric[point].argmax(1)
    vertex = surface.faces[polylines.face[point], row]
    head_of = vertex[next_in_loop(polylines.offsets)[point]]
    border = np.flatnonzero(mesh.twins == NO_TWIN)
    tail, head = halfedge_ends(surface.faces)
    n = np.int64(surface.n_vertices)
    key = tail[border] * n + head[border]
    order = np.argsort(key)
    a, b = vertex[start], head_of[start]
    wanted = np.where(is_left, a * n + b, b * n + a)
    found = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(order) - 1)]
    return border[found], is_left


def _segment_faces(polylines: Polylines, twins: Ints) -> tuple[Ints, Ints, Floats]:
    """For every point: the face of the segment that begins there, the halfedge it lies on or -1, and where on it."""
    row = np.arange(len(polylines.points))
    least = polylines.barycentric.argmin(1)
    on_edge = polylines.barycentric[row, least] < _ON_EDGE
    face = polylines.face
    halfedge = 3 * face + (least + 1) % 3
    ahead = polylines.barycentric[row, (least + 2) % 3]
    part = ahead / np.maximum(ahead + polylines.barycentric[row, (least + 1) % 3], np.finfo(float).tiny)
    twin = np.where(on_edge, twins[halfedge], NO_TWIN)
    other = np.where(twin == NO_TWIN, face, twin // 3)
    after = next_in_loop(polylines.offsets)
    shared = np.where((face == face[after]) | (face == other[after]), face, other)
    return shared, np.where(on_edge, halfedge, NONE), part
