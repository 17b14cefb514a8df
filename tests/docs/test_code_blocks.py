"""The code blocks of README.md and of the documents run, and print what the pages show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from document_blocks import PAGES, ROOT, blocks_of, labels_of, like, prepare, run_page

SLOW = ("docs/exploring.md", "docs/how_to/choose.md")
"""Pages that start worker processes."""


def pages() -> list[Any]:
    names = {page: str(page.relative_to(ROOT)) for page in PAGES}
    return [
        pytest.param(page, id=name, marks=[pytest.mark.slow] if name in SLOW else [])
        for page, name in names.items()
        if any(block.is_run for block in blocks_of(page.read_text("utf-8")))
    ]


@pytest.mark.parametrize("page", pages())
def test_the_code_blocks_of_a_page_run_and_print_what_it_shows(page: Path, tmp_path: Path) -> None:
    prepare(tmp_path)
    for block, output, shown in run_page(page.read_text("utf-8"), tmp_path):
        if shown is not None:
            assert labels_of(like(output, shown.code)) == labels_of(shown.code), block.code


def test_an_output_may_be_shown_from_below_an_ellipsis_on() -> None:
    output = "spacing 3\nrods 24\nwritten x\n"
    assert labels_of(like(output, "…\nrods 23\nwritten y\n")) == ["…", "rods", "written"]
    assert labels_of(like(output, "rods 23\n")) == ["spacing", "rods", "written"]


def test_blocks_are_found_with_their_marks() -> None:
    text = "<!-- not run: installs -->\n\n```sh\npip\n```\n```sh\nweavecore\n```\n"
    text += "\n<!-- output -->\n```text\nrods 3\n```\n"
    assert [(block.mark, block.code) for block in blocks_of(text)] == [
        ("not run", "pip\n"),
        ("", "weavecore\n"),
        ("output", "rods 3\n"),
    ]
