"""The page of an exploration in a browser: it loads by itself, and its views filter and pick together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from explored_tube import explore_tube
from weavecore.exploring.evaluate import FIGURES
from weavecore.exploring.explore_page import encode_explore_page
from weavecore.exploring.table import INPUTS, Row


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four variants, of which two cannot be woven, with pages."""
    return explore_tube(tmp_path_factory.mktemp("explored") / "tube", pages=True).folder


def opened(page: Any, folder: Path) -> Any:
    return page.open(folder / "index.html")


def rows_shown(page: Any) -> list[str]:
    return list(page.run("[...document.querySelectorAll('tbody tr:not([hidden])')].map(row => row.cells[0].innerText)"))


def test_it_loads_without_errors_and_asks_the_network_for_nothing(page: Any, folder: Path) -> None:
    opened(page, folder)
    assert page.told("browser") == []
    assert [url for url in page.requests() if not url.startswith("file:")] == []
    assert page.run("document.querySelectorAll('.lines path').length") == 4
    assert page.run("document.querySelectorAll('.dot').length") == 2
    assert "2 with errors" in page.text("#count")
    page.wait("[...document.images].every(image => image.complete)")
    assert page.run("[...document.images].map(image => image.naturalWidth > 0)") == [True] * 3


def test_a_row_that_is_picked_shows_its_picture_figures_and_page(page: Any, folder: Path) -> None:
    opened(page, folder)
    page.run("document.querySelectorAll('tbody tr')[1].click()")
    assert "plain" in page.text("#picked h3")
    assert page.run("document.querySelector('.lines .at') === document.querySelector('.lines').lastChild")
    link = page.run("document.querySelector('#picked a').href")
    assert Path(link.removeprefix("file://")).is_file()
    page.open(Path(link.removeprefix("file://")))
    assert page.told("browser") == []


def test_the_error_of_a_variant_is_shown_as_text(page: Any, folder: Path) -> None:
    opened(page, folder)
    page.run("document.querySelectorAll('tbody tr')[3].click()")
    assert page.text("#picked .error").startswith("BAD_INDEX")


def test_a_range_on_an_axis_filters_every_view(page: Any, folder: Path) -> None:
    from selenium.webdriver import ActionChains

    opened(page, folder)
    axis = page.driver.find_element("css selector", "[data-column='pattern']")
    height = axis.size["height"]
    drag = ActionChains(page.driver).move_to_element_with_offset(axis, 0, round(-0.45 * height)).click_and_hold()
    drag.move_by_offset(0, round(0.4 * height)).release().perform()
    page.wait("!document.getElementById('reset').disabled")
    assert rows_shown(page) == ["2", "4"]
    assert page.run("document.querySelectorAll('#pictures li:not([hidden])').length") == 1
    assert page.run("document.querySelectorAll('.dot').length") == 1
    page.click("#reset")
    assert rows_shown(page) == ["1", "2", "3", "4"]


def test_a_heading_sorts_the_table_with_empty_cells_last(page: Any, folder: Path) -> None:
    opened(page, folder)
    column = 1 + len(INPUTS) + FIGURES.index("rods")
    values = f"[...document.querySelectorAll('tbody tr')].map(row => row.cells[{column}].innerText)"
    for _ in "ab":
        page.run(f"document.querySelectorAll('thead th button')[{column}].click()")
        first, second, *others = page.run(values)
        assert others == ["–", "–"]
    assert int(first) > int(second)


def test_the_pareto_front_has_what_no_other_variant_beats(page: Any, tmp_path: Path) -> None:
    places = [(1, 9), (2, 5), (3, 6), (4, 1), (4, 3)]
    inputs = dict(zip(INPUTS, ("s", "all", "1", "plain", "stock", "gfrp")))
    rows = [
        Row(n, inputs, {"rods": x, "stubs": y}, "", f"k{n}", "", "", "None") for n, (x, y) in enumerate(places, start=1)
    ]
    path = tmp_path / "index.html"
    path.write_bytes(encode_explore_page(rows, ("rods", "stubs")))
    page.open(path)
    assert page.run("document.getElementById('scatter').dataset.front") == "1 2 4"


def test_texts_of_the_table_are_never_markup(page: Any, tmp_path: Path) -> None:
    text = "</script><b id='bold'>x</b>{{data}}"
    row = Row(1, dict(zip(INPUTS, (text, "all", "1", "plain", "stock", "gfrp"))), {}, text, "k", "", "", "None")
    path = tmp_path / "index.html"
    path.write_bytes(encode_explore_page([row], FIGURES))
    page.open(path)
    assert page.run("document.getElementById('bold')") is None
    assert text in page.text("#picked .error")
