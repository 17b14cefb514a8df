"""Curves of Rhino files, of text files and of memory, as points along them."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import rhino_shapes as make
from raw_meshes import grid
from weavecore.errors import BadCurve, Degenerate, NoCurve, NonFinite, Unreadable
from weavecore.geometry.curve_embedding.sampling import distance_from_segments
from weavecore.reading import curve_from, inspect_file, read_curves, read_surface

r = pytest.importorskip("rhino3dm")


def off_circle(points, radius):
    """How far points and the middles between them lie off a circle about the z axis."""
    middles = (points[1:] + points[:-1]) / 2
    return max(np.abs(np.linalg.norm(p[:, :2], axis=1) - radius).max() for p in (points, middles))


def arc_and_line():
    joined = r.PolyCurve()
    joined.Append(r.Arc(make.point(1, 0, 0), make.point(0, 1, 0), make.point(-1, 0, 0)))
    joined.Append(r.Line(make.point(-1, 0, 0), make.point(-1, -5, 0)))
    return joined


class TestInMemory:
    @pytest.mark.parametrize(
        "curve",
        [
            make.circle(2.0),
            r.Circle(make.point(0, 0, 0), 2.0),
            r.ArcCurve.CreateFromCircle(r.Circle(make.point(0, 0, 0), 2.0)),
        ],
    )
    def test_a_circle_is_told_to_the_tolerance_and_comes_back(self, curve):
        points = curve_from(curve, tolerance=1e-4)
        assert off_circle(points, 2.0) <= 1e-4
        assert np.allclose(points[0], points[-1])
        assert len(points) < 2 * len(curve_from(curve, tolerance=1e-5))

    def test_without_a_tolerance_a_part_of_the_size_is_taken(self):
        for scale in (1e-3, 1.0, 1e6):
            points = curve_from(make.circle(scale))
            assert off_circle(points, scale) < 4e-4 * scale
            assert len(points) < 300

    def test_lines_and_polylines_are_their_corners(self):
        corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0), (5.0, 2.0, 1.0)]
        assert curve_from(make.polyline(*corners)).tolist() == [list(corner) for corner in corners]
        for line in (
            r.Line(make.point(1, 2, 3), make.point(4, 5, 6)),
            r.LineCurve(make.point(1, 2, 3), make.point(4, 5, 6)),
        ):
            assert curve_from(line).tolist() == [[1, 2, 3], [4, 5, 6]]

    def test_a_kink_between_an_arc_and_a_line_is_kept(self):
        points = curve_from(arc_and_line(), tolerance=1e-3)
        assert np.linalg.norm(points - [-1, 0, 0], axis=1).min() < 1e-12
        arc = points[points[:, 1] > 1e-9]
        assert off_circle(arc, 1.0) <= 1e-3

    def test_points_are_given_back_and_nothing_else_is_taken(self):
        assert curve_from([[0, 0, 0], [1, 2, 3]]).tolist() == [[0, 0, 0], [1, 2, 3]]
        with pytest.raises(BadCurve, match="A Sphere is not a curve"):
            curve_from(r.Sphere(make.point(0, 0, 0), 1.0))


@pytest.fixture
def path(tmp_path):
    """A sheet with a circle, a hidden line, and two curves on a layer below another, in millimetres."""
    model = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Millimeters
    model.Settings.ModelAbsoluteTolerance = 0.01
    layers = {}
    for name, above in (("Shell", None), ("Aids", None), ("Guides", "Aids")):
        layer = r.Layer()
        layer.Name = name
        if above:
            layer.ParentLayerId = model.Layers[layers[above]].Id
        layers[name] = model.Layers.Add(layer)
    mesh = r.Mesh()
    vertices, faces = grid(3, 2)
    for point in vertices.tolist():
        mesh.Vertices.AddPoint3d(*point)
    for face in faces.tolist():
        mesh.Faces.AddFace(*face)
    shapes = [
        ("sheet", "Shell", mesh),
        ("ring", "Shell", make.circle(1.0)),
        ("hidden", "Shell", make.polyline((0, 0, 0), (9, 0, 0))),
        ("a", "Guides", make.polyline((0, 0, 0), (1, 0, 0))),
        ("b", "Guides", make.polyline((0, 1, 0), (1, 1, 0))),
    ]
    for name, layer, geometry in shapes:
        attributes = r.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, layers[layer]
        if name == "hidden":
            attributes.Mode = r.ObjectMode.Hidden
        model.Objects.Add(geometry, attributes)
    model.Write(str(tmp_path / "model.3dm"), 8)
    return tmp_path / "model.3dm"


class TestRhinoFiles:
    def test_curves_do_not_make_the_surface_ambiguous(self, path):
        assert read_surface(path).name == "sheet"

    @pytest.mark.parametrize(
        ("names", "lengths"),
        [
            (["ring"], [2 * math.pi]),
            (["hidden"], [9]),
            (["Guides"], [1, 1]),
            (["aids::guides"], [1, 1]),
            (["b", "ring", "Guides"], [1, 2 * math.pi, 1]),
        ],
    )
    def test_they_are_named_by_name_or_layer_each_once(self, path, names, lengths):
        curves = read_curves(path, names=names)
        made = [np.linalg.norm(np.diff(curve, axis=0), axis=1).sum() for curve in curves]
        assert made == pytest.approx(lengths, rel=1e-3)

    def test_or_by_id(self, path):
        (ring,) = [one for one in inspect_file(path).curves if one.name == "ring"]
        assert np.array_equal(*(read_curves(path, names=[n])[0] for n in ("ring", ring.id.upper())))

    def test_what_is_not_there_is_told_with_what_is(self, path):
        with pytest.raises(NoCurve, match=r"no curve with the name 'sheet'.*'ring'.*'a'.*on layer 'Aids::Guides'"):
            read_curves(path, names=["sheet"])
        with pytest.raises(NoCurve, match=r"model\.3dm has 3 curves, and exactly one is needed"):
            read_curves(path)

    def test_curves_without_a_name_are_not_meant_by_an_empty_one(self, tmp_path):
        model = r.File3dm()
        model.Objects.Add(make.circle(1.0), r.ObjectAttributes())
        model.Write(str(tmp_path / "unnamed.3dm"), 8)
        with pytest.raises(NoCurve, match="no curve with the name ''"):
            read_curves(tmp_path / "unnamed.3dm", names=[""])

    def test_another_unit_is_converted(self, path):
        (metres,) = read_curves(path, names=["a"], unit="Meters")
        assert metres.tolist() == [[0, 0, 0], [0.001, 0, 0]]
        for unit in ("None", "Millimeters"):
            assert read_curves(path, names=["a"], unit=unit)[0].tolist() == [[0, 0, 0], [1, 0, 0]]

    def test_guarded_reading_gives_the_same(self, path):
        assert np.array_equal(read_curves(path, names=["ring"], guarded=True)[0], read_curves(path, names=["ring"])[0])
        path.write_bytes(path.read_bytes()[:200])
        with pytest.raises(Unreadable):
            read_curves(path, guarded=True)

    def test_info_tells_their_length_and_whether_they_are_closed(self, path):
        told = {one.name: (one.layer, round(one.length, 2), one.is_closed) for one in inspect_file(path).curves}
        assert told["ring"] == ("Shell", 6.28, True)
        assert told["b"] == ("Aids::Guides", 1.0, False)


class TestTextFiles:
    @pytest.mark.parametrize(
        "text",
        [
            "1,2,3\n4,5,6\n",
            "x;y;z\r\n1;2;3\r\n\r\n4;5;6",
            "# points\n1 2 3 0.5 red\n4\t5\t6 # last\n",
            "\ufeff1.0, 2.0, 3.0,\n4e0, 5, 6,\n",
            "x;y;z\n1,0;2,0;3,0\n4,0; 5,0; 6,0;\n",
        ],
    )
    def test_three_numbers_a_line_are_a_point(self, tmp_path, text):
        file = tmp_path / "curve.csv"
        file.write_text(text, "utf-8")
        assert [curve.tolist() for curve in read_curves(file)] == [[[1, 2, 3], [4, 5, 6]]]

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("1,2,3\n\n3,4\n", r"curve\.txt has a line without three numbers \(line 3\)"),
            ("1,2,3\n4,five,6\n", r"curve\.txt has a line without three numbers \(line 2\)"),
            ("x,y,z\n1,2;3\n", r"\(line 2\)"),
            ("x,y,z\n", r"curve\.txt has no points\."),
        ],
    )
    def test_what_is_no_point_is_refused_with_its_line(self, tmp_path, text, told):
        file = tmp_path / "curve.txt"
        file.write_text(text, "utf-8")
        with pytest.raises(Unreadable, match=told):
            read_curves(file)

    def test_a_mesh_file_holds_no_curves(self, tmp_path):
        with pytest.raises(NoCurve, match=r"shell\.obj cannot hold curves.*\.csv"):
            read_curves(tmp_path / "shell.obj", names=["a"])


def test_a_broken_curve_is_refused_and_not_listed(tmp_path):
    model = r.File3dm()
    model.Objects.Add(make.polyline((0, 0, 0), (math.nan, 0, 0)), r.ObjectAttributes())
    model.Write(str(tmp_path / "broken.3dm"), 8)
    with pytest.raises((NonFinite, Unreadable)):
        read_curves(tmp_path / "broken.3dm")
    assert inspect_file(tmp_path / "broken.3dm").curves == ()


def test_a_wave_with_many_bends_is_told_to_the_tolerance():
    x = np.linspace(0, 10, 40)
    wave = r.NurbsCurve.Create(False, 3, [make.point(a, math.sin(3 * a), 0) for a in x.tolist()])
    coarse, fine = (curve_from(wave, tolerance=t) for t in (1e-3, 1e-6))
    nearest = [distance_from_segments(np.tile(p, (len(coarse) - 1, 1)), coarse[:-1], coarse[1:]).min() for p in fine]
    assert max(nearest) <= 1.5e-3
    assert len(coarse) < len(fine)


def net_curve(drawn, asked):
    """A curve of RhinoCommon as far as it is asked; it writes down how fine it is to be drawn."""
    return SimpleNamespace(
        GetType=None,  # That it is there tells RhinoCommon's from rhino3dm's.
        ToNurbsCurve=None,
        GetBoundingBox=lambda _: SimpleNamespace(Diagonal=SimpleNamespace(Length=100.0)),
        ToPolyline=lambda *how: asked.append(how) or drawn,
    )


def test_curves_that_rhino_holds_are_drawn_by_rhino():
    asked = []
    curve = net_curve(SimpleNamespace(PointCount=3, Point=lambda i: make.point(float(i), 0.0, 0.0)), asked)
    assert curve_from(curve, tolerance=1e-3).tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert curve_from(curve).tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert [how[0] for how in asked] == pytest.approx([1e-3, 1e-2])
    with pytest.raises(Degenerate, match="Rhino makes no polyline"):
        curve_from(net_curve(None, []))


def test_arcs_and_rectangles_of_rhino_are_made_curves_first():
    drawn = SimpleNamespace(PointCount=2, Point=lambda i: make.point(float(i), 0.0, 0.0))
    curve = net_curve(drawn, [])
    arc = SimpleNamespace(GetType=None, BoundingBox=lambda: None, ToNurbsCurve=lambda: curve)
    rectangle = SimpleNamespace(GetType=None, BoundingBox=None, ToPolyline=lambda: None, ToNurbsCurve=lambda: curve)
    for structure in (arc, rectangle):
        assert curve_from(structure).tolist() == [[0, 0, 0], [1, 0, 0]]
    with pytest.raises(Degenerate, match="Rhino makes no polyline of this SimpleNamespace"):
        curve_from(SimpleNamespace(GetType=None, ToNurbsCurve=lambda: None))
