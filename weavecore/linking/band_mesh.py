"""The surface between the polylines of some bands, as triangles of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.bisection import bisect_edges, bisect_long_edges
from weavecore.geometry.cut import NONE, Cells, Marks, cut_along
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends, next_halfedge
from weavecore.geometry.triangulate2d import LEAST_CROWD, lay_ladder, triangulate_polygon
from weavecore.linking.free_borders import Hem, points_on
from weavecore.linking.resample import index_at, points_at
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

_LONGEST = 0.5
_NO_FAN = 4
"""A cell of up to so many sides is cut into triangles by its diagonal."""


@dataclass(frozen=True, eq=False)
class BandMesh:
    """Triangles that fill some bands, each band apart from the others.

    A *seat* is a node as seen from one side: a node of a cut has one on either side, unless it is a free end.

    Parameters
    ----------
    points : (n, 3) float64
    triangles : (t, 3) int64
        Counter-clockwise seen from outside.
    band : (n,) int64
        The band of each point.
    seat : (n,) int64
        The seat that a point on a side belongs to, -1 of a point inside.
    seat_band, seat_node : (s,) int64
        Which node each seat is, and in which band.
    """

    points: Floats
    triangles: Ints
    band: Ints
    seat: Ints
    seat_band: Ints
    seat_node: Ints


def mesh_bands(latitudes: Latitudes, nodes: list[Floats], hem: Hem, wanted: Ints, edge_length: float) -> BandMesh:
    """Cut the wanted bands out of the surface.

    Parameters
    ----------
    latitudes : Latitudes
    nodes : list of (n,) float64
        Stations of the nodes of each polyline.
    hem : Hem
    wanted : (b,) int64
        Bands.
    edge_length : float
        Triangles come out a good deal finer than this.
    """
    bands = latitudes.bands
    sides = np.flatnonzero(np.isin(rows_of(bands.offsets), wanted))
    mesh = open_mesh(latitudes.surface)
    curves = curves_around(latitudes, mesh, nodes, hem, sides)
    cells = cut_along(mesh.faces, mesh.twins, curves.marks)
    side_curve, side_piece = _curves_of_sides(latitudes, curves, cells, sides)
    band_of_piece = np.full(max(int(cells.cell_piece.max()), int(cells.face_piece.max())) + 1, NONE, np.int64)
    band_of_piece[side_piece] = rows_of(bands.offsets)[sides]
    points, triangles, band = _triangles(mesh, curves, cells, band_of_piece)

    point, point_band, local = _apart(triangles, band, curves.marks.vertex, len(points), len(bands))
    n = np.int64(len(points))
    key = point_band * n + point
    order = np.argsort(key)
    seats = Seats(latitudes, nodes, hem, sides)
    seat = np.full(len(key), NONE, np.int64)

    def sit(curve: int, band: int, seats_along: Ints) -> None:
        part = slice(curves.offsets[curve], curves.offsets[curve + 1])
        wanted_key = band * n + curves.marks.vertex[part]
        seat[order[np.searchsorted(key, wanted_key, sorter=order)]] = seats_along[curves.index[part]]

    for rank, curve in enumerate(side_curve.tolist()):
        sit(curve, int(rows_of(bands.offsets)[sides[rank]]), seats.of_side(rank))
    n_rings = len(curves.polyline) - len(hem.selvedges)
    for s, selvedge in enumerate(hem.selvedges):
        piece = cells.edge_piece[selvedge.halfedge[0]]
        on_band = int(band_of_piece[piece]) if selvedge.closed else seats.band_of_selvedge(s)
        if on_band != NONE:
            sit(n_rings + s, on_band, seats.of_selvedge(s))
    used, number = np.unique(seat[seat != NONE], return_inverse=True)
    seat_band = np.zeros(len(used), np.int64)
    seat_band[number] = point_band[seat != NONE]
    seat[seat != NONE] = number
    whole = BandMesh(points[point], local, point_band, seat, seat_band, seats.node[used])
    return _refined(whole, *bisect_long_edges(whole.points, whole.triangles, _LONGEST * edge_length))


def _apart(triangles: Ints, band: Ints, shared: Ints, n: int, n_bands: int) -> tuple[Ints, Ints, Ints]:
    """Points numbered anew so that no two bands have one in common: old number, band, and the triangles.

    Only the points ``shared`` can lie in several bands.
    """
    is_shared = np.zeros(n, bool)
    is_shared[shared] = True
    at = is_shared[triangles]
    corner_band = np.broadcast_to(band[:, None], triangles.shape)
    key, number = np.unique(triangles[at] * np.int64(n_bands) + corner_band[at], return_inverse=True)
    band_of = np.full(n, NONE, np.int64)
    band_of[triangles[~at]] = corner_band[~at]
    single = np.flatnonzero(band_of != NONE)
    place = np.full(n, NONE, np.int64)
    place[single] = np.arange(len(single))
    local = place[triangles]
    local[at] = len(single) + number.ravel()
    return np.concatenate([single, key // n_bands]), np.concatenate([band_of[single], key % n_bands]), local


def refine_edges(mesh: BandMesh, chosen: Bools) -> BandMesh:
    """The same mesh with the chosen ones of its `unique_edges` split."""
    return _refined(mesh, *bisect_edges(mesh.points, mesh.triangles, chosen))


def _refined(mesh: BandMesh, points: Floats, triangles: Ints, origin: Ints) -> BandMesh:
    inside = np.full(len(points) - len(mesh.points), NONE, np.int64)
    seat = np.concatenate([mesh.seat, inside])
    return BandMesh(points, triangles, mesh.band[origin], seat, mesh.seat_band, mesh.seat_node)


def _curves_of_sides(latitudes: Latitudes, curves: Curves, cells: Cells, sides: Ints) -> tuple[Ints, Ints]:
    """For each side its curve, and the piece of the mesh that lies on it."""
    bands = latitudes.bands
    is_ring = curves.polyline != NONE
    on_edges = latitudes.generation[curves.polyline[is_ring]] == 0
    curve_key = 2 * curves.polyline[is_ring] + (on_edges & ~curves.is_left[is_ring])
    polyline, is_left = bands.polyline[sides], bands.is_left[sides]
    curve = np.searchsorted(curve_key, 2 * polyline + ((latitudes.generation[polyline] == 0) & ~is_left))
    mark = curves.offsets[curve]
    across = np.where(is_left, cells.left_piece[mark], cells.right_piece[mark])
    return curve, np.where(on_edges[curve], cells.edge_piece[curves.border[curve]], across)


def _triangles(mesh: OpenMesh, curves: Curves, cells: Cells, band_of_piece: Ints) -> tuple[Floats, Ints, Ints]:
    """Points, triangles and their bands: whole faces, and cells cut by a diagonal, as ladders, fans or polygons."""
    face_band = np.where(cells.face_piece == NONE, NONE, band_of_piece[cells.face_piece])
    whole = np.flatnonzero(face_band != NONE)
    cell_band = band_of_piece[cells.cell_piece]
    points = np.concatenate([mesh.vertices, curves.points])
    count = np.bincount(cells.part_cell, minlength=len(cell_band))
    first = np.empty(len(cell_band), np.int64)
    first[cells.part_cell] = np.arange(len(cells.part_cell))
    small = np.flatnonzero((cell_band != NONE) & (count <= _NO_FAN))
    second = cells.part_after[first[small]]
    third = cells.part_after[second]
    a, b, c, d = (cells.part_start[p] for p in (first[small], second, third, cells.part_after[third]))
    four = count[small] == _NO_FAN
    is_large = (cell_band != NONE) & (count > _NO_FAN)
    large = np.flatnonzero(is_large)
    part = np.flatnonzero(is_large[cells.part_cell])
    fan = np.cumsum(is_large)[cells.part_cell[part]] - 1
    start, end = cells.part_start[part], cells.part_end[part]
    size = np.maximum(np.bincount(fan, minlength=len(large)), 1)
    middle = np.stack([np.bincount(fan, points[start, k], minlength=len(large)) for k in range(3)], axis=1)
    triangles = [mesh.faces[whole], np.c_[a, b, c], np.c_[a, c, d][four]]
    band = [face_band[whole], cell_band[small], cell_band[small][four]]
    points = np.concatenate([points, middle / size[:, None]])
    n_known = len(mesh.vertices) + len(curves.points)
    normal = np.cross(points[start] - points[n_known + fan], points[end] - points[n_known + fan])
    whole_normal = np.stack([np.bincount(fan, normal[:, k], minlength=len(large)) for k in range(3)], axis=1)
    is_folded, is_fan = np.zeros(len(large), bool), np.ones(len(large), bool)
    is_folded[fan[(normal * whole_normal[fan]).sum(1) < 0]] = True
    for k in np.flatnonzero(is_folded | (count[large] >= LEAST_CROWD + 2)).tolist():
        corners = _around(cells, int(first[large[k]]), int(count[large[k]]))
        ladder = lay_ladder(points[corners])
        if ladder is None and not is_folded[k]:
            continue
        parts = triangulate_polygon(points[corners], whole_normal[k]) if ladder is None else ladder.triangles
        if parts is not None:
            more = np.zeros((0, 3)) if ladder is None else ladder.points
            number = np.concatenate([corners, len(points) + np.arange(len(more))])
            points = np.concatenate([points, more])
            triangles.append(number[parts])
            band.append(np.full(len(parts), cell_band[large[k]]))
            is_fan[k] = False
    kept = is_fan[fan]
    triangles.append(np.c_[start, end, n_known + fan][kept])
    band.append(cell_band[large][fan[kept]])
    return points, np.concatenate(triangles), np.concatenate(band)


def _around(cells: Cells, first: int, count: int) -> Ints:
    """The corners of a cell in its order, from where one of its parts starts."""
    part, parts = first, []
    for _ in range(count):
        parts.append(part)
        part = int(cells.part_after[part])
    return cells.part_start[parts]


# ----------------------------------------------------------------------
# Marks: the polylines around some bands, as curves by which the mesh is cut.
#
# A polyline of generation 0 runs along edges.  On the mesh opened along its cuts it is a border on
# each of its sides, so it gives one curve a side; any other polyline gives one curve.  Selvedges
# run along edges as well; the marks at their ends are those of the polylines that end there.

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
    after, before = _loop_around(offsets)
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


def _loop_around(offsets: Ints) -> tuple[Ints, Ints]:
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
    after, before = _loop_around(offsets)
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


# ----------------------------------------------------------------------
# The surface's mesh opened along its cuts, so that a cut is two borders.


@dataclass(frozen=True, eq=False)
class OpenMesh:
    """Vertices (V, 3), faces (F, 3) and twins (3F,): faces are those of the surface, vertices on a cut appear twice."""

    vertices: Floats
    faces: Ints
    twins: Ints


def open_mesh(surface: SurfaceMesh) -> OpenMesh:
    """The mesh itself where there is no cut."""
    if not surface.is_cut.any():
        return OpenMesh(surface.vertices, surface.faces, surface.twins)
    twins = np.where(surface.is_cut, NO_TWIN, surface.twins)
    inner = np.flatnonzero(twins != NO_TWIN)
    n = len(twins)
    links = coo_matrix((np.ones(len(inner), np.int8), (inner, next_halfedge(twins[inner]))), shape=(n, n))
    count, fan = connected_components(links, directed=False)
    vertices = np.empty((count, 3))
    vertices[fan] = surface.vertices[surface.faces.ravel()]
    return OpenMesh(vertices, fan.astype(np.int64).reshape(-1, 3), twins)


# ----------------------------------------------------------------------
# Seats: the nodes around some bands, each as it is seen from one side.

NO_SEAT = -1


class Seats:
    """Numbers of the seats along sides of bands and along selvedges.

    A selvedge shares its ends with the sides of the polylines that end there.  A curve inside the surface has two
    sides, which meet at an end that no border cuts off.

    Attributes
    ----------
    node : (s,) int64
        The node of each seat.
    """

    def __init__(self, latitudes: Latitudes, nodes: list[Floats], hem: Hem, sides: Ints) -> None:
        bands = latitudes.bands
        polyline, is_left = bands.polyline[sides], bands.is_left[sides]
        counts = np.array([len(stations) for stations in nodes], np.int64)
        first = offsets_of(counts)
        own = [first[p] + np.arange(counts[p]) for p in polyline.tolist()]
        self._offsets = offsets_of([len(row) for row in own])
        self._hem = hem
        self._band = rows_of(bands.offsets)[sides]
        self._rank = {(p, left): rank for rank, (p, left) in enumerate(zip(polyline.tolist(), is_left.tolist()))}
        self._first_of_hem = int(first[-1])
        hem_nodes = first[-1] + np.arange(len(hem.places))
        self.node: Ints = np.concatenate([np.zeros(0, np.int64), *own, hem_nodes])
        self._alias = np.arange(len(self.node))
        on_border = {end for selvedge in hem.selvedges for end in (selvedge.first, selvedge.last)}
        for p in np.flatnonzero(~latitudes.polylines.closed).tolist():
            for end in (0, 1):
                left, right = self._end(p, end, left=True), self._end(p, end, left=False)
                if (p, end) not in on_border and NO_SEAT not in (left, right):
                    self._alias[right] = left

    def of_side(self, rank: int) -> Ints:
        """The seats along a side, in the order of its polyline's nodes."""
        return self._alias[self._offsets[rank] : self._offsets[rank + 1]]

    def of_selvedge(self, s: int) -> Ints:
        """The seats along a selvedge, its ends among them."""
        selvedge, nodes = self._hem.selvedges[s], self._hem.nodes[s]
        seats: Ints = self._offsets[-1] + nodes - self._first_of_hem
        if selvedge.first is not None and selvedge.last is not None:
            # Beyond the end of a polyline lies its left side, before its beginning as well.
            seats[0] = self._end(*selvedge.first, left=selvedge.first[1] == 1)
            seats[-1] = self._end(*selvedge.last, left=selvedge.last[1] == 0)
        return seats

    def band_of_selvedge(self, s: int) -> int:
        """The band on an open selvedge; -1 where that is not among those asked for, and of closed ones."""
        first = self._hem.selvedges[s].first
        rank = NO_SEAT if first is None else self._rank.get((first[0], first[1] == 1), NO_SEAT)
        return NO_SEAT if rank == NO_SEAT else int(self._band[rank])

    def _end(self, p: int, end: int, *, left: bool) -> int:
        rank = self._rank.get((p, left), NO_SEAT)
        return NO_SEAT if rank == NO_SEAT else int(self._offsets[rank + end]) - end
