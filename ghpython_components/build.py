"""Build the Grasshopper plugin: ``python ghpython_components/build.py -o FOLDER``.

Writes a ``.ghuser`` file for each component and the package for Rhino's package manager.
No Rhino is needed, and the same sources give the same bytes.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from grasshopper_files.components import encode_user_object, read_components

HERE = Path(__file__).resolve().parent


def version() -> str:
    """The version of weavecore in this checkout."""
    text = (HERE.parent / "pyproject.toml").read_text("utf-8")
    return re.search(r'^version = "(.+)"$', text, re.MULTILINE)[1]  # type: ignore[index]


def build() -> dict[str, bytes]:
    """All files of the plugin by their names."""
    return {f"{one.folder}.ghuser": encode_user_object(one) for one in read_components(HERE)}


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the plugin into a folder."""
    parser = argparse.ArgumentParser(description="Build the Grasshopper plugin.")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER", help="where the files go")
    folder = parser.parse_args(arguments).out
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in build().items():
        (folder / name).write_bytes(content)
        print(f"{name}: {len(content):,} bytes")


if __name__ == "__main__":
    sys.exit(main())
