"""Polysurfaces as a whole: borders on their edges, faces turned alike, many faces in seconds, loops as they say."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

import rhino_shapes as make
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.geometry.lawson_flips import least_angles
from weavecore.reading import inspect_file, surface_from
from weavecore.reading.nurbs_mesher import MeshedObject, mesh_object
from weavecore.reading.nurbs_mesher.objects import as_brep
from weavecore.reading.raw import RawMesh
from weavecore.reading.repair import repair

r = pytest.importorskip("rhino3dm")

OPEN = ["tube", "cone", "bowl", "hourglass", "half_tube", "disc", "star", "saddle", "fan", "folded", "beam"]
N_SIDES = 98


def borders(mesh: MeshedObject) -> list[np.ndarray]:
    twins = find_twins(mesh.faces, len(mesh.vertices))
    check_manifold_vertices(mesh.faces, twins, len(mesh.vertices))
    return border_loops(mesh.faces, twins)


def fine_points(curve: Any, n: int = 4200) -> np.ndarray:  # corners at thirds and tenths are hit
    parameters = np.linspace(curve.Domain.T0, curve.Domain.T1, n + 1)
    return np.array([(p.X, p.Y, p.Z) for p in map(curve.PointAt, parameters.tolist())])


def gear() -> Any:
    """A toothed wheel with 98 flanks and two flat sides: 100 faces."""
    angle = np.arange(N_SIDES + 1) * 2 * np.pi / N_SIDES
    radius = np.where(np.arange(N_SIDES + 1) % 2 == 0, 10.0, 9.0)
    corners = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    corners[-1] = corners[0]
    return r.Extrusion.Create(make.polyline(*corners.tolist()), 4.0, True)


@pytest.mark.parametrize("name", OPEN)
def test_borders_lie_on_the_edges_as_rhino_s_own_library_evaluates_them(name):
    shape = getattr(make, name)()
    mesh = mesh_object(shape)
    brep = as_brep(shape)
    lines = [fine_points(brep.Edges[i]) for i in range(len(brep.Edges))]
    near = cKDTree(np.concatenate(lines))
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    step = max(np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in lines)
    for loop in borders(mesh):
        _, k = near.query(mesh.vertices[loop], k=2)
        a, b = (near.data[k[:, i]] for i in (0, 1))
        along = b - a
        t = np.einsum("ij,ij->i", mesh.vertices[loop] - a, along) / np.maximum((along**2).sum(1), 1e-300)
        off = np.linalg.norm(a + t[:, None] * along - mesh.vertices[loop], axis=1)
        # What is left is how much a curve bends between two of the points that it was sampled at.
        assert off.max() <= step**2 / size + 1e-9 * size


def test_a_hundred_faces_are_meshed_in_seconds_with_progress():
    told: list[float] = []
    start = time.process_time()
    mesh = mesh_object(gear(), progress=lambda share, _: told.append(share))
    assert time.process_time() - start < 10.0
    assert len(as_brep(gear()).Faces) == N_SIDES + 2
    assert len(told) > N_SIDES
    assert told == sorted(told)
    assert borders(mesh) == []
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 40


def test_a_hundred_faces_look_outwards_together():
    mesh = mesh_object(gear())
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    area = N_SIDES * 10.0 * 9.0 * np.sin(2 * np.pi / N_SIDES) / 2
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4.0 * area, rel=1e-6)


@pytest.mark.parametrize("turned", [[0], [1, 3], [0, 1, 2, 3, 4, 5]])
def test_faces_that_look_the_other_way_come_out_turned_like_the_others(turned):
    """A box of six meshes, some of them inside out, as faces with reversed orientation are."""
    box = mesh_object(make.box())
    normal = np.cross(*(box.vertices[box.faces[:, k]] - box.vertices[box.faces[:, 0]] for k in (1, 2)))
    side = np.argmax(np.abs(normal), axis=1) * 2 + (normal[np.arange(len(normal)), np.abs(normal).argmax(1)] > 0)
    faces = np.where(np.isin(side, turned)[:, None], box.faces[:, ::-1], box.faces)
    surface = surface_from((box.vertices, faces))
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(6.0)


def test_more_borders_than_the_object_says_are_told():
    vertices, faces = mesh_object(make.tube()).vertices, mesh_object(make.tube()).faces
    told = repair(RawMesh(vertices, faces, n_borders_expected=2)).notes
    assert not any("borders" in one for one in told)
    told = repair(replace(RawMesh(vertices, faces), n_borders_expected=1)).notes
    assert "By its edges the object has 1 borders, and its mesh has 2." in map(str, told)


def test_the_report_of_a_file_names_borders_and_their_lengths(tmp_path: Path):
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    for shape in (make.tube(), make.disc(), gear()):
        model.Objects.Add(shape, r.ObjectAttributes())
    model.Write(str(tmp_path / "three.3dm"), 8)
    tube, disc, wheel = inspect_file(tmp_path / "three.3dm").objects
    assert tube.border_lengths == pytest.approx([2 * np.pi] * 2, rel=2e-3)
    assert disc.border_lengths == pytest.approx([3 * np.pi], rel=2e-3)
    assert (wheel.n_borders, wheel.euler_characteristic, wheel.kind) == (0, 2, "Extrusion")
