"""After a fault at any call of the file system the old outputs or the new ones are whole; see `fault_injection`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fault_injection
from weavecore import pipeline
from woven_tube import tube_lattice

ROOT = Path(__file__).resolve().parents[2]
LEAST_FAULTS = 200
"""Five at each call, with and without what was there before: fewer, and the hook sees nothing."""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    lattice = tube_lattice()
    pipeline.export(lattice.latitudes.surface, folder / "tube.obj")
    pipeline.export(pipeline.weave(lattice), folder / "tube.json")
    return folder


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize("command", sorted(fault_injection.OUTPUTS))
def test_the_old_outputs_or_the_new_ones_are_whole_after_a_fault_at_any_call(
    inputs: Path, tmp_path: Path, command: str
) -> None:
    for path in inputs.iterdir():
        shutil.copy(path, tmp_path)
    done = subprocess.run(
        [sys.executable, fault_injection.__file__, command, str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *wrong, total = done.stdout.splitlines()
    assert wrong == []
    assert int(total) >= LEAST_FAULTS
