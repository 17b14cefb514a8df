"""The code blocks of the documents, run in a folder: ``python tests/document_blocks.py --write`` renews their outputs.

A block of ``sh`` or ``python`` is run, one after the other on a page, in a folder that holds what the pages call the
reader's own files.  A comment before a block changes this::

    <!-- not run: why -->        the block is left out
    <!-- refused -->             the command ends with status 1
    <!-- output -->              the block of text that follows is what the block above prints; below a line of …
                                 it shows the last lines only

Commands of weavecore run in this process, which saves its start; everything else runs in bash.  Nothing is installed:
of ``python -m pip install … && weavecore …`` the second half is run.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from itertools import product
from pathlib import Path
from typing import Optional

from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), ROOT / "sample_files" / "README.md"]
LEFT_OUT = "…"
BLOCK = re.compile(
    r"(?:^ *<!-- (?P<mark>not run|refused|output)\b[^\n]*-->\n+)?"
    r"^ *```(?P<language>sh|python|text)\n(?P<code>.*?)^ *```",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """A code block of a page: ``mark`` is ``""``, ``"not run"``, ``"refused"`` or ``"output"``."""

    language: str
    mark: str
    code: str
    span: tuple[int, int]

    @property
    def is_run(self) -> bool:
        return self.language != "text" and self.mark != "not run"


def blocks_of(text: str) -> list[Block]:
    return [
        Block(found["language"], found["mark"] or "", found["code"], found.span("code"))
        for found in BLOCK.finditer(text)
    ]


def run_page(text: str, folder: Path) -> Iterator[tuple[Block, str, Optional[Block]]]:
    """Run the blocks of a page: each block, what it prints, and the block with the output that the page shows."""
    blocks = blocks_of(text)
    with _inside(folder):
        for number, block in enumerate(blocks):
            if block.is_run:
                after = blocks[number + 1] if number + 1 < len(blocks) else None
                yield block, _run(block), after if after is not None and after.mark == "output" else None


def like(output: str, shown: str) -> str:
    """The output, and of one that a page shows below … as many of its last lines."""
    lines, shown_lines = output.splitlines(), shown.splitlines()
    if shown_lines[:1] != [LEFT_OUT]:
        return output
    return "\n".join([LEFT_OUT, *lines[len(lines) - len(shown_lines) + 1 :]])


def labels_of(output: str) -> list[str]:
    """The first word of each line: numbers may change from version to version, what is said may not."""
    return [line.split()[0].rstrip(":") for line in output.splitlines() if line.strip() and not line.startswith(" ")]


def prepare(folder: Path) -> None:
    """The files that the pages call the reader's own, and the samples."""
    import rhino3dm

    (folder / "sample_files").symlink_to(ROOT / "sample_files")
    (folder / "dome.3dm").symlink_to(ROOT / "sample_files" / "hemisphere.3dm")
    shell = _model()
    shell.Objects.AddSurface(_canopy(), _on_layer(shell, "Shell"))
    shell.Write(str(folder / "shell.3dm"), 7)
    site = _model()
    for x, y in ((0, 0), (1200, 0), (0, 900), (1200, 900)):
        site.Objects.AddPoint(rhino3dm.Point3d(x, y, 0), _on_layer(site, "Feet"))
    site.Objects.AddPoint(rhino3dm.Point3d(600, 450, 300), _on_layer(site, "Lamps"))
    site.Write(str(folder / "site.3dm"), 7)
    (folder / "messy.obj").write_text(_messy_mesh(), "utf-8")


def _model() -> object:
    import rhino3dm

    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Settings.ModelAbsoluteTolerance = 0.01
    return model


def _on_layer(model: object, name: str) -> object:
    import rhino3dm

    attributes = rhino3dm.ObjectAttributes()
    found = [layer.Index for layer in model.Layers if layer.Name == name]
    if not found:
        layer = rhino3dm.Layer()
        layer.Name = name
        found = [model.Layers.Add(layer)]
    attributes.LayerIndex = found[0]
    attributes.Name = name.lower()
    return attributes


def _canopy() -> object:
    """A shell of 1.2 m by 0.9 m, a third of a metre high."""
    import rhino3dm

    surface = rhino3dm.NurbsSurface.Create(3, False, 4, 4, 5, 5)
    heights = (0.0, 0.6, 1.0, 0.6, 0.0)
    for i in range(5):
        for j in range(5):
            surface.Points[i, j] = rhino3dm.Point4d(300.0 * i, 225.0 * j, 450.0 * heights[i] * heights[j], 1.0)
    surface.KnotsU.CreateUniformKnots(0.5)
    surface.KnotsV.CreateUniformKnots(0.5)
    return surface


def _messy_mesh() -> str:
    """A shell as careless exporters leave it: faces apart, some turned over, and a scrap beside it."""
    lines: list[str] = []
    for i, j in product(range(24), range(18)):
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        lines += [f"v {50 * a} {50 * b} {0.8 * a * (24 - a) * b * (18 - b) / 36:.6g}" for a, b in corners]
        first = len([line for line in lines if line[0] == "v"]) - 3
        order = (3, 2, 1, 0) if (i + j) % 7 == 0 else (0, 1, 2, 3)
        lines.append("f " + " ".join(str(first + k) for k in order))
    scrap = len([line for line in lines if line[0] == "v"])
    lines += ["v 0 0 500", "v 20 0 500", "v 0 20 500", f"f {scrap + 1} {scrap + 2} {scrap + 3}"]
    return "\n".join(lines) + "\n"


def _run(block: Block) -> str:
    if block.language == "python":
        return _run_python(block.code)
    joined = block.code.replace("\\\n", " ")
    return "".join(_run_line(line, 1 if block.mark == "refused" else 0) for line in joined.splitlines() if line.strip())


def _run_python(code: str) -> str:
    if "__main__" in code:  # Its processes import it, so it must be a file.
        Path("script.py").write_text(code, "utf-8")
        return _in_bash(f"{shlex.quote(sys.executable)} script.py")
    printed = StringIO()
    with redirect_stdout(printed):
        exec(compile(code, "block", "exec"), {})
    return printed.getvalue()


def _run_line(line: str, status: int) -> str:
    line = re.sub(r"^python -m pip install [^&]*&& ", "", line)
    if not re.match(r" *weavecore [^|&;<>$]*$", line):
        return _in_bash(line)
    from weavecore.cli import app
    from weavecore.commands.time_limit import stop_clock

    words = shlex.split(line, comments=True)[1:]
    try:
        ended = CliRunner().invoke(app, words)
    finally:
        stop_clock()
    if ended.exit_code != status:
        raise AssertionError(f"{line}\n{ended.output}\n{ended.exception!r}")
    return ended.output if status == 0 else f"weavecore: {' '.join(str(ended.exception).split())}\n"


def _in_bash(line: str) -> str:
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(paths), "PYTHONPATH": str(ROOT)}
    command = ["bash", "-euo", "pipefail", "-c", line]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=environment)
    if ended.returncode:
        raise AssertionError(f"{line}\n{ended.stdout}\n{ended.stderr}")
    return ended.stdout


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _renewed(text: str, folder: Path) -> str:
    """The page with the outputs of its blocks as they are now."""
    outputs = [(shown.span, output) for _, output, shown in run_page(text, folder) if shown]
    for (begin, end), output in reversed(outputs):
        lines = [line.rstrip() for line in like(output, text[begin:end]).splitlines()]
        text = text[:begin] + "\n".join(lines).strip("\n") + "\n" + text[end:]
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description="Run the code blocks of documents.")
    parser.add_argument("pages", nargs="*", type=Path, default=PAGES)
    parser.add_argument("--write", action="store_true", help="renew the outputs in the pages")
    options = parser.parse_args()
    for page in options.pages:
        text = page.read_text("utf-8")
        with tempfile.TemporaryDirectory() as scratch:
            prepare(Path(scratch))
            renewed = _renewed(text, Path(scratch))
        if options.write and renewed != text:
            page.write_text(renewed, "utf-8")


if __name__ == "__main__":
    main()
