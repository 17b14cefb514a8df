"""The surface of some bands as triangles of their own, with the nodes of the lattice on its boundary.

1. The mesh, opened along its cuts, is cut along the boundary curves of the bands (`band_boundaries`, `geometry.cut`).
   What the curves leave of a face are *cells*.
2. Cells become triangles, by their number of sides:

       3 or 4             more                     a side with many marks          folded (a curve turns back)
       ┌──────┐           ┌──────┐                 ┌┬┬┬┬┬┬┐                        ear clipping of the polygon
       │    ╱ │ diagonal  │ ╲  ╱ │ fan about the   rows that halve from the        (`triangulate_polygon`)
       │ ╱    │           │ ╱  ╲ │ centroid        crowded side on (`triangulate_crowded_side`)
       └──────┘           └──────┘

3. A vertex on a curve between two bands becomes one in each, so bands share nothing.
4. Each boundary vertex belongs to the nearest node of its curve.  A node of a cut is seen from either side; each view
   is a *copy* of it, but at a free end of a curve inside the surface, where both sides meet, it is one copy.
5. Long inner edges are divided, those of needles at once (`geometry.needles`) and others by bisection, until the
   triangles are much smaller than the edges of the lattice.

Time is O(N log N) for N triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.errors import TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.bisection import bisect_edges, bisect_long_edges, expected_bisections
from weavecore.geometry.cut import NONE, CellComplex, cut_along
from weavecore.geometry.needles import divide_needles
from weavecore.geometry.triangulate2d import MIN_CROWD, triangulate_crowded_side, triangulate_polygon
from weavecore.linking.band_boundaries import BandBoundaries, OpenMesh, open_mesh, trace_band_boundaries
from weavecore.linking.free_borders import FreeBorderNodes, PolylineEnd
from weavecore.model.latitudes import Latitudes
from weavecore.model.notes import at
from weavecore.polling import each
from weavecore.texts import rough_count

_LONGEST_EDGE = 0.5
"""Part of the lattice's edge length: no inner edge of a band mesh is longer, so that two nodes next to each other
have several vertices between them."""
MOST_POINTS = 5_000_000
"""Points of a band mesh: some 4 GB with its graph.  A scan of a million faces has half of it at 100,000 nodes."""
_TRIANGLES_PER_POINT = 2
_MOST_SIDES_OF_SMALL = 4
"""A cell of up to so many sides is triangulated by a diagonal."""


@dataclass(frozen=True, eq=False)
class BandMesh:
    """Triangles that cover some bands, each band apart from the others.

    A *copy* is a node as seen from one side: a node of a cut has one on either side, unless it is a free end.

    Parameters
    ----------
    points : (n, 3) float64
    triangles : (t, 3) int64
        Counter-clockwise seen from outside.
    band : (n,) int64
        The band of each point.
    copy : (n,) int64
        The copy of a node to which a boundary point belongs, -1 of an inner point.
    copy_band, copy_node : (s,) int64
        The band in which each copy is, and its node.
    """

    points: Floats
    triangles: Ints
    band: Ints
    copy: Ints
    copy_band: Ints
    copy_node: Ints


def mesh_bands(
    latitudes: Latitudes, stations: list[Floats], border_nodes: FreeBorderNodes, bands: Ints, edge_length: float
) -> BandMesh:
    """Cut bands out of the surface.

    Parameters
    ----------
    latitudes : Latitudes
    stations : list of (n,) float64
        Of the nodes of each polyline.
    border_nodes : FreeBorderNodes
    bands : (b,) int64
        The bands to cut out.
    edge_length : float
        Of the lattice.  Inner edges of the band mesh are half as long at most.

    Raises
    ------
    TooMuchWork
        Where about `MOST_POINTS` points are not enough for that.
    """
    all_bands = latitudes.bands
    sides = np.flatnonzero(np.isin(rows_of(all_bands.offsets), bands))
    mesh = open_mesh(latitudes.surface)
    boundaries = trace_band_boundaries(latitudes, mesh, stations, border_nodes, sides)
    cells = cut_along(mesh.faces, mesh.twins, boundaries.marks)
    side_curve, side_piece = _curves_of_sides(latitudes, boundaries, cells, sides)
    band_of_piece = np.full(max(int(cells.cell_piece.max()), int(cells.face_piece.max())) + 1, NONE, np.int64)
    band_of_piece[side_piece] = rows_of(all_bands.offsets)[sides]
    points, triangles, band = _triangulate(mesh, boundaries, cells, band_of_piece)
    point, point_band, local = _separate(triangles, band, boundaries.marks.vertex, len(points), len(all_bands))

    copies = _Copies(latitudes, stations, border_nodes, sides)
    finder = _BoundaryPoints(boundaries, point_band * np.int64(len(points)) + point, len(points))
    copy = np.full(len(point), NONE, np.int64)
    for rank, curve in enumerate(side_curve.tolist()):
        at, index = finder.of_curve(curve, int(rows_of(all_bands.offsets)[sides[rank]]))
        copy[at] = copies.of_side(rank)[index]
    n_polylines = len(boundaries.polyline) - len(border_nodes.borders)
    for k, border in enumerate(border_nodes.borders):
        piece = cells.edge_piece[border.halfedge[0]]
        border_band = int(band_of_piece[piece]) if border.closed else copies.band_of_border(k)
        if border_band != NONE:
            at, index = finder.of_curve(n_polylines + k, border_band)
            copy[at] = copies.of_border(k)[index]
    used, number = np.unique(copy[copy != NONE], return_inverse=True)
    copy_band = np.zeros(len(used), np.int64)
    copy_band[number] = point_band[copy != NONE]
    copy[copy != NONE] = number
    whole = BandMesh(points[point], local, point_band, copy, copy_band, copies.node[used])
    return _with_short_edges(whole, _LONGEST_EDGE * edge_length)


def _with_short_edges(mesh: BandMesh, longest: float) -> BandMesh:
    """The same mesh with its long inner edges divided."""
    mesh = _refined(mesh, *divide_needles(mesh.points, mesh.triangles, longest))
    n_expected = expected_bisections(mesh.points, mesh.triangles, longest) / _TRIANGLES_PER_POINT
    if n_expected > MOST_POINTS:
        corners = mesh.points[mesh.triangles]
        widest = corners[np.ptp(corners, axis=1).max(1).argmax()].mean(0)
        raise TooMuchWork(
            f"Pockets in triangles with edges of {longest:.4g} at most would have about {rough_count(n_expected)} "
            f"points, more than {MOST_POINTS:,}; the largest triangle lies near {at(widest)}",
            remedy="Use longer edges or a larger spacing.",
            points=[widest.tolist()],
        )
    return _refined(mesh, *bisect_long_edges(mesh.points, mesh.triangles, longest))


def split_edges_of(mesh: BandMesh, chosen: Bools) -> BandMesh:
    """The same mesh with some inner edges bisected.

    Parameters
    ----------
    mesh : BandMesh
    chosen : (E,) bool
        Of its `unique_edges`.
    """
    return _refined(mesh, *bisect_edges(mesh.points, mesh.triangles, chosen))


def _refined(mesh: BandMesh, points: Floats, triangles: Ints, origin: Ints) -> BandMesh:
    inner = np.full(len(points) - len(mesh.points), NONE, np.int64)
    copy = np.concatenate([mesh.copy, inner])
    return BandMesh(points, triangles, mesh.band[origin], copy, mesh.copy_band, mesh.copy_node)


def _curves_of_sides(
    latitudes: Latitudes, boundaries: BandBoundaries, cells: CellComplex, sides: Ints
) -> tuple[Ints, Ints]:
    """For each side its boundary curve, and the piece of the mesh that lies on it."""
    bands = latitudes.bands
    is_ring = boundaries.polyline != NONE
    on_edges = latitudes.generation[boundaries.polyline[is_ring]] == 0
    curve_key = 2 * boundaries.polyline[is_ring] + (on_edges & ~boundaries.is_left[is_ring])
    polyline, is_left = bands.polyline[sides], bands.is_left[sides]
    curve = np.searchsorted(curve_key, 2 * polyline + ((latitudes.generation[polyline] == 0) & ~is_left))
    mark = boundaries.offsets[curve]
    across = np.where(is_left, cells.left_piece[mark], cells.right_piece[mark])
    return curve, np.where(on_edges[curve], cells.edge_piece[boundaries.first_halfedge[curve]], across)


def _triangulate(
    mesh: OpenMesh, boundaries: BandBoundaries, cells: CellComplex, band_of_piece: Ints
) -> tuple[Floats, Ints, Ints]:
    """Points, triangles and the band of each triangle: whole faces, small cells, and large cells."""
    points = np.concatenate([mesh.vertices, boundaries.points])
    face_band = np.where(cells.face_piece == NONE, NONE, band_of_piece[cells.face_piece])
    whole = np.flatnonzero(face_band != NONE)
    small, small_cell = _small_cells(cells, band_of_piece)
    large_points, large, large_cell = _large_cells(cells, points, band_of_piece)
    cell_band = band_of_piece[cells.cell_piece]
    triangles = np.concatenate([mesh.faces[whole], small, large])
    band = np.concatenate([face_band[whole], cell_band[small_cell], cell_band[large_cell]])
    return np.concatenate([points, large_points]), triangles, band


def _side_counts(cells: CellComplex) -> Ints:
    return np.bincount(cells.part_cell, minlength=len(cells.cell_piece))


def _a_part_of_each(cells: CellComplex) -> Ints:
    """(C,) the last part of each cell."""
    part = np.empty(len(cells.cell_piece), np.int64)
    part[cells.part_cell] = np.arange(len(cells.part_cell))
    return part


def _small_cells(cells: CellComplex, band_of_piece: Ints) -> tuple[Ints, Ints]:
    """Triangles (t, 3) of the cells of three or four sides in wanted bands, and the cell of each."""
    n_sides = _side_counts(cells)
    cell = np.flatnonzero((band_of_piece[cells.cell_piece] != NONE) & (n_sides <= _MOST_SIDES_OF_SMALL))
    first = _a_part_of_each(cells)[cell]
    second = cells.part_after[first]
    third = cells.part_after[second]
    a, b, c, d = (cells.part_start[p] for p in (first, second, third, cells.part_after[third]))
    four = n_sides[cell] == _MOST_SIDES_OF_SMALL
    return np.concatenate([np.c_[a, b, c], np.c_[a, c, d][four]]), np.concatenate([cell, cell[four]])


@dataclass(frozen=True, eq=False)
class _Fans:
    """Fans about the centroids of large cells.

    Parameters
    ----------
    cell : (L,) int64
    centroid : (L, 3) float64
    fan, start, end : (s,) int64
        The fan of each side of these cells, and the points where the side starts and ends, the cell on its left.
    normal : (L, 3) float64
        Area vectors of the cells, doubled.
    is_folded : (L,) bool
        Whether some triangles of a fan are inverted.
    """

    cell: Ints
    centroid: Floats
    fan: Ints
    start: Ints
    end: Ints
    normal: Floats
    is_folded: Bools


def _fans_of(cells: CellComplex, points: Floats, band_of_piece: Ints) -> _Fans:
    is_large = (band_of_piece[cells.cell_piece] != NONE) & (_side_counts(cells) > _MOST_SIDES_OF_SMALL)
    cell = np.flatnonzero(is_large)
    part = np.flatnonzero(is_large[cells.part_cell])
    fan = np.cumsum(is_large)[cells.part_cell[part]] - 1
    start, end = cells.part_start[part], cells.part_end[part]
    centroid = _sum_by(fan, points[start], len(cell)) / np.maximum(np.bincount(fan, minlength=len(cell)), 1)[:, None]
    area = np.cross(points[start] - centroid[fan], points[end] - centroid[fan])
    normal = _sum_by(fan, area, len(cell))
    is_folded = np.zeros(len(cell), bool)
    is_folded[fan[(area * normal[fan]).sum(1) < 0]] = True
    return _Fans(cell, centroid, fan, start, end, normal, is_folded)


def _sum_by(group: Ints, vectors: Floats, n: int) -> Floats:
    return np.stack([np.bincount(group, vectors[:, k], minlength=n) for k in range(3)], axis=1)


def _large_cells(cells: CellComplex, points: Floats, band_of_piece: Ints) -> tuple[Floats, Ints, Ints]:
    """More points, triangles (t, 3) and the cell of each: fans, but rows or polygons where fans would be poor."""
    fans = _fans_of(cells, points, band_of_piece)
    n_sides, first = _side_counts(cells)[fans.cell], _a_part_of_each(cells)[fans.cell]
    is_fan = np.ones(len(fans.cell), bool)
    more, triangles, cell = [fans.centroid], [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    n_points = len(points) + len(fans.centroid)
    for k in each(np.flatnonzero(fans.is_folded | (n_sides >= MIN_CROWD + 2)).tolist()):
        corners = _corners_of(cells, int(first[k]), int(n_sides[k]))
        normal = fans.normal[k] if fans.is_folded[k] else None
        found = _rows_or_polygon(points[corners], normal)
        if found is not None:
            row_points, parts = found
            number = np.concatenate([corners, n_points + np.arange(len(row_points))])
            n_points += len(row_points)
            more.append(row_points)
            triangles.append(number[parts])
            cell.append(np.full(len(parts), fans.cell[k]))
            is_fan[k] = False
    kept = is_fan[fans.fan]
    triangles.append(np.c_[fans.start, fans.end, len(points) + fans.fan][kept])
    cell.append(fans.cell[fans.fan[kept]])
    return np.concatenate(more), np.concatenate(triangles), np.concatenate(cell)


def _rows_or_polygon(polygon: Floats, normal: Optional[Floats]) -> Optional[tuple[Floats, Ints]]:
    """New points and triangles of a polygon with one crowded side, or if it has none of one with a ``normal``."""
    rows = triangulate_crowded_side(polygon)
    if rows is not None:
        return rows.points, rows.triangles
    parts = None if normal is None else triangulate_polygon(polygon, normal)
    return None if parts is None else (np.zeros((0, 3)), parts)


def _corners_of(cells: CellComplex, first: int, count: int) -> Ints:
    """The corners of a cell in its order, from where one of its parts starts."""
    part, parts = first, []
    for _ in range(count):
        parts.append(part)
        part = int(cells.part_after[part])
    return cells.part_start[parts]


def _separate(triangles: Ints, band: Ints, shared: Ints, n: int, n_bands: int) -> tuple[Ints, Ints, Ints]:
    """Points numbered anew so that no two bands have one in common.

    Parameters
    ----------
    triangles : (t, 3) int64
    band : (t,) int64
    shared : (k,) int64
        The points that can lie in several bands.
    n, n_bands : int
        Number of points and of bands.

    Returns
    -------
    point, point_band : (n',) int64
        Old number and band of each new point.
    triangles : (t, 3) int64
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


class _BoundaryPoints:
    """Finds the points of a band mesh that lie on a boundary curve.

    Parameters
    ----------
    boundaries : BandBoundaries
    key : (n',) int64
        ``band * n + vertex`` of each point of the band mesh.
    n : int
        Number of vertices before bands were separated.
    """

    def __init__(self, boundaries: BandBoundaries, key: Ints, n: int) -> None:
        self._boundaries = boundaries
        self._key = key
        self._order = np.argsort(key)
        self._n = np.int64(n)

    def of_curve(self, curve: int, band: int) -> tuple[Ints, Ints]:
        """The points along a curve as a band has them, and the index of the nearest node of each."""
        part = slice(self._boundaries.offsets[curve], self._boundaries.offsets[curve + 1])
        wanted = band * self._n + self._boundaries.marks.vertex[part]
        at = self._order[np.searchsorted(self._key, wanted, sorter=self._order)]
        return at, self._boundaries.node_index[part]


class _Copies:
    """Numbers of the copies of nodes along the sides of some bands and along free borders.

    A free border shares its ends with the sides of the polylines that end there.  A curve inside the surface has two
    sides, which meet at an end that is on no border.

    Parameters
    ----------
    latitudes : Latitudes
    stations : list of (n,) float64
        Of the nodes of each polyline.
    border_nodes : FreeBorderNodes
    sides : (s,) int64
        Sides of `Bands`.

    Attributes
    ----------
    node : (c,) int64
        The node of each copy.
    """

    def __init__(
        self, latitudes: Latitudes, stations: list[Floats], border_nodes: FreeBorderNodes, sides: Ints
    ) -> None:
        bands = latitudes.bands
        polyline, is_left = bands.polyline[sides], bands.is_left[sides]
        counts = np.array([len(own) for own in stations], np.int64)
        first = offsets_of(counts)
        own = [first[p] + np.arange(counts[p]) for p in polyline.tolist()]
        self._offsets = offsets_of([len(row) for row in own])
        self._border_nodes = border_nodes
        self._band = rows_of(bands.offsets)[sides]
        self._rank = {(p, left): rank for rank, (p, left) in enumerate(zip(polyline.tolist(), is_left.tolist()))}
        self._first_on_border = int(first[-1])
        on_borders = first[-1] + np.arange(len(border_nodes.points))
        self.node: Ints = np.concatenate([np.zeros(0, np.int64), *own, on_borders])
        self._alias = np.arange(len(self.node))
        border_ends = {end for border in border_nodes.borders for end in (border.first, border.last)}
        for p in np.flatnonzero(~latitudes.polylines.closed).tolist():
            for end in (PolylineEnd(p, 0), PolylineEnd(p, 1)):
                left, right = self._at_end(end, left=True), self._at_end(end, left=False)
                if end not in border_ends and NONE not in (left, right):
                    self._alias[right] = left

    def of_side(self, rank: int) -> Ints:
        """The copies along a side, in the order of its polyline's nodes."""
        return self._alias[self._offsets[rank] : self._offsets[rank + 1]]

    def of_border(self, k: int) -> Ints:
        """The copies along a free border, its ends among them."""
        border, nodes = self._border_nodes.borders[k], self._border_nodes.nodes[k]
        copies: Ints = self._offsets[-1] + nodes - self._first_on_border
        if border.first is not None and border.last is not None:
            # Beyond the end of a polyline lies its left side, before its beginning as well.
            copies[0] = self._at_end(border.first, left=border.first.is_last == 1)
            copies[-1] = self._at_end(border.last, left=border.last.is_last == 0)
        return copies

    def band_of_border(self, k: int) -> int:
        """The band on an open free border; -1 where that is not among the wanted ones, and of closed borders."""
        first = self._border_nodes.borders[k].first
        rank = NONE if first is None else self._rank.get((first.polyline, first.is_last == 1), NONE)
        return NONE if rank == NONE else int(self._band[rank])

    def _at_end(self, end: PolylineEnd, *, left: bool) -> int:
        rank = self._rank.get((end.polyline, left), NONE)
        return NONE if rank == NONE else PolylineEnd(rank, end.is_last).element(self._offsets)
