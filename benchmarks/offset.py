"""Offset a freeform shell at four sizes, beside the heat method and fast marching.

    pip install -e ".[bench]"
    python benchmarks/offset.py                            # prints the tables
    python benchmarks/offset.py --write docs/benchmarks.md # and keeps them

Each method starts from bare arrays and gives the levels of the distance from the borders at the
same eight distances: weavecore its `Latitudes`, the others a distance at the vertices and
marching triangles.  Times are processor seconds, so that other work on the machine counts for
little, and medians of three runs, the methods taking turns.  The error is that of the points of
the levels, off the ridges, against an exact polyhedral solver, in parts of the spacing; the
solver is slow, so the error is taken at the two smaller sizes.
"""

from __future__ import annotations

import argparse
import os
import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np

from exact import ExactDistance
from methods import METHODS, Places
from shell import make_shell

SIZES = (20_000, 70_000, 230_000, 650_000)
MOST_FACES_FOR_EXACT = 100_000
N_LEVELS = 8
DEPTH = 0.67
"""About the distance from the borders at the shell's deepest place."""
ROUNDS = 3
NEXT = "\n# Every stage"
"""What `stages.py` has written behind the tables."""


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Time and error of the offset beside its peers.")
    parser.add_argument("--write", type=Path, help="a Markdown file to keep the tables in")
    parser.add_argument("--faces", type=int, nargs="+", default=SIZES, help="about how many faces the shells have")
    options = parser.parse_args()
    text = report(options.faces)
    print(text)
    if options.write:
        before = options.write.read_text("utf-8") if options.write.exists() else ""
        options.write.write_text("".join([text, "\n", *before.partition(NEXT)[1:]]), encoding="utf-8")


def report(sizes: list[int]) -> str:
    """The tables, as Markdown."""
    faces, seconds, errors = [], [], []
    for size in sizes:
        vertices, triangles = make_shell(size)
        runs = [[method(vertices, triangles, DEPTH / N_LEVELS) for method in METHODS.values()] for _ in range(ROUNDS)]
        faces.append(len(triangles))
        seconds.append([float(np.median([run.seconds for run in column])) for column in zip(*runs)])
        if size <= MOST_FACES_FOR_EXACT:
            errors.append(errors_of([run.places() for run in runs[-1]]))
    return "\n".join(
        [
            "# Offset beside its peers",
            "",
            "Printed by `python benchmarks/offset.py`, which also says what is measured and how.",
            f"{machine()}.",
            "",
            *table_of_seconds(faces, seconds),
            "",
            *table_of_errors(faces, errors),
        ]
    )


def errors_of(places: list[Places]) -> list[tuple[float, float]]:
    """Mean and 99th percentile of the error of each method, in percent of the spacing."""
    solved: dict[int, ExactDistance] = {}  # the peers share a mesh
    errors = []
    for at in places:
        if id(at.faces) not in solved:
            solved[id(at.faces)] = ExactDistance(at.vertices, at.faces)
        percent = 100 * solved[id(at.faces)].errors_at(at) / (DEPTH / N_LEVELS)
        errors.append((float(percent.mean()), float(np.quantile(percent, 0.99))))
    return errors


def table_of_seconds(faces: list[int], seconds: list[list[float]]) -> list[str]:
    """Seconds by size and method, how they compare to weavecore's, and how they grow."""
    lines = ["| processor seconds | " + " | ".join(f"{n:,} faces" for n in faces) + " | growth |"]
    lines += ["|---" * (len(faces) + 2) + "|"]
    ours = np.array([row[0] for row in seconds])
    for name, column in zip(METHODS, np.array(seconds).T):
        cells = [f"{s:.2f} ({s / own:.2f}×)" for s, own in zip(column, ours)]
        growth = f"{np.polyfit(np.log(faces), np.log(column), 1)[0]:.2f}" if len(faces) > 1 else "–"
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {growth} |")
    return [
        *lines,
        "",
        "In brackets the time as a multiple of weavecore's.  *Growth* is the exponent of a power of the number of",
        "faces, fitted to the times.",
    ]


def table_of_errors(faces: list[int], errors: list[list[tuple[float, float]]]) -> list[str]:
    """Mean and 99th percentile of the error by size and method."""
    lines = ["| error, % of spacing: mean / p99 | " + " | ".join(f"{n:,} faces" for n, _ in zip(faces, errors)) + " |"]
    lines += ["|---" * (len(errors) + 1) + "|"]
    for name, cells in zip(METHODS, zip(*errors)):
        lines.append(f"| {name} | " + " | ".join(f"{mean:.3f} / {p99:.2f}" for mean, p99 in cells) + " |")
    return lines


def machine() -> str:
    """What it ran on."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "potpourri3d", "pygeodesic"))
    return f"Python {platform.python_version()} on {platform.machine()} with {os.cpu_count()} cores; {packages}"


if __name__ == "__main__":
    main()
