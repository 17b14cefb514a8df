"""The page of the notebook: its cells one after the other."""

from __future__ import annotations

import json
from pathlib import Path

NOTEBOOK = Path(__file__).resolve().parents[1] / "tutorial" / "weave.ipynb"


def text() -> str:
    """The page in Markdown."""
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    return "\n\n".join(_cell(cell) for cell in cells) + "\n\n[Download the notebook](weave.ipynb).\n"


def _cell(cell: dict[str, object]) -> str:
    source = "".join(cell["source"])  # type: ignore[arg-type]
    return source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```"
