"""Weave and fabricate every sample in every pattern, and tell what a workshop would ask.

    python benchmarks/weaves.py                              # prints the table
    python benchmarks/weaves.py --write docs/fabrication.md  # and keeps it there, between two comments
    python benchmarks/weaves.py --checks sample_files/README.md  # a table of the checks that fail, kept there

Spacing and rods are those that weavecore chooses; stock is 6 m, spliced by overlaps.  *Node off* is how far the nodes
that are rebuilt from the marks and axes alone lie from where they should, at most.  Times are of making the
tables and their report, with the templates for the last column.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from weavecore import pipeline
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.folder_reader import WrittenFolder
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import fabricate_weave
from weavecore.model import Weave
from weavecore.units import millimetres_in
from weavecore.weaving.sequence import find_sequence

SAMPLES = ("shell_2400x1600", "hemisphere", "narrow_neck", "six_way_joint", "minimal_surface")
PATTERNS = ("triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal")
ALL_SAMPLES = (*SAMPLES, "hourglass", "handle", "closed_body")
FOLDER = Path(__file__).resolve().parents[1] / "sample_files"
BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"
SHORT = {"rods_that_clash": "clash"}
RODS = ("strands", "median, mm", "ends inside", "conflicts", "least radius, mm")
CUTTING = ("pieces", "splices", "bars", "waste, %", "node off, mm", "s", "s with templates")
COLUMNS = (*RODS, *CUTTING)


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Figures of every sample in every pattern.")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    parser.add_argument("--samples", nargs="+", default=SAMPLES, choices=SAMPLES)
    parser.add_argument("--patterns", nargs="+", default=PATTERNS, choices=PATTERNS)
    parser.add_argument("--checks", type=Path, help="write a table of failed checks to such a file instead")
    options = parser.parse_args()
    text = checks() if options.checks else report(options.samples, options.patterns)
    print(text)
    target = options.checks or options.write
    if target:
        whole = target.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        target.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def checks() -> str:
    """A table of the checks that fail in the default run of every sample and pattern, as Markdown."""
    lines = ["| sample | " + " | ".join(PATTERNS) + " |", "|---" * (len(PATTERNS) + 1) + "|"]
    for name in ALL_SAMPLES:
        surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
        latitudes = pipeline.offset(surface)
        cells = []
        for pattern in PATTERNS:
            weave = pipeline.weave(pipeline.link(latitudes, pattern=pattern))
            source = Source("", "", weave.over_under, weave.lattice.pattern)
            scale = millimetres_in(surface.unit)
            made = fabricate_weave(weave, find_sequence(weave), scale=scale, workshop=Workshop(), source=source)
            found = [f"{one.value:g} {SHORT.get(one.invariant, one.invariant)}" for one in made.failed]
            cells.append(", ".join(found) or "passed")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def report(samples: list[str], patterns: list[str]) -> str:
    """The table, as Markdown."""
    lines = ["| sample | pattern | " + " | ".join(COLUMNS) + " |", "|---|---|" + "---:|" * len(COLUMNS)]
    for name in samples:
        surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
        latitudes = pipeline.offset(surface)
        for pattern in patterns:
            weave = pipeline.weave(pipeline.link(latitudes, pattern=pattern))
            lines.append(f"| {name} | {pattern} | " + " | ".join(figures(weave)) + " |")
    return "\n".join(lines)


def figures(weave: Weave) -> list[str]:
    """One row of the table."""
    scale = millimetres_in(weave.lattice.latitudes.surface.unit)
    sequence = find_sequence(weave)
    source = Source("", "", weave.over_under, weave.lattice.pattern)
    seconds = []
    for workshop in (Workshop(templates=()), Workshop()):
        start = time.process_time()
        made = fabricate_weave(weave, sequence, scale=scale, workshop=workshop, source=source)
        seconds.append(time.process_time() - start)
    folder = WrittenFolder(made.files)
    return [
        str(len(weave)),
        f"{weave.median_length * scale:.0f}",
        str(weave.n_ends_inside),
        str(len(weave.conflicts)),
        f"{weave.bending.min_radius.min() * scale:.0f}",
        str(len(folder.table("pieces"))),
        str(len(folder.table("splices"))),
        str(len(folder.table("nesting"))),
        f"{made['waste_pct'].value:.1f}",
        f"{made['node_rebuilt_off_mm'].value:.4f}",
        *(f"{second:.1f}" for second in seconds),
    ]


if __name__ == "__main__":
    main()
