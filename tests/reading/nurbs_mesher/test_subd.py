# ruff: noqa: N802
"""SubDs.  rhino3dm reads them but cannot make them: a stand-in with its interface refines a cube or a sheet."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.errors import Degenerate, NonFinite, TooMuchWork, Unreadable
from weavecore.geometry.halfedges import border_loops, find_twins
from weavecore.geometry.lawson_flips import least_angles
from weavecore.reading.nurbs_mesher import mesh_object

CUBE = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


class _Point:
    def __init__(self, x: float, y: float, z: float) -> None:
        self.X, self.Y, self.Z = x, y, z


class _Vertex:
    def __init__(self, number: int, place: np.ndarray) -> None:
        self.Id, self.SurfacePoint = number + 1, _Point(*place.tolist())


class _Face:
    def __init__(self, corners: list[_Vertex]) -> None:
        self._corners, self.VertexCount = corners, len(corners)

    def Vertex(self, k: int) -> _Vertex:
        return self._corners[k]


class _Edge:
    def __init__(self, ends: tuple[int, int], n_faces: int) -> None:
        self._ends, self.FaceCount = ends, n_faces

    def VertexId(self, k: int) -> int:
        return self._ends[k]


def on_a_sphere(points: np.ndarray) -> np.ndarray:
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def flat(points: np.ndarray) -> np.ndarray:
    return points


class SubD:
    """The limit surface is where ``place`` puts the control net, which is refined by halving."""

    def __init__(self, points: np.ndarray, faces: list[list[int]], place=on_a_sphere, shuffled=False) -> None:
        self._points, self._faces, self._place, self._shuffled = points, faces, place, shuffled

    def Duplicate(self) -> SubD:
        return SubD(self._points.copy(), [list(f) for f in self._faces], self._place, self._shuffled)

    def Subdivide(self, count: int) -> bool:
        for _ in range(count):
            self._halve()
        return True

    def _halve(self) -> None:
        points, middle, faces = self._points.tolist(), {}, []

        def add(*ends: int) -> int:
            key = tuple(sorted(ends))
            if key not in middle:
                middle[key] = len(points)
                points.append(np.mean([self._points[e] for e in ends], axis=0).tolist())
            return middle[key]

        for f in self._faces:
            centre = add(*f)
            for k, corner in enumerate(f):
                faces.append([corner, add(corner, f[(k + 1) % len(f)]), centre, add(f[k - 1], corner)])
        self._points, self._faces = np.array(points), faces

    @property
    def FaceCount(self) -> int:
        return len(self._faces)

    @property
    def Vertices(self) -> list[_Vertex]:
        return [_Vertex(i, p) for i, p in enumerate(self._place(self._points))]

    @property
    def Faces(self) -> list[_Face]:
        vertices = self.Vertices
        return [_Face([vertices[i] for i in f]) for f in self._faces][:: -1 if self._shuffled else 1]

    @property
    def Edges(self) -> list[_Edge]:
        count: dict[tuple[int, int], int] = {}
        for f in self._faces:
            for a, b in zip(f, f[1:] + f[:1]):
                key = (min(a, b) + 1, max(a, b) + 1)
                count[key] = count.get(key, 0) + 1
        return [_Edge(ends, n) for ends, n in count.items()]


def cube(missing: int = 0) -> SubD:
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    return SubD(corners, CUBE[missing:])


def test_the_mesh_lies_on_the_limit_surface_and_looks_outwards():
    mesh = mesh_object(cube())
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() <= 1e-12
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4 * np.pi / 3, rel=1e-2)
    assert mesh.n_borders_expected == 0
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 40


def test_it_is_refined_until_the_chord_error_is_kept():
    mesh = mesh_object(cube(), chord=2e-3)
    middle = np.linalg.norm(mesh.vertices[mesh.faces].mean(1), axis=1)
    assert 1 - middle.min() <= 2e-3
    assert len(mesh.faces) > len(mesh_object(cube(), chord=2e-2, edge_target=0.5).faces)


def test_borders_are_counted_on_the_control_net():
    mesh = mesh_object(cube(missing=2))
    assert mesh.n_borders_expected == 2
    assert len(border_loops(mesh.faces, find_twins(mesh.faces, len(mesh.vertices)))) == 2


def test_a_mirroring_transform_keeps_the_outside_outside():
    mesh = mesh_object(cube(), transform=np.diag([-1.0, 2.0, 1.0, 1.0]))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(8 * np.pi / 3, rel=1e-2)


def test_nothing_too_large_not_finite_or_empty_is_made():
    with pytest.raises(TooMuchWork):
        mesh_object(cube(), edge_target=1e-3)
    with pytest.raises(Degenerate):
        mesh_object(SubD(np.zeros((0, 3)), [], flat))
    broken = cube()
    broken._points[0, 0] = np.nan
    with pytest.raises(NonFinite):
        mesh_object(broken)


def sheet(n: int, m: int, size: float, place=flat, shuffled=False) -> SubD:
    x, y = np.meshgrid(np.linspace(0, size, n + 1), np.linspace(0, size, m + 1), indexing="ij")
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    corner = i * (m + 1) + j
    faces = np.column_stack([corner, corner + m + 1, corner + m + 2, corner + 1]).tolist()
    return SubD(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), faces, place, shuffled)


def bump(x, y):
    return 0.5 * np.exp(-4 * ((x - 2) ** 2 + (y - 2) ** 2))


def lifted(points: np.ndarray) -> np.ndarray:
    x, y, _ = points.T
    return np.column_stack([x, y, bump(x, y)])


def test_long_quads_are_divided_the_long_way():
    mesh = mesh_object(sheet(2, 8, 12.0))
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 36
    assert len(border_loops(mesh.faces, find_twins(mesh.faces, len(mesh.vertices)))) == 1


def test_a_bent_place_is_divided_more_and_flat_ones_are_not():
    mesh = mesh_object(sheet(8, 8, 16.0, lifted), chord=0.01, edge_target=2.0)
    x, y, z = mesh.vertices[mesh.faces].mean(1).T
    assert np.abs(bump(x, y) - z).max() <= 0.015
    near = np.hypot(x - 2, y - 2) < 1.5
    assert near.mean() > 5 * np.pi * 1.5**2 / 16**2
    twins = find_twins(mesh.faces, len(mesh.vertices))
    assert len(border_loops(mesh.faces, twins)) == 1
    assert len(mesh.vertices) - (len(twins) + (twins < 0).sum()) // 2 + len(mesh.faces) == 1


def test_triangles_that_are_halved_stay_well_shaped():
    mesh = mesh_object(sheet(8, 8, 16.0, lifted), chord=0.01, edge_target=2.0)
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 40
    assert least_angles(mesh.vertices, mesh.faces).min() >= 20


def test_edges_are_no_longer_than_asked_for_by_much():
    mesh = mesh_object(sheet(2, 8, 12.0), edge_target=0.5)
    sides = mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)]
    assert np.linalg.norm(sides, axis=2).max() <= 0.5 * 1.3 * np.sqrt(2)
    assert len(mesh.faces) <= 4 * 12 * 12 / 0.5**2


def test_a_refinement_that_is_not_face_by_face_is_refused():
    with pytest.raises(Unreadable, match="does not follow its faces"):
        mesh_object(sheet(2, 3, 2.0, shuffled=True))
