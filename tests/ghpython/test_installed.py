"""The plugin as its package installs it: Python's standard library, NumPy, SciPy, and what the .yak brings along."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import scipy

import build
from ghpython.stubs import COMPONENTS
from grasshopper_files.components import read_component, without_requirements
from grasshopper_files.library import FOLDER, library_files, machine_of, system_of
from weavecore import pipeline

SECONDS = 300


def test_the_package_alone_weaves_beside_numpy_and_scipy(tmp_path: Path) -> None:
    package, numerics, target = tmp_path / "package", tmp_path / "numerics", tmp_path / "dome.obj"
    (content,) = (body for name, body in build.build().items() if name.endswith(".yak"))
    zipfile.ZipFile(BytesIO(content)).extractall(package)
    numerics.mkdir()
    for home in (Path(module.__file__).parent for module in (np, scipy)):
        # The libraries that a wheel brings along lie beside its package.
        for folder in home.parent.glob(f"{home.name}*"):
            (numerics / folder.name).symlink_to(folder, target_is_directory=True)
    pipeline.export(pipeline.read_surface(build.ROOT / "sample_files" / "hemisphere.3dm"), target)
    script = Path(__file__).with_name("bare_canvas.py")
    command = [sys.executable, "-I", "-S", str(script), str(package), str(target), str(numerics)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    last = ran.stdout.splitlines()[-1]
    assert last == f"{build.version()} {package / FOLDER / 'weavecore' / '__init__.py'}"
    assert (tmp_path / "woven.html").stat().st_size > 100_000
    assert {"pieces.csv", "templates.svg"} <= {path.name for path in (tmp_path / "workshop").iterdir()}


def test_wheels_are_unpacked_for_their_machine_and_then_nothing_is_asked_of_rhino(tmp_path: Path) -> None:
    wheel = tmp_path / "numpy-2.0.2-cp39-cp39-macosx_14_0_arm64.whl"
    with zipfile.ZipFile(wheel, "w") as content:
        content.writestr("numpy/core.py", "a = 1")
        content.writestr("numpy/tests/test_core.py", "")
    files = library_files(build.ROOT / "weavecore", "1.2", [wheel])
    assert files[f"{FOLDER}/arm64/numpy/core.py"] == b"a = 1"
    assert not any("/tests/" in name or "__pycache__" in name for name in files)
    assert b"Version: 1.2" in files[f"{FOLDER}/weavecore-1.2.dist-info/METADATA"]
    assert (system_of([wheel]), system_of([])) == ("mac", "any")
    script = without_requirements(read_component(COMPONENTS / "Weave_Link")).code
    assert script.startswith('"""Divides')


@pytest.mark.parametrize(
    ("tag", "machine"),
    [
        ("win_amd64", "amd64"),
        ("macosx_10_9_x86_64", "x86_64"),
        ("manylinux_2_17_x86_64.manylinux2014_x86_64", "x86_64"),
    ],
)
def test_a_wheel_names_its_machine(tag: str, machine: str) -> None:
    assert machine_of(f"scipy-1.13.1-cp39-cp39-{tag}.whl") == machine
    with pytest.raises(ValueError, match="not a wheel for one kind of machine"):
        machine_of("six-1.0-py3-none-any.whl")
