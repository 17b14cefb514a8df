"""The HTML page: markup, style, programs and data in one file that loads nothing from the network.

The template is ``assets/page.html``; `offline_page` fills it.
"""

from __future__ import annotations

import html
from importlib import resources
from typing import Optional

from weavecore.model import BuildSequence, Strands
from weavecore.viewing.page.offline_page import as_script_data, content_policy, fill_template
from weavecore.viewing.page.page_content import page_content
from weavecore.viewing.page.work import check_work
from weavecore.viewing.scene import Pictured

_LIBRARY = "three.js"
_PROGRAMS = (
    "data.js",
    "rods.js",
    "stage.js",
    "scenery.js",
    "showing.js",
    "legend.js",
    "equilibrium.js",
    "list.js",
    "details.js",
    "player.js",
    "main.js",
)
"""The page's own programs in the order in which they need each other."""


def encode_page(
    value: Pictured, *, strands: Optional[Strands] = None, sequence: Optional[BuildSequence] = None
) -> bytes:
    """Write the HTML page that shows a stage's result.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    strands : Strands, optional
        The rods of a lattice, which it needs.
    sequence : BuildSequence, optional
        The construction of a weave.

    Returns
    -------
    bytes
        UTF-8; the same value gives the same bytes.

    Raises
    ------
    TooMuchWork
        Where a page would be too large for a browser.
    """
    check_work(value)
    content = page_content(value, strands=strands, sequence=sequence)
    library, style = _asset(_LIBRARY), _asset("page.css")
    own = "\n".join(_asset(name) for name in _PROGRAMS)
    program = f'(function () {{\n"use strict";\n{own}\n}})();\n'
    parts = {
        "policy": content_policy([library, program], style),
        "title": html.escape(f"{content['title']} – weavecore"),
        "style": style,
        "data": as_script_data(content),
        "licence": _asset("three.LICENSE.txt").strip(),
        "library": library,
        "program": program,
    }
    return fill_template(_asset("page.html"), parts)


def _asset(name: str) -> str:
    return resources.files("weavecore.viewing.page").joinpath("assets", name).read_text("utf-8")
