"""Turning over triangles that look against the surface, as they may where a lattice is coarser than a fold."""

from __future__ import annotations

from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.bisection import unique_edges
from weavecore.geometry.closest import nearest_on_triangles
from weavecore.geometry.lawson_flips import angle_at, stays_upright, turn_edges
from weavecore.linking.band_faces import NO_CORNER, BandFaces
from weavecore.linking.resample import segments_at
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh

_UPRIGHT = 0.2
"""Cosine between a triangle's normal and the surface's that an edge is turned for."""
_DOUBTFUL = 0.9
"""Below this cosine to the normals at its corners a triangle is compared with the surface at its middle."""
_FACES_ASKED = 12
"""Of so many faces with the nearest middles one is taken to be the nearest face."""


class Uprightness:
    """How faces look: the cosine of the angle between their normals and those of the surface.

    Parameters
    ----------
    surface : SurfaceMesh
    normals : (N, 3) float64
        About where the surface looks at each node.
    """

    def __init__(self, surface: SurfaceMesh, normals: Floats) -> None:
        self._surface = surface
        self._normals = normals
        self._tree: Optional[cKDTree] = None

    def of_triangles(self, nodes: Floats, a: Ints, b: Ints, c: Ints) -> Floats:
        """By corners, one value a triangle."""
        pa, pb, pc = nodes[a], nodes[b], nodes[c]
        toward = self._normals[a] + self._normals[b] + self._normals[c]
        return self._of(np.cross(pb - pa, pc - pa), toward, (pa + pb + pc) / 3)

    def of(self, nodes: Floats, corners: Ints, offsets: Ints) -> Floats:
        """One value a face, whose corners lie one face after the other."""
        first, after = offsets[:-1], next_in_loop(offsets)
        points = nodes[corners]
        arm = points - points[first][rows_of(offsets)]
        area = np.add.reduceat(np.cross(arm, arm[after]), first)
        middle = np.add.reduceat(points, first) / np.diff(offsets)[:, None]
        return self._of(area, np.add.reduceat(self._normals[corners], first), middle)

    def _of(self, area: Floats, toward: Floats, middle: Floats) -> Floats:
        cosine = _cosine(area, toward)
        doubtful = np.flatnonzero(cosine < _DOUBTFUL)
        if len(doubtful):
            face = self._nearest_faces(middle[doubtful])
            cosine[doubtful] = _cosine(area[doubtful], self._surface.face_normals[face])
        return cosine

    def _nearest_faces(self, points: Floats) -> Ints:
        """The nearest of the few faces whose middles are nearest."""
        surface = self._surface
        if self._tree is None:
            self._tree = cKDTree(surface.vertices[surface.faces].mean(1))
        few = min(_FACES_ASKED, surface.n_faces)
        faces = np.asarray(self._tree.query(points, k=few)[1], np.int64).reshape(len(points), few)
        each = np.repeat(points, few, axis=0)
        place = nearest_on_triangles(each, surface.vertices[surface.faces[faces.ravel()]])
        gap = np.linalg.norm(place - each, axis=1).reshape(faces.shape)
        nearest: Ints = faces[np.arange(len(points)), gap.argmin(1)]
        return nearest


def _cosine(u: Floats, v: Floats) -> Floats:
    along: Floats = (u * v).sum(1)
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    cosine: Floats = np.divide(along, size, out=np.zeros_like(along), where=size > 0)
    return cosine


def turn_upright(surface: SurfaceMesh, nodes: Floats, normals: Floats, faces: BandFaces, ring_edges: Ints) -> BandFaces:
    """Turn edges of triangles that look against the surface, where both new ones look along with it.

    Parameters
    ----------
    surface : SurfaceMesh
    nodes, normals : (N, 3) float64
        The nodes, and where the surface looks there.
    faces : BandFaces
    ring_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    """
    is_triangle = faces.corners[:, 3] == NO_CORNER
    triangles = faces.corners[is_triangle, :3]
    look = Uprightness(surface, normals).of_triangles

    def gain(_triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        before = np.minimum(look(nodes, a, b, c), look(nodes, b, a, d))
        gained = np.zeros(len(a))
        fallen = np.flatnonzero(before <= 0)
        a, b, c, d = a[fallen], b[fallen], c[fallen], d[fallen]
        after = np.minimum(look(nodes, c, a, d), look(nodes, d, b, c))
        gained[fallen] = np.where(after > _UPRIGHT, after - before[fallen], 0.0)
        return gained

    if (look(nodes, *triangles.T) > 0).all():
        return faces
    n = np.int64(len(nodes))
    fixed = np.concatenate([ring_edges, faces.where(~is_triangle).edges()])
    corners = faces.corners.copy()
    corners[is_triangle, :3] = turn_edges(triangles, len(nodes), np.unique(fixed[:, 0] * n + fixed[:, 1]), gain)
    return BandFaces(corners, faces.band)


def find_fallen(surface: SurfaceMesh, nodes: Floats, normals: Floats, faces: BandFaces) -> Ints:
    """(k, 3) the triangles that look against the surface; parameters as of `turn_upright`."""
    triangles = faces.corners[faces.corners[:, 3] == NO_CORNER, :3]
    fallen: Ints = triangles[Uprightness(surface, normals).of_triangles(nodes, *triangles.T) <= 0]
    return fallen


def node_normals(latitudes: Latitudes, latitude: Ints, station: Floats, faces: BandFaces, n_nodes: int) -> Floats:
    """Where the surface looks at each node (N, 3), not of unit length; at a hub, where it looks at the nodes around."""
    polylines = latitudes.polylines
    on_ring = np.flatnonzero(latitude >= 0)
    latitude = latitude[on_ring]
    start = segments_at(polylines, latitude, station[on_ring])
    ends = polylines.offsets[latitude + 1] - 1
    after = np.where(start == ends, polylines.offsets[latitude], start + 1)
    of_face = latitudes.surface.face_normals
    normals = np.zeros((n_nodes, 3))
    normals[on_ring] = of_face[polylines.face[start]] + of_face[polylines.face[after]]
    tail, head, _ = faces.sides()
    is_ring = np.zeros(n_nodes, bool)
    is_ring[on_ring] = True
    to_hub = ~is_ring[head] & is_ring[tail]
    np.add.at(normals, head[to_hub], normals[tail[to_hub]])
    return normals


# ----------------------------------------------------------------------
# Evening out how many edges the nodes have, where that costs little: between two rings an inner node wants six.

_INSIDE, _ON_BORDER = 6, 4
_LEAST_ANGLE = np.radians(30.0)


def even_out(
    nodes: Floats, latitude: Ints, is_border: Bools, triangles: Ints, ring_edges: Ints, longest: float
) -> Ints:
    """Turn edges where the nodes then have more even numbers of edges, and the triangles are still good ones.

    Parameters
    ----------
    nodes : (N, 3) float64
    latitude : (N,) int64
        Polyline of each node, -1 of a hub.
    is_border : (N,) bool
    triangles : (T, 3) int64
    ring_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    longest : float
        No edge longer than this is made.

    Returns
    -------
    (T, 3) int64
    """
    wanted = np.where(is_border, _ON_BORDER, _INSIDE)

    def gain(triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        edges, _ = unique_edges(triangles)
        excess = np.bincount(edges.ravel(), minlength=len(nodes)) - wanted
        # A corner with k edges too many counts for k squared.
        gained = 2.0 * (excess[a] + excess[b] - excess[c] - excess[d]) - 4.0
        at = np.flatnonzero((gained > 0) & ((latitude[c] != latitude[d]) | (latitude[c] < 0)))
        a, b, c, d = a[at], b[at], c[at], d[at]
        good = np.linalg.norm(nodes[c] - nodes[d], axis=1) <= longest
        good &= stays_upright(nodes, a, b, c, d)
        for corner, one, other in ((a, c, d), (b, c, d), (c, a, d), (d, a, c), (c, d, b), (d, c, b)):
            good &= angle_at(nodes, corner, one, other) >= _LEAST_ANGLE
        worth = np.zeros(len(gained))
        worth[at[good]] = gained[at[good]]
        return worth

    n = np.int64(len(nodes))
    fixed = np.unique(ring_edges[:, 0] * n + ring_edges[:, 1])
    return turn_edges(triangles, len(nodes), fixed, gain, one_a_corner=True)
