"""Several objects of a Rhino file: when they are one surface, and when it is asked which is meant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rhino_shapes as make
from raw_meshes import grid, moved
from weavecore.errors import AmbiguousSurface, NoSurface
from weavecore.model.notes import texts_of
from weavecore.reading import read_surface

r = pytest.importorskip("rhino3dm")

FLOOR = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
WALL = ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))
ROOF = ((1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1))


def saved(folder: Path, *objects: tuple[Any, str, str]) -> Path:
    """A file of objects: geometry, name, layer."""
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Meters
    model.Settings.ModelAbsoluteTolerance = 1e-3
    layers: dict[str, int] = {}
    for geometry, name, layer in objects:
        if layer not in layers:
            made = r.Layer()
            made.Name = layer
            layers[layer] = model.Layers.Add(made)
        attributes = r.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, layers[layer]
        model.Objects.Add(geometry, attributes)
    path = folder / "parts.3dm"
    model.Write(str(path), 8)
    return path


def quad_mesh(corners: tuple[tuple[float, ...], ...]) -> Any:
    mesh = r.Mesh()
    for corner in corners:
        mesh.Vertices.AddPoint3d(*corner)
    mesh.Faces.AddFace(0, 1, 2, 3)
    return mesh


@pytest.fixture
def shell(tmp_path: Path) -> Path:
    return saved(
        tmp_path,
        (make.square(*FLOOR), "floor", "Shell"),
        (make.square(*WALL), "wall", "Shell"),
        (make.square(*ROOF), "roof", "Shell"),
        (make.disc(), "disc", "Other"),
    )


def test_the_objects_of_a_layer_are_joined_where_their_edges_coincide(shell):
    surface = read_surface(shell, layer="Shell")
    assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
    assert texts_of(surface.notes)[0] == "Joined 3 objects where their edges coincide."
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([1, 1, 1])
    assert surface.name == "floor, wall, roof"


def test_without_a_layer_or_a_name_it_is_asked_which_is_meant(shell):
    with pytest.raises(AmbiguousSurface, match="name several to join them") as refused:
        read_surface(shell)
    assert len(refused.value.ids) == 4


def test_objects_that_are_named_are_joined(shell):
    surface = read_surface(shell, object=["wall", "floor"])
    assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
    assert surface.vertices[:, 2].max() == pytest.approx(1.0)
    assert surface.name == "floor, wall"


def test_objects_that_are_named_need_not_touch(shell):
    surface = read_surface(shell, object=["floor", "roof"])
    assert len(surface.borders) == 2


def test_a_name_that_is_missing_among_several_is_told(shell):
    with pytest.raises(NoSurface, match="'cellar'"):
        read_surface(shell, object=["floor", "cellar"])


def test_an_object_that_is_named_twice_is_one(shell):
    assert read_surface(shell, object=["floor", "floor"]).name == "floor"


def test_several_layers_can_be_named(tmp_path):
    path = saved(
        tmp_path,
        (make.square(*FLOOR), "a", "One"),
        (make.square(*WALL), "b", "Two"),
        (make.disc(), "c", "Three"),
    )
    assert len(read_surface(path, layer=["One", "Two"]).borders) == 1
    with pytest.raises(AmbiguousSurface):
        read_surface(path, layer=["One", "Three"])


def test_objects_of_a_layer_that_do_not_touch_are_listed(tmp_path):
    path = saved(tmp_path, (make.square(*FLOOR), "a", "L"), (make.square(*ROOF), "b", "L"))
    with pytest.raises(AmbiguousSurface, match="2 candidate objects") as refused:
        read_surface(path, layer="L")
    assert "'a'" in refused.value.ids[0]


def test_one_object_apart_makes_a_layer_ambiguous(tmp_path):
    apart = tuple((x + 1.5, y, z) for x, y, z in FLOOR)
    path = saved(
        tmp_path,
        (make.square(*FLOOR), "a", "L"),
        (make.square(*WALL), "b", "L"),
        (make.square(*apart), "c", "L"),
    )
    with pytest.raises(AmbiguousSurface, match="3 candidate objects"):
        read_surface(path, layer="L")


@pytest.mark.parametrize("make_one", [lambda: make.square(*FLOOR), make.bowl, lambda: quad_mesh(FLOOR)])
def test_copies_that_lie_on_each_other_are_not_glued_together(tmp_path, make_one):
    path = saved(tmp_path, (make_one(), "a", "L"), (make_one(), "b", "L"))
    with pytest.raises(AmbiguousSurface):
        read_surface(path, layer="L")


def test_meshes_surfaces_and_solids_of_a_layer_are_joined(tmp_path):
    path = saved(
        tmp_path,
        (make.tube(), "tube", "L"),
        (make.bowl(turn=0.3), "bowl", "L"),
    )
    surface = read_surface(path, layer="L")
    assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
    path = saved(tmp_path, (quad_mesh(FLOOR), "mesh", "L"), (make.square(*WALL), "wall", "L"))
    assert len(read_surface(path, layer="L").borders) == 1


def test_what_is_joined_is_read_in_a_process_of_its_own_alike(shell):
    plain, guarded = read_surface(shell, layer="Shell"), read_surface(shell, layer="Shell", guarded=True)
    assert plain.vertices.tobytes() == guarded.vertices.tobytes()
    assert plain.notes == guarded.notes
    assert not guarded.vertices.flags.writeable


def test_edges_are_as_long_as_asked_for(shell):
    fine, coarse = (read_surface(shell, layer="Shell", edge_target=h) for h in (0.05, 0.2))
    assert np.median(fine.edge_lengths) == pytest.approx(0.05, rel=0.25)
    assert np.median(coarse.edge_lengths) == pytest.approx(0.2, rel=0.25)


def test_the_order_of_the_names_does_not_matter(shell):
    one, two = (read_surface(shell, object=names) for names in (["wall", "floor"], ["floor", "wall"]))
    assert one.vertices.tobytes() == two.vertices.tobytes()


def _saved_meshes(path, *sheets):
    document = r.File3dm()
    document.Settings.ModelAbsoluteTolerance = 0.001
    for name, vertices, quads in sheets:
        mesh = r.Mesh()
        for point in vertices.tolist():
            mesh.Vertices.Add(*point)
        for quad in quads.tolist():
            mesh.Faces.AddFace(*quad)
        attributes = r.ObjectAttributes()
        attributes.Name = name
        document.Objects.AddMesh(mesh, attributes)
    document.Write(str(path), 7)
    return path


def test_a_gap_beyond_the_tolerance_is_named_and_closed_on_request(tmp_path):
    vertices, quads = grid(4, 3)
    path = _saved_meshes(tmp_path / "g.3dm", ("left", vertices, quads), ("right", moved(vertices, 4.005, 0, 0), quads))
    surface = read_surface(path, object=["left", "right"])
    assert [note.code for note in surface.notes if note.is_doubt] == ["GAP"]
    closed = read_surface(path, object=["left", "right"], weld=0.01)
    assert len(closed.borders) == 1
    assert not any(note.is_doubt for note in closed.notes)


def test_an_object_that_lies_on_another_is_left_out(tmp_path):
    vertices, quads = grid(4, 3)
    path = _saved_meshes(tmp_path / "t.3dm", ("a", vertices, quads), ("b", vertices, np.roll(quads, 1, axis=1)))
    surface = read_surface(path, object=["a", "b"])
    assert (surface.n_faces, len(surface.borders)) == (24, 1)
    assert "Left out b, which lies on a." in texts_of(surface.notes)
