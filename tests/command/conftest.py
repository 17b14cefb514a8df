"""What the tests of the command share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Callable, NamedTuple

import pytest

from weavecore.cli import main
from weavecore.pipeline import export
from woven_tube import tube_surface


class Ended(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a tube 5 m high in two files: one knows its unit, one does not."""
    monkeypatch.chdir(tmp_path)
    surface = replace(tube_surface(), name="Tube", tolerance=0.002)
    export(surface, "tube.3dm")
    export(surface, "tube.obj")
    return tmp_path


@pytest.fixture
def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., Ended]:
    """Run the command in that folder."""

    def run_with(*arguments: str) -> Ended:
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        captured = capsys.readouterr()
        return Ended(int(ended.value.code or 0), captured.out, captured.err)

    return run_with
