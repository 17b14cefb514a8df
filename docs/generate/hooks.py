"""Hooks of the site's build (`mkdocs build`): pages that are made from the code, and links out of ``docs/``.

Pages of the reference are made while the site is built, so that they cannot differ from the code.  README.md is the
first page.  A link to a file outside ``docs/`` leads to a copy of it, if it is a page or a picture; else its text
stays.
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path
from typing import Any, Callable

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(Path(__file__).parent))

import codes_page
import commands_page
import json_result_page
import notebook_page

MADE: dict[str, Callable[[], str]] = {
    "reference/commands.md": commands_page.text,
    "reference/codes.md": codes_page.text,
    "reference/json_result.md": json_result_page.text,
    "tutorial/notebook.md": notebook_page.text,
}
"""Pages that are made from the code, and by what."""

COPIED = ("CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "sample_files/README.md")
"""Pages outside ``docs/``."""

LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made, and copies of what lies outside ``docs/``."""
    for place, make in MADE.items():
        files.append(File.generated(config, place, content=make()))
    files.append(File.generated(config, "index.md", content=_read("README.md")))
    for name in COPIED:
        files.append(File.generated(config, f"repository/{name}", content=_read(name)))
    for picture in sorted((ROOT / "ghpython_components").glob("*/icon.png")):
        name = f"repository/{picture.relative_to(ROOT).as_posix()}"
        files.append(File.generated(config, name, content=picture.read_bytes()))
    return files


def on_page_markdown(markdown: str, page: Any, files: Files, **_: Any) -> str:
    """Turn the links of a page, which are right in the repository, into links of the site."""
    place = page.file.src_uri
    home = posixpath.dirname(_repository_path(place))

    def turned(found: re.Match[str]) -> str:
        mark, label, link = found.groups()
        target, hash_, anchor = link.partition("#")
        if not target or "://" in link or link.startswith("mailto:"):
            return found[0]
        path = posixpath.normpath(posixpath.join(home, target))
        there = _site_path(path)
        if files.get_file_from_path(there) is None:
            return label if path.split("/")[0] != "docs" and (ROOT / path).exists() else found[0]
        return f"{mark}[{label}]({posixpath.relpath(there, posixpath.dirname(place) or '.')}{hash_}{anchor})"

    # Code blocks and code between backticks hold no links.
    parts = re.split(r"(^```.*?^```|`[^`\n]+`(?!\]))", markdown, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if number % 2 else LINK.sub(turned, part) for number, part in enumerate(parts))


def _read(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


def _repository_path(place: str) -> str:
    """Path in the repository of a page of the site."""
    if place == "index.md":
        return "README.md"
    return place[len("repository/") :] if place.startswith("repository/") else f"docs/{place}"


def _site_path(path: str) -> str:
    """Path in the site of a file of the repository."""
    if path == "README.md":
        return "index.md"
    return path[len("docs/") :] if path.startswith("docs/") else f"repository/{path}"
