"""Surfaces joined where their edges coincide, meshes stitched, blocks expanded."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.errors import NoSurface, Unreadable
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.geometry.lawson_flips import least_angles
from weavecore.reading import read_surface
from weavecore.reading.nurbs_mesher import MeshedObject, expand_reference, join_meshes, mesh_object, mesh_objects

r = pytest.importorskip("rhino3dm")

FLOOR = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
WALL = ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))
HALF_WALL = ((1, 0.25, 0), (1, 0.75, 0), (1, 0.75, 1), (1, 0.25, 1))


def shape_of(mesh: MeshedObject) -> tuple[int, int]:
    """Borders and Euler characteristic; raises where the mesh is not manifold and oriented alike."""
    twins = find_twins(mesh.faces, len(mesh.vertices))
    check_manifold_vertices(mesh.faces, twins, len(mesh.vertices))
    edges = (len(twins) + int((twins < 0).sum())) // 2
    return len(border_loops(mesh.faces, twins)), len(mesh.vertices) - edges + len(mesh.faces)


def test_two_squares_become_one_surface():
    mesh = mesh_objects([make.square(*FLOOR), make.square(*WALL)], tolerance=1e-3)
    assert shape_of(mesh) == (1, 1)
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 50


def test_orientation_is_unified():
    turned = (WALL[0], WALL[3], WALL[2], WALL[1])
    assert shape_of(mesh_objects([make.square(*FLOOR), make.square(*turned)], tolerance=1e-3)) == (1, 1)


def test_edges_within_the_tolerance_are_joined_and_others_are_not():
    def lifted(gap: float) -> MeshedObject:
        wall = make.square(*(tuple(np.add(corner, (0, 0, gap))) for corner in WALL))
        return mesh_objects([make.square(*FLOOR), wall], tolerance=1e-3)

    assert shape_of(lifted(5e-4)) == (1, 1)
    assert shape_of(lifted(5e-2)) == (2, 2)


def test_edges_that_coincide_in_part_are_stitched():
    mesh = mesh_objects([make.square(*FLOOR), make.square(*HALF_WALL)], tolerance=1e-3)
    assert shape_of(mesh) == (1, 1)


def test_a_cap_whose_seam_lies_elsewhere_closes_a_tube():
    mesh = mesh_objects([make.tube(), make.bowl(turn=0.3)], tolerance=1e-3)
    assert shape_of(mesh) == (1, 1)
    x, y, z = mesh.vertices.T
    off_the_tube, off_the_bowl = np.abs(np.hypot(x, y) - 1), np.abs(np.sqrt(x**2 + y**2 + (z - 2) ** 2) - 1)
    assert np.where(z < 2, off_the_tube, off_the_bowl).max() <= 1e-9


def test_meshes_of_different_edge_lengths_are_stitched():
    meshes = [mesh_object(make.tube()), mesh_object(make.bowl(turn=0.3), edge_target=0.13)]
    assert shape_of(join_meshes(meshes, tolerance=1e-3)) == (1, 1)


def test_meshes_that_do_not_touch_stay_apart():
    far = np.eye(4)
    far[0, 3] = 10
    meshes = [mesh_object(make.disc()), mesh_object(make.disc(), transform=far)]
    joined = join_meshes(meshes, tolerance=1e-3)
    assert shape_of(joined) == (2, 2)
    assert len(joined.faces) == sum(len(m.faces) for m in meshes)


@pytest.fixture
def nested(tmp_path) -> Any:
    """A file with a block that holds a tube and a block that holds a bowl, and one reference to the outer one."""
    model, plain = r.File3dm(), r.ObjectAttributes()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    table = model.InstanceDefinitions
    table.Add("inner", "", "", "", r.Point3d(0, 0, 0), (r.Brep.CreateFromSurface(make.bowl()),), (plain,))
    inner = r.InstanceReference(table[0].Id, r.Transform.Translation(1, 0, 0))
    table.Add("outer", "", "", "", r.Point3d(0, 0, 0), (inner, make.tube()), (plain, plain))
    placed = r.Transform.Multiply(r.Transform.Translation(0, 10, 0), r.Transform.Scale(r.Point3d(0, 0, 0), 2.0))
    model.Objects.AddInstanceObject(r.InstanceReference(table[1].Id, placed))
    path = tmp_path / "nested.3dm"
    model.Write(str(path), 8)
    return r.File3dm.Read(str(path))


def the_reference(model: Any) -> Any:
    found = [o for o in model.Objects if not o.Attributes.IsInstanceDefinitionObject]
    assert len(found) == 1
    return found[0].Geometry


def test_nested_blocks_are_expanded_with_their_transforms_composed(nested):
    parts = expand_reference(nested, the_reference(nested))
    assert len(parts) == 2
    bowl, tube = (mesh_object(part.geometry, transform=part.transform) for part in parts)
    assert tube.vertices.min(0) == pytest.approx([-2, 8, 0], abs=1e-2)
    assert tube.vertices.max(0) == pytest.approx([2, 12, 4], abs=1e-2)
    assert bowl.vertices.max(0) == pytest.approx([4, 12, 6], abs=1e-2)
    assert np.abs(np.linalg.norm(bowl.vertices - [2, 10, 4], axis=1) - 2).max() <= 1e-9


def test_the_parts_of_a_block_can_be_joined(nested):
    parts = expand_reference(nested, the_reference(nested))
    back = np.eye(4)
    back[0, 3] = -2.0
    moved = [back @ parts[0].transform, parts[1].transform]
    mesh = mesh_objects([p.geometry for p in parts], transforms=moved, tolerance=1e-3)
    assert shape_of(mesh) == (1, 1)
    assert mesh.vertices[:, 2].max() == pytest.approx(6.0, abs=1e-9)


def test_a_block_is_read_from_a_file_as_one_surface(nested, tmp_path):
    surface = read_surface(tmp_path / "nested.3dm")
    assert len(surface.borders) == 3
    assert surface.vertices[:, 1].min() == pytest.approx(8.0, abs=1e-2)


def test_a_block_of_curves_is_no_candidate(tmp_path):
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    model.InstanceDefinitions.Add("lines", "", "", "", r.Point3d(0, 0, 0), (make.circle(1.0),), (r.ObjectAttributes(),))
    model.Objects.AddInstanceObject(r.InstanceReference(model.InstanceDefinitions[0].Id, r.Transform.Identity()))
    model.Write(str(tmp_path / "lines.3dm"), 8)
    with pytest.raises(NoSurface):
        read_surface(tmp_path / "lines.3dm")


def test_a_mesh_and_a_surface_are_stitched():
    mesh = r.Mesh()
    for corner in FLOOR:
        mesh.Vertices.Add(*corner)
    mesh.Faces.AddFace(0, 1, 2, 3)
    joined = mesh_objects([mesh, make.square(*WALL)], tolerance=1e-3)
    assert shape_of(joined) == (1, 1)


def test_a_block_without_objects_is_refused():
    model = r.File3dm()
    lonely = r.InstanceReference("9b5f2f66-6f63-4a2c-9c8c-3c2b7b6a0e11", r.Transform.Identity())
    with pytest.raises(NoSurface, match="block"):
        expand_reference(model, lonely)


def test_a_block_that_holds_itself_is_refused():
    class Definition:
        def GetObjectIds(self) -> tuple[str, ...]:  # noqa: N802
            return ("one",)

    class Source:
        """What rhino3dm cannot write: a definition whose only object refers to it."""

        def __init__(self, reference: Any) -> None:
            holder = type("Holder", (), {"Geometry": reference, "Attributes": r.ObjectAttributes()})
            self.InstanceDefinitions = type("Table", (), {"FindId": lambda _, __: Definition()})()
            self.Objects = type("Table", (), {"FindId": lambda _, __: holder})()

    reference = r.InstanceReference("9b5f2f66-6f63-4a2c-9c8c-3c2b7b6a0e11", r.Transform.Identity())
    with pytest.raises(Unreadable, match="itself"):
        expand_reference(Source(reference), reference)


def test_a_stitched_pipe_has_the_area_of_its_parts():
    mesh = mesh_objects([make.tube(), make.bowl(turn=1.0)], tolerance=1e-3)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(6 * math.pi, rel=5e-3)
