"""Parts of every HTML page that is written here: a template with marks ``{{name}}``, data as JSON, and a policy.

A page loads nothing from the network.  A content security policy allows only the scripts and the style whose SHA-256 is
in the page; texts of a result are data, with ``<``, ``>`` and ``&`` escaped.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any


def content_policy(programs: Sequence[str], style: str, *, images: str = "data: blob:") -> str:
    """The content security policy: run only the scripts of the page, and load nothing but images.

    Parameters
    ----------
    programs : sequence of str
        The contents of the script elements that run.
    style : str
        The content of the style element.
    images : str
        Sources of images.
    """
    runs = " ".join(_hash(program) for program in programs)
    return (
        f"default-src 'none'; script-src {runs}; style-src {_hash(style)}; "
        f"img-src {images}; base-uri 'none'; form-action 'none'"
    )


def as_script_data(content: Mapping[str, Any]) -> str:
    """JSON in which no text can close its script element.

    Parameters
    ----------
    content : mapping
        JSON values; numbers are finite.
    """
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def fill_template(template: str, parts: Mapping[str, str]) -> bytes:
    """Put the parts in the places of their marks.

    Parameters
    ----------
    template : str
    parts : mapping of str to str
        Texts by the names of the marks.

    Returns
    -------
    bytes
        UTF-8.
    """
    # A part may itself contain a mark, so the template is split first.
    head, *rest = template.split("{{")
    filled = [head]
    for piece in rest:
        name, _, text = piece.partition("}}")
        filled += [parts[name], text]
    # A lone surrogate in a name cannot be encoded.
    return "".join(filled).encode("utf-8", "replace")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"
