"""The same input gives the same bytes: in another process, with another hash seed, kernels of BLAS and threads."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

WEAVE = """
import sys
from weavecore import pipeline
surface = pipeline.read_surface(sys.argv[1])
weave = pipeline.weave(pipeline.link(pipeline.offset(surface)))
for name in sys.argv[2:]:
    pipeline.export(weave, name)
"""


def digests(sample: str, folder: Path, hash_seed: str, kernel: str, threads: str) -> dict[str, str]:
    """Hashes of the files that a new process writes."""
    folder.mkdir()
    names = ["woven.json", "woven.3dm", "woven.png", "woven.obj"]
    blas = {"OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": threads}
    environment = {**os.environ, **blas, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", WEAVE, str(ROOT / "sample_files" / sample), *names]
    subprocess.run(command, check=True, cwd=folder, env=environment)
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


@pytest.mark.parametrize("sample", ["hemisphere.3dm", pytest.param("six_way_joint.3dm", marks=pytest.mark.slow)])
def test_hash_seeds_kernels_and_threads_change_no_byte(sample: str, tmp_path: Path) -> None:
    """Both kernels run on every x86-64 processor of the last ten years; elsewhere their names are ignored."""
    first = digests(sample, tmp_path / "one", "1", "Nehalem", "1")
    assert digests(sample, tmp_path / "two", "4242", "Haswell", "2") == first
