"""The HTML page: markup, style, programs and data in one file that loads nothing from the network.

The template ``assets/page.html`` has marks ``{{name}}``.  A content security policy allows only the scripts and the
style whose SHA-256 is in the page; texts of the result are data, with ``<``, ``>`` and ``&`` escaped.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from importlib import resources
from typing import Any, Optional

from weavecore.model import BuildSequence, Strands
from weavecore.viewing.page.page_content import page_content
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
    """
    content = page_content(value, strands=strands, sequence=sequence)
    library, style = _asset(_LIBRARY), _asset("page.css")
    own = "\n".join(_asset(name) for name in _PROGRAMS)
    program = f'(function () {{\n"use strict";\n{own}\n}})();\n'
    parts = {
        "policy": _policy([library, program], style),
        "title": html.escape(f"{content['title']} – weavecore"),
        "style": style,
        "data": _as_script_data(content),
        "licence": _asset("three.LICENSE.txt").strip(),
        "library": library,
        "program": program,
    }
    page = _asset("page.html")
    # A part may itself contain a mark, so the template is split first.
    head, *rest = page.split("{{")
    filled = [head]
    for piece in rest:
        name, _, text = piece.partition("}}")
        filled += [parts[name], text]
    # A lone surrogate in a name cannot be encoded.
    return "".join(filled).encode("utf-8", "replace")


def _asset(name: str) -> str:
    return resources.files("weavecore.viewing.page").joinpath("assets", name).read_text("utf-8")


def _policy(programs: list[str], style: str) -> str:
    """The content security policy: load nothing, and run only the scripts of the page."""
    runs = " ".join(_hash(program) for program in programs)
    return (
        f"default-src 'none'; script-src {runs}; style-src {_hash(style)}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"


def _as_script_data(content: dict[str, Any]) -> str:
    """JSON in which no text can close its script element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
