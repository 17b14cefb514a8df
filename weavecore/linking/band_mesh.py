"""The surface of some bands as triangles of their own, with the nodes of the lattice on its boundary.

1. The mesh, opened along its cuts, is cut along the boundary curves of the bands (`band_boundaries`, `geometry.cut`):
   all of it, or a *window*, the faces around some points.  What the curves leave of a face are *cells*.
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

from dataclasses import dataclass, replace
from itertools import product
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, ranges, rows_of, sorted_unique
from weavecore.geometry.bisection import bisect_edges, bisect_long_edges, expected_bisections
from weavecore.geometry.cut import NONE, CellComplex, Marks, cut_along
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
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
    is_outer : (n,) bool
        Points where the mesh ends though its band goes on.
    """

    points: Floats
    triangles: Ints
    band: Ints
    copy: Ints
    copy_band: Ints
    copy_node: Ints
    is_outer: Bools


@dataclass(frozen=True, eq=False)
class _Window:
    """Some faces of an open mesh, as a mesh of their own with the same vertices.

    Parameters
    ----------
    faces : (f, 3) int64
    twins : (3f,) int64
    is_outer : (V,) bool
        Vertices of edges beyond which a face was left out.
    number : (F,) int64
        Number of each face of the whole mesh here, -1 where it was left out.
    """

    faces: Ints
    twins: Ints
    is_outer: Bools
    number: Ints

    def halfedges(self, halfedge: Ints) -> Ints:
        """The same halfedges here, -1 where there are none."""
        face = np.where(halfedge == NONE, NONE, self.number[halfedge // 3])
        return np.where(face == NONE, NONE, 3 * face + halfedge % 3)

    def marks(self, marks: Marks, twins: Ints) -> Marks:
        """The marks of curves on the whole mesh, with its ``twins``, on the edges and faces that are here."""
        here = self.halfedges(marks.halfedge)
        twin = np.where(marks.halfedge == NONE, NONE, twins[marks.halfedge])
        there = self.halfedges(twin)
        is_turned = (here == NONE) & (there != NONE)
        face = np.where(marks.face == NONE, NONE, self.number[marks.face])
        part = np.where(is_turned, 1.0 - marks.part, marks.part)
        return replace(marks, halfedge=np.where(is_turned, there, here), part=part, face=face)


def _window(mesh: OpenMesh, kept: Ints) -> _Window:
    """Some faces of a mesh."""
    n = len(mesh.faces)
    number = np.full(n, NONE, np.int64)
    number[kept] = np.arange(len(kept))
    twins = mesh.twins.reshape(-1, 3)[kept].ravel()
    face = np.where(twins == NO_TWIN, NONE, number[twins // 3])
    faces = mesh.faces[kept]
    is_outer = np.zeros(len(mesh.vertices), bool)
    for end in halfedge_ends(faces):
        is_outer[end[(face == NONE) & (twins != NO_TWIN)]] = True
    return _Window(faces, np.where(face == NONE, NO_TWIN, 3 * face + twins % 3), is_outer, number)


def _faces_near(mesh: OpenMesh, side_lengths: Floats, near: Floats, reach: float) -> Ints:
    """The faces that come within reach of some points, and a few more; ``side_lengths`` (3F,) are of all faces."""
    most = reach + float(side_lengths.max(initial=0.0))
    is_maybe = _are_in_cubes_around(mesh.vertices, near, most)
    maybe = np.flatnonzero(is_maybe)
    distance = np.full(len(mesh.vertices), np.inf)
    distance[maybe] = cKDTree(near).query(mesh.vertices[maybe], distance_upper_bound=most)[0]
    face = np.flatnonzero(is_maybe[mesh.faces].any(1))
    least = distance[mesh.faces[face]].min(1)
    # No point of a face is further from one of its corners than its longest side.
    near_faces: Ints = face[least <= reach + side_lengths.reshape(-1, 3)[face].max(1)]
    return near_faces


def _are_in_cubes_around(points: Floats, near: Floats, size: float) -> Bools:
    """Whether points lie in the cube of one of some others, or in one beside it; all within its size do."""
    low = np.minimum(points.min(0), near.min(0)) - size
    shape = ((np.maximum(points.max(0), near.max(0)) - low) / size).astype(np.int64) + 2
    steps = np.array([1, shape[0], shape[0] * shape[1]])
    cubes = sorted_unique(((near - low) / size).astype(np.int64) @ steps)
    around = cubes[:, None] + np.array(list(product((-1, 0, 1), repeat=3))) @ steps
    at = ((points - low) / size).astype(np.int64) @ steps
    return np.isin(at, sorted_unique(around.ravel()))


def mesh_bands(
    latitudes: Latitudes,
    stations: list[Floats],
    border_nodes: FreeBorderNodes,
    bands: Ints,
    edge_length: float,
    *,
    near: Optional[Floats] = None,
    reach: float = 0.0,
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
    near : (k, 3) float64, optional
        Faces beyond ``reach`` from these points are left out.
    reach : float

    Raises
    ------
    TooMuchWork
        Where about `MOST_POINTS` points are not enough for that.
    """
    all_bands = latitudes.bands
    sides = np.flatnonzero(np.isin(rows_of(all_bands.offsets), bands))
    mesh = open_mesh(latitudes.surface)
    every = np.arange(len(mesh.faces))
    window = _window(mesh, every if near is None else _faces_near(mesh, latitudes.surface.edge_lengths, near, reach))
    boundaries = trace_band_boundaries(latitudes, mesh, stations, border_nodes, sides)
    marks = window.marks(boundaries.marks, mesh.twins)
    cells = cut_along(window.faces, window.twins, marks)
    along = window.halfedges(boundaries.along)
    side_curve = _curves_of_sides(latitudes, boundaries, sides)
    band_of_piece = _bands_of_pieces(latitudes, boundaries, cells, along, sides, side_curve)
    vertices = np.concatenate([mesh.vertices, boundaries.points])
    points, triangles, band = _triangulate(window.faces, vertices, cells, band_of_piece)
    point, point_band, local = _separate(triangles, band, boundaries.marks.vertex, len(points), len(all_bands))

    copies = _Copies(latitudes, stations, border_nodes, sides)
    finder = _BoundaryPoints(boundaries, point_band * np.int64(len(points)) + point, len(points))
    copy = np.full(len(point), NONE, np.int64)
    for rank, curve in enumerate(side_curve.tolist()):
        at, index = finder.of_curve(curve, int(rows_of(all_bands.offsets)[sides[rank]]))
        copy[at] = copies.of_side(rank)[index]
    n_polylines = len(boundaries.polyline) - len(border_nodes.borders)
    for k, border in enumerate(border_nodes.borders):
        on_border = along[boundaries.offsets[n_polylines + k] : boundaries.offsets[n_polylines + k + 1]]
        own = band_of_piece[cells.edge_piece[on_border[on_border != NONE]]]
        border_band = int(own.max(initial=NONE)) if border.closed else copies.band_of_border(k)
        if border_band != NONE:
            at, index = finder.of_curve(n_polylines + k, border_band)
            copy[at] = copies.of_border(k)[index]
    is_outer = _outer_points(window, marks, len(points))[point]
    used, number = np.unique(copy[copy != NONE], return_inverse=True)
    copy_band = np.zeros(len(used), np.int64)
    copy_band[number] = point_band[copy != NONE]
    copy[copy != NONE] = number
    whole = BandMesh(points[point], local, point_band, copy, copy_band, copies.node[used], is_outer)
    return _with_short_edges(whole, _LONGEST_EDGE * edge_length)


def _with_short_edges(mesh: BandMesh, longest: float) -> BandMesh:
    """The same mesh with its long inner edges divided."""
    mesh = _refined(mesh, *divide_needles(mesh.points, mesh.triangles, longest))
    n_triangles = expected_bisections(mesh.points, mesh.triangles, longest, is_loose=mesh.is_outer)
    n_expected = n_triangles / _TRIANGLES_PER_POINT
    if n_expected > MOST_POINTS:
        corners = mesh.points[mesh.triangles]
        widest = corners[np.ptp(corners, axis=1).max(1).argmax()].mean(0)
        raise TooMuchWork(
            f"Pockets in triangles with edges of {longest:.4g} at most would have about {rough_count(n_expected)} "
            f"points, more than {MOST_POINTS:,}; the largest triangle lies near {at(widest)}",
            remedy="Use longer edges or a larger spacing.",
            points=[widest.tolist()],
        )
    return _refined(mesh, *bisect_long_edges(mesh.points, mesh.triangles, longest, is_loose=mesh.is_outer))


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
    copy, is_outer = np.concatenate([mesh.copy, inner]), np.concatenate([mesh.is_outer, np.zeros(len(inner), bool)])
    return BandMesh(points, triangles, mesh.band[origin], copy, mesh.copy_band, mesh.copy_node, is_outer)


def _curves_of_sides(latitudes: Latitudes, boundaries: BandBoundaries, sides: Ints) -> Ints:
    """The boundary curve of each side."""
    bands = latitudes.bands
    is_ring = boundaries.polyline != NONE
    on_edges = latitudes.generation[boundaries.polyline[is_ring]] == 0
    curve_key = 2 * boundaries.polyline[is_ring] + (on_edges & ~boundaries.is_left[is_ring])
    polyline, is_left = bands.polyline[sides], bands.is_left[sides]
    curve: Ints = np.searchsorted(curve_key, 2 * polyline + ((latitudes.generation[polyline] == 0) & ~is_left))
    return curve


def _bands_of_pieces(
    latitudes: Latitudes, boundaries: BandBoundaries, cells: CellComplex, along: Ints, sides: Ints, curve: Ints
) -> Ints:
    """The band of each piece that lies on a side of one of the wanted bands, -1 of the others."""
    bands = latitudes.bands
    n_marks = np.diff(boundaries.offsets)[curve]
    mark, side = ranges(boundaries.offsets[curve], n_marks), np.repeat(sides, n_marks)
    across = np.where(bands.is_left[side], cells.left_piece[mark], cells.right_piece[mark])
    on_edges = latitudes.generation[bands.polyline[side]] == 0
    beside = np.where(along[mark] == NONE, NONE, cells.edge_piece[along[mark]])
    piece = np.where(on_edges, beside, across)
    band_of_piece = np.full(max(int(cells.cell_piece.max(initial=NONE)), int(cells.face_piece.max())) + 1, NONE)
    band_of_piece[piece[piece != NONE]] = rows_of(bands.offsets)[side[piece != NONE]]
    return band_of_piece


def _outer_points(window: _Window, marks: Marks, n: int) -> Bools:
    """(n,) the outer vertices of a window, and the marks between two of them on an edge where it ends."""
    is_outer = np.zeros(n, bool)
    is_outer[: len(window.is_outer)] = window.is_outer
    split = np.flatnonzero(marks.halfedge != NONE)
    split = split[window.twins[marks.halfedge[split]] == NO_TWIN]
    tail, head = (ends[marks.halfedge[split]] for ends in halfedge_ends(window.faces))
    is_outer[marks.vertex[split[window.is_outer[tail] & window.is_outer[head]]]] = True
    return is_outer


def _triangulate(faces: Ints, points: Floats, cells: CellComplex, band_of_piece: Ints) -> tuple[Floats, Ints, Ints]:
    """Points, triangles and the band of each triangle: whole faces, small cells, and large cells."""
    face_band = np.where(cells.face_piece == NONE, NONE, band_of_piece[cells.face_piece])
    whole = np.flatnonzero(face_band != NONE)
    small, small_cell = _small_cells(cells, band_of_piece)
    large_points, large, large_cell = _large_cells(cells, points, band_of_piece)
    cell_band = band_of_piece[cells.cell_piece]
    triangles = np.concatenate([faces[whole], small, large])
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
        """The points along a curve that a band has, as it has them, and the index of the nearest node of each."""
        part = slice(self._boundaries.offsets[curve], self._boundaries.offsets[curve + 1])
        wanted = band * self._n + self._boundaries.marks.vertex[part]
        rank = np.minimum(np.searchsorted(self._key, wanted, sorter=self._order), len(self._order) - 1)
        is_there = self._key[self._order[rank]] == wanted
        return self._order[rank[is_there]], self._boundaries.node_index[part][is_there]


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
