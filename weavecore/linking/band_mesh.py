"""The surface between the polylines of some bands, as triangles of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.bisecting import bisect_edges, bisect_long_edges
from weavecore.geometry.cutting import NONE, Cells, cut_along
from weavecore.geometry.laddering import LEAST_CROWD, lay_ladder
from weavecore.geometry.planar import triangulate_polygon
from weavecore.linking.band_marks import Curves, curves_around
from weavecore.linking.open_mesh import OpenMesh, open_mesh
from weavecore.linking.seats import Seats
from weavecore.linking.selvedges import Hem
from weavecore.model.latitudes import Latitudes

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
