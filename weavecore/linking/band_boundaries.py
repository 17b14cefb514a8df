"""The boundary curves of bands, sampled and located on the mesh, so that the mesh can be cut along them.

A band is bounded by polylines and by free borders.  Each boundary curve is the row of its points and of
`SAMPLES_PER_EDGE` samples between neighbouring nodes of the lattice; every mark of it knows the nearest node:

      node 2            node 3            node 4        ●  node of the lattice (not a mark itself)
    ────●────·──┬──·──┬──·●───·──┬──·─────·──●──        ┬  point of the polyline: it splits an edge of the mesh
                                                        ·  sample: it lies within a face, or splits a border edge

* A polyline of generation 0 runs along edges of the mesh.  On the mesh opened along its cuts it is a border on
  each of its sides, so it gives one curve a side.
* Any other polyline crosses faces and gives one curve, which parts the band on its left from the one on its right.
* A free border runs along border edges; the marks at its ends are those of the polylines that end there.

Time is linear in the number of marks, but for binary searches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cut import NONE, Marks
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge
from weavecore.linking.arc_length import index_at, points_at
from weavecore.linking.free_borders import FreeBorder, FreeBorderNodes, points_on_border
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

SAMPLES_PER_EDGE = 4
"""Samples between neighbouring nodes: nearest nodes change halfway, so two samples belong to either."""
_ON_EDGE = 1e-9
"""A point whose least barycentric coordinate is below this lies on an edge."""
_SAME_STATION = 1e-9
"""Part of a curve's length: a sample nearer than this to a point of the curve is left out."""


@dataclass(frozen=True, eq=False)
class OpenMesh:
    """The surface's mesh opened along its cuts: faces are those of the surface, vertices on a cut appear twice.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
        -1 on borders and along cuts.
    """

    vertices: Floats
    faces: Ints
    twins: Ints


def open_mesh(surface: SurfaceMesh) -> OpenMesh:
    """Open a surface along its cuts, so that each cut becomes two borders.

    Parameters
    ----------
    surface : SurfaceMesh
    """
    if not surface.is_cut.any():
        return OpenMesh(surface.vertices, surface.faces, surface.twins)
    twins = np.where(surface.is_cut, NO_TWIN, surface.twins)
    inner = np.flatnonzero(twins != NO_TWIN)
    n = len(twins)
    # Corners that are connected across inner edges make one vertex.
    links = coo_matrix((np.ones(len(inner), np.int8), (inner, next_halfedge(twins[inner]))), shape=(n, n))
    count, fan = connected_components(links, directed=False)
    vertices = np.empty((count, 3))
    vertices[fan] = surface.vertices[surface.faces.ravel()]
    return OpenMesh(vertices, fan.astype(np.int64).reshape(-1, 3), twins)


@dataclass(frozen=True, eq=False)
class BandBoundaries:
    """The boundary curves along polylines, then those along free borders.

    Parameters
    ----------
    marks : Marks
        All curves, located on the open mesh; those along free borders have no marks of their own at their ends.
    points : (M, 3) float64
        Of the marks.
    offsets : (K+1,) int64
        Marks of each curve.
    polyline : (K,) int64
        Of a free border -1.
    is_left : (K,) bool
        Of a curve along edges: whether it is the left side of its polyline.
    node_index : (M,) int64
        Which node of its polyline or free border is nearest to each mark along the curve.
    along : (M,) int64
        Of a curve along edges: the border halfedge on which each mark lies; of others -1.
    """

    marks: Marks
    points: Floats
    offsets: Ints
    polyline: Ints
    is_left: Bools
    node_index: Ints
    along: Ints


@dataclass(frozen=True, eq=False)
class _SampledPolylines:
    """Curves along polylines with their samples, not yet located on the mesh.

    Parameters
    ----------
    polyline : (K,) int64
    is_left : (K,) bool
        The side of the polyline, where it runs along edges.
    offsets : (K+1,) int64
        Marks of each curve.
    start : (M,) int64
        The point of the polyline at or before each mark.
    station : (M,) float64
    node_index : (M,) int64
        The nearest node.
    """

    polyline: Ints
    is_left: Bools
    offsets: Ints
    start: Ints
    station: Floats
    node_index: Ints


def trace_band_boundaries(
    latitudes: Latitudes, mesh: OpenMesh, stations: list[Floats], border_nodes: FreeBorderNodes, sides: Ints
) -> BandBoundaries:
    """The boundary curves of some sides of bands, and those of all free borders.

    Parameters
    ----------
    latitudes : Latitudes
    mesh : OpenMesh
        Of its surface.
    stations : list of (n,) float64
        Of the nodes of each polyline.
    border_nodes : FreeBorderNodes
    sides : (s,) int64
        Sides of `Bands`.
    """
    sampled = _sample_polylines(latitudes, stations, sides)
    return _with_free_borders(_locate(latitudes, mesh, sampled), mesh, border_nodes)


def _sample_polylines(latitudes: Latitudes, stations: list[Floats], sides: Ints) -> _SampledPolylines:
    """One curve for each polyline, or for each of its sides where it runs along edges."""
    bands, polylines = latitudes.bands, latitudes.polylines
    polyline, is_left = bands.polyline[sides], bands.is_left[sides]
    on_edges = latitudes.generation[polyline] == 0
    _, first = np.unique(2 * polyline + (on_edges & ~is_left), return_index=True)
    polyline, is_left = polyline[first], is_left[first]
    rows = []
    for p in polyline.tolist():
        known = polylines.stations[polylines.offsets[p] : polylines.offsets[p + 1]]
        length, closed = float(polylines.lengths[p]), bool(polylines.closed[p])
        start, station, index = _insert_samples(known, length, stations[p], closed=closed)
        rows.append((start + polylines.offsets[p], station, index))
    start, station, index = (np.concatenate(column) for column in zip(*rows))
    return _SampledPolylines(polyline, is_left, offsets_of([len(row[0]) for row in rows]), start, station, index)


def _insert_samples(known: Floats, length: float, nodes: Floats, *, closed: bool) -> tuple[Ints, Floats, Ints]:
    """Stations of a curve's points and of samples between its nodes.

    Parameters
    ----------
    known : (n,) float64
        Stations of the points.
    length : float
    nodes : (k,) float64
        Stations of the nodes.
    closed : bool

    Returns
    -------
    start : (m,) int64
        The point at or before each mark.
    station : (m,) float64
    node_index : (m,) int64
        The nearest node.
    """
    around = np.append(nodes, nodes[0] + length) if closed else nodes
    samples = around[:-1, None] + np.diff(around)[:, None] * np.arange(SAMPLES_PER_EDGE) / SAMPLES_PER_EDGE
    samples = np.sort(samples.ravel() % length)
    at = np.searchsorted(known, samples, side="right") - 1
    beyond = np.append(known, length)[at + 1]
    least = _SAME_STATION * length
    samples = samples[(samples - known[at] > least) & (beyond - samples > least)]
    station = np.concatenate([known, samples])
    is_sample = np.arange(len(station)) >= len(known)
    order = np.argsort(station, kind="stable")
    station = station[order]
    start = np.cumsum(~is_sample[order]) - 1
    index = np.floor(index_at(nodes, length, station, closed=closed) + 0.5).astype(np.int64) % len(nodes)
    return start, station, index


def _locate(latitudes: Latitudes, mesh: OpenMesh, sampled: _SampledPolylines) -> BandBoundaries:
    """The curves along polylines with the edge that each mark splits and the face of each segment."""
    offsets, start = sampled.offsets, sampled.start
    n = len(start)
    after, before = _neighbours_around(offsets)
    is_point = start != np.where(before < np.arange(n), start[before], NONE)
    is_point[offsets[:-1]] = True
    on_edges = (latitudes.generation[sampled.polyline] == 0)[rows_of(offsets)]
    vertex = len(mesh.vertices) + np.arange(n)
    halfedge = np.full(n, NONE, np.int64)
    part = np.zeros(n)
    face = np.full(n, NONE, np.int64)
    along = np.full(n, NONE, np.int64)

    at = np.flatnonzero(on_edges)
    along[at], corner_vertex, edge_part = _locate_on_edges(latitudes, mesh, sampled, at)
    vertex[at] = np.where(is_point[at], corner_vertex, vertex[at])
    halfedge[at] = np.where(is_point[at], NONE, along[at])
    part[at] = np.where(is_point[at], 0.0, edge_part)

    polylines = latitudes.polylines
    at = np.flatnonzero(~on_edges)
    segment_face, split_halfedge, split_part = _faces_of_segments(polylines, mesh.twins)
    face[at] = segment_face[start[at]]
    face[offsets[1:][~polylines.closed[sampled.polyline]] - 1] = NONE
    own = at[is_point[at]]
    crossing = own[face[own] != face[before[own]]]
    halfedge[crossing] = split_halfedge[start[crossing]]
    part[crossing] = split_part[start[crossing]]

    points = points_at(polylines, sampled.polyline[rows_of(offsets)], sampled.station)
    marks = Marks(after, before, vertex, halfedge, part, face)
    return BandBoundaries(marks, points, offsets, sampled.polyline, sampled.is_left, sampled.node_index, along)


def _locate_on_edges(
    latitudes: Latitudes, mesh: OpenMesh, sampled: _SampledPolylines, at: Ints
) -> tuple[Ints, Ints, Floats]:
    """Of marks ``at`` along edges: the border halfedge, the vertex at or before each, and where a sample splits it."""
    polylines, start = latitudes.polylines, sampled.start[at]
    is_left = sampled.is_left[rows_of(sampled.offsets)[at]]
    # The end of an open polyline lies on the halfedge before it.
    is_end = start == np.where(polylines.closed, NONE, polylines.offsets[1:] - 1)[polylines.owner[start]]
    along = _border_halfedges(latitudes, mesh, start - is_end, is_left)
    # On the right side the halfedge runs against the polyline, so its head is the segment's first point.
    corner = np.where(is_left != is_end, along, next_halfedge(along))
    length = np.maximum(polylines.segment_lengths[start], np.finfo(float).tiny)
    share = (sampled.station[at] - polylines.stations[start]) / length
    return along, mesh.faces.ravel()[corner], np.where(is_left, share, 1.0 - share)


def _border_halfedges(latitudes: Latitudes, mesh: OpenMesh, start: Ints, is_left: Bools) -> Ints:
    """The halfedge on the wanted side of segments of generation 0; on the left it runs along with the segment."""
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
    halfedges: Ints = border[found]
    return halfedges


def _faces_of_segments(polylines: Polylines, twins: Ints) -> tuple[Ints, Ints, Floats]:
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


def _with_free_borders(boundaries: BandBoundaries, mesh: OpenMesh, border_nodes: FreeBorderNodes) -> BandBoundaries:
    """The same curves, and those along the free borders without the marks at their ends."""
    borders = border_nodes.borders
    if not borders:
        return boundaries
    n_marks = len(boundaries.node_index)
    rows = [_locate_on_border(border, at, mesh) for border, at in zip(borders, border_nodes.stations)]
    offsets = offsets_of([len(row[0]) for row in rows])
    vertex, halfedge, part, points, index, along = (np.concatenate(column) for column in zip(*rows))
    vertex = np.where(vertex == NONE, len(mesh.vertices) + n_marks + np.arange(len(vertex)), vertex)
    after, before = _neighbours_around(offsets)
    old = boundaries.marks
    return BandBoundaries(
        Marks(
            np.concatenate([old.after, n_marks + after]),
            np.concatenate([old.before, n_marks + before]),
            np.concatenate([old.vertex, vertex]),
            np.concatenate([old.halfedge, halfedge]),
            np.concatenate([old.part, part]),
            np.concatenate([old.face, np.full(len(vertex), NONE, np.int64)]),
        ),
        np.concatenate([boundaries.points, points]),
        np.concatenate([boundaries.offsets, n_marks + offsets[1:]]),
        np.concatenate([boundaries.polyline, np.full(len(borders), NONE)]),
        np.concatenate([boundaries.is_left, np.ones(len(borders), bool)]),
        np.concatenate([boundaries.node_index, index]),
        np.concatenate([boundaries.along, along]),
    )


def _locate_on_border(
    border: FreeBorder, nodes: Floats, mesh: OpenMesh
) -> tuple[Ints, Ints, Floats, Floats, Ints, Ints]:
    """Marks of a free border: vertex or -1, halfedge that it splits, part of it, point, nearest node, halfedge."""
    start, station, index = _insert_samples(border.stations, border.length, nodes, closed=border.closed)
    is_point = np.diff(start, prepend=NONE) > 0
    if not border.closed:
        start, station, index, is_point = start[1:-1], station[1:-1], index[1:-1], is_point[1:-1]
    halfedge = border.halfedge[start]
    size = np.diff(np.append(border.stations, border.length))[start]
    # The halfedge on which the last segment lies ends beyond it, as the first may begin before.
    ends = np.append(border.part[1:], 1.0)[start]
    ends = np.where(ends > border.part[start], ends, 1.0)
    part = border.part[start] + (ends - border.part[start]) * (station - border.stations[start]) / size
    vertex = np.where(is_point, mesh.faces.ravel()[halfedge], NONE)
    points = points_on_border(border, station)
    return vertex, np.where(is_point, NONE, halfedge), np.where(is_point, 0.0, part), points, index, halfedge


def _neighbours_around(offsets: Ints) -> tuple[Ints, Ints]:
    """The mark after and the one before each, around its curve."""
    after = next_in_loop(offsets)
    before = np.empty(len(after), np.int64)
    before[after] = np.arange(len(after))
    return after, before
