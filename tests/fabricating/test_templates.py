"""Templates are 1:1 and read back: DXF by ezdxf, SVG as XML, PDF by pypdf."""

from __future__ import annotations

import io
import os
import re
import runpy
import subprocess
import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import ezdxf
import numpy as np
import pypdf
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabricated import SHELL, made, make, table
from weavecore.errors import Unsupported
from weavecore.fabricating.drawing import Drawing
from weavecore.fabricating.drawing_files import encode_dxf, encode_pdf, encode_svg
from weavecore.fabricating.marks import mark_pieces
from weavecore.fabricating.plan import plan_rods
from weavecore.fabricating.splices import cut_rods
from weavecore.fabricating.templates import ROW, sections_of, spread_labels, strips_of
from weavecore.fabricating.ties import find_ties
from weavecore.fabricating.views import Views, draw_sheets
from weavecore.fabricating.workshop import PAPERS, Workshop
from weavecore.fabricating.workshop_folder import Fabrication
from woven_rods import woven_sample, woven_tube

ALL = Workshop()
SVG = "{http://www.w3.org/2000/svg}"
MM = 72 / 25.4


def folder() -> Fabrication:
    return made(SHELL, "triangular", ALL)


def ticks_of(made_folder: Fabrication) -> list[tuple[int, float]]:
    """Row of the piece, and distance from its start, of every tick that the marks ask for."""
    marks, pieces = table(made_folder, "marks"), table(made_folder, "pieces")
    row = {piece: k for k, piece in enumerate(pieces["piece_id"])}
    return sorted({(row[p], no, at) for p, no, at in zip(marks["piece_id"], marks["no"], marks.floats("from_start"))})


def test_ticks_of_the_dxf_are_the_marks() -> None:
    document = ezdxf.read(io.StringIO(folder().files["templates.dxf"].decode()))
    assert document.dxfversion == "AC1024"
    assert (document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == (4, 1)
    assert not document.audit().errors
    space = document.modelspace()
    found = sorted(
        (-line.dxf.start.y - line.dxf.end.y, line.dxf.start.x) for line in space.query('LINE[layer=="TICKS"]')
    )
    wanted = sorted((row, at) for row, _, at in ticks_of(folder()))
    assert len(found) == len(wanted)
    assert np.allclose([row for row, _ in found], [(2 * row + 1) * ROW for row, _ in wanted])
    assert np.allclose([x for _, x in found], [at for _, at in wanted], atol=0.001)


def test_texts_of_the_dxf_name_every_piece_at_both_ends_and_every_rod_that_crosses() -> None:
    document = ezdxf.read(io.StringIO(folder().files["templates.dxf"].decode()))
    texts = [text.dxf.text for text in document.modelspace().query("TEXT")]
    for piece in table(folder(), "pieces")["piece_id"]:
        assert texts.count(piece) == 2
    marks = table(folder(), "marks")
    rows = zip(marks["over_under"], marks["other_rod"], marks["side"])
    crossings = [f"{over} {other} {side[0].upper()}" for over, other, side in rows if other]
    assert sorted(text for text in texts if text.startswith(("over ", "under "))) == sorted(crossings)
    statement = document.header.custom_vars.get("weavecore")
    assert "weavecore 1.2.3" in statement
    assert "unit mm" in statement
    assert "0" * 64 in statement


def test_the_scale_bars_are_100_mm() -> None:
    document = ezdxf.read(io.StringIO(folder().files["templates.dxf"].decode()))
    bar = max(
        document.modelspace().query('LINE[layer=="SCALE"]'), key=lambda line: abs(line.dxf.end.x - line.dxf.start.x)
    )
    assert abs(bar.dxf.end.x - bar.dxf.start.x) == pytest.approx(100.0)
    root = ET.fromstring(folder().files["templates.svg"])
    lines = [one for group in root.iter(f"{SVG}g") if group.get("id") == "SCALE" for one in group.iter(f"{SVG}line")]
    assert max(float(one.get("x2")) - float(one.get("x1")) for one in lines) == pytest.approx(100.0)
    for page in pypdf.PdfReader(io.BytesIO(folder().files["templates.pdf"])).pages[:2]:
        assert 100.0 in [pytest.approx(length, abs=0.01) for length in horizontal_lines(page)]


def horizontal_lines(page: pypdf.PageObject) -> list[float]:
    """Lengths in millimetres, which the page is scaled to."""
    operations = pypdf.generic.ContentStream(page.get_contents(), page.pdf).operations
    scales = [tuple(map(float, operands)) for operands, operator in operations if operator == b"cm"]
    assert scales[1 if len(scales) > 1 and scales[0][:4] == (1, 0, 0, 1) else 0][0] == pytest.approx(MM, abs=1e-4)
    lengths, start = [], None
    for operands, operator in operations:
        if operator == b"m":
            start = [float(x) for x in operands]
        elif operator == b"l" and start is not None and float(operands[1]) == start[1]:
            lengths.append(abs(float(operands[0]) - start[0]))
    return lengths


def test_every_code_of_a_rod_is_one_mark_and_is_on_its_template_and_in_the_sequence() -> None:
    for sample, pattern in ((SHELL, "triangular"), ("handle", "twill")):
        files = made(sample, pattern, ALL)
        marks = table(files, "marks")
        place: dict[tuple[str, str], set[str]] = {}
        codes: dict[str, set[str]] = {}
        columns = (marks[name] for name in ("rod_id", "code", "station", "joint_id", "piece_id"))
        for rod, code, station, joint, piece in zip(*columns):
            place.setdefault((rod, code), set()).add(station)
            assert code.startswith(joint)
            codes.setdefault(piece, set()).add(code)
        assert all(len(stations) == 1 for stations in place.values())
        pieces = table(files, "pieces")
        assert {piece: set(row) for piece, row in zip(pieces["piece_id"], pieces.lists("codes"))} == codes
        drawn = ezdxf.read(io.StringIO(files.files["templates.dxf"].decode())).modelspace().query("TEXT")
        on_templates = [text.dxf.text.split()[0] for text in drawn if text.dxf.text.startswith("J")]
        wanted = [code for row in pieces.lists("codes") for code in row if code.startswith("J")]
        assert sorted(on_templates) == sorted(wanted)
        tied = {joint for row in table(files, "sequence").lists("joints_to_tie") for joint in row}
        assert tied == {joint for joint in marks["joint_id"] if joint.startswith("J")}


def test_the_svg_is_as_many_millimetres_as_it_says_and_holds_all_it_draws() -> None:
    root = ET.fromstring(folder().files["templates.svg"])
    _, _, width, height = (float(part) for part in root.get("viewBox", "").split())
    assert (root.get("width"), root.get("height")) == (f"{width:.3f}mm", f"{height:.3f}mm")
    assert width > table(folder(), "pieces").floats("cut_length").max()
    for line in root.iter(f"{SVG}line"):
        assert all(0 <= float(line.get(key, "nan")) <= width for key in ("x1", "x2"))
        assert all(0 <= float(line.get(key, "nan")) <= height for key in ("y1", "y2"))
    ticks = [one for group in root.iter(f"{SVG}g") if group.get("id") == "TICKS" for one in group.iter(f"{SVG}line")]
    assert len(ticks) == len(ticks_of(folder()))
    assert "input sha256" in root.findtext(f"{SVG}title", "")


def test_the_pdf_has_every_piece_on_pages_of_the_paper() -> None:
    reader = pypdf.PdfReader(io.BytesIO(folder().files["templates.pdf"]))
    text = "\n".join(page.extract_text() for page in reader.pages)
    for page in reader.pages:
        assert (float(page.mediabox.width) / MM, float(page.mediabox.height) / MM) == pytest.approx(
            PAPERS["A3"], abs=0.01
        )
    pieces = table(folder(), "pieces")
    cuts = np.array([float(number) for number in re.findall(r"end, cut ([\d.]+)", text)])
    for piece, length in zip(pieces["piece_id"], pieces.floats("cut_length")):
        assert piece in text
        # The table is rounded to a micrometre, the template to a tenth of a millimetre.
        assert np.abs(cuts - length).min() <= 0.051
    assert "input sha256" in str(reader.metadata.subject)
    assert reader.viewer_preferences.print_scaling == "/None"


def test_every_piece_has_a_label_for_each_end_with_its_cut_its_bar_and_its_step() -> None:
    reader = pypdf.PdfReader(io.BytesIO(folder().files["labels.pdf"]))
    text = "\n".join(page.extract_text() for page in reader.pages).splitlines()
    pieces, sequence = table(folder(), "pieces"), table(folder(), "sequence")
    # Names on one base line are read as one line.
    names = [line.split() for line in text if set(line.split()) <= set(pieces["piece_id"])]
    assert Counter(name for row in names for name in row) == dict.fromkeys(pieces["piece_id"], 2)
    step: dict[str, str] = {}
    for piece, number in zip(sequence["piece"], sequence["step"]):
        step.setdefault(piece, number)
    whole = " ".join(text)
    for piece, bar, cut in zip(pieces["piece_id"], pieces["stock_id"], pieces.floats("cut_length").tolist()):
        assert f"bar {bar}, step {step[piece]}" in whole
        assert any(f"cut {cut + shift:.1f} mm" in whole for shift in (0.0, -1e-3, 1e-3))


def test_drawings_show_plan_and_elevations_to_scale_and_every_step() -> None:
    weave = woven_sample(SHELL, "triangular")
    document = ezdxf.read(io.StringIO(folder().files["drawings.dxf"].decode()))
    assert not document.audit().errors
    space = document.modelspace()
    rods = [one for one in space.query("LWPOLYLINE") if one.dxf.layer.startswith("RODS-")]
    assert len(rods) == 3 * len(weave)
    plan = np.array([point for one in rods[: len(weave)] for point in one.get_points("xy")])
    assert np.allclose(np.ptp(plan, axis=0), np.ptp(weave.axes.points, axis=0)[:2], atol=25.0)
    steps = table(folder(), "sequence")["step"]
    assert len(space.query('LWPOLYLINE[layer=="SET"]')) == len(steps)
    titles = [text.dxf.text.split()[0] for text in space.query("TEXT") if text.dxf.text.split()[0].isdigit()]
    assert set(steps) <= set(titles)
    pages = pypdf.PdfReader(io.BytesIO(folder().files["drawings.pdf"])).pages
    assert len(pages) == 2 + -(-len(steps) // 12)
    root = ET.fromstring(folder().files["drawings.svg"])
    drawn = [one for group in root.iter(f"{SVG}g") if group.get("id") == "SET" for one in group.iter(f"{SVG}polyline")]
    assert len(drawn) == len(steps)


@pytest.mark.parametrize("name", [SHELL, "narrow_neck"])
def test_views_fill_their_sheets_and_neither_leave_them_nor_overlap(name: str) -> None:
    plan = plan_rods(woven_sample(name, "triangular"), 1.0)
    views, n = Views.of(plan, "A3"), len(plan.ids)
    for sheet, k in zip(draw_sheets(views, [], find_ties(plan), ""), (1, 2)):
        drawn = [np.concatenate([path.points for path in sheet.paths[a : a + n]]) for a in range(0, k * n, n)]
        low, high = np.array([one.min(axis=0) for one in drawn]), np.array([one.max(axis=0) for one in drawn])
        size = np.ptp(views.samples.points, axis=0)
        assert np.allclose((high - low)[0] * sheet.scale, size[[0, k]], rtol=1e-9)
        assert (low >= 0).all()
        assert (high <= [sheet.width, sheet.height]).all()
        assert k == 1 or ((low[0] > high[1]) | (low[1] > high[0])).any()
        # The largest step between usual scales is 2.5 times, and one view below another has half the height.
        room = np.array([sheet.width, sheet.height])
        assert ((high - low) / room).max() >= 0.3


@pytest.mark.parametrize("name", [SHELL, "narrow_neck", "six_way_joint"])
def test_names_in_the_plan_hardly_cover_each_other(name: str) -> None:
    plan = plan_rods(woven_sample(name, "triangular"), 1.0)
    sheet = next(draw_sheets(Views.of(plan, "A3"), [], find_ties(plan), ""))
    names = [text for text in sheet.texts if text.text in plan.ids]
    places = np.array([(text.x, text.y) for text in names])
    apart = abs(places[:, None] - places)
    covers = (apart[..., 0] < 2.5) & (apart[..., 1] < names[0].height)
    assert len(names) == len(plan.ids)
    assert covers.sum() - len(names) <= 0.1 * len(names)


def test_sections_on_the_pages_have_every_mark_once() -> None:
    plan = plan_rods(woven_sample(SHELL, "triangular"), 1.0)
    pieces, _ = cut_rods(plan, ALL)
    for strip in strips_of(pieces, mark_pieces(plan, pieces)):
        sections = sections_of(strip, 300.0)
        assert [mark for section in sections for mark in section.marks] == list(strip.marks)
        assert sections[0].low == 0.0
        assert sections[-1].high == strip.piece.cut_length
        assert all(a.high == b.low and a.high - a.low == 300.0 for a, b in zip(sections, sections[1:]))


@given(st.lists(st.tuples(st.floats(0, 200), st.integers(1, 4)), max_size=30))
def test_labels_never_lie_on_each_other_and_stay_where_there_is_room(ticks: list[tuple[float, int]]) -> None:
    wanted = sorted(at for at, _ in ticks)
    widths = [3.5 * count for _, count in ticks]
    places = spread_labels(wanted, widths, low=0.0, high=200.0)
    gaps = [b - a - (v + w) / 2 for a, b, v, w in zip(places, places[1:], widths, widths[1:])]
    assert all(gap >= -1e-9 for gap in gaps)
    if sum(widths) <= 200.0 and places:
        assert places[0] - widths[0] / 2 >= -1e-9
        assert places[-1] + widths[-1] / 2 <= 200.0 + 1e-9


def test_labels_with_room_stand_at_their_ticks() -> None:
    assert spread_labels([20.0, 60.0, 63.0, 150.0], [7.0] * 4, low=0.0, high=200.0) == [20.0, 58.0, 65.0, 150.0]


def test_only_the_templates_that_are_asked_for_are_drawn() -> None:
    files = make(woven_tube("quad"), Workshop(templates=("svg",))).files
    assert [name for name in files if not name.endswith((".csv", ".txt"))] == ["templates.svg", "drawings.svg"]


def test_a_missing_library_is_named_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for library in ("reportlab", "ezdxf"):
        monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(Unsupported, match=r"reportlab.*weavecore\[fabricate\].*--templates svg"):
        make(woven_tube("quad"), Workshop(templates=("pdf",)))
    assert {"bom.csv", "templates.dxf"} <= set(make(woven_tube("quad"), Workshop(templates=("svg", "dxf"))).files)


def test_the_frame_of_a_dxf_is_the_one_that_ezdxf_makes_and_its_audit_finds_nothing() -> None:
    path = Path(__file__).resolve().parents[2] / "docs" / "generate" / "dxf_frame.py"
    made = runpy.run_path(str(path))
    names = [made["frame"](), made["TARGET"].read_text("utf-8")]
    # Releases of ezdxf differ in line types and the like; the places to be filled stay.
    assert [re.findall(r"\{[A-Z_]+\}(?=\n|  0\n)", text) for text in names] == [
        ["{STATEMENT}", "{HANDLE}", "{N_LAYERS}", "{LAYERS}", "{ENTITIES}"]
    ] * 2
    for name in ("templates.dxf", "drawings.dxf"):
        document = ezdxf.read(io.StringIO(folder().files[name].decode()))
        assert document.units == 4
        audit = document.audit()
        assert (audit.errors, audit.fixes) == ([], [])
        handles = [entity.dxf.handle for entity in document.entitydb.values()]
        assert len(set(handles)) == len(handles)
        assert int(document.header["$HANDSEED"], 16) > max(int(handle, 16) for handle in handles)


def test_the_same_weave_gives_the_same_templates() -> None:
    weave = woven_tube("diagonal")
    one, other = make(weave, ALL).files, make(weave, ALL).files
    assert [name for name in one if one[name] != other[name]] == []


DRAW = """
import sys
from weavecore.fabricating.drawing import Drawing
from weavecore.fabricating.drawing_files import encode_dxf
drawing = Drawing({"TICKS": (0, 0, 0)})
drawing.line(0.0, 0.0, 1.0, 0.0, "TICKS")
sys.stdout.buffer.write(encode_dxf(drawing, "a statement"))
"""


def test_the_bytes_of_the_dxf_do_not_depend_on_the_hash_seed_of_the_process() -> None:
    contents = [
        subprocess.run(
            [sys.executable, "-c", DRAW], env={**os.environ, "PYTHONHASHSEED": seed}, check=True, capture_output=True
        ).stdout
        for seed in ("1", "4")  # Unsorted classes come in two orders for these.
    ]
    assert b"a statement" in contents[0]
    assert contents[0] == contents[1]
    classes = [one.dxf.name for one in ezdxf.read(io.StringIO(contents[0].decode())).classes]
    assert len(classes) > 10
    assert classes == sorted(classes)


@pytest.mark.parametrize("name", ["A\n0\nLINE", "A\x00", "(A)\\", "<A&B>", "Ångström"])
def test_no_text_can_break_a_drawing(name: str) -> None:
    drawing = Drawing({"NAMES": (0, 0, 0)}, 100.0, 100.0)
    for anchor in ("left", "middle", "right"):
        drawing.text(10.0, 10.0, name, 2.0, "NAMES", anchor=anchor)
    document = ezdxf.read(io.StringIO(encode_dxf(drawing, "statement").decode()))
    shown = [text.dxf.text for text in document.modelspace().query("TEXT")]
    assert len(document.modelspace()) == 3
    assert [text.replace(" ", "") for text in shown] == [name.replace("\n", "").replace("\x00", "")] * 3
    root = ET.fromstring(encode_svg(drawing, "statement"))
    assert [text.text for text in root.iter(f"{SVG}text")] == shown
    page = pypdf.PdfReader(io.BytesIO(encode_pdf([drawing], "test", "statement"))).pages[0]
    assert shown[0].strip() in page.extract_text()
