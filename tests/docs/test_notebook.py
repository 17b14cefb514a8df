"""The notebook of the tutorial: its cells run one after the other, and it is kept without outputs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from document_blocks import ROOT

NOTEBOOK = ROOT / "docs" / "tutorial" / "weave.ipynb"


def cells() -> list[dict[str, Any]]:
    return json.loads(NOTEBOOK.read_text("utf-8"))["cells"]


def test_the_cells_run_and_every_check_of_the_workshop_folder_passes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for number, cell in enumerate(cells()):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
    assert names["fabrication"].failed == ()
    assert {"woven.png", "woven.html", "woven.3dm", "workshop"} == {path.name for path in tmp_path.iterdir()}


def test_the_notebook_has_ten_cells_and_no_outputs() -> None:
    assert len(cells()) == 10
    assert [cell for cell in cells() if cell.get("outputs") or cell.get("execution_count")] == []
