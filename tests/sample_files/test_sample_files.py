"""The sample files are what their README says, and what makes them makes them well."""

from __future__ import annotations

import re
from functools import cache
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
import rhino3dm

import shapes
from make import LAYERS
from minimal import mean_curvature
from weavecore import pipeline
from weavecore.model import SurfaceMesh

FOLDER = Path(__file__).resolve().parents[2] / "sample_files"
README = (FOLDER / "README.md").read_text("utf-8")
TOPOLOGY = {
    "narrow_neck": (1, 1),
    "six_way_joint": (6, -4),
    "minimal_surface": (2, -8),
    "hemisphere": (1, 1),
    "hourglass": (2, 0),
    "handle": (1, -1),
    "closed_body": (0, 2),
    "shell_2400x1600": (3, -1),
}
every_sample = pytest.mark.parametrize("name", sorted(LAYERS))


@cache
def document(name: str) -> rhino3dm.File3dm:
    return rhino3dm.File3dm.Read(str(FOLDER / f"{name}.3dm"))


@cache
def surface(name: str) -> SurfaceMesh:
    mesh = document(name).Objects[0].Geometry
    points = mesh.Vertices.ToPoint3dArray()
    vertices = np.stack([np.fromiter(map(attrgetter(axis), points), float) for axis in "XYZ"], axis=1)
    return SurfaceMesh(vertices, np.array(list(mesh.Faces))[:, :3])


@cache
def coarse(name: str) -> SurfaceMesh:
    """The sample made anew with edges three times as long."""
    fine = surface(name)
    area = np.linalg.norm(area_vectors(fine), axis=1).sum()
    return SurfaceMesh(*getattr(shapes, name)(3 * np.sqrt(area / fine.n_faces * 4 / np.sqrt(3))))


def area_vectors(mesh: SurfaceMesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


def least_angles(mesh: SurfaceMesh) -> np.ndarray:
    corners = mesh.vertices[mesh.faces]
    angles = []
    for k in range(3):
        u, w = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angles.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(u, w), axis=1), (u * w).sum(1))))
    return np.min(angles, axis=0)


def test_the_readme_lists_every_sample_with_its_figures() -> None:
    row = re.compile(r"^\| `(\w+)\.3dm` \| (.+?) \| .+? \| ([\d,]+) \| (\d) \| (−?\d) \|", re.MULTILINE)
    told = {
        name: (layer, int(faces.replace(",", "")), int(loops), int(euler.replace("−", "-")))
        for name, layer, faces, loops, euler in row.findall(README)
    }
    found = {
        name: (layer, surface(name).n_faces, len(surface(name).borders), surface(name).euler_characteristic)
        for name, layer in LAYERS.items()
    }
    assert told == found


@every_sample
def test_a_file_holds_one_named_mesh_on_its_layer_in_millimetres(name: str) -> None:
    model = document(name)
    assert len(model.Objects) == 1
    attributes = model.Objects[0].Attributes
    assert attributes.Name == name
    assert model.Layers[attributes.LayerIndex].Name == LAYERS[name]
    assert model.Settings.ModelUnitSystem == rhino3dm.UnitSystem.Millimeters
    assert model.Objects[0].Geometry.IsValid
    content = (FOLDER / f"{name}.3dm").read_bytes()
    assert len(content) < 1_000_000
    folder_in_file = f"/{name}.3dm".encode("utf-16-le")
    assert folder_in_file not in content


@every_sample
def test_triangles_are_well_shaped_and_borders_evenly_divided(name: str) -> None:
    mesh = surface(name)
    angles = least_angles(mesh)
    assert np.median(angles) > 50
    assert angles.min() > 20
    for border in mesh.borders:
        steps = np.linalg.norm(mesh.vertices[np.roll(border, -1)] - mesh.vertices[border], axis=1)
        assert steps.max() < 1.25 * steps.mean()
        assert steps.min() > 0.8 * steps.mean()


@every_sample
def test_a_sample_made_coarser_has_the_same_topology(name: str) -> None:
    mesh = coarse(name)
    assert mesh.n_faces < surface(name).n_faces / 4
    assert (len(mesh.borders), mesh.euler_characteristic) == TOPOLOGY[name]
    assert (len(surface(name).borders), surface(name).euler_characteristic) == TOPOLOGY[name]
    assert least_angles(mesh).min() > 10


def test_the_faces_look_outwards() -> None:
    def volume(mesh: SurfaceMesh) -> float:
        return float((mesh.vertices[mesh.faces[:, 0]] * area_vectors(mesh)).sum() / 3)

    assert volume(coarse("closed_body")) > 0
    assert volume(coarse("hourglass")) > 0
    for name in ("hemisphere", "narrow_neck", "shell_2400x1600"):
        assert area_vectors(coarse(name))[:, 2].sum() > 0


def test_a_shape_is_made_the_same_each_time() -> None:
    first, second = shapes.hourglass(40.0), shapes.hourglass(40.0)
    assert [array.tobytes() for array in first] == [array.tobytes() for array in second]


def test_the_minimal_surface_has_no_mean_curvature() -> None:
    mesh = surface("minimal_surface")
    mean, principal = mean_curvature(mesh.vertices, mesh.faces)
    assert np.abs(mean).max() < 1e-6 * np.median(principal)


def test_the_minimal_surface_is_covered_by_eighty_polylines() -> None:
    command = next(
        line for line in (FOLDER / "README.md").read_text("utf-8").splitlines() if line.startswith("weavecore")
    )
    spacing = float(re.findall(r"--spacing ([\d.]+)", command)[0])
    latitudes = pipeline.offset(surface("minimal_surface"), spacing=spacing)
    assert len(latitudes) == 80
    assert (latitudes.generation == 0).sum() == 2
