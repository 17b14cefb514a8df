"""From the fronts of all generations to `Latitudes`: points, bands and parents.

The paper stores the parent of each child while it offsets (Yan et al. 2016, §5).  Here parents are read from the
surface itself: it is cut along all fronts, and what lies between them are the bands.  A front bounds two of them, as
parent of the one on its left and as child of the one on its right::

        ... band 2 ...
    ------------------->  front of generation 2:  parent of band 2, child of band 1
        ... band 1 ...
    ------------------->  front of generation 1
        ... band 0 ...
    ===================>  source

The time is that of cutting the mesh, linear in faces and points, and of nearest-neighbour queries for the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, inverted, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cut import NONE, CellComplex, Marks, cut_along
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import Origins, SurfaceMesh
from weavecore.offsetting.isolines.bands import find_parents, order_bands
from weavecore.offsetting.isolines.cut_mesh import sides_of_origins, split_vertices_at_cuts
from weavecore.offsetting.isolines.extract import corners_at
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves
from weavecore.offsetting.spacing import LevelSchedule

_SAMPLES_PER_SPACING = 20
"""Samples on a length of one spacing from which vertices measure their distance: half a gap aside is 0.03% longer."""

_SAME_PLACE = 1e-8
"""Points that differ by less in barycentric coordinates, or in median edges, are one."""


def assemble_latitudes(
    surface: SurfaceMesh, domain: Domain, generations: list[SurfaceCurves], *, schedule: LevelSchedule
) -> Latitudes:
    """Make latitudes of the sources, as generation 0, and of the fronts of each generation.

    Parameters
    ----------
    surface : SurfaceMesh
    domain : Domain
        Of that surface.
    generations : list of SurfaceCurves
        From 1 on.
    schedule : LevelSchedule
        Distances of the generations, in the model's unit.

    Returns
    -------
    Latitudes
    """
    origins = surface.origins
    polylines = _make_polylines(surface, origins, generations)
    n_fronts = [len(fronts) for fronts in generations]
    generation = np.repeat(np.arange(len(n_fronts) + 1), [len(origins), *n_fronts])
    marks = _mark_fronts(polylines, len(origins), surface.n_vertices)
    pieces = _Pieces(surface, domain, marks, cut_along(surface.faces, domain.twins, marks))
    sides = _find_sides(surface, pieces, polylines, len(origins))
    distance = schedule.distance_of(generation.astype(np.float64))
    spacing = schedule.widest_spacing(len(generations) + 1)
    vertex_distance = _measure_vertices(surface, polylines, distance, pieces, sides, spacing)
    depth = np.zeros(pieces.count)
    np.maximum.at(depth, pieces.of_node, vertex_distance[pieces.vertex])
    np.maximum.at(depth, sides.piece, distance[sides.polyline])
    bands = order_bands(sides.polyline, sides.piece, sides.is_parent, sides.is_left, pieces.euler, depth)
    return Latitudes(
        surface=surface,
        polylines=polylines,
        generation=generation,
        distance=distance,
        parents=find_parents(bands),
        bands=bands,
        spacing=spacing,
        vertex_distance=vertex_distance,
    )


def _make_polylines(surface: SurfaceMesh, origins: Origins, generations: list[SurfaceCurves]) -> Polylines:
    vertex = origins.vertices()
    face, weights = corners_at(surface, vertex)
    kept = [_find_distinct(fronts) for fronts in generations]
    faces = np.concatenate([face, *(fronts.face[k] for fronts, k in zip(generations, kept))])
    weights = np.concatenate([weights, *(fronts.start[k] for fronts, k in zip(generations, kept))])
    points = np.einsum("nk,nkd->nd", weights, surface.vertices[surface.faces[faces]])
    points[: len(vertex)] = surface.vertices[vertex]
    per_front = (np.bincount(fronts.owner[k], minlength=len(fronts)) for fronts, k in zip(generations, kept))
    counts = np.concatenate([[len(path) for path in origins.paths], *per_front])
    closed = np.concatenate([origins.closed, *(fronts.closed for fronts in generations)])
    return Polylines(points, offsets_of(counts), closed, faces, weights)


def _find_distinct(fronts: SurfaceCurves) -> Bools:
    """Which points (m,) of fronts stay.

    Points inside faces go that lie as good as at the point before or after, and pairs of points at which a front
    goes over an edge and back again in one place.
    """
    tiny = np.abs(fronts.end - fronts.start).max(1) < _SAME_PLACE
    before = np.zeros(len(tiny), bool)
    before[fronts.after] = tiny
    kept = ~((tiny | before) & (fronts.start > 0).all(1))
    row = np.flatnonzero(kept)
    offsets = offsets_of(np.bincount(fronts.owner[row], minlength=len(fronts)))
    after = next_in_loop(offsets)
    there = np.abs(fronts.points[row[after]] - fronts.points[row]).max(1, initial=0.0) < _SAME_PLACE
    there &= after > np.arange(len(row))
    face = fronts.face[row]
    entered = np.empty(len(row), np.int64)
    entered[after] = face
    there &= (face != face[after]) & (entered == face[after])
    kept[row[there]] = kept[row[after[there]]] = False
    return np.asarray(kept)


def _mark_fronts(polylines: Polylines, n_sources: int, n_vertices: int) -> Marks:
    """The fronts as curves to cut the mesh by: each point marks where it enters the face of its segment.

    The ends of open ones split an edge of a free border, and at the last no segment begins.
    """
    first = polylines.offsets[n_sources]
    offsets = polylines.offsets[n_sources:] - first
    is_open = ~polylines.closed[n_sources:]
    face, weights = polylines.face[first:], polylines.barycentric[first:]
    after = next_in_loop(offsets)
    before = inverted(after)
    apex = weights.argmin(1)
    row = np.arange(len(face))
    goes_in = face != face[before]
    last = offsets[1:][is_open] - 1
    goes_in[offsets[:-1][is_open]] = goes_in[last] = True
    on_edge = (weights[row, apex] == 0.0) & goes_in
    tail, head = (apex + 1) % 3, (apex + 2) % 3
    return Marks(
        after=after,
        before=before,
        vertex=n_vertices + row,
        halfedge=np.where(on_edge, 3 * face + tail, NONE),
        part=np.where(on_edge, weights[row, head], 0.0),
        face=np.where(np.isin(row, last), NONE, face),
    )


class _Pieces:
    """What the fronts leave of the surface: the bands, before they are ordered.

    Parameters
    ----------
    surface : SurfaceMesh
    domain : Domain
    marks : Marks
        Of the fronts, M points.
    cells : CellComplex
        The mesh cut along them.

    Attributes
    ----------
    count : int
    vertex, of_node : (n,) int64
        The vertices, those on a cut once for each of its sides, and the piece of each.
    left, right : (M,) int64
        The pieces beside the segment that begins at each mark.
    beside : (3F,) int64
        The piece inside each halfedge, at its tail.
    euler : (count,) int64
        Euler characteristics.
    """

    def __init__(self, surface: SurfaceMesh, domain: Domain, marks: Marks, cells: CellComplex) -> None:
        used = np.unique(np.concatenate([cells.face_piece, cells.cell_piece]))
        used = used[used != NONE]
        name = np.full(int(used.max()) + 2, NONE)
        name[used] = np.arange(len(used))
        self.count = len(used)
        self.left, self.right = name[cells.left_piece], name[cells.right_piece]
        self.beside: Ints = name[cells.edge_piece]
        faces, self.vertex = split_vertices_at_cuts(surface)
        self.of_node = np.empty(len(self.vertex), np.int64)
        self.of_node[faces.ravel()] = self.beside
        whole, parts = name[cells.face_piece[cells.face_piece != NONE]], name[cells.cell_piece]
        self.euler: Ints = (
            self._tally(self.of_node)
            - self._count_edges(domain, marks)
            + self._tally(whole)
            + self._tally(parts)
            + self._count_open_sides(marks)
        )

    def _tally(self, pieces: Ints) -> Ints:
        return np.bincount(pieces, minlength=self.count)

    def _count_edges(self, domain: Domain, marks: Marks) -> Ints:
        """Edges in each piece, those that fronts split in parts: the one at the tail, and one beyond each mark."""
        one = np.flatnonzero(domain.twins < np.arange(len(domain.twins)))
        split = np.flatnonzero(marks.halfedge != NONE)
        forth = domain.twins[marks.halfedge[split]] < marks.halfedge[split]
        # What lies right of a curve that comes in from an edge lies left of one that goes out by it.
        last = np.flatnonzero(marks.face == NONE)
        right, left = self.right.copy(), self.left.copy()
        right[last], left[last] = self.left[marks.before[last]], self.right[marks.before[last]]
        beyond = np.where(forth, right[split], left[split])
        return self._tally(self.beside[one]) + self._tally(beyond)

    def _count_open_sides(self, marks: Marks) -> Ints:
        """Sides of open fronts along each piece: each counts for 1, those of closed ones for nothing."""
        first = marks.after[np.flatnonzero(marks.face == NONE)]
        return self._tally(self.left[first]) + self._tally(self.right[first])


@dataclass(frozen=True, eq=False)
class _PolylineSides:
    """The sides of all polylines: those of cuts both as parents, those of borders once.

    Parameters
    ----------
    polyline : (n,) int64
    piece : (n,) int64
        The piece of the surface on that side.
    is_parent : (n,) bool
        Whether the polyline is a parent of that piece.
    is_left : (n,) bool
        Whether the piece lies on its left.
    """

    polyline: Ints
    piece: Ints
    is_parent: Bools
    is_left: Bools


def _find_sides(surface: SurfaceMesh, pieces: _Pieces, polylines: Polylines, n_sources: int) -> _PolylineSides:
    sources = sides_of_origins(surface)
    first = polylines.offsets[n_sources:-1] - polylines.offsets[n_sources]
    child = n_sources + np.arange(len(first))
    polyline = np.concatenate([sources.polyline, child, child])
    piece = np.concatenate([pieces.beside[sources.halfedge], pieces.left[first], pieces.right[first]])
    is_parent = np.arange(len(polyline)) < len(sources.polyline) + len(child)
    is_left = is_parent.copy()
    is_left[: len(sources.polyline)] = sources.is_left
    return _PolylineSides(polyline, piece, is_parent, is_left)


def _measure_vertices(
    surface: SurfaceMesh,
    polylines: Polylines,
    distance: Floats,
    pieces: _Pieces,
    sides: _PolylineSides,
    spacing: float,
) -> Floats:
    """Distance (V,) from the sources at vertices: that of the nearest parent of the band, and straight on from there.

    ``distance`` (P,) are those of the polylines.
    """
    after = next_in_loop(polylines.offsets)
    step = spacing / _SAMPLES_PER_SPACING
    ragged = offsets_of(np.maximum(1, np.ceil(polylines.segment_lengths / step)))
    row = rows_of(ragged)
    part = ((np.arange(ragged[-1]) - ragged[row]) / np.diff(ragged)[row])[:, None]
    samples = polylines.points[row] * (1 - part) + polylines.points[after[row]] * part
    owner = polylines.owner[row]
    # The piece is a fourth coordinate, so far apart that only samples of the same piece are near.
    far = 4.0 * surface.size
    found = np.full(len(pieces.vertex), np.inf)
    for second in (False, True):  # A polyline is the parent of one band, a cut of two.
        side = np.full(len(polylines), NONE)
        parents = np.flatnonzero(sides.is_parent)[::-1] if second else np.flatnonzero(sides.is_parent)
        side[sides.polyline[parents]] = sides.piece[parents]
        tree = cKDTree(np.c_[samples, far * side[owner]], balanced_tree=False)
        away, nearest = tree.query(np.c_[surface.vertices[pieces.vertex], far * pieces.of_node])
        found = np.minimum(found, np.where(away < far / 2, distance[owner[nearest]] + away, np.inf))
    least = np.full(surface.n_vertices, np.inf)
    np.minimum.at(least, pieces.vertex, found)
    least[surface.origins.vertices()] = 0.0
    return least
