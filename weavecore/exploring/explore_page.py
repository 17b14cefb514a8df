"""The page of an exploration: table, parallel coordinates, scatter plot with the Pareto front, and pictures.

One HTML file with its style, program and data (``assets/``), which opens offline; pictures and the variants' own pages
are files beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from typing import Any

from weavecore.exploring.choose import rank_rows
from weavecore.exploring.evaluate import BEND, DIAMETER, RADIUS
from weavecore.exploring.table import INPUTS, Row
from weavecore.units import with_unit
from weavecore.viewing.page.offline_page import as_script_data, content_policy, fill_template

_MORE_IS_BETTER = (BEND, RADIUS, DIAMETER)
"""Of all other figures less is better."""

_MOST_ROWS = 2000
"""Of a larger table the page shows the best: a browser still draws so many lines and pictures within a second."""

_IMAGES = "'self' file: data:"
"""Pictures lie beside the page, on a disk or a server."""


def encode_explore_page(rows: Sequence[Row], figures: Sequence[str]) -> bytes:
    """Write the page of a table.

    Parameters
    ----------
    rows : sequence of Row
    figures : sequence of str
        Names of the figures, in the order of the columns.

    Returns
    -------
    bytes
        UTF-8; the same table gives the same bytes.
    """
    style, program = _asset("explore.css"), _asset("explore.js")
    parts = {
        "policy": content_policy([program], style, images=_IMAGES),
        "style": style,
        "data": as_script_data(_content(rows, figures)),
        "program": program,
    }
    return fill_template(_asset("explore.html"), parts)


def _content(rows: Sequence[Row], figures: Sequence[str]) -> dict[str, Any]:
    ranked = rank_rows(rows)
    best = ranked[0].number if ranked and ranked[0].figures else None
    shown = sorted(ranked[:_MOST_ROWS], key=lambda row: row.number)
    units = sorted({with_unit(1.0, row.unit).partition(" ")[2] for row in rows})
    return {
        "inputs": list(INPUTS),
        "figures": [{"name": name, "moreIsBetter": name in _MORE_IS_BETTER} for name in figures],
        "rows": [_row(row, figures) for row in shown],
        "count": len(rows),
        "best": best,
        "unit": units[0] if len(units) == 1 else "",
    }


def _row(row: Row, figures: Sequence[str]) -> dict[str, Any]:
    return {
        "number": row.number,
        "inputs": [row.inputs[name] for name in INPUTS],
        "figures": [row.figures.get(name) for name in figures],
        "picture": row.picture,
        "page": row.page,
        "error": row.error,
    }


def _asset(name: str) -> str:
    return resources.files("weavecore.exploring").joinpath("assets", name).read_text("utf-8")
