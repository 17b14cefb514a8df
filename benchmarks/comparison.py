"""Compare both methods of weavecore with their peers: error, time, memory, and what comes out.

    pip install -e ".[bench]"
    python benchmarks/comparison.py                             # prints the tables
    python benchmarks/comparison.py --write docs/comparison.md  # and keeps them there, between two comments

Three surfaces, each at three sizes; each method in a process of its own, on one thread, from bare arrays
to polylines.  Methods that are not installed are left out, and named.
"""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import subprocess
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Callable

import numpy as np

from comparison_methods import METHODS
from comparison_quality import Result, count_crossed, errors
from exact import ExactDistance
from paper_figures.pages import table
from shell import make_shell

HERE = Path(__file__).resolve().parent
SIZES = (5_000, 20_000, 70_000)
MOST_FACES_FOR_EXACT = 30_000
OWN = "weavecore levels"
SPECK = 0.5
"""Spacings: a polyline that is shorter is a speck."""

BEGIN, END = "<!-- tables -->", "<!-- end of tables -->"
_EDGE_OF_JOINT, _EDGE_OF_NECK = 1279.0, 718.0
"""Edge times the square root of the number of faces, mm."""

_SECONDS = 300
Arrays = tuple[np.ndarray, np.ndarray]


def make_sample(name: str, edge: float) -> Arrays:
    """A surface of sample_files/ with edges of about that length."""
    sys.path.insert(0, str(HERE.parent / "sample_files"))
    try:
        shape = getattr(importlib.import_module("shapes"), name)
    finally:
        sys.path.pop(0)
    vertices, faces = shape(edge)
    return vertices, faces


SURFACES: dict[str, tuple[float, Callable[[int], Arrays]]] = {
    "shell": (0.67 / 8, make_shell),
    "six_way_joint": (30.0, lambda n: make_sample("six_way_joint", _EDGE_OF_JOINT / np.sqrt(n))),
    "narrow_neck": (25.0, lambda n: make_sample("narrow_neck", _EDGE_OF_NECK / np.sqrt(n))),
}
"""The spacing, and what makes about so many faces."""


def main() -> None:
    """Run the comparison as the command line says."""
    parser = argparse.ArgumentParser(description="Both methods beside their peers.")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the tables between")
    parser.add_argument("--faces", type=int, nargs="+", default=SIZES, help="about how many faces the surfaces have")
    parser.add_argument("--surfaces", nargs="+", default=list(SURFACES), choices=SURFACES)
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS)
    options = parser.parse_args()
    text = report(options.surfaces, options.faces, options.methods)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def report(surfaces: list[str], sizes: list[int], methods: list[str]) -> str:
    """The tables, as Markdown."""
    wanted = [name for name in methods if is_installed(METHODS[name][0])]
    blocks = [f"{machine(wanted)}."]
    missing = [f"{name} ({METHODS[name][0]})" for name in methods if name not in wanted]
    if missing:
        blocks.append(f"Not installed, and left out: {', '.join(missing)}.")
    for surface in surfaces:
        spacing, make = SURFACES[surface]
        meshes = [make(size) for size in sizes]
        results = {name: [run(name, *mesh, spacing) for mesh in meshes] for name in wanted}
        blocks += [f"### {surface}, spacing {spacing:.4g}", tables(results, meshes, spacing)]
    return "\n\n".join(blocks)


def is_installed(package: str) -> bool:
    """Whether a method can run."""
    if package == "weavecore":
        return True
    try:
        version(package)
    except PackageNotFoundError:
        return False
    return True


def run(name: str, vertices: np.ndarray, faces: np.ndarray, spacing: float) -> Result | None:
    """What a worker finds; None where it fails."""
    with tempfile.TemporaryDirectory() as folder:
        given, result = Path(folder) / "mesh.npz", Path(folder) / "result.npz"
        np.savez(given, vertices=vertices, faces=faces, spacing=spacing)
        worker = [sys.executable, str(HERE / "comparison_worker.py"), name, str(given), str(result)]
        threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        paths = {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        done = subprocess.run(worker, env={**os.environ, **threads, **paths}, timeout=_SECONDS, check=False)
        if done.returncode != 0:
            return None
        with np.load(result) as data:
            arrays = {key: data[key] for key in data.files}
    return Result(float(arrays.pop("seconds")), float(arrays.pop("memory")), **arrays)


def tables(results: dict[str, list[Result | None]], meshes: list[Arrays], spacing: float) -> str:
    """Two tables: error, time and memory by size; the polylines by size."""
    heads = [f"{len(faces):,} faces" for _, faces in meshes]
    can = is_installed("pygeodesic")
    exact = [ExactDistance(*mesh) if can and len(mesh[1]) <= MOST_FACES_FOR_EXACT else None for mesh in meshes]
    costs, lines = [], []
    for name, found in results.items():
        error = [_error(e, mesh, result, spacing) for e, mesh, result in zip(exact, meshes, found) if e is not None]
        own = results.get(OWN, [None] * len(found))
        time = [_time(result, first) for result, first in zip(found, own)]
        memory = ["failed" if result is None else f"{result.memory:.0f}" for result in found]
        costs.append([name, *error, *time, *memory])
        lines.append([name, *(_lines(result, spacing) for result in found)])
    measured = [head for head, e in zip(heads, exact) if e is not None]
    columns = [f"error, %: {head}" for head in measured]
    columns += [f"seconds: {head}" for head in heads] + [f"MB: {head}" for head in heads]
    return "\n\n".join(
        [table(["<method", *columns], costs), table(["<polylines / open / not simple / specks", *heads], lines)]
    )


def _error(exact: ExactDistance, mesh: Arrays, result: Result | None, spacing: float) -> str:
    if result is None:
        return "failed"
    percent = 100 * errors(exact, *mesh, result) / spacing
    return f"{percent.mean():.3f} / {np.quantile(percent, 0.99):.2f}"


def _time(result: Result | None, first: Result | None) -> str:
    if result is None:
        return "failed"
    ratio = f" ({result.seconds / first.seconds:.2f}×)" if first is not None else ""
    return f"{result.seconds:.2f}{ratio}"


def _lines(result: Result | None, spacing: float) -> str:
    if result is None:
        return "failed"
    offsets = np.concatenate([[0], np.cumsum(result.counts)])
    size = [np.linalg.norm(np.diff(result.points[i:j], axis=0), axis=1).sum() for i, j in zip(offsets, offsets[1:])]
    n_specks = int((np.array(size) < SPECK * spacing).sum())
    return f"{len(size)} / {int((~result.closed).sum())} / {count_crossed(result)} / {n_specks}"


def machine(methods: list[str]) -> str:
    """What it ran on."""
    packages = sorted({"numpy", "scipy", *(METHODS[name][0] for name in methods)} - {"weavecore"})
    versions = ", ".join(f"{name} {version(name)}" for name in packages)
    return f"Python {platform.python_version()} on {platform.machine()} with {os.cpu_count()} cores; {versions}"


if __name__ == "__main__":
    main()
