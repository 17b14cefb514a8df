"""A short part of the fuzzing of the readers; `tests/fuzz_readers.py` runs the rest on demand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HARNESS = Path(__file__).resolve().parents[1] / "fuzz_readers.py"
READERS = ["obj", "ply", "stl", "off"]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(HARNESS), *arguments], capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform == "win32", reason="the harness forks")
def test_damaged_mesh_files_end_in_a_surface_or_a_typed_error():
    done = run("--cases", "40", "--seed", "1", *[part for reader in READERS for part in ("--reader", reader)])
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("40 cases") == len(READERS)


@pytest.mark.skipif(sys.platform == "win32", reason="the harness forks")
def test_damaged_rhino_files_end_in_a_surface_or_a_typed_error():
    pytest.importorskip("rhino3dm")
    done = run("--cases", "30", "--seed", "2", "--reader", "3dm")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "refused: UNREADABLE" in done.stdout
