"""The command that makes the paper's figures anew: quick cases, so that it does not rot."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="the figures are drawn with matplotlib")

import figures
from paper_figures import offsets, steps, woven
from paper_figures.plates import Plate, circle

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
MOST_BYTES = 3_000_000


def cells_of(text: str) -> list[list[str]]:
    """The rows of the tables in a text, without the heads."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if "---" not in line][1:]


@pytest.mark.parametrize("name", figures.FIGURES)
def test_each_figure_has_its_place_in_its_page_and_what_was_measured_stands_there(name: str) -> None:
    page = (DOCS / figures.FIGURES[name][0]).read_text("utf-8")
    (block,) = re.findall(rf"<!-- figure {name} -->(.*?)<!-- end of figure {name} -->", page, re.DOTALL)
    pictures = re.findall(r"images/paper/\w+\.png", block)
    assert pictures
    assert [picture for picture in pictures if not (DOCS / picture).exists()] == []


def test_the_pictures_are_small_and_none_is_left_over() -> None:
    pictures = list((DOCS / "images" / "paper").glob("*"))
    assert sum(picture.stat().st_size for picture in pictures) < MOST_BYTES
    pages = "".join((DOCS / page).read_text("utf-8") for page in ("paper.md", "patterns.md", "structure.md"))
    assert [picture.name for picture in pictures if picture.name not in pages] == []


def test_only_what_stands_between_the_comments_of_a_figure_is_replaced() -> None:
    page = "a <!-- figure 3 -->old<!-- end of figure 3 --> b <!-- figure 5 -->kept<!-- end of figure 5 --> c"
    replaced = figures.replace_block(page, "3", "new")
    assert "old" not in replaced
    assert replaced.startswith("a <!-- figure 3 -->")
    assert "new" in replaced
    assert replaced.endswith("<!-- end of figure 3 --> b <!-- figure 5 -->kept<!-- end of figure 5 --> c")


def test_a_figure_is_drawn_into_copies_of_the_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = "kept\n<!-- figure 5 -->\n<!-- end of figure 5 -->\nkept too\n"
    (tmp_path / "paper.md").write_text(words, "utf-8")
    monkeypatch.setattr("sys.argv", ["figures.py", "--only", "5", "--docs", str(tmp_path)])
    figures.main()
    page = (tmp_path / "paper.md").read_text("utf-8")
    assert "1 child with\n2 crossings and, after reconnection, 3 loops, of which\n2 have room" in page
    assert page.startswith("kept\n")
    assert page.endswith("kept too\n")
    assert (tmp_path / "images" / "paper" / "figure_5.png").read_bytes()[:4] == b"\x89PNG"


def test_three_kinds_of_offset_have_the_crossings_that_the_paper_tells_of(tmp_path: Path) -> None:
    plain, itself, mutual = cells_of(offsets.draw_three_kinds(tmp_path))
    assert plain[1:5] == ["1", "1", "0", "1"]
    assert itself[1:5] == ["1", "1", "2", "2"]
    assert mutual[1:5] == ["2", "2", "2", "1"]


def test_crossings_are_taken_apart_one_by_one(tmp_path: Path) -> None:
    text = steps.draw_reduction(tmp_path)
    assert "10 crossings" in text
    assert "left are 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0,\none less each time" in text


def test_on_the_ring_only_the_test_by_side_tells_that_children_have_passed(tmp_path: Path) -> None:
    rows = {row[0]: row[1:] for row in cells_of(steps.draw_grandchildren(tmp_path))}
    assert rows["ring 1"] == rows["ring 2"] == ["no", "yes", "removed"]
    assert [rows[f"neck {k}"][2] for k in (1, 2, 3)] == ["goes on", "removed", "goes on"]


def test_the_sum_of_angles_is_right_at_random_and_in_doubt_where_segments_touch() -> None:
    agreed, near, wrong = steps.compare_criterion()
    assert agreed > 0.9999
    assert near + wrong == pytest.approx(1.0)
    assert wrong > 0.1


def test_a_disc_is_offset_to_a_smaller_one() -> None:
    plate = Plate([circle(3.0, edge=0.3)], spacing=1.0, edge=0.3)
    step = plate.offset(1)
    assert (len(step.raw), len(step.crossings), len(step.loops)) == (1, 0, 1)
    assert np.linalg.norm(step.end, axis=1) == pytest.approx(2.0, abs=0.02)
    (loop,) = plate.outlines(step.loops)
    assert np.linalg.norm(loop, axis=1) == pytest.approx(2.0, abs=0.02)


def test_models_patterns_and_weaves_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(woven, "_SIZE", (64, 48))
    monkeypatch.setattr(woven, "_SMALL", (64, 48))
    monkeypatch.setattr(woven, "MODELS", {"hemisphere": 120.0})
    monkeypatch.setattr(woven, "GRIDS", {"hemisphere": 120.0})
    monkeypatch.setattr(woven, "BUILT", {"hemisphere": (120.0, 2.0)})
    monkeypatch.setattr(woven, "PATTERN_SPACING", 120.0)
    monkeypatch.setattr(woven, "PATTERNS", {"quad": "rings", "kagome": "triangles and hexagons"})
    (model,) = cells_of(woven.draw_models(tmp_path))
    assert model[4] == model[5] == "4"
    assert model[7] == "yes"
    assert [row[0] for row in cells_of(woven.draw_patterns(tmp_path))] == ["`quad`", "`kagome`"]
    (grid,), (built,) = cells_of(woven.draw_lattices(tmp_path)), cells_of(woven.draw_built(tmp_path))
    assert int(grid[2]) > 10
    assert built[1] == "600 × 600 × 300"
    assert len(list(tmp_path.glob("*.png"))) == 6
