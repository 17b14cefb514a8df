"""From the fronts of all generations to `Latitudes`: points, bands and parents.

Who is whose parent is read from the surface itself: it is cut along all fronts, and what lies between
them are the bands.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.cut import NONE, Cells, Marks, cut_along
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import Origins, SurfaceMesh
from weavecore.offsetting.isolines.bands import find_parents, order_bands
from weavecore.offsetting.isolines.cut_mesh import part_vertices, sides_of_origins
from weavecore.offsetting.isolines.extract import corners_at
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.spacing import Ladder

_SAMPLES_PER_SPACING = 20

_SAME_PLACE = 1e-8
"""In barycentric coordinates."""


def assemble(surface: SurfaceMesh, ground: Ground, generations: list[Curves], *, ladder: Ladder) -> Latitudes:
    """The origins as generation 0, then the fronts of each generation."""
    origins = surface.origins
    polylines = _polylines(surface, origins, generations)
    n_fronts = [len(fronts) for fronts in generations]
    generation = np.repeat(np.arange(len(n_fronts) + 1), [len(origins), *n_fronts])
    marks = _marks(polylines, len(origins), surface.n_vertices)
    pieces = _Pieces(surface, ground, marks, cut_along(surface.faces, ground.twins, marks))
    polyline, piece, is_parent, is_left = _sides(surface, pieces, polylines, len(origins))
    distance = ladder.distance(generation.astype(np.float64))
    spacing = ladder.widest(len(generations) + 1)
    vertex_distance = _vertex_distances(surface, polylines, distance, pieces, polyline, piece, is_parent, spacing)
    depth = np.zeros(pieces.count)
    np.maximum.at(depth, pieces.of_node, vertex_distance[pieces.vertex])
    np.maximum.at(depth, piece, distance[polyline])
    bands = order_bands(polyline, piece, is_parent, is_left, pieces.euler, depth)
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


def _polylines(surface: SurfaceMesh, origins: Origins, generations: list[Curves]) -> Polylines:
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


def _find_distinct(fronts: Curves) -> Bools:
    """Which points of fronts stay.

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


def _marks(polylines: Polylines, n_origins: int, n_vertices: int) -> Marks:
    """The fronts as curves to cut the mesh by: each point marks where it enters the face of its segment.

    The ends of open ones split an edge of a selvedge, and at the last no segment begins.
    """
    first = polylines.offsets[n_origins]
    offsets = polylines.offsets[n_origins:] - first
    is_open = ~polylines.closed[n_origins:]
    face, weights = polylines.face[first:], polylines.barycentric[first:]
    after = next_in_loop(offsets)
    before = np.empty(len(after), np.int64)
    before[after] = np.arange(len(after))
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
    """What the fronts leave of the surface.

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
    """

    def __init__(self, surface: SurfaceMesh, ground: Ground, marks: Marks, cells: Cells) -> None:
        used = np.unique(np.concatenate([cells.face_piece, cells.cell_piece]))
        used = used[used != NONE]
        name = np.full(int(used.max()) + 2, NONE)
        name[used] = np.arange(len(used))
        self.count = len(used)
        self.left, self.right = name[cells.left_piece], name[cells.right_piece]
        last = np.flatnonzero(marks.face == NONE)
        self.beside: Ints = name[cells.edge_piece]
        faces, self.vertex = part_vertices(surface)
        self.of_node = np.empty(len(self.vertex), np.int64)
        self.of_node[faces.ravel()] = self.beside
        # Cut into open cells: closed fronts count for nothing, and open ones for 1 on either side.
        # An edge gives the part at the tail of one of its halfedges, and one more beyond each mark.
        one = np.flatnonzero(ground.twins < np.arange(len(ground.twins)))
        split = np.flatnonzero(marks.halfedge != NONE)
        forth = ground.twins[marks.halfedge[split]] < marks.halfedge[split]
        # What lies right of a curve that comes in from an edge lies left of one that goes out by it.
        right, left = self.right.copy(), self.left.copy()
        right[last], left[last] = self.left[marks.before[last]], self.right[marks.before[last]]
        beyond = np.where(forth, right[split], left[split])
        edges = self._tally(self.beside[one]) + self._tally(beyond)
        whole, parts = name[cells.face_piece[cells.face_piece != NONE]], name[cells.cell_piece]
        sides = self._tally(self.left[marks.after[last]]) + self._tally(self.right[marks.after[last]])
        self.euler: Ints = self._tally(self.of_node) - edges + self._tally(whole) + self._tally(parts) + sides

    def _tally(self, pieces: Ints) -> Ints:
        return np.bincount(pieces, minlength=self.count)


def _sides(
    surface: SurfaceMesh, pieces: _Pieces, polylines: Polylines, n_origins: int
) -> tuple[Ints, Ints, Bools, Bools]:
    """For each side of each polyline: the polyline, the piece, whether it is its parent, whether on its left."""
    origins = sides_of_origins(surface)
    first = polylines.offsets[n_origins:-1] - polylines.offsets[n_origins]
    child = n_origins + np.arange(len(first))
    polyline = np.concatenate([origins.polyline, child, child])
    piece = np.concatenate([pieces.beside[origins.halfedge], pieces.left[first], pieces.right[first]])
    is_parent = np.arange(len(polyline)) < len(origins.polyline) + len(child)
    is_left = is_parent.copy()
    is_left[: len(origins.polyline)] = origins.is_left
    return polyline, piece, is_parent, is_left


def _vertex_distances(
    surface: SurfaceMesh,
    polylines: Polylines,
    distance: Floats,
    pieces: _Pieces,
    polyline: Ints,
    piece: Ints,
    is_parent: Bools,
    spacing: float,
) -> Floats:
    """Distance from the borders at every vertex: that of the parents of its band, and straight on from the nearest."""
    after = next_in_loop(polylines.offsets)
    step = spacing / _SAMPLES_PER_SPACING
    ragged = offsets_of(np.maximum(1, np.ceil(polylines.segment_lengths / step)))
    row = rows_of(ragged)
    part = ((np.arange(ragged[-1]) - ragged[row]) / np.diff(ragged)[row])[:, None]
    samples = polylines.points[row] * (1 - part) + polylines.points[after[row]] * part
    owner = polylines.owner[row]
    far = 4.0 * surface.size
    found = np.full(len(pieces.vertex), np.inf)
    for second in (False, True):  # A polyline is the parent of one band, a cut of two.
        side = np.full(len(polylines), NONE)
        sides = np.flatnonzero(is_parent)[::-1] if second else np.flatnonzero(is_parent)
        side[polyline[sides]] = piece[sides]
        tree = cKDTree(np.c_[samples, far * side[owner]], balanced_tree=False)
        away, nearest = tree.query(np.c_[surface.vertices[pieces.vertex], far * pieces.of_node])
        found = np.minimum(found, np.where(away < far / 2, distance[owner[nearest]] + away, np.inf))
    least = np.full(surface.n_vertices, np.inf)
    np.minimum.at(least, pieces.vertex, found)
    least[surface.origins.vertices()] = 0.0
    return least
