"""Offset every sample by both methods, and compare the results.

    pip install -e ".[bench]"
    python benchmarks/fronts.py                          # prints the tables
    python benchmarks/fronts.py --write docs/methods.md  # and writes them to a file
    python benchmarks/fronts.py FILE...                  # other surfaces

Both methods get the same spacing.  The error is that of the points of the polylines, off the cut locus, against an
exact polyhedral solver, in percent of the spacing.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from comparing import AGREED, NARROW, Comparison, compare
from exact import ExactDistance, Places
from weavecore import pipeline
from weavecore.model import Latitudes, SurfaceMesh
from weavecore.validating import validate

SAMPLES = Path(__file__).resolve().parents[1] / "sample_files"
METHODS = ("levels", "fronts")
COLUMNS = (
    "surface",
    "faces",
    "spacing",
    "polylines by generation: levels",
    "fronts",
    "same parents",
    "mean",
    "farthest",
    "farthest outside tongues",
    f"length further than {AGREED:.0%}",
)


def main() -> None:
    """Run the comparison as the command line says."""
    parser = argparse.ArgumentParser(description="Compare both methods of the offset.")
    parser.add_argument("files", type=Path, nargs="*", default=sorted(SAMPLES.glob("*.3dm")))
    parser.add_argument("--write", type=Path, help="Markdown file to write the tables to")
    options = parser.parse_args()
    text = report(options.files)
    print(text)
    if options.write:
        options.write.write_text(text + "\n", encoding="utf-8")


def report(files: list[Path]) -> str:
    """The tables, as Markdown."""
    agreement = [
        f"| {' | '.join(COLUMNS)} |",
        "|---" * len(COLUMNS) + "|",
    ]
    quality = ["| surface | error of levels: mean / p99 | of fronts | seconds: levels | fronts | checks |"]
    quality += ["|---" * 6 + "|"]
    for file in files:
        surface = pipeline.read_surface(file)
        spacing = pipeline.suggest_spacing(surface)
        results, seconds = zip(*(timed(surface, spacing, method) for method in METHODS))
        agreement.append(row_of_agreement(file.stem, results[0], compare(*results)))
        errors = [error_of(latitudes) for latitudes in results]
        checks = ", ".join("pass" if validate(latitudes).holds else "FAIL" for latitudes in results)
        cells = [*map(format_error, errors), *(f"{s:.2f}" for s in seconds), checks]
        quality.append(f"| {file.stem} | " + " | ".join(cells) + " |")
    return "\n".join([*HEADING, *agreement, "", *EXPLANATION, "", *quality, "", *FOOT])


def timed(surface: SurfaceMesh, spacing: float, method: str) -> tuple[Latitudes, float]:
    """The latitudes, and the processor seconds that they took."""
    begin = time.process_time()
    latitudes = pipeline.offset(surface, spacing=spacing, method=method)
    return latitudes, time.process_time() - begin


def row_of_agreement(name: str, latitudes: Latitudes, found: Comparison) -> str:
    """One line of the first table."""
    counts = [" ".join(map(str, row)) for row in found.counts]
    cells = [
        name,
        f"{latitudes.surface.n_faces:,}",
        f"{latitudes.spacing:g}",
        counts[0],
        "the same" if found.same_counts else counts[1],
        "yes" if found.same_parents else "no",
        *(f"{100 * part:.2f}" for part in (found.mean, found.farthest, found.farthest_outside, found.apart)),
    ]
    return "| " + " | ".join(cells) + " |"


def format_error(error: tuple[float, float] | None) -> str:
    """Mean and 99th percentile as text."""
    return "–" if error is None else f"{error[0]:.3f} / {error[1]:.2f}"


def error_of(latitudes: Latitudes) -> tuple[float, float] | None:
    """Mean and 99th percentile of the error off the cut locus, in percent of the spacing; None where there are cuts."""
    surface, lines = latitudes.surface, latitudes.polylines
    if surface.cuts:
        return None
    inner = latitudes.generation[lines.owner] > 0
    exact = ExactDistance(surface.vertices, surface.faces, surface.is_origin)
    distance = latitudes.distance[lines.owner[inner]]
    places = Places(surface.vertices, surface.faces, lines.face[inner], lines.barycentric[inner], distance)
    percent = 100 * exact.errors_at(places) / latitudes.spacing
    return float(percent.mean()), float(np.quantile(percent, 0.99))


HEADING = [
    "# The two methods compared",
    "",
    "Printed by `python benchmarks/fronts.py`, which also says what is measured and how.  The methods are described",
    "in [offset.md](offset.md) (levels) and [fronts.md](fronts.md) (fronts, the paper's front propagation).",
    "",
    "Distances are those between the polylines of one generation, from either side, in percent of the spacing.",
    "",
]
EXPLANATION = [
    f"Where polylines lie more than {AGREED:.0%} of the spacing apart they are at sharp corners, where fronts meet:",
    "",
    "- *levels* has its points on the edges of the mesh, so it cuts such a corner short within a face; *fronts* has",
    "  a point at the corner itself.",
    "- *levels* cuts off tongues and necks less than 6% of the spacing wide; *fronts* keeps them.  (Here a tongue is",
    f"  where two branches of a generation face each other over less than {NARROW:.0%}.)",
    "",
    "For the same reason, at another spacing, a neck of less than that width may be open by one method and closed by",
    "the other.  A pocket about as deep as the least cap (4% of the spacing) may have a ring by one and none by the",
    "other: *levels* takes its depth at vertices, *fronts* offsets it by the least cap and tests whether it vanishes.",
]
FOOT = [
    "The error is in percent of the spacing, off the cut locus; it is not measured on surfaces that were cut.",
    "*Checks* are those of `weavecore.validate`.",
]

if __name__ == "__main__":
    main()
