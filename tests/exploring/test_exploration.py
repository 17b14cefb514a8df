"""Exploring a grid: rows, resuming, and the same bytes whoever weaves."""

from __future__ import annotations

import csv
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from explored_tube import contents, explore_tube
from weavecore import pipeline
from weavecore.errors import NotWritten, Unsupported
from weavecore.exploring import Exploration, evaluate, read_rows
from weavecore.exploring.evaluate import BEND, FIGURES, JOINTS, RODS, SIMULATED, TIES, WASTE
from weavecore.exploring.variants import steps_between


class Stopped(Exception):
    pass


def copy_of(explored: Exploration, folder: Path) -> Path:
    shutil.copytree(explored.folder, folder)
    return folder


def test_each_variant_has_a_row_with_its_figures_or_its_error(explored: Exploration) -> None:
    assert [(row.inputs["borders"], row.inputs["pattern"]) for row in explored.rows] == [
        ("all", "triangular"), ("all", "plain"), ("7", "triangular"), ("7", "plain")
    ]  # fmt: skip
    for row in explored.rows[:2]:
        assert row.error == ""
        assert tuple(row.figures) == FIGURES
        assert None not in row.figures.values()
    assert explored.failed == explored.rows[2:]
    for row in explored.failed:
        assert row.error.startswith("BAD_INDEX: ")
        assert row.figures == {}


def test_figures_are_those_of_the_weave(explored: Exploration) -> None:
    from woven_tube import tube_surface

    weave = pipeline.weave(
        pipeline.link(pipeline.offset(tube_surface(), spacing=1.0), pattern="plain"), rod_diameter=0.02
    )
    figures = explored.rows[1].figures
    assert figures[RODS] == len(weave)
    assert figures[JOINTS] == len(weave.joints)
    assert figures[TIES] == len(weave.joints.contacts)
    assert figures[BEND] == pytest.approx(100 * (weave.bending.utilisation <= 1).mean())
    assert 0 < float(figures[WASTE] or 0) < 100


def test_the_table_has_the_columns_that_design_explorer_reads(explored: Exploration) -> None:
    with (explored.folder / "data.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    columns = list(rows[0])
    assert columns[:6] == [f"in:{name}" for name in ("surface", "borders", "spacing", "pattern", "rod", "material")]
    assert columns[6 : 6 + len(FIGURES)] == [f"out:{name}" for name in FIGURES]
    assert columns[6 + len(FIGURES)] == "img"
    assert all((explored.folder / row["img"]).read_bytes().startswith(b"\x89PNG") for row in rows[:2])
    assert [row["img"] for row in rows[2:]] == ["", ""]


def test_the_table_is_read_back_as_it_was(explored: Exploration) -> None:
    assert read_rows(explored.folder) == explored.rows


def test_a_second_run_weaves_nothing_and_changes_no_byte(explored: Exploration, tmp_path: Path) -> None:
    folder = copy_of(explored, tmp_path / "tube")
    assert explore_tube(folder).n_woven == 0
    assert contents(folder) == contents(explored.folder)


@pytest.mark.parametrize("lost", ["results", "pictures"])
def test_only_what_is_missing_is_woven_again(explored: Exploration, tmp_path: Path, lost: str) -> None:
    folder = copy_of(explored, tmp_path / "tube")
    next((folder / lost).glob(f"{explored.rows[1].key}.*")).unlink()
    assert explore_tube(folder).n_woven == 1
    assert contents(folder) == contents(explored.folder)


def test_a_run_that_is_stopped_keeps_whole_results_and_goes_on(explored: Exploration, tmp_path: Path) -> None:
    def stop(fraction: float, _label: str) -> None:
        if fraction > 0:
            raise Stopped

    with pytest.raises(Stopped):
        explore_tube(tmp_path / "tube", progress=stop)
    assert len(list((tmp_path / "tube" / "results").iterdir())) == 1
    assert not (tmp_path / "tube" / "data.csv").exists()
    assert explore_tube(tmp_path / "tube").n_woven == 3
    assert contents(tmp_path / "tube") == contents(explored.folder)


def test_two_processes_give_the_same_bytes(explored: Exploration, tmp_path: Path) -> None:
    explore_tube(tmp_path / "tube", workers=2)
    assert contents(tmp_path / "tube") == contents(explored.folder)


def test_any_executor_gives_the_same_bytes(explored: Exploration, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as executor:
        explore_tube(tmp_path / "tube", executor=executor, workers=2)
        assert executor.submit(int).result() == 0  # It stays open.
    assert contents(tmp_path / "tube") == contents(explored.folder)


def test_the_offset_is_computed_once_for_all_patterns_and_rods(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def counted(name: str) -> Any:
        verb = getattr(pipeline, name)

        def call(*values: Any, **options: Any) -> Any:
            calls.append(name)
            return verb(*values, **options)

        return call

    for name in ("offset", "link"):
        monkeypatch.setattr(pipeline, name, counted(name))
    explore_tube(tmp_path / "tube", borders=["all"], rods=[0.02, 0.01])
    assert calls == ["offset", "link", "link"]


def test_a_fault_ends_its_variant_only_and_is_tried_again(
    explored: Exploration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weave = pipeline.weave

    def fault(lattice: Any, **options: Any) -> Any:
        if lattice.pattern == "triangular":
            raise ZeroDivisionError("a fault\nin two lines")
        return weave(lattice, **options)

    monkeypatch.setattr(pipeline, "weave", fault)
    rows = explore_tube(tmp_path / "tube").rows
    assert rows[0].error == "INTERNAL: ZeroDivisionError: a fault in two lines"
    assert rows[1].figures == explored.rows[1].figures
    monkeypatch.undo()
    assert explore_tube(tmp_path / "tube").n_woven == 1
    assert contents(tmp_path / "tube") == contents(explored.folder)


def test_a_simulated_variant_has_its_departure(tmp_path: Path) -> None:
    (row,) = explore_tube(tmp_path / "tube", borders=["all"], patterns=["plain"], simulate=True).rows
    assert row.error == ""
    assert set(SIMULATED) <= set(row.figures)


def test_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear")
    with pytest.raises(NotWritten, match=r"letter\.txt"):
        explore_tube(tmp_path)
    assert (tmp_path / "letter.txt").read_text() == "Dear"


@pytest.mark.parametrize(
    "options", [{"patterns": []}, {"patterns": "plain"}, {"patterns": ["herringbone"]}, {"workers": 0}, {"rods": ["x"]}]
)
def test_options_that_cannot_be_woven_are_refused_at_once(tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(Unsupported):
        explore_tube(tmp_path / "tube", **options)


def test_no_process_is_started_from_a_program_that_is_not_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.executable", "/Applications/Rhino 8.app/Rhino")
    with pytest.raises(Unsupported, match="Use 1 worker"):
        explore_tube(tmp_path / "tube", workers=2)


def test_ranges_include_their_end_and_no_rounding() -> None:
    assert steps_between(0.1, 0.3, 0.1) == [0.1, 0.2, 0.3]
    assert steps_between(20, 34, 5) == [20, 25, 30]
    for start, stop, step in ((3, 2, 1), (1, 2, 0), (1, float("inf"), 1)):
        with pytest.raises(Unsupported):
            steps_between(start, stop, step)


def test_a_variant_that_takes_too_long_ends_alone_and_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = [0.0]
    clock = SimpleNamespace(monotonic=lambda: time.monotonic() + late[0], perf_counter=time.perf_counter)

    def link(latitudes: Any, *, pattern: str, progress: Any) -> Any:
        if pattern == "plain":
            late[0] += 1000.0
            progress(0.5, "linking")
        return pipeline.link(latitudes, pattern=pattern, progress=progress)

    with monkeypatch.context() as patched:
        patched.setattr(evaluate, "time", clock)
        patched.setattr(evaluate, "pipeline", SimpleNamespace(**{**vars(pipeline), "link": link}))
        ended = explore_tube(tmp_path / "out", borders=["all"], time_limit=900.0)
    assert [row.error[:13] for row in ended.rows] == ["", "TOO_MUCH_WORK"]
    assert "longer than 900 seconds" in ended.rows[1].error

    again = explore_tube(tmp_path / "out", borders=["all"])
    assert (again.n_woven, again.failed) == (1, ())
