"""What `mesh_object` makes of every kind of surface that rhino3dm can build."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.errors import NonFinite, TooMuchWork, Unsupported
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.geometry.lawson_flips import least_angles
from weavecore.reading.nurbs_mesher import MeshedObject, mesh_object
from weavecore.reading.nurbs_mesher.brep_shape import nurbs_surface

r = pytest.importorskip("rhino3dm")

CATALOGUE = {
    # name: (borders, Euler characteristic, area)
    "box": (0, 2, 22.0),
    "sphere": (0, 2, 16 * math.pi),
    "tube": (2, 0, 4 * math.pi),
    "can": (0, 2, 6 * math.pi),
    "cone": (1, 1, math.pi * math.sqrt(5)),
    "torus": (0, 0, 12 * math.pi**2),
    "bowl": (1, 1, 2 * math.pi),
    "hourglass": (2, 0, None),
    "half_tube": (1, 1, 3 * math.pi),
    "plate": (1, 1, 6.0),
    "disc": (1, 1, 2.25 * math.pi),
    "star": (1, 1, 10 * 2.0 * 0.7 * math.sin(math.pi / 10)),
    "saddle": (1, 1, None),
    "fan": (1, 1, 2.2),
    "folded": (1, 1, 6.0),
    "pipe": (0, 0, 2 * 3 * math.pi + 2 * math.pi * 3 * 3),
    "punched": (0, 0, 2 * (12 - math.pi) + 14 + 2 * math.pi),
    "beam": (1, 1, 9.0),
}


@pytest.fixture(scope="module", params=CATALOGUE)
def meshed(request: pytest.FixtureRequest) -> tuple[str, MeshedObject]:
    return request.param, mesh_object(getattr(make, request.param)())


def borders(mesh: MeshedObject) -> list:
    return border_loops(mesh.faces, find_twins(mesh.faces, len(mesh.vertices)))


def euler(mesh: MeshedObject) -> int:
    twins = find_twins(mesh.faces, len(mesh.vertices))
    return len(mesh.vertices) - (len(twins) + int((twins < 0).sum())) // 2 + len(mesh.faces)


def size(mesh: MeshedObject) -> float:
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))


def area(mesh: MeshedObject) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def volume(mesh: MeshedObject) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_borders_and_euler_characteristic_are_the_surface_s_own(meshed):
    name, mesh = meshed
    n_borders, characteristic, _ = CATALOGUE[name]
    check_manifold_vertices(mesh.faces, find_twins(mesh.faces, len(mesh.vertices)), len(mesh.vertices))
    assert len(borders(mesh)) == n_borders == mesh.n_borders_expected
    assert euler(mesh) == characteristic
    assert mesh.notes == ()


def test_area_is_the_surface_s_own(meshed):
    name, mesh = meshed
    true = CATALOGUE[name][2]
    if true is not None:
        assert area(mesh) == pytest.approx(true, rel=6e-3)


def test_triangles_are_well_shaped(meshed):
    _, mesh = meshed
    angles = least_angles(mesh.vertices, mesh.faces)
    assert np.median(angles) >= 43
    assert np.percentile(angles, 5) >= 30


def test_chord_error_is_a_thousandth_of_the_size_at_most(meshed):
    _, mesh = meshed
    assert mesh.chord_error <= 1e-3 * size(mesh)


def test_every_vertex_is_used_and_the_arrays_are_read_only(meshed):
    _, mesh = meshed
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert not mesh.vertices.flags.writeable
    assert not mesh.faces.flags.writeable


@pytest.mark.parametrize(("name", "true"), [("box", 6.0), ("sphere", 32 * math.pi / 3), ("can", 2 * math.pi)])
def test_solids_look_outwards(name, true):
    assert volume(mesh_object(getattr(make, name)())) == pytest.approx(true, rel=1e-2)


def test_vertices_of_a_sphere_lie_on_it():
    mesh = mesh_object(make.sphere(2.0))
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 2.0).max() <= 1e-12


def test_chord_error_told_is_the_true_one():
    mesh = mesh_object(make.sphere(2.0))
    middle = mesh.vertices[mesh.faces].mean(1)
    true = float((2.0 - np.linalg.norm(middle, axis=1)).max())
    assert true * 0.99 <= mesh.chord_error <= 2.5 * true


def test_borders_lie_on_the_edge_curves():
    mesh = mesh_object(make.tube(1.0, 2.0))
    for loop in borders(mesh):
        x, y, z = mesh.vertices[loop].T
        assert np.abs(np.hypot(x, y) - 1.0).max() <= 1e-12
        assert np.ptp(z) <= 1e-12


def test_corners_of_borders_are_kept():
    mesh = mesh_object(make.star())
    angle = np.arange(20) * math.pi / 10
    radius = np.where(np.arange(20) % 2 == 0, 2.0, 0.7)
    corners = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    distance = np.linalg.norm(mesh.vertices[:, None] - corners, axis=2).min(0)
    assert distance.max() <= 1e-12


def test_a_crease_inside_a_face_is_kept():
    mesh = mesh_object(make.folded())
    x, _, z = mesh.vertices[mesh.faces].mean(1).T
    off_the_folds = np.minimum.reduce([np.hypot(0, z) + (x > 1), np.abs(x - 1), np.abs(z - 1) + (x < 1)])
    assert off_the_folds.max() <= 1e-9


def test_error_falls_with_the_square_of_the_edge_length():
    coarse, fine = (mesh_object(make.sphere(1.0), edge_target=h, chord=1.0) for h in (0.2, 0.1))
    lost = [4 * math.pi / 3 - volume(mesh) for mesh in (coarse, fine)]
    assert 3.0 <= lost[0] / lost[1] <= 5.0


@pytest.mark.parametrize("name", ["disc", "sphere", "saddle"])
def test_edges_are_as_long_as_asked_for(name):
    mesh = mesh_object(getattr(make, name)(), edge_target=0.1, chord=1.0)
    sides = mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)]
    length = np.linalg.norm(sides, axis=2)
    assert 0.08 <= np.median(length) <= 0.11
    assert length.max() <= 0.17


def test_a_smaller_chord_error_gives_more_triangles_where_it_bends():
    mesh = mesh_object(make.sphere(1.0), chord=5e-4)
    assert mesh.chord_error <= 5e-4
    assert len(mesh.faces) > 3 * len(mesh_object(make.sphere(1.0), edge_target=0.2, chord=2e-3).faces)


def test_the_same_input_gives_the_same_bytes():
    one, two = (mesh_object(make.pipe()) for _ in range(2))
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.faces.tobytes() == two.faces.tobytes()


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_the_unit_does_not_matter(scale):
    plain, scaled = (mesh_object(make.hourglass(), transform=np.diag([s, s, s, 1.0])) for s in (1.0, scale))
    assert len(borders(scaled)) == 2
    assert len(scaled.faces) == pytest.approx(len(plain.faces), rel=0.02)


def test_far_from_the_origin_borders_and_shape_are_kept():
    far = np.eye(4)
    far[:3, 3] = 1e6, -2e6, 3e6
    mesh = mesh_object(make.hourglass(), transform=far)
    assert len(borders(mesh)) == 2
    assert np.median(least_angles(mesh.vertices - far[:3, 3], mesh.faces)) >= 45


def test_a_mirroring_transform_keeps_the_outside_outside():
    mesh = mesh_object(make.can(), transform=np.diag([1.0, -3.0, 1.0, 1.0]))
    assert volume(mesh) == pytest.approx(6 * math.pi, rel=1e-2)
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 45


def test_progress_rises_to_one_and_can_cancel():
    told: list[float] = []
    mesh_object(make.box(), progress=lambda share, _: told.append(share))
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(told) > 10

    def cancel(share: float, _: str) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh_object(make.box(), progress=cancel)


def test_what_is_no_surface_is_refused():
    with pytest.raises(Unsupported, match="cannot be made into a surface"):
        mesh_object(make.circle(1.0))


def test_too_many_triangles_are_refused_before_they_are_made():
    with pytest.raises(TooMuchWork):
        mesh_object(make.plate(), edge_target=1e-5)


def test_a_transform_that_flattens_is_refused():
    with pytest.raises(NonFinite):
        mesh_object(make.plate(), transform=np.diag([1.0, 1.0, 0.0, 1.0]))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e200])
def test_a_control_point_that_is_not_finite_is_refused(wrong):
    surface = make.saddle()
    surface.Points[1, 1] = r.Point4d(wrong, 0.0, 0.0, 1.0)
    with pytest.raises(NonFinite):
        nurbs_surface(surface)
