"""A short part of the fuzzing, and every input that ever failed; `fuzz.py` and `guided.py` run the rest on demand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
MESH_READERS = ["obj", "ply", "stl", "off"]

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the driver forks")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(HERE / "fuzz.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_damaged_mesh_files_end_in_a_surface_or_a_typed_error() -> None:
    done = run("--cases", "40", "--seed", "1", *[part for name in MESH_READERS for part in ("--target", name)])
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("40 cases") == len(MESH_READERS)


def test_damaged_rhino_files_end_in_a_surface_or_a_typed_error() -> None:
    pytest.importorskip("rhino3dm")
    done = run("--cases", "30", "--seed", "2", "--target", "3dm")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "refused: UNREADABLE" in done.stdout


def test_damaged_results_are_read_or_refused_and_so_are_those_to_be_fabricated() -> None:
    done = run("--cases", "30", "--seed", "3", "--target", "json", "--target", "fabricate")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("refused: ") > 2


def test_whole_files_and_every_input_that_ever_failed_are_read_or_refused() -> None:
    done = run("--replay")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("as it should be") > 20
