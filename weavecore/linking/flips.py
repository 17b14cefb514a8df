"""Inverted-face repair and valence optimisation by edge flips.

Both flip the common edge ab of two triangles to cd, while a gain is positive (`geometry.lawson_flips`):

        c                c
      ╱   ╲            ╱ | ╲
     a ─── b    →     a  |  b
      ╲   ╱            ╲ | ╱
        d                d

*Inverted faces.*  A face is inverted where its normal points against that of the surface, as it may where a lattice
is coarser than a fold.  Its orientation is the cosine between the two normals: that of the surface is averaged at
the corners, and where that leaves doubt taken from the nearest face.  The gain is the rise of the lesser cosine.

*Valences.*  The gain is the fall of Σ (valence - target)², target 6 inside and 4 on a border, as in isotropic
remeshing (Botsch and Kobbelt 2004), for flips that keep corners above 30° and links short.

Each round of flips is linear in the number of triangles.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, cross, dots, next_in_loop, rows_of
from weavecore.geometry.bisection import unique_edges
from weavecore.geometry.lawson_flips import angle_at, stays_upright, turn_edges
from weavecore.linking.arc_length import segments_at
from weavecore.linking.band_faces import NO_CORNER, BandFaces
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh

_REPAIRED = 0.2
"""Cosine to the surface's normal that both triangles must exceed after a flip that repairs an inverted one: about
78°, so that a repaired triangle does not just miss being inverted."""
_CERTAIN = 0.9
"""Below this cosine to the normals at its corners a triangle is compared with the nearest face of the surface."""
_VALENCE_INSIDE, _VALENCE_ON_BORDER = 6, 4
"""Edges at a node of a regular lattice of triangles."""
_LEAST_ANGLE = np.radians(30.0)
"""Least corner that a flip for the sake of valences may make: half that of an equilateral triangle."""


class FaceOrientation:
    """The cosine of the angle between the normals of faces and those of the surface.

    Parameters
    ----------
    surface : SurfaceMesh
    normals : (N, 3) float64
        Approximate normal of the surface at each node, of any length.
    certain : float
        Below this cosine to the normals at its corners a triangle is compared with the nearest face of the surface.
    """

    def __init__(self, surface: SurfaceMesh, normals: Floats, *, certain: float = _CERTAIN) -> None:
        self._surface = surface
        self._normals = normals
        self._certain = certain

    def of_triangles(self, nodes: Floats, a: Ints, b: Ints, c: Ints) -> Floats:
        """Cosine (k,) of each triangle.

        Parameters
        ----------
        nodes : (N, 3) float64
        a, b, c : (k,) int64
            Corners, counter-clockwise seen from outside.
        """
        pa, pb, pc = nodes[a], nodes[b], nodes[c]
        expected = self._normals[a] + self._normals[b] + self._normals[c]
        return self._cosines(cross(pb - pa, pc - pa), expected, (pa + pb + pc) / 3)

    def any_against(self, nodes: Floats, triangles: Ints) -> bool:
        """Whether the cosine of any triangle (k, 3) is 0 or less."""
        if np.isinf(self._certain):
            return bool(_are_inverted(self._surface, nodes, triangles).any())
        return not bool((self.of_triangles(nodes, *triangles.T) > 0).all())

    def of_polygons(self, nodes: Floats, corners: Ints, offsets: Ints) -> Floats:
        """Cosine (F,) of each face.

        Parameters
        ----------
        nodes : (N, 3) float64
        corners : (C,) int64
            Of all faces, one after the other.
        offsets : (F+1,) int64
        """
        first, after = offsets[:-1], next_in_loop(offsets)
        points = nodes[corners]
        arm = points - points[first][rows_of(offsets)]
        area = np.add.reduceat(cross(arm, arm[after]), first)
        centroid = np.add.reduceat(points, first) / np.diff(offsets)[:, None]
        return self._cosines(area, np.add.reduceat(self._normals[corners], first), centroid)

    def _cosines(self, area: Floats, expected: Floats, centroid: Floats) -> Floats:
        cosine = _cosine(area, expected)
        doubtful = np.flatnonzero(cosine < self._certain)
        if len(doubtful):
            face = self._nearest_faces(centroid[doubtful])
            cosine[doubtful] = _cosine(area[doubtful], self._surface.face_normals[face])
        return cosine

    def _nearest_faces(self, points: Floats) -> Ints:
        return self._surface.face_finder.find(points)[0]


def _cosine(u: Floats, v: Floats) -> Floats:
    along: Floats = (u * v).sum(1)
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    cosine: Floats = np.divide(along, size, out=np.zeros_like(along), where=size > 0)
    return cosine


def repair_inverted_faces(
    surface: SurfaceMesh, nodes: Floats, normals: Floats, faces: BandFaces, fixed_edges: Ints
) -> BandFaces:
    """Flip edges of inverted triangles where both new triangles then follow the surface.

    First by the normals at the nodes, with a margin; then, of what is left, by the nearest faces.

    Parameters
    ----------
    surface : SurfaceMesh
    nodes, normals : (N, 3) float64
        The nodes, and the normals of the surface there (`node_normals`).
    faces : BandFaces
    fixed_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    """
    by_nodes = FaceOrientation(surface, normals)
    faces = _flipped(nodes, faces, fixed_edges, by_nodes, _REPAIRED)
    return _flipped(nodes, faces, fixed_edges, FaceOrientation(surface, normals, certain=np.inf), 0.0)


def _flipped(nodes: Floats, faces: BandFaces, fixed_edges: Ints, measure: FaceOrientation, least: float) -> BandFaces:
    """The faces after flips of inverted triangles, by one measure of their orientation."""
    is_triangle = faces.corners[:, 3] == NO_CORNER
    triangles = faces.corners[is_triangle, :3]
    orientation = measure.of_triangles

    def gain(_triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        before = np.minimum(orientation(nodes, a, b, c), orientation(nodes, b, a, d))
        gained = np.zeros(len(a))
        inverted = np.flatnonzero(before <= 0)
        a, b, c, d = a[inverted], b[inverted], c[inverted], d[inverted]
        after = np.minimum(orientation(nodes, c, a, d), orientation(nodes, d, b, c))
        gained[inverted] = np.where(after > least, after - before[inverted], 0.0)
        return gained

    if not measure.any_against(nodes, triangles):
        return faces
    n = np.int64(len(nodes))
    fixed = np.concatenate([fixed_edges, faces.where(~is_triangle).edges()])
    corners = faces.corners.copy()
    corners[is_triangle, :3] = turn_edges(triangles, len(nodes), np.unique(fixed[:, 0] * n + fixed[:, 1]), gain)
    return BandFaces(corners, faces.band)


def find_inverted_triangles(surface: SurfaceMesh, nodes: Floats, faces: BandFaces) -> Ints:
    """The triangles whose normals point against those of the faces nearest to their middles.

    Parameters
    ----------
    surface : SurfaceMesh
    nodes : (N, 3) float64
    faces : BandFaces

    Returns
    -------
    (k, 3) int64
    """
    triangles = faces.corners[faces.corners[:, 3] == NO_CORNER, :3]
    inverted: Ints = triangles[_are_inverted(surface, nodes, triangles)]
    return inverted


def _are_inverted(surface: SurfaceMesh, nodes: Floats, triangles: Ints) -> Bools:
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    middle = (a + b + c) / 3
    # Nodes lie on the surface, so it comes as near to the middle of a triangle as its nearest node.
    near = np.sqrt(np.min([dots(arm, arm) for arm in (a - middle, b - middle, c - middle)], axis=0))
    return surface.nearest_normals.are_against(middle, cross(b - a, c - a), near)


def node_normals(latitudes: Latitudes, latitude: Ints, station: Floats, faces: BandFaces, n_nodes: int) -> Floats:
    """Normal of the surface at each node, not of unit length.

    At a node off the polylines it is the sum of those at the nodes that a side leads from.

    Parameters
    ----------
    latitudes : Latitudes
    latitude, station : (M,)
        Polyline of the first M nodes, -1 on a free border, and arc length on it.
    faces : BandFaces
    n_nodes : int
        N, Steiner vertices included.

    Returns
    -------
    (N, 3) float64
    """
    polylines = latitudes.polylines
    on_ring = np.flatnonzero(latitude >= 0)
    latitude = latitude[on_ring]
    start = segments_at(polylines, latitude, station[on_ring])
    ends = polylines.offsets[latitude + 1] - 1
    after = np.where(start == ends, polylines.offsets[latitude], start + 1)
    face_normals = latitudes.surface.face_normals
    normals = np.zeros((n_nodes, 3))
    normals[on_ring] = face_normals[polylines.face[start]] + face_normals[polylines.face[after]]
    tail, head, _ = faces.sides()
    is_ring = np.zeros(n_nodes, bool)
    is_ring[on_ring] = True
    off_ring = ~is_ring[head] & is_ring[tail]
    np.add.at(normals, head[off_ring], normals[tail[off_ring]])
    return normals


def optimise_valences(
    nodes: Floats, latitude: Ints, is_border: Bools, triangles: Ints, fixed_edges: Ints, longest: float
) -> Ints:
    """Flip edges where the valences of the nodes then come nearer to regular and the triangles stay well shaped.

    Parameters
    ----------
    nodes : (N, 3) float64
    latitude : (N,) int64
        Polyline of each node, -1 off the polylines.
    is_border : (N,) bool
    triangles : (T, 3) int64
    fixed_edges : (E, 2) int64
        Edges that stay, the lesser node first.
    longest : float
        No edge longer than this is made.

    Returns
    -------
    (T, 3) int64
    """
    target = np.where(is_border, _VALENCE_ON_BORDER, _VALENCE_INSIDE)

    def gain(triangles: Ints, a: Ints, b: Ints, c: Ints, d: Ints) -> Floats:
        edges, _ = unique_edges(triangles)
        excess = np.bincount(edges.ravel(), minlength=len(nodes)) - target
        # The fall of Σ excess² where a and b lose an edge, and c and d get one.
        gained = 2.0 * (excess[a] + excess[b] - excess[c] - excess[d]) - 4.0
        at = np.flatnonzero((gained > 0) & ((latitude[c] != latitude[d]) | (latitude[c] < 0)))
        a, b, c, d = a[at], b[at], c[at], d[at]
        good = np.linalg.norm(nodes[c] - nodes[d], axis=1) <= longest
        good &= stays_upright(nodes, a, b, c, d)
        for corner, one, other in ((a, c, d), (b, c, d), (c, a, d), (d, a, c), (c, d, b), (d, c, b)):
            good &= angle_at(nodes, corner, one, other) >= _LEAST_ANGLE
        gains = np.zeros(len(gained))
        gains[at[good]] = gained[at[good]]
        return gains

    n = np.int64(len(nodes))
    fixed = np.unique(fixed_edges[:, 0] * n + fixed_edges[:, 1])
    return turn_edges(triangles, len(nodes), fixed, gain, one_a_corner=True)
