"""Mesh files of all four formats, as other programs write them, and broken ones."""

import contextlib
import struct

import numpy as np
import pytest

from raw_meshes import area, ball, grid, moved, triangles
from weavecore.errors import BadIndex, NonFinite, NoSurface, TooMuchWork, Unreadable, Unsupported, WeaveError
from weavecore.model.notes import texts_of
from weavecore.reading import inspect_file, read_surface
from weavecore.reading.formats import mesh_file

SHEET, QUADS = grid(3, 2)
TRIANGLES = triangles(QUADS)


@pytest.fixture
def put(tmp_path):
    def put(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return put


def obj(vertices=SHEET, faces=QUADS, *, end="\n"):
    lines = ["# made by hand", "o sheet", *("v {} {} {}".format(*v) for v in vertices.tolist())]
    return end.join([*lines, *("f " + " ".join(str(i + 1) for i in f) for f in faces.tolist())]) + end


def off(vertices=SHEET, faces=QUADS, *, end="\n"):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0", *("{} {} {}".format(*v) for v in vertices.tolist())]
    return end.join([*lines, *(f"{len(f)} " + " ".join(map(str, f)) for f in faces.tolist())]) + end


def ply_header(kind, n_vertices, n_faces, *, coordinate="float", extra=""):
    return (
        f"ply\nformat {kind} 1.0\ncomment made by hand\nelement vertex {n_vertices}\n"
        + "".join(f"property {coordinate} {axis}\n" for axis in "xyz")
        + extra
        + f"element face {n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )


def ply_binary(order="<", faces=QUADS, vertices=SHEET):
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    body = vertices.astype(order + "f4").tobytes()
    body += b"".join(bytes([len(f)]) + np.array(f, order + "i4").tobytes() for f in faces)
    return ply_header(name, len(vertices), len(faces)).encode() + body


def stl_binary(vertices=SHEET, faces=TRIANGLES):
    rows = b"".join(struct.pack("<12fH", 0, 0, 1, *vertices[f].ravel(), 0) for f in faces)
    return b"solid is no promise".ljust(80) + struct.pack("<I", len(faces)) + rows


def stl_text(vertices=SHEET, faces=TRIANGLES):
    facet = "facet normal 0 0 1\n outer loop\n{} endloop\nendfacet\n"
    corners = ("".join("  vertex {} {} {}\n".format(*p) for p in vertices[f]) for f in faces)
    return "solid sheet\n" + "".join(facet.format(c) for c in corners) + "endsolid sheet\n"


GOOD = {
    "sheet.obj": obj(),
    "windows.obj": obj(end="\r\n"),
    "sheet.off": off(),
    "windows.off": off(end="\r\n"),
    "text.ply": ply_header("ascii", 12, 6) + "\n".join(off().splitlines()[2:]) + "\n",
    "little.ply": ply_binary("<"),
    "big.ply": ply_binary(">"),
    "binary.stl": stl_binary(),
    "text.stl": stl_text(),
    "SHOUTED.OBJ": obj(),
}


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_same_sheet(put, name):
    surface = read_surface(put(name, GOOD[name]))
    assert (surface.n_vertices, surface.n_faces, len(surface.borders)) == (12, 12, 1)
    assert area(surface.vertices, surface.faces) == pytest.approx(6)
    assert surface.name == name.split(".")[0]
    assert surface.unit == "None"
    assert {tuple(v) for v in surface.vertices} == {tuple(v) for v in SHEET}
    assert (surface.face_normals[:, 2] > 0).all()


class TestObj:
    def test_texture_and_normal_indices_are_passed_over(self, put):
        text = obj().splitlines()
        faces = [
            " ".join(["f"] + [f"{i}/{i}/1" if k % 2 else f"{i}//1" for k, i in enumerate(line.split()[1:])])
            for line in text
            if line[0] == "f"
        ]
        path = put(
            "a.obj", "\n".join([*text[:14], "vt 0 0", "vn 0 0 1", "g part", "usemtl stone", "s off", *faces, "l 1 2"])
        )
        assert read_surface(path).n_faces == 12

    def test_negative_indices_count_back_from_their_line(self, put):
        path = put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 1 1 0\nf -3 -1 -2\n")
        assert read_surface(path).faces.tolist() == [[0, 1, 2], [1, 3, 2]]

    def test_colours_and_weights_after_the_coordinates_are_passed_over(self, put):
        text = obj().replace("v 0.0 0.0 0.0", "v 0.0 0.0 0.0 1.0").replace("v 1.0 0.0 0.0", "v 1.0 0.0 0.0 0.5 0.5 0.5")
        assert read_surface(put("a.obj", text)).n_vertices == 12

    def test_faces_with_more_corners_are_cut_into_ears(self, put):
        star = [(np.cos(t), np.sin(t)) for t in np.arange(10) * np.pi / 5]
        vertices = "".join(f"v {r * x} {r * y} 0\n" for (x, y), r in zip(star, [2, 1] * 5))
        surface = read_surface(put("a.obj", vertices + "f " + " ".join(map(str, range(1, 11))) + "\n"))
        assert surface.n_faces == 8
        assert (surface.face_normals[:, 2] > 0).all()
        assert area(surface.vertices, surface.faces) == pytest.approx(10 * np.sin(np.pi / 5))
        assert "Split 1 face with more than four corners into triangles." in texts_of(surface.notes)

    def test_no_ear_covers_what_lies_outside(self, put):
        bracket = [(0, 0), (6, 0), (6, 6), (0, 6), (0, 5), (5, 5), (5, 1), (0, 1)]
        for turn in range(8):
            corners = " ".join(str(1 + (k + turn) % 8) for k in range(8))
            path = put("a.obj", "".join(f"v {x} {y} 0\n" for x, y in bracket) + f"f {corners}\n")
            surface = read_surface(path)
            assert area(surface.vertices, surface.faces) == pytest.approx(16)
            assert (surface.face_normals[:, 2] > 0).all()

    def test_lines_that_go_on_below(self, put):
        assert read_surface(put("a.obj", obj().replace("f 1 2", "f 1 \\\n 2"))).n_faces == 12

    def test_nan_is_refused_and_named(self, put):
        with pytest.raises(NonFinite) as refused:
            read_surface(put("a.obj", obj().replace("v 2.0 1.0 0.0", "v nan 1.0 0.0")))
        assert refused.value.ids == (6,)

    def test_numbers_beyond_all_measure_are_refused(self, put):
        with pytest.raises(NonFinite):
            read_surface(put("a.obj", obj().replace("v 2.0 1.0 0.0", "v 1e999 1.0 0.0")))

    @pytest.mark.parametrize("bad", ["13", "-13", "99999999999"])
    def test_indices_out_of_range_are_refused_and_named(self, put, bad):
        with pytest.raises(BadIndex) as refused:
            read_surface(put("a.obj", obj() + f"f 1 2 {bad}\n"))
        assert refused.value.ids == (6,)

    @pytest.mark.parametrize(
        "bad", ["f 0 1 2", "f 1 2 x", "f 1 2 1.5", "f 1 2 99999999999999999999999", "v 1 2", "v 1 2 z"]
    )
    def test_what_is_no_number_is_refused(self, put, bad):
        with pytest.raises(Unreadable):
            read_surface(put("a.obj", obj() + bad + "\n"))

    def test_points_without_faces_are_no_surface(self, put):
        with pytest.raises(NoSurface, match="12 vertices and no faces"):
            read_surface(put("a.obj", obj(faces=QUADS[:0])))

    def test_lines_among_the_faces_are_dropped_and_told(self, put):
        surface = read_surface(put("a.obj", obj() + "f 1 2\n"))
        assert "Dropped 1 face with less than three corners." in texts_of(surface.notes)


class TestOff:
    def test_comments_colours_and_counts_on_the_first_line(self, put):
        lines = off().splitlines()
        text = [
            "OFF 12 6 17 # counts",
            "",
            "# vertices",
            *lines[2:14],
            *(line + " 0.5 0.25 1 # red" for line in lines[14:]),
        ]
        assert read_surface(put("a.off", "\n".join(text))).n_faces == 12

    def test_normals_and_colours_of_vertices(self, put):
        lines = off().splitlines()
        text = ["CNOFF", *lines[1:2], *(line + " 0 0 1 255 0 0 255" for line in lines[2:14]), *lines[14:]]
        assert read_surface(put("a.off", "\n".join(text))).n_vertices == 12

    @pytest.mark.parametrize("between", [" ", "\n"])
    @pytest.mark.parametrize("counts", ["12 6 0", "12 6"])
    def test_lines_may_break_anywhere_also_in_the_header(self, put, between, counts):
        words = ["OFF", *counts.split(), *" ".join(off().splitlines()[2:]).split()]
        assert read_surface(put("a.off", between.join(words))).n_faces == 12

    @pytest.mark.parametrize(
        "bad", ["", "OF\n", "OFF\n", "OFF\nmany few\n", "OFF\n-1 2 0\n", off()[:-20], off().replace("4 0", "9 0")]
    )
    def test_broken_files_are_refused(self, put, bad):
        with pytest.raises(Unreadable):
            read_surface(put("a.off", bad))

    @pytest.mark.parametrize("head", ["4OFF", "nOFF", "OFF BINARY"])
    def test_kinds_that_are_not_read_are_named(self, put, head):
        with pytest.raises(Unsupported, match=head.split()[0]):
            read_surface(put("a.off", off().replace("OFF", head, 1)))

    def test_promises_beyond_the_file_allocate_nothing(self, put):
        with pytest.raises(Unreadable, match="announces"):
            read_surface(put("a.off", off().replace("12 6", "999999999999 6")))


class TestPly:
    @pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
    def test_vertices_without_faces_are_no_surface(self, put, kind):
        with pytest.raises(NoSurface):
            read_surface(put("a.ply", ply_header(kind, 1, 0).encode() + (b"0 0 0\n" if kind == "ascii" else bytes(12))))

    def test_triangles_and_quads_mixed_in_a_binary_file(self, put):
        faces = [*QUADS[:3].tolist(), *triangles(QUADS[3:]).tolist()]
        for order in "<>":
            for after in (b"", bytes(200)):
                assert read_surface(put("a.ply", ply_binary(order, faces) + after)).n_faces == 12

    def test_other_properties_and_elements_are_passed_over(self, put):
        header = (
            "ply\nformat binary_little_endian 1.0\nelement camera 2\nproperty double f\nelement strip 1\n"
            "property list int short runs\n"
            "element vertex 12\nproperty uchar red\nproperty double z\nproperty double y\n"
            "property double x\nelement face 12\nproperty float quality\nproperty list uchar uint vertex_index\n"
            "property list uchar float texcoord\nend_header\n"
        )
        body = struct.pack("<2d", 1, 2) + struct.pack("<i3h", 3, 1, 2, 3)
        body += b"".join(struct.pack("<B3d", 9, *v[::-1]) for v in SHEET)
        body += b"".join(struct.pack("<fB3IB2f", 0.5, 3, *f, 2, 0, 1) for f in TRIANGLES)
        assert read_surface(put("a.ply", header.encode() + body)).n_faces == 12

    def test_text_with_other_properties(self, put):
        header = ply_header("ascii", 12, 6, extra="property uchar red\n").replace(
            "property list", "property int id\nproperty list"
        )
        rows = off().splitlines()[2:]
        text = [*(row + " 255" for row in rows[:12]), *("7 " + row for row in rows[12:])]
        assert read_surface(put("a.ply", header + "\n".join(text))).n_faces == 12

    @pytest.mark.parametrize("cut", [30, 100, 250, 290])
    def test_files_that_break_off_are_refused(self, put, cut):
        for content in (ply_binary(), GOOD["text.ply"].encode()):
            with pytest.raises(Unreadable):
                read_surface(put("a.ply", content[:-cut]))

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ("format ascii", "format klingon"),
            ("float x", "quad x"),
            ("property float x", "property float w"),
            ("face 6", "face 99999999999"),
            ("vertex 12", "vertex -12"),
            ("end_header", "end"),
            ("uchar int", "uchar"),
        ],
    )
    def test_broken_headers_are_refused(self, put, old, new):
        with pytest.raises(Unreadable):
            read_surface(put("a.ply", GOOD["text.ply"].replace(old, new)))

    def test_lists_longer_than_the_file_allocate_nothing(self, put):
        content = ply_binary().replace(b"list uchar", b"list uint")
        with pytest.raises((Unreadable, BadIndex)):
            read_surface(put("a.ply", content))

    def test_indices_out_of_range_are_refused_and_named(self, put):
        faces = QUADS.copy()
        faces[4, 1] = 12
        with pytest.raises(BadIndex) as refused:
            read_surface(put("a.ply", ply_binary(faces=faces)))
        assert refused.value.ids == (4,)


class TestStl:
    def test_the_triangles_of_a_closed_body_are_welded_and_cut(self, put):
        surface = read_surface(put("a.stl", stl_binary(*ball(2))))
        assert surface.euler_characteristic == 2
        assert len(surface.cuts) == 1

    def test_a_wrong_count_is_refused(self, put):
        content = bytearray(stl_binary())
        content[80] += 1
        with pytest.raises(Unreadable):
            read_surface(put("a.stl", bytes(content)))

    @pytest.mark.parametrize("cut", [20, 60, 500])
    def test_files_that_break_off_are_refused(self, put, cut):
        for content in (stl_binary(), stl_text().encode()):
            with pytest.raises(Unreadable):
                read_surface(put("a.stl", content[:-cut]))

    def test_a_triangle_without_a_corner_is_refused(self, put):
        lines = stl_text().splitlines()
        with pytest.raises(Unreadable):
            read_surface(put("a.stl", "\n".join(lines[:3] + lines[4:])))
        with pytest.raises(Unreadable):
            read_surface(put("a.stl", "\n".join(lines[:3] + lines[6:])))

    def test_single_precision_far_from_the_origin_is_refused(self, put):
        with pytest.raises(WeaveError) as refused:
            read_surface(put("a.stl", stl_binary(moved(SHEET, 3e6))))
        assert refused.value.code == "TOO_FAR_FROM_ORIGIN"


class TestFiles:
    @pytest.mark.parametrize("name", ["a.step", "a.3mf", "a.glb", "a", "a.obj.gz"])
    def test_other_formats_are_refused_by_name(self, put, name):
        with pytest.raises(Unsupported, match=r"\.obj"):
            read_surface(put(name, obj()))

    def test_missing_empty_and_no_files(self, put, tmp_path):
        for path in (tmp_path / "none.obj", put("empty.obj", ""), tmp_path):
            with pytest.raises((Unreadable, Unsupported)):
                read_surface(path)
        (tmp_path / "folder.obj").mkdir()
        with pytest.raises(Unreadable, match="is not a file"):
            read_surface(tmp_path / "folder.obj")

    def test_too_large_files_are_refused_unread(self, put, monkeypatch):
        monkeypatch.setattr(mesh_file, "MOST_BYTES", 100)
        with pytest.raises(TooMuchWork):
            read_surface(put("a.obj", obj()))

    def test_too_little_memory_is_not_a_damaged_file(self, put, monkeypatch):
        def run_out_of_memory(data):
            raise MemoryError

        monkeypatch.setattr(mesh_file, "MESH_READERS", {".obj": run_out_of_memory})
        with pytest.raises(TooMuchWork, match="memory does not suffice") as caught:
            read_surface(put("a.obj", obj()))
        assert "damaged" not in str(caught.value)

    def test_layers_and_objects_are_for_rhino_files(self, put):
        with pytest.raises(NoSurface):
            read_surface(put("a.obj", obj()), layer="Shell")

    def test_a_report_tells_borders_and_what_would_be_mended(self, put):
        report = inspect_file(put("a.obj", obj()))
        (sheet,) = report.objects
        assert (report.format, report.unit, report.version) == ("obj", "None", None)
        assert (sheet.n_faces, sheet.n_borders, sheet.euler_characteristic, sheet.code) == (12, 1, 1, "")
        assert sheet.border_lengths == pytest.approx([10])
        assert sheet.is_candidate

    def test_a_report_of_a_bad_mesh_has_its_code(self, put):
        (bad,) = inspect_file(put("a.obj", obj().replace("v 2.0 1.0 0.0", "v nan 1.0 0.0"))).objects
        assert (bad.code, bad.n_faces, bad.euler_characteristic) == ("NON_FINITE", 0, None)
        (bad,) = inspect_file(put("a.obj", obj() + "f 1 2 77\n")).objects
        assert bad.code == "BAD_INDEX"

    def test_random_damage_gives_a_surface_or_a_weave_error(self, put):
        rng = np.random.default_rng(5)
        for name, content in GOOD.items():
            data = content if isinstance(content, bytes) else content.encode()
            for _ in range(60):
                damaged = np.frombuffer(data, np.uint8).copy()
                at = rng.integers(0, len(damaged), rng.integers(1, 6))
                damaged[at] = rng.integers(0, 256, len(at))
                with contextlib.suppress(WeaveError):
                    read_surface(put(name, damaged[: rng.integers(1, len(damaged) + 1)].tobytes()))
