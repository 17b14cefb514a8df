"""Processor seconds and memory of every stage, from 10,000 faces and 1,000 nodes to a million and 100,000.

    python benchmarks/stages.py --write docs/benchmarks.md   # prints the table, keeps it there and in stages.csv
    python benchmarks/stages.py --sizes 3 --check            # says what is slower than in the last run kept

Each size runs in a process of its own, on the shell of the benchmarks; a stage that is not done within ``--minutes``
in all is left out.  *Memory* is the most that the process has held up to the end of the stage.  *Growth* is the
exponent of a power of the number of nodes, fitted to the times from the second size on; of the offset, of the number
of faces.
A load of the machine lengthens all times of a run alike, so that ``--check`` compares shares of the whole.
"""

from __future__ import annotations

import argparse
import csv
import datetime as dt
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KEPT = Path(__file__).with_name("stages.csv")
BEGIN, END = "<!-- stages -->", "<!-- end of stages -->"
SIZES = ((10_000, 1_000), (30_000, 4_000), (100_000, 15_000), (300_000, 40_000), (1_000_000, 100_000))
"""Faces and nodes, about."""

STAGES = ("offset", "link", "weave", "JSON", "3dm", "picture", "page", "fabricate")
COLUMNS = ("date", "version", "faces", "nodes", "stage", "seconds", "memory_mb")
SLOWER = 1.3
"""A stage whose part of the whole has grown by this factor is reported."""

WORKER = """
import json, resource, sys, tempfile, time, warnings
sys.path.insert(0, sys.argv[1])
warnings.simplefilter("ignore")
from pathlib import Path
from shell import make_shell
from weavecore import pipeline
faces, nodes = int(sys.argv[2]), int(sys.argv[3])
vertices, triangles = make_shell(faces)
surface = pipeline.surface_from((vertices * 1200.0, triangles), unit="Millimeters")
spacing = (surface.area / nodes * 0.87) ** 0.5
small = pipeline.weave(pipeline.link(pipeline.offset(surface, spacing=10 * spacing)))
folder = Path(tempfile.mkdtemp())
def told(name, work):
    begin = time.process_time()
    value = work()
    seconds = time.process_time() - begin
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"stage": name, "seconds": seconds, "memory_mb": memory, "nodes": count}), flush=True)
    return value
count = 0
latitudes = told("offset", lambda: pipeline.offset(surface, spacing=spacing))
lattice = told("link", lambda: pipeline.link(latitudes))
count = lattice.n_nodes
weave = told("weave", lambda: pipeline.weave(lattice))
for name, ending in (("JSON", ".json"), ("3dm", ".3dm"), ("picture", ".png"), ("page", ".html")):
    told(name, lambda: pipeline.export(weave, folder / ("woven" + ending)))
told("fabricate", lambda: pipeline.fabricate(weave, folder / "workshop"))
"""

Row = dict[str, str]


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Processor seconds and memory of every stage over size.")
    parser.add_argument("--sizes", type=int, default=len(SIZES), help="how many of the sizes, the smallest first")
    parser.add_argument("--minutes", type=float, default=20.0, help="of elapsed time, in all")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    parser.add_argument("--check", action="store_true", help="compare with the last run kept; status 1 where slower")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    stated = {"date": dt.date.today().isoformat(), "version": version()}
    runs = [measured(faces, nodes, stated, end) for faces, nodes in SIZES[: options.sizes]]
    print(report(runs))
    if options.check:
        slower = slower_stages(runs, kept_rows())
        print("\n".join(slower) or "No stage is slower.")
        raise SystemExit(bool(slower))
    if options.write:
        keep(runs)
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{report(runs)}\n\n{END}{after}", encoding="utf-8")


def measured(faces: int, nodes: int, stated: Row, end: float) -> list[Row]:
    """A row for each stage of one size that was done before the end of the time, with what is stated of the run."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", WORKER, str(ROOT / "benchmarks"), str(faces), str(nodes)]
    try:
        run = subprocess.run(
            command,
            env=environment,
            cwd="/",
            stdout=subprocess.PIPE,
            check=False,
            timeout=max(end - time.monotonic(), 1.0),
        )
        lines = run.stdout
    except subprocess.TimeoutExpired as late:
        lines = late.stdout or b""
    found = [json.loads(line) for line in lines.decode().splitlines()]
    n_nodes = max([one["nodes"] for one in found], default=0) or nodes
    size = {"faces": str(faces), "nodes": str(n_nodes)}
    return [
        {
            **stated,
            **size,
            "stage": one["stage"],
            "seconds": f"{one['seconds']:.3f}",
            "memory_mb": f"{one['memory_mb']:.0f}",
        }
        for one in found
    ]


def version() -> str:
    """The commit that is checked out, as far as git knows it."""
    run = subprocess.run(["git", "describe", "--always"], cwd=ROOT, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "unknown"


def report(runs: list[list[Row]]) -> str:
    """The table, as Markdown."""
    names = [f"{int(run[0]['nodes']):,} nodes, {int(run[0]['faces']):,} faces" for run in runs if run]
    lines = [
        f"{dt.date.today().isoformat()}, `python benchmarks/stages.py`: processor seconds, and memory in MB.",
        "",
        "| stage | " + " | ".join(names) + " | growth |",
        "|---" * (len(names) + 2) + "|",
    ]
    for stage in STAGES:
        rows = [next((row for row in run if row["stage"] == stage), None) for run in runs if run]
        cells = [f"{float(row['seconds']):.2f} ({int(row['memory_mb']):,})" if row else "not done" for row in rows]
        known = [row for row in rows[1:] if row]
        growth = f"{exponent(known, 'faces' if stage == 'offset' else 'nodes'):.2f}" if len(known) > 1 else ""
        lines.append(f"| {stage} | " + " | ".join(cells) + f" | {growth} |")
    return "\n".join(lines)


def exponent(rows: list[Row], size: str) -> float:
    """Slope of the logarithm of the time over that of the size, by least squares."""
    points = [(math.log(float(row[size])), math.log(float(row["seconds"]))) for row in rows]
    x, y = (sum(values) / len(points) for values in zip(*points))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


def kept_rows() -> list[Row]:
    """The last row that was kept of every size and stage."""
    if not KEPT.exists():
        return []
    with KEPT.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    return list({(row["faces"], row["stage"]): row for row in rows}.values())


def keep(runs: list[list[Row]]) -> None:
    """Append the rows to the file of all runs."""
    is_new = not KEPT.exists()
    with KEPT.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerows(row for run in runs for row in run)


def slower_stages(runs: list[list[Row]], before: list[Row]) -> list[str]:
    """What takes a larger part of the whole than before, for each size that both have."""
    found = []
    for run in runs:
        now = {row["stage"]: float(row["seconds"]) for row in run}
        then = {row["stage"]: float(row["seconds"]) for row in before if run and row["faces"] == run[0]["faces"]}
        both = [stage for stage in STAGES if stage in now and stage in then]
        load = sum(now[stage] for stage in both) / max(sum(then[stage] for stage in both), 1e-9)
        for stage in both:
            ratio = now[stage] / then[stage] / load
            if ratio > SLOWER:
                found.append(f"{stage} at {run[0]['faces']} faces: {ratio:.2f} times its part of the run before")
    return found


if __name__ == "__main__":
    main()
