"""``weavecore explore`` and ``weavecore choose``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable

import pytest

from weavecore.commands.explore import spacings_of
from weavecore.exploring import read_rows
from weavecore.units import Length

Run = Callable[..., Any]
GRID = (
    "--spacing",
    "1000mm",
    "--borders",
    "all,7",
    "--pattern",
    "plain,kagome",
    "--rod",
    "20mm",
    "--workers",
    "1",
    "--no-pages",
)


def test_a_grid_is_woven_to_a_folder_and_the_best_is_chosen(run: Run, folder: Path) -> None:
    ended = run("explore", "tube.3dm", "-o", "out", *GRID)
    assert (ended.status, ended.err) == (0, "")
    assert "4, 4 woven now" in ended.out
    assert "2, the first in row 3: BAD_INDEX" in ended.out
    rows = read_rows(folder / "out")
    assert [(row.spacing, row.inputs["borders"]) for row in rows] == [(1, "all")] * 2 + [(1, "7")] * 2
    assert [row.inputs["rod"] for row in rows] == ["0.02"] * 4

    again = run("explore", "tube.3dm", "-o", "out", *GRID)
    assert "4, 0 woven now, 4 from earlier runs" in again.out

    chosen = run("choose", "out", "--spacing", "1m")
    assert chosen.status == 0
    assert chosen.out.splitlines()[0].startswith("choice  ")
    assert chosen.out.splitlines()[1].startswith("reason  ")
    assert "weavecore weave INPUT --spacing 1 --pattern" in chosen.out


def test_choosing_from_what_is_not_an_exploration_is_refused_in_one_line(run: Run, folder: Path) -> None:
    (folder / "empty").mkdir()
    (folder / "other.csv").write_text("a,b\n1,2\n")
    for name in ("empty", "other.csv"):
        ended = run("choose", name)
        assert ended.status == 1
        assert ended.err.startswith("weavecore: UNREADABLE: ")
        assert len(ended.err.splitlines()) == 1


@pytest.mark.parametrize(
    "wrong",
    [
        ("--spacing", "20:60"),
        ("--spacing", "60:20:5"),
        ("--spacing", "20mm:60:5"),
        ("--pattern", "plain,herringbone"),
        ("--material", "glass"),
        ("--rod", "stock,x"),
        ("--borders", "all,a"),
        ("--workers", "0"),
    ],
)
def test_wrong_usage_ends_with_status_2(run: Run, wrong: tuple[str, str]) -> None:
    ended = run("explore", "tube.3dm", "-o", "out", *wrong)
    assert ended.status == 2
    assert not Path("out").exists()


def test_lists_and_ranges_of_spacings() -> None:
    assert spacings_of("20:30:5,60").values == tuple(Length(v) for v in (20, 25, 30, 60))
    assert spacings_of("1m,20mm:40mm:20mm").values == (
        Length(1, "Meters"), Length(20, "Millimeters"), Length(40, "Millimeters")
    )  # fmt: skip
