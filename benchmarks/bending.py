"""Whether the rods of every sample and pattern can be bent to their places, in the diameter that weavecore chooses.

    python benchmarks/bending.py                          # prints the table
    python benchmarks/bending.py --write docs/bending.md  # and keeps it there, between two comments

*Bendable* is measured on the written axes alone: the circle through three points in a row of ``axes.csv`` against the
allowed radius.  *Turn* is the sharpest turn of a rod at a joint, as its chords turn; a *stub* has three joints or
fewer; *edges* is the longest edge of the lattice over the shortest.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from weavecore import pipeline
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.folder_reader import WrittenFolder
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import fabricate_weave
from weavecore.model import Weave
from weavecore.model.rod_ends import FEWEST_JOINTS
from weavecore.units import millimetres_in
from weavecore.weaving.sequence import find_sequence

FOLDER = Path(__file__).resolve().parents[1] / "sample_files"
PATTERNS = ("triangular", "plain", "kagome")
BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"
COLUMNS = (
    "rods",
    "ends inside",
    "diameter, mm",
    "bendable, %",
    "least radius / allowed",
    "sharpest turn, °",
    "stubs, %",
    "edges",
    "conflicts",
    "clashes",
    "s",
)


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Bending of every sample in every pattern.")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    parser.add_argument("--patterns", nargs="+", default=PATTERNS)
    options = parser.parse_args()
    text = report(options.patterns)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def report(patterns: list[str]) -> str:
    """The table, as Markdown."""
    lines = ["| sample | pattern | " + " | ".join(COLUMNS) + " |", "|---|---|" + "---:|" * len(COLUMNS)]
    for path in sorted(FOLDER.glob("*.3dm")):
        latitudes = pipeline.offset(pipeline.read_surface(path))
        for pattern in patterns:
            began = time.perf_counter()
            weave = pipeline.weave(pipeline.link(latitudes, pattern=pattern))
            seconds = time.perf_counter() - began
            lines.append(f"| {path.stem} | {pattern} | " + " | ".join([*figures(weave), f"{seconds:.1f}"]) + " |")
    return "\n".join(lines)


def figures(weave: Weave) -> list[str]:
    """One row of the table without the time."""
    room = _room(weave)
    joints = np.bincount(weave.joints.strand, minlength=len(weave))
    edges = weave.lattice.edge_lengths
    return [
        str(len(weave)),
        str(weave.n_ends_inside),
        f"{weave.rod_diameter * millimetres_in(weave.lattice.latitudes.surface.unit):g}",
        f"{100 * (room >= 1.0).mean():.1f}",
        f"{room.min():.2f}",
        f"{np.degrees(_turns(weave).max(initial=0.0)):.0f}",
        f"{100 * (joints < FEWEST_JOINTS).mean():.1f}",
        f"{edges.max() / edges.min():.1f}",
        str(len(weave.conflicts)),
        str(len(weave.clashes)),
    ]


def _room(weave: Weave) -> np.ndarray:
    """(S,) least radius over allowed radius of every rod, from the written tables."""
    scale = millimetres_in(weave.lattice.latitudes.surface.unit)
    source = Source("", "", weave.over_under, weave.lattice.pattern)
    made = fabricate_weave(weave, find_sequence(weave), scale=scale, workshop=Workshop(templates=()), source=source)
    folder = WrittenFolder(made.files)
    rods, axes = folder.table("rods"), folder.axes
    allowed = rods.floats("allowed_radius")
    room = np.full(len(allowed), np.inf)
    for k, name in enumerate(rods["rod_id"]):
        points = axes.points[axes.rod(axes.rod_of[name])]
        if rods["closed"][k] == "yes":
            points = np.concatenate([points[-2:-1], points])
        a, b, c = points[:-2], points[1:-1], points[2:]
        sides = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - b, axis=1) * np.linalg.norm(c - a, axis=1)
        curvature = 2.0 * np.linalg.norm(np.cross(b - a, c - a), axis=1) / sides
        if curvature.max(initial=0.0) > 0:
            room[k] = 1.0 / (curvature.max() * allowed[k])
    return room


def _turns(weave: Weave) -> np.ndarray:
    """(n,) angle between the chords of every rod at its joints."""
    strands, nodes = weave.strands, weave.lattice.nodes
    found = [np.zeros(0)]
    for s in range(len(strands)):
        path = strands.strand(s)
        if strands.closed[s]:
            path = np.concatenate([path, path[:2]])
        along = np.diff(nodes[path], axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        found.append(np.arccos(np.clip((along[1:] * along[:-1]).sum(1), -1.0, 1.0)))
    return np.concatenate(found)


if __name__ == "__main__":
    main()
