"""How rods bend on surfaces that nobody tuned for: those of ``tests/sweep.py``, drawn by name and seed.

    python benchmarks/bending_sweep.py                                       # prints quantiles over 60 surfaces
    python benchmarks/bending_sweep.py --count 60 --write docs/bending.md    # and keeps them there

Every surface is scaled to a diagonal of 600 mm and woven in one pattern, by turns, at the spacing and in the stock
diameter that weavecore chooses.  The figures are those of ``benchmarks/bending.py``; *hidden* rods are those that
exceed the allowed radius by the written axes and not by the program.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from bending import _room, _turns
from weavecore import pipeline
from weavecore.errors import WeaveError
from weavecore.model import Weave
from weavecore.model.rod_ends import FEWEST_JOINTS

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "sample_files")]

from tough_surfaces import TOUGH  # noqa: E402

PATTERNS = ("triangular", "plain", "kagome")
BEGIN, END = "<!-- sweep -->", "<!-- end of sweep -->"
DIAGONAL = 600.0
TENTHS = (0.0, 0.1, 0.5, 0.9, 1.0)

ROUNDING = 1.01
"""A radius that falls short of the allowed one by less is not hidden: that much the points of the tables round it."""

FIGURES = (
    "bendable, %",
    "hidden",
    "turns above 45°",
    "sharpest turn, °",
    "stubs, %",
    "ends inside, % of rods",
    "edges",
    "conflicts",
)


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Bending on tough surfaces.")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=71000, help="even: spacings are those that are suggested")
    parser.add_argument("--minutes", type=float, default=60.0, help="no surface is begun later than this")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    options = parser.parse_args()
    text = report(options)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def report(options: argparse.Namespace) -> str:
    """The quantiles, as Markdown."""
    rows: dict[str, list[list[float]]] = {pattern: [] for pattern in PATTERNS}
    refused, begun = [], time.perf_counter()
    for k in range(options.count):
        if time.perf_counter() - begun > 60 * options.minutes:
            break
        name, seed, pattern = sorted(TOUGH)[k % len(TOUGH)], options.seed + 2 * k, PATTERNS[k % len(PATTERNS)]
        try:
            found = figures(woven(name, seed, pattern))
        except WeaveError as error:
            refused.append(f"{name} ({type(error).__name__})")
            continue
        rows[pattern].append(found)
        print(name, seed, pattern, " ".join(f"{x:.1f}" for x in found), file=sys.stderr, flush=True)
    lines = ["| pattern | surfaces | figure | least | 10 % | median | 90 % | most |", "|---|---:|---|" + "---:|" * 5]
    for pattern, found in rows.items():
        if found:
            spread = np.quantile(np.array(found), TENTHS, axis=0).T
            for figure, values in zip(FIGURES, spread):
                lines.append(
                    f"| {pattern} | {len(found)} | {figure} | " + " | ".join(f"{value:.1f}" for value in values) + " |"
                )
    lines += ["", f"Refused: {', '.join(refused) or 'none'}."]
    return "\n".join(lines)


def woven(name: str, seed: int, pattern: str) -> Weave:
    """A tough surface, scaled and woven at the suggested spacing."""
    surface = pipeline.surface_from(TOUGH[name](seed))
    scaled = replace(surface, vertices=surface.vertices * DIAGONAL / surface.size, unit="Millimeters")
    return pipeline.weave(pipeline.link(pipeline.offset(scaled), pattern=pattern))


def figures(weave: Weave) -> list[float]:
    """One number for each of `FIGURES`."""
    room, turns = _room(weave), np.degrees(_turns(weave))
    joints = np.bincount(weave.joints.strand, minlength=len(weave))
    edges = weave.lattice.edge_lengths
    hidden = (room * ROUNDING < 1.0) & (weave.bending.utilisation <= 1.0)
    return [
        100 * float((room >= 1.0 / ROUNDING).mean()),
        float(hidden.sum()),
        float((turns > 45.0).sum()),
        float(turns.max(initial=0.0)),
        100 * float((joints < FEWEST_JOINTS).mean()),
        100 * weave.n_ends_inside / len(weave),
        float(edges.max() / edges.min()),
        float(len(weave.conflicts)),
    ]


if __name__ == "__main__":
    main()
