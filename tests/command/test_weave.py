"""``weavecore weave``: what it writes, what it says, and how it ends."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any, Callable

import pytest
import rhino3dm
from typer.testing import CliRunner

from weavecore import pipeline
from weavecore.cli import app
from weavecore.commands import time_limit
from weavecore.linking.link import PATTERN_NAMES
from weavecore.viewing import picture
from woven_tube import COLUMNS, tube_latitudes, tube_surface

Run = Callable[..., Any]


def spacing_of(path: str) -> float:
    return json.loads(Path(path).read_text("utf-8"))["parameters"]["spacing"]


def test_all_three_outputs_are_written_and_told(run: Run, folder: Path) -> None:
    ended = run("weave", "tube.3dm", "-o", "w.3dm", "--json", "w.json", "--picture", "w.png", "--spacing", "1")
    assert (ended.status, ended.err) == (0, "")
    lines = [line.split(maxsplit=1) for line in ended.out.splitlines()]
    assert ["written", "w.3dm, w.json, w.png"] in lines
    assert ["spacing", "1 m"] in lines
    document = rhino3dm.File3dm.Read("w.3dm")
    assert document.Settings.ModelUnitSystem == rhino3dm.UnitSystem.Meters
    assert document.Settings.ModelAbsoluteTolerance == 0.002
    assert Path("w.png").read_bytes()[1:4] == b"PNG"
    result = json.loads(Path("w.json").read_text("utf-8"))
    assert {"surface", "latitudes", "lattice", "strands"} <= set(result)
    assert result["unit"] == "Meters"
    assert result["parameters"]["input"] == "tube.3dm"
    assert result["parameters"]["pattern"] == "triangular"


@pytest.mark.parametrize(
    ("typed", "metres"), [("1.25", 1.25), ("1250mm", 1.25), ("125 cm", 1.25), ("4ft", 1.2192), ("48in", 1.2192)]
)
def test_lengths_are_converted_to_the_unit_of_the_file(run: Run, typed: str, metres: float) -> None:
    assert run("weave", "tube.3dm", "--json", "w.json", "--spacing", typed).status == 0
    assert spacing_of("w.json") == pytest.approx(metres, rel=1e-15)


def test_the_spacing_is_graded_at_points_that_are_typed(run: Run, folder: Path) -> None:
    ended = run(
        "weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--spacing-at", "0,0,2.5,0.5", "--reach", "9m"
    )
    assert (ended.status, ended.err) == (0, "")
    parameters = json.loads(Path("w.json").read_text("utf-8"))["parameters"]
    assert (parameters["factors"], parameters["reach"]) == ([[[0.0, 0.0, 2.5], 0.5]], 9.0)
    assert max(parameters["spacings"]) < 0.6
    for wrong in ("0,0,2", "0,0,2,0", "0,0,nan,1", "abc"):
        assert run("weave", "tube.3dm", "--json", "v.json", "--spacing-at", wrong).status == 2


def test_rods_of_each_family_have_the_diameter_that_is_typed(run: Run, folder: Path) -> None:
    ended = run(
        "weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--rod", "latitudinal=9mm,longitudinal=0.006"
    )
    assert (ended.status, ended.err) == (0, "")
    assert "latitudinal 0.009 m, longitudinal 0.006 m gfrp" in ended.out
    result = json.loads(Path("w.json").read_text("utf-8"))
    assert {(rod["family"], rod["diameter"]) for rod in result["strands"]} == {
        ("latitudinal", 0.009),
        ("longitudinal", 0.006),
    }
    assert result["parameters"]["rod_diameters"] == {"latitudinal": 0.009, "longitudinal": 0.006}


def test_a_file_without_unit_takes_plain_numbers_only(run: Run, folder: Path) -> None:
    ended = run("weave", "tube.obj", "--json", "w.json", "--spacing", "1000mm")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: UNSUPPORTED: The file states no unit, so 1,000 mm cannot be converted.")
    assert not Path("w.json").exists()
    assert run("weave", "tube.obj", "--json", "w.json", "--spacing", "1").status == 0


def test_without_spacing_one_is_chosen_and_told(run: Run) -> None:
    ended = run("weave", "tube.3dm", "--json", "w.json")
    assert "(chosen; set it with --spacing)" in ended.out
    assert spacing_of("w.json") == pipeline.suggest_spacing(pipeline.read_surface("tube.3dm"))


@pytest.mark.parametrize(
    ("pattern", "spacing"), [("triangular", 1.2 * 3**0.5 / 2), ("kagome", 1.2 * 3**0.5 / 2), ("quad", 1.2)]
)
def test_the_edge_alone_gives_the_spacing_that_makes_the_pattern_regular(
    run: Run, monkeypatch: pytest.MonkeyPatch, pattern: str, spacing: float
) -> None:
    asked = []
    read = pipeline.read_surface
    monkeypatch.setattr(pipeline, "read_surface", lambda *a, **k: (asked.append(k["spacing"]), read(*a, **k))[1])
    assert run("weave", "tube.3dm", "--json", "w.json", "--edge", "1200mm", "--pattern", pattern).status == 0
    result = json.loads(Path("w.json").read_text("utf-8"))
    assert result["parameters"]["spacing"] == pytest.approx(spacing)
    assert result["parameters"]["edge_length"] == pytest.approx(1.2)
    assert [length.in_unit("Meters") for length in asked] == [pytest.approx(spacing)], "the mesh follows the spacing"


def test_the_help_of_the_edge_says_what_each_pattern_takes() -> None:
    text = " ".join(CliRunner().invoke(app, ["weave", "--help"], env={"COLUMNS": "400"}).output.split())
    help_text = re.search(
        r"Distance between the nodes of a ring: by default (.+?) Without --spacing it sets the spacing too\.", text
    )
    assert help_text is not None
    squares, triangles = help_text[1].split("2/√3")
    for pattern in PATTERN_NAMES:
        is_square = pipeline.spacing_for_edges(1.0, pattern=pattern) == 1.0
        assert (pattern in squares, pattern in triangles) == (is_square, not is_square), pattern


@pytest.mark.parametrize(
    "arguments",
    [
        ["--spacing", "12parsecs"],
        ["--spacing", "wide"],
        ["--spacing", "0"],
        ["--spacing", "-3"],
        ["--edge", "1e999"],
        ["--rod", "rings=3mm"],
        ["--rod", "latitudinal=3,latitudinal=2"],
        ["--rod", "latitudinal=wide"],
        ["--pattern", "plaid"],
        ["--method", "guess"],
        ["--cut-plane", "0,0,0,1,0"],
        ["--cut-plane", "0,0,0,0,0,0"],
        ["--cut-plane", "0,0,nan,0,0,1"],
        ["--json", "w.txt"],
        ["--picture", "w.jpg"],
        ["--colour", "blue"],
    ],
    ids=" ".join,
)
def test_wrong_usage_ends_with_2_before_any_work(arguments: list[str], folder: Path) -> None:
    ended = CliRunner().invoke(app, ["weave", "not there.3dm", *arguments])
    assert ended.exit_code == 2, ended.output
    assert "Usage" in ended.output
    assert isinstance(ended.exception, SystemExit)


def test_outputs_that_exist_are_refused_before_the_work_and_kept(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("w.json").write_text("old")
    monkeypatch.setattr(pipeline, "read_surface", lambda *_a, **_k: pytest.fail("the work was begun"))
    ended = run("weave", "tube.3dm", "-o", "w.3dm", "--json", "w.json")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: EXISTS: w.json exists already. ")
    assert ended.err.count("\n") == 1
    assert Path("w.json").read_text() == "old"
    assert not Path("w.3dm").exists()


def test_overwrite_replaces(run: Run, folder: Path) -> None:
    Path("w.json").write_text("old")
    assert run("weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--overwrite").status == 0
    assert spacing_of("w.json") == 1.0


@pytest.mark.parametrize(
    ("out", "code"), [("nowhere/w.3dm", "NOT_WRITTEN"), ("w.dwg", "UNSUPPORTED"), ("w", "UNSUPPORTED")]
)
def test_outputs_that_cannot_be_are_refused_in_one_line(run: Run, out: str, code: str) -> None:
    ended = run("weave", "tube.3dm", "-o", out)
    assert ended.status == 1
    assert ended.err.startswith(f"weavecore: {code}: ")
    assert ended.err.count("\n") == 1


def test_nothing_is_written_where_one_output_fails(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = sorted(path.name for path in folder.iterdir())

    def fail(*_a: object, **_k: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(picture, "encode_picture", fail)
    ended = run("weave", "tube.3dm", "--json", "w.json", "--picture", "w.png", "--spacing", "1")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: TOO_MUCH_WORK: ")
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_spacing_too_large_is_refused_in_one_line(run: Run) -> None:
    ended = run("weave", "tube.3dm", "--spacing", "100")
    assert ended.status == 1
    assert ended.out == ""
    assert ended.err.startswith("weavecore: SPACING_TOO_LARGE: ")
    assert ended.err.count("\n") == 1


def test_quiet_says_nothing(run: Run) -> None:
    ended = run("weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--quiet")
    assert ended == (0, "", "")


def test_a_fault_of_the_program_is_one_line_too(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_a: object, **_k: object) -> None:
        raise ZeroDivisionError("by\nnought")

    monkeypatch.setattr(pipeline, "offset", fail)
    ended = run("weave", "tube.3dm")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: INTERNAL: ZeroDivisionError: by nought. This is a fault of weavecore")
    assert ended.err.count("\n") == 1


def test_stopping_it_leaves_all_as_it_was(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_a: object, **_k: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pipeline, "encode", stop)
    Path("w.json").write_text("old")
    ended = run("weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--overwrite")
    assert ended.status == 130
    assert Path("w.json").read_text() == "old"


def test_the_unit_that_is_missing_is_warned_of_in_one_line(run: Run, folder: Path) -> None:
    assert run("mesh", "tube.obj", "-o", "plain.3dm", "--quiet").status == 0
    ended = run("weave", "plain.3dm", "--spacing", "1")
    assert ended.status == 0
    assert ended.err == "weavecore: warning: UNIT_UNKNOWN: plain.3dm has no unit; lengths are used as they are\n"
    assert "UNIT_UNKNOWN: plain.3dm has no unit" in ended.out
    refused = run("weave", "plain.3dm", "--spacing", "1", "--strict")
    assert refused.status == 1
    assert "DOUBTFUL: UNIT_UNKNOWN" in refused.err


def test_the_parts_of_the_work_make_one_progress(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bar is drawn on a terminal alone; here a list takes its place."""
    from contextlib import contextmanager

    told: list[tuple[float, str]] = []

    @contextmanager
    def listening(*, quiet: bool) -> Any:
        yield lambda fraction, label: told.append((fraction, label))

    monkeypatch.setattr(time_limit, "progress_bar", listening)
    assert CliRunner().invoke(app, ["weave", "tube.3dm", "--json", "w.json", "--spacing", "1"]).exit_code == 0
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0.0
    assert fractions[-1] <= 1.0
    assert len({label for _, label in told}) >= 4


def test_several_spacings_are_taken_from_the_border_on(run: Run, folder: Path) -> None:
    ended = run("weave", "tube.3dm", "--json", "w.json", "--spacing", "0.5,1,0.75")
    assert ended.status == 0
    result = json.loads(Path("w.json").read_text())
    distances = sorted(set(result["latitudes"]["distance"]))
    assert distances[:3] == [0.0, 0.5, 1.5]
    assert result["parameters"]["spacings"][:2] == [0.5, 1.0]
    assert run("weave", "tube.3dm", "--spacing", "0.5,x").status == 2


def test_the_borders_that_rings_start_from_are_told(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = {}

    def offset(surface: Any, **options: Any) -> Any:
        asked["starts"] = surface.starts
        return tube_latitudes()

    monkeypatch.setattr(pipeline, "offset", offset)
    ended = run("weave", "tube.3dm", "--json", "w.json", "--spacing", "1", "--borders", "1")
    assert (ended.status, ended.err) == (0, "")
    assert [path.tolist() for path in asked["starts"].paths] == [tube_surface().borders[1].tolist()]
    assert json.loads(Path("w.json").read_text("utf-8"))["parameters"]["borders"] == [1]


def test_a_border_that_is_not_there_is_refused_and_no_number_is_wrong_usage(run: Run, folder: Path) -> None:
    ended = run("weave", "tube.3dm", "--json", "w.json", "--borders", "0,2")
    assert ended.status == 1
    assert ended.err.startswith("weavecore: BAD_INDEX: The surface has 2 borders, numbers 0 to 1 (unknown border 2).")
    for typed in ("", "first", "0;1", "1.5", "-1"):
        assert run("weave", "tube.3dm", "--json", "w.json", "--borders", typed).status == 2


def test_curves_come_from_the_file_and_from_files_of_their_own(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = rhino3dm.File3dm.Read("tube.3dm")
    attributes = rhino3dm.ObjectAttributes()
    attributes.Name = "waist"
    model.Objects.AddPolyline(polyline_at(2.0), attributes)
    model.Write("with curve.3dm", 8)
    other = rhino3dm.File3dm()
    other.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    other.Objects.AddPolyline(polyline_at(1.0, scale=1000.0), rhino3dm.ObjectAttributes())
    other.Write("rib.3dm", 8)
    Path("row.csv").write_text("\n".join(f"{p.X},{p.Y},{p.Z}" for p in polyline_at(4.0)), "utf-8")
    asked = {}

    def offset(surface: Any, **options: Any) -> Any:
        asked["starts"], asked["vertices"] = surface.starts, surface.vertices
        return tube_latitudes()

    monkeypatch.setattr(pipeline, "offset", offset)
    names = ["--curve", "rib.3dm", "--curve", "row.csv", "--curve", "waist", "--borders", "0"]
    ended = run("weave", "with curve.3dm", "--json", "w.json", "--spacing", "1", *names)
    assert (ended.status, ended.err) == (0, "")
    heights = [asked["vertices"][path][:, 2] for path in asked["starts"].paths]
    assert [h.mean() for h in heights] == pytest.approx([0.0, 2.0, 1.0, 4.0])
    assert [h.std() for h in heights] == pytest.approx([0.0] * 4, abs=1e-9)
    told = json.loads(Path("w.json").read_text("utf-8"))["parameters"]
    assert told["curves"] == ["rib.3dm", "row.csv", "waist"]
    assert "curves on which rings may start: waist on weave, 6.2117 m, closed\n" in run("info", "with curve.3dm").out


def polyline_at(height: float, scale: float = 1.0) -> Any:
    """Once around the tube along the corners of its columns."""
    around = rhino3dm.Polyline(COLUMNS + 1)
    for turn in range(COLUMNS + 1):
        angle = 2 * math.pi * turn / COLUMNS
        around.Add(scale * math.cos(angle), scale * math.sin(angle), scale * height)
    return around


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("waist", "NO_CURVE: tube.3dm has no curve with the name 'waist'"),
        ("none.csv", "UNREADABLE: none.csv does not exist"),
        ("far.csv", "BAD_CURVE: The curve lies up to 9 off the surface"),
    ],
)
def test_a_curve_that_cannot_be_used_is_one_line(run: Run, folder: Path, name: str, told: str) -> None:
    Path("far.csv").write_text("10,0,1\n10,0,2\n", "utf-8")
    ended = run("weave", "tube.3dm", "--json", "w.json", "--curve", name)
    assert (ended.status, ended.err.count("\n")) == (1, 1)
    assert ended.err.startswith(f"weavecore: {told}")
