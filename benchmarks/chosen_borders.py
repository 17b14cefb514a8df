"""Offset the samples from chosen borders only, by both methods, and compare the results with the exact distance.

    pip install -e ".[bench]"
    python benchmarks/chosen_borders.py

Distances start at the first border, or at half of the only one.  The others, or the other half, are free borders, which
cut the polylines.  The error is that of the points of the polylines, off the cut locus, against an exact polyhedral
solver, in percent of the spacing.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from comparing import AGREED, compare
from fronts import METHODS, SAMPLES, error_of, format_error, timed
from weavecore import pipeline
from weavecore.model import SurfaceMesh
from weavecore.model.surface import Origins

COLUMNS = (
    "surface",
    "distances start at",
    "polylines by generation: levels",
    "fronts",
    "same parents",
    "open",
    "mean apart",
    f"length further than {AGREED:.0%}",
    "error of levels: mean / p99",
    "of fronts",
    "seconds: levels",
    "fronts",
)


def main() -> None:
    """Print the table."""
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|")
    for file in sorted(SAMPLES.glob("*.3dm")):
        surface = pipeline.read_surface(file)
        if not surface.is_closed:
            print(row_of(file, *start_partly(surface)), flush=True)


def start_partly(surface: SurfaceMesh) -> tuple[SurfaceMesh, str]:
    """The surface with distances from its first border, or from half of its only one; and a name for the choice."""
    border = surface.borders[0]
    if len(surface.borders) > 1:
        return replace(surface, starts=Origins((border,), np.array([True]))), f"one border of {len(surface.borders)}"
    half = border[: len(border) // 2]
    return replace(surface, starts=Origins((half,), np.array([False]))), "half of the border"


def row_of(file: Path, surface: SurfaceMesh, chosen: str) -> str:
    """One line of the table."""
    spacing = pipeline.suggest_spacing(surface)
    (levels, fronts), seconds = zip(*(timed(surface, spacing, method) for method in METHODS))
    found = compare(levels, fronts)
    counts = [" ".join(map(str, row)) for row in found.counts]
    cells = [
        file.stem,
        chosen,
        counts[0],
        "the same" if found.same_counts else counts[1],
        "yes" if found.same_parents else "no",
        f"{(~fronts.polylines.closed).sum()}",
        f"{100 * found.mean:.2f}",
        f"{100 * found.apart:.2f}",
        *(format_error(error_of(latitudes)) for latitudes in (levels, fronts)),
        *(f"{s:.2f}" for s in seconds),
    ]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
