# ruff: noqa: N802
"""SubDs.  rhino3dm reads them but cannot make them: a stand-in with its interface refines a cube or a sheet."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.errors import Degenerate, NonFinite, TooMuchWork
from weavecore.geometry.halfedges import border_loops, find_twins
from weavecore.geometry.relaxing import least_angles
from weavecore.reading.rhino_surfaces import mesh_object

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


class SubD:
    """The limit surface is a sphere (or stays flat), the control net refined by halving."""

    def __init__(self, points: np.ndarray, faces: list[list[int]], round_: bool) -> None:
        self._points, self._faces, self._round = points, faces, round_

    def Duplicate(self) -> SubD:
        return SubD(self._points.copy(), [list(f) for f in self._faces], self._round)

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
        length = np.linalg.norm(self._points, axis=1, keepdims=True)
        return [_Vertex(i, p) for i, p in enumerate(self._points / length if self._round else self._points)]

    @property
    def Faces(self) -> list[_Face]:
        vertices = self.Vertices
        return [_Face([vertices[i] for i in f]) for f in self._faces]

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
    return SubD(corners, CUBE[missing:], round_=True)


def test_the_mesh_lies_on_the_limit_surface_and_looks_outwards():
    mesh = mesh_object(cube())
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() <= 1e-12
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4 * np.pi / 3, rel=1e-2)
    assert mesh.loops_expected == 0
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 40


def test_it_is_refined_until_the_chord_error_is_kept():
    mesh = mesh_object(cube(), chord=2e-3)
    middle = np.linalg.norm(mesh.vertices[mesh.faces].mean(1), axis=1)
    assert 1 - middle.min() <= 2e-3
    assert len(mesh.faces) > len(mesh_object(cube(), chord=2e-2, edge_target=0.5).faces)


def test_borders_are_counted_on_the_control_net():
    mesh = mesh_object(cube(missing=2))
    assert mesh.loops_expected == 2
    assert len(border_loops(mesh.faces, find_twins(mesh.faces, len(mesh.vertices)))) == 2


def test_a_mirroring_transform_keeps_the_outside_outside():
    mesh = mesh_object(cube(), transform=np.diag([-1.0, 2.0, 1.0, 1.0]))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(8 * np.pi / 3, rel=1e-2)


def test_nothing_too_large_not_finite_or_empty_is_made():
    with pytest.raises(TooMuchWork):
        mesh_object(cube(), edge_target=1e-3)
    with pytest.raises(Degenerate):
        mesh_object(SubD(np.zeros((0, 3)), [], round_=False))
    broken = cube()
    broken._points[0, 0] = np.nan
    with pytest.raises(NonFinite):
        mesh_object(broken)
