"""``weavecore fabricate`` and the verb behind it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import rhino3dm

import weavecore as wc
from fabricated import table
from weavecore import pipeline
from weavecore.errors import NotWritten, OutputExists, Unreadable, Unsupported
from weavecore.exporting.registry import encode
from weavecore.fabricating import workshop_folder
from weavecore.fabricating.workshop_folder import Fabrication
from woven_rods import woven_tube

Run = Callable[..., Any]

FILES = {
    *(f"{name}.csv" for name in ("rods", "pieces", "splices", "nesting", "marks", "joints", "axes", "clashes")),
    "sequence.csv",
    "machine.csv",
    "drawings.dxf",
    "drawings.svg",
    "drawings.pdf",
    "labels.pdf",
    "bom.csv",
    "report.csv",
    "report.txt",
    "woven.3dm",
    "templates.dxf",
    "templates.svg",
    "templates.pdf",
}


@pytest.fixture
def result(folder: Path) -> Path:
    wc.export(woven_tube("kagome"), "result.json")
    return folder / "result.json"


def read_folder(path: Path) -> Fabrication:
    return Fabrication({one.name: one.read_bytes() for one in path.iterdir()}, ())


def test_the_folder_has_all_files_and_each_states_unit_version_and_the_hash_of_the_result(
    run: Run, result: Path
) -> None:
    ended = run("fabricate", "result.json", "-o", "out")
    assert (ended.status, ended.err) == (0, "")
    made = read_folder(Path("out"))
    assert made.files.keys() == FILES
    digest = hashlib.sha256(result.read_bytes()).hexdigest()
    for name, content in made.files.items():
        if name.endswith((".csv", ".txt", ".svg", ".dxf")):
            for statement in ("unit mm", f"weavecore {wc.__version__}", digest):
                assert statement in content.decode(), name
    lines = dict(line.split(None, 1) for line in ended.out.splitlines())
    assert lines.keys() == {"rods", "pieces", "stock", "joints", "checked", "written"}
    assert f"{len(table(made, 'rods'))}, " in lines["rods"]


def test_the_3dm_has_the_axes_as_named_curves_on_layers(run: Run, result: Path) -> None:
    assert run("fabricate", "result.json", "-o", "out", "--templates", "none").status == 0
    assert not list(Path("out").glob("templates.*"))
    document = rhino3dm.File3dm.Read("out/woven.3dm")
    rods = {one.Attributes.Name: one for one in document.Objects if type(one.Geometry).__name__ == "NurbsCurve"}
    rows = table(read_folder(Path("out")), "rods")
    assert sorted(rods) == sorted(rows["rod_id"])
    for one in rods.values():
        assert document.Layers[one.Attributes.LayerIndex].FullPath.startswith("weave::rods::")
    digest = hashlib.sha256(result.read_bytes()).hexdigest()
    told = [dict(one.Attributes.GetUserStrings()) for one in document.Objects]
    assert [texts["input_sha256"] for texts in told if "input_sha256" in texts] == [digest]
    assert str(document.Settings.ModelUnitSystem).endswith("Millimeters")


def test_stock_splices_overhang_and_paper_are_taken_as_typed(run: Run, result: Path) -> None:
    ended = run(
        *("fabricate", "result.json", "-o", "out", "--stock", "0.8m", "--splice", "sleeve"),
        *("--overhang", "2cm", "--kerf", "2", "--paper", "a4", "--templates", "pdf"),
    )
    assert ended.status == 0
    made = read_folder(Path("out"))
    bom = table(made, "bom")
    assert (bom["stock_length"], bom["kerf"]) == (["800.000"], ["2.000"])
    rods, marks = table(made, "rods"), table(made, "marks")
    is_open = {rod for rod, closed in zip(rods["rod_id"], rods["closed"]) if closed == "no"}
    stations = [at for rod, at in zip(marks["rod_id"], marks.floats("station").tolist()) if rod in is_open]
    assert min(stations) == pytest.approx(20.0)
    assert set(table(made, "splices")["kind"]) == {"sleeve"}
    assert b"841.8898 595.2756" in made.files["templates.pdf"]


def test_a_folder_that_is_there_is_replaced_only_when_asked(run: Run, result: Path) -> None:
    arguments = ("fabricate", "result.json", "-o", "out", "--templates", "none", "--quiet")
    assert run(*arguments).status == 0
    refused = run(*arguments)
    assert (refused.status, refused.out) == (1, "")
    assert refused.err.startswith("weavecore: EXISTS: out ")
    assert run(*arguments, "--overwrite").status == 0
    (Path("out") / "notes.txt").write_text("mine")
    refused = run(*arguments, "--overwrite")
    assert "NOT_WRITTEN" in refused.err
    assert "notes.txt" in refused.err


def test_a_result_without_a_unit_asks_for_one(run: Run, folder: Path) -> None:
    content = {**json.loads(encode(woven_tube("kagome"), "a.json")), "unit": "None"}
    Path("result.json").write_text(json.dumps(content))
    refused = run("fabricate", "result.json", "-o", "out")
    assert refused.status == 1
    assert "--unit mm" in refused.err
    assert not Path("out").exists()
    assert (
        run("fabricate", "result.json", "-o", "out", "--unit", "cm", "--stock", "60m", "--templates", "none").status
        == 0
    )
    made = read_folder(Path("out"))
    assert np.allclose(table(made, "rods").floats("length"), 10 * woven_tube("kagome").axes.lengths, atol=0.001)
    assert run("fabricate", "result.json", "-o", "other", "--unit", "ells").status == 1


@pytest.mark.parametrize(
    ("content", "words"),
    [("{", "UNREADABLE"), ("{}", "UNSUPPORTED"), (None, "UNREADABLE"), ("surface", "no rods")],
)
def test_what_is_no_weave_is_refused_in_one_line(run: Run, folder: Path, content: str | None, words: str) -> None:
    if content == "surface":
        wc.export(wc.read_surface("tube.3dm"), "result.json")
    elif content is not None:
        Path("result.json").write_text(content)
    refused = run("fabricate", "result.json", "-o", "out")
    assert (refused.status, len(refused.err.splitlines())) == (1, 1)
    assert words in refused.err
    assert not Path("out").exists()


def test_wrong_usage_has_status_2(run: Run, result: Path) -> None:
    assert run("fabricate", "result.json").status == 2
    assert run("fabricate", "result.json", "-o", "out", "--stock", "long").status == 2
    for option, wrong, known in (
        ("--splice", "glue", "overlap"),
        ("--paper", "A7", "A4"),
        ("--templates", "dwg", "svg"),
        ("--templates", "dxf,", "svg"),
    ):
        refused = run("fabricate", "result.json", "-o", "out", option, wrong)
        assert refused.status == 2
        assert known in refused.err
    assert not Path("out").exists()


def test_the_verb_takes_a_weave_or_a_path_and_gives_the_same_folder(folder: Path) -> None:
    weave = woven_tube("quad")
    wc.export(weave, "result.json")
    one = wc.fabricate("result.json", "one")
    other = wc.fabricate(weave, "other")
    assert one.files.keys() == other.files.keys() == FILES
    assert [name for name in FILES if one.files[name] != other.files[name]] == []
    assert {path.name: path.read_bytes() for path in Path("one").iterdir()} == one.files


def test_the_verb_tells_its_progress_and_can_be_cancelled(folder: Path) -> None:
    told: list[float] = []
    workshop = pipeline.Workshop(templates=())
    wc.fabricate(woven_tube("quad"), "out", workshop=workshop, progress=lambda done, _label: told.append(done))
    assert told == sorted(told)
    assert 0.0 <= told[0] <= told[-1] <= 1.0

    def cancel(fraction: float, label: str) -> None:
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        wc.fabricate(woven_tube("quad"), "cancelled", workshop=workshop, progress=cancel)
    assert not Path("cancelled").exists()


def test_errors_come_before_the_work(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("out").mkdir()
    (Path("out") / "bom.csv").write_text("")
    monkeypatch.setattr(workshop_folder, "fabricate_weave", None)
    with pytest.raises(OutputExists):
        wc.fabricate(woven_tube("quad"), "out")
    with pytest.raises(NotWritten):
        wc.fabricate(woven_tube("quad"), "no/where")
    with pytest.raises(Unreadable):
        wc.fabricate("missing.json", "new")
    with pytest.raises(Unsupported):
        wc.fabricate(woven_tube("quad"), "new", unit="in")
