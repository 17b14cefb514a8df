"""Rhino files: which object is meant, what is kept of the file, what is refused."""

import warnings

import numpy as np
import pytest
import rhino3dm

from raw_meshes import ball, grid
from weavecore.errors import (
    AmbiguousSurface,
    BadIndex,
    Degenerate,
    NonFinite,
    NoSurface,
    UnitUnknown,
    Unreadable,
    Unsupported,
    WeaveError,
)
from weavecore.reading import inspect_file, read_surface, surface_from
from weavecore.reading.read import read_raw


def mesh_of(vertices, faces):
    mesh = rhino3dm.Mesh()
    for point in vertices.tolist():
        mesh.Vertices.AddPoint3d(*point)
    for face in faces.tolist():
        mesh.Faces.AddFace(*face)
    return mesh


def sheet(n=3, m=2):
    return mesh_of(*grid(n, m))


class Model:
    """A Rhino file in the making."""

    def __init__(self, unit=rhino3dm.UnitSystem.Millimeters, tolerance=0.01):
        self.file = rhino3dm.File3dm()
        self.file.Settings.ModelUnitSystem = unit
        self.file.Settings.ModelAbsoluteTolerance = tolerance
        self.layers = {}

    def layer(self, name, *, above=None, visible=True, locked=False):
        layer = rhino3dm.Layer()
        layer.Name = name
        if above is not None:
            layer.ParentLayerId = self.file.Layers[self.layers[above]].Id
        layer.Visible, layer.Locked = visible, locked
        self.layers[name if above is None else f"{above}::{name}"] = self.file.Layers.Add(layer)
        return self

    def add(self, geometry, *, name="", layer=None, mode=None):
        if not self.layers:
            self.layer("Default")
        attributes = rhino3dm.ObjectAttributes()
        attributes.Name = name
        attributes.LayerIndex = self.layers[layer or next(iter(self.layers))]
        if mode is not None:
            attributes.Mode = getattr(rhino3dm.ObjectMode, mode)
        self.id = str(self.file.Objects.Add(geometry, attributes))
        return self

    def save(self, path, version=8):
        assert self.file.Write(str(path), version)
        return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.3dm"


class TestChoice:
    def test_the_only_mesh_is_meant(self, path):
        surface = read_surface(
            Model().add(rhino3dm.Point(rhino3dm.Point3d(1, 2, 3))).add(sheet(), name="Shell").save(path)
        )
        assert (surface.n_faces, surface.name) == (12, "Shell")

    def test_an_object_without_a_name_is_called_by_its_file(self, path):
        assert read_surface(Model().add(sheet()).save(path)).name == "model"

    def test_several_are_listed(self, path):
        model = Model().layer("A").layer("B").add(sheet(), name="one", layer="A").add(sheet(), name="two", layer="B")
        with pytest.raises(AmbiguousSurface) as refused:
            read_surface(model.save(path))
        assert len(refused.value.ids) == 2
        assert "'one'" in str(refused.value)
        assert model.id in str(refused.value)

    def test_by_name_and_by_id(self, path):
        model = Model().add(sheet(3, 2), name="one").add(sheet(4, 2), name="two").add(sheet(5, 2), name="three")
        model.save(path)
        assert read_surface(path, object="two").n_faces == 16
        assert read_surface(path, object=model.id).n_faces == 20
        assert read_surface(path, object="{" + model.id.upper() + "}").n_faces == 20

    def test_by_layer(self, path):
        model = Model().layer("Roof").layer("Shell", above="Roof").layer("Wall").layer("Shell", above="Wall")
        model.add(sheet(3, 2), layer="Roof::Shell").add(sheet(4, 2), layer="Wall::Shell").add(sheet(5, 2), layer="Wall")
        model.save(path)
        assert read_surface(path, layer="Roof::Shell").n_faces == 12
        assert read_surface(path, layer="wall::shell").n_faces == 16
        assert read_surface(path, layer="Wall").n_faces == 20
        assert read_surface(path, layer="Roof").n_faces == 12
        with pytest.raises(AmbiguousSurface):
            read_surface(path, layer="Shell")

    def test_by_layer_and_name(self, path):
        model = Model().layer("A").layer("B")
        model.add(sheet(3, 2), name="same", layer="A").add(sheet(4, 2), name="same", layer="B").save(path)
        with pytest.raises(AmbiguousSurface):
            read_surface(path, object="same")
        assert read_surface(path, object="same", layer="B").n_faces == 16

    @pytest.mark.parametrize("mode", ["Hidden", "Locked"])
    def test_hidden_and_locked_objects_are_not_meant_unless_named(self, path, mode):
        Model().add(sheet(3, 2), name="shown").add(sheet(4, 2), name="aside", mode=mode).save(path)
        assert read_surface(path).n_faces == 12
        assert read_surface(path, object="aside").n_faces == 16
        assert read_surface(path, layer="Default").n_faces == 12

    @pytest.mark.parametrize("state", [{"visible": False}, {"locked": True}])
    def test_layers_that_are_off_or_locked_are_not_meant_unless_named(self, path, state):
        model = Model().layer("On").layer("Off", **state).layer("Below", above="Off")
        model.add(sheet(3, 2), layer="On").add(sheet(4, 2), name="aside", layer="Off::Below").save(path)
        assert read_surface(path).n_faces == 12
        assert read_surface(path, object="aside").n_faces == 16
        assert read_surface(path, layer="Below").n_faces == 16

    def test_a_shown_object_goes_before_a_hidden_one_of_the_same_name(self, path):
        Model().add(sheet(3, 2), name="shell").add(sheet(4, 2), name="shell", mode="Hidden").save(path)
        assert read_surface(path, object="shell").n_faces == 12

    def test_what_is_only_hidden_is_named(self, path):
        with pytest.raises(NoSurface, match="all of them hidden") as refused:
            read_surface(Model().add(sheet(), name="aside", mode="Hidden").save(path))
        assert "'aside'" in str(refused.value)
        assert "hidden" in str(refused.value)

    def test_members_of_blocks_are_not_meant(self, path):
        model = Model().add(sheet(3, 2))
        attributes = rhino3dm.ObjectAttributes()
        model.file.InstanceDefinitions.Add(
            "block", "", "", "", rhino3dm.Point3d(0, 0, 0), (sheet(4, 2),), (attributes,)
        )
        assert read_surface(model.save(path)).n_faces == 12
        assert [one.aside for one in inspect_file(path).objects] == ["", "part of a block"]

    def test_no_surface_says_what_there_is(self, path):
        Model().add(rhino3dm.Point(rhino3dm.Point3d(1, 2, 3))).add(
            rhino3dm.LineCurve(rhino3dm.Point3d(0, 0, 0), rhino3dm.Point3d(1, 0, 0))
        ).save(path)
        with pytest.raises(NoSurface, match="1 Curve, 1 Point"):
            read_surface(path)

    def test_layers_and_names_that_are_not_there_list_those_that_are(self, path):
        Model().layer("Roof").add(sheet(), name="shell", layer="Roof").save(path)
        with pytest.raises(NoSurface, match="Roof"):
            read_surface(path, layer="Cellar")
        with pytest.raises(NoSurface, match="'shell'"):
            read_surface(path, object="shel")


class TestWhatIsKept:
    @pytest.mark.parametrize("unit", ["Millimeters", "Meters", "Inches", "Feet"])
    def test_unit_and_tolerance(self, path, unit):
        surface = read_surface(Model(getattr(rhino3dm.UnitSystem, unit), 0.25).add(sheet()).save(path))
        assert (surface.unit, surface.tolerance) == (unit, 0.25)

    def test_no_unit_is_warned_of(self, path):
        Model(getattr(rhino3dm.UnitSystem, "None")).add(sheet()).save(path)
        with pytest.warns(UnitUnknown, match="has no unit"):
            assert read_surface(path).unit == "None"

    def test_a_unit_is_not_warned_of(self, path):
        Model().add(sheet()).save(path)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read_surface(path)

    def test_coordinates_in_double_precision(self, path):
        vertices, quads = grid()
        vertices = vertices / 3 + [4_000_000, 1 / 7, 0]
        surface = read_surface(Model().add(mesh_of(vertices, quads)).save(path))
        assert np.array_equal(surface.vertices, vertices)

    @pytest.mark.parametrize("version", [2, 3, 4, 5, 6, 7, 8])
    def test_files_of_older_versions(self, path, version):
        assert read_surface(Model().add(sheet()).save(path, version)).n_faces == 12
        assert inspect_file(path).version == version

    def test_a_closed_mesh_is_cut_by_the_plane(self, path):
        Model().add(mesh_of(*ball(3))).save(path)
        surface = read_surface(path, cut_plane=([0.3, 0, 0], [1, 0, 0]))
        assert surface.vertices[surface.cuts[0], 0] == pytest.approx(0.3, abs=0.03)

    def test_raw_arrays_hold_nothing_of_rhino(self, path):
        raw = read_raw(Model().add(sheet(), name="shell").save(path))
        assert (type(raw.vertices), type(raw.faces)) == (np.ndarray, np.ndarray)
        assert (raw.unit, raw.name, raw.faces.shape) == ("Millimeters", "shell", (6, 4))


class TestRefusals:
    def test_what_is_no_rhino_file(self, path):
        path.write_bytes(b"something else entirely, long enough to have a header")
        with pytest.raises(Unreadable, match="is not a Rhino file"):
            read_surface(path)

    def test_a_missing_file(self, path):
        with pytest.raises(Unreadable, match="does not exist"):
            read_surface(path)

    @pytest.mark.parametrize("version", [1, 9, 90])
    def test_versions_that_are_not_read(self, path, version):
        Model().add(sheet()).save(path)
        data = path.read_bytes()
        path.write_bytes(data[:24] + f"{version:>8}".encode() + data[32:])
        with pytest.raises(Unsupported, match="version"):
            read_surface(path)

    def test_a_file_that_breaks_off(self, path):
        Model().add(sheet(60, 60)).save(path)
        path.write_bytes(path.read_bytes()[:400])
        with pytest.raises(Unreadable):
            read_surface(path)

    def test_indices_beyond_the_vertices(self, path):
        mesh = sheet()
        mesh.Faces.AddFace(0, 1, 99)
        with pytest.raises(BadIndex) as refused:
            read_surface(Model().add(mesh).save(path))
        assert refused.value.ids == (6,)

    def test_a_vertex_that_is_no_number(self):
        vertices, quads = grid()
        vertices[5, 2] = np.nan
        mesh = mesh_of(vertices, quads)
        with pytest.raises(NonFinite) as refused:
            surface_from(mesh)
        assert refused.value.ids == (5,)

    def test_a_mesh_without_faces(self):
        with pytest.raises(Degenerate):
            surface_from(mesh_of(grid()[0], grid()[1][:0]))


class TestReports:
    def test_a_report_lists_every_surface_and_counts_the_rest(self, path):
        bad = sheet()
        bad.Faces.AddFace(0, 1, 99)
        model = Model(rhino3dm.UnitSystem.Meters).layer("Roof").add(rhino3dm.Point(rhino3dm.Point3d(1, 2, 3)))
        model.add(sheet(), name="shell", layer="Roof").add(mesh_of(*ball(1)), name="ball", mode="Hidden").add(
            bad, name="bad"
        )
        report = inspect_file(model.save(path))
        assert (report.format, report.version, report.unit, report.layers) == ("3dm", 8, "Meters", ("Roof",))
        assert report.others == (("Point", 1),)
        shell, hidden, refused = report.objects
        assert (shell.name, shell.kind, shell.layer, shell.is_candidate) == ("shell", "Mesh", "Roof", True)
        assert shell.border_lengths == pytest.approx([10])
        assert (hidden.n_borders, hidden.euler_characteristic, hidden.aside, hidden.is_candidate) == (
            0,
            2,
            "hidden",
            False,
        )
        assert (refused.code, refused.n_faces) == ("BAD_INDEX", 0)
        assert refused.id == model.id

    def test_a_surface_that_is_no_mesh_is_meshed_for_the_report(self, path):
        tube = rhino3dm.Cylinder(rhino3dm.Circle(rhino3dm.Point3d(0, 0, 0), 2.0), 5.0).ToBrep(False, False)
        (report,) = inspect_file(Model().add(tube).save(path)).objects
        assert (report.kind, report.n_borders, report.euler_characteristic, report.code) == ("Brep", 2, 0, "")
        assert report.border_lengths == pytest.approx([4 * np.pi] * 2, rel=0.01)


class TestGeometry:
    def test_pairs_and_meshes_of_other_libraries(self):
        import trimesh

        vertices, faces = ball(2)
        for given in (
            (vertices, faces),
            [vertices.tolist(), faces.tolist()],
            trimesh.Trimesh(vertices, faces),
            mesh_of(vertices, faces),
        ):
            assert surface_from(given, unit="Meters", name="ball").euler_characteristic == 2

    def test_options_go_with_the_geometry(self):
        surface = surface_from(sheet(), unit="Inches", tolerance=0.5, name="shell")
        assert (surface.unit, surface.tolerance, surface.name) == ("Inches", 0.5, "shell")

    def test_faces_with_named_corners_as_in_rhino_itself(self):
        class Face:
            def __init__(self, corners):
                self.A, self.B, self.C, self.D = corners

        class Mesh:
            Vertices = sheet().Vertices
            Faces = [Face(corners) for corners in grid(3, 2)[1].tolist()]

        assert surface_from(Mesh()).n_faces == 12

    @pytest.mark.parametrize(
        "given",
        [
            ([[0, 0, 0], [1, 0]], [[0, 1, 2]]),
            ([["a", "b", "c"]], [[0, 0, 0]]),
            (np.eye(3), [["a", "b", "c"]]),
            (np.eye(3)[:, :2], [[0, 1, 2]]),
            (np.eye(3), [[0, 1]]),
            (np.eye(3), [[0, 1, 1.5]]),
        ],
    )
    def test_arrays_that_are_no_mesh_are_refused(self, given):
        with pytest.raises(WeaveError):
            surface_from(given)

    @pytest.mark.parametrize("given", ["shell", 7, None, object(), rhino3dm.Point3d(0, 0, 0)])
    def test_what_is_no_surface_is_refused(self, given):
        with pytest.raises(Unsupported):
            surface_from(given)
