"""Processor seconds and memory of every stage, from 10,000 faces and 1,000 nodes to a million and 100,000.

    python benchmarks/stages.py --write docs/benchmarks.md   # prints the table, keeps it there and in stages.csv
    python benchmarks/stages.py --beside ../before --write docs/benchmarks.md
    python benchmarks/stages.py --scan --skip 4              # the largest noisy scan with holes, not the smooth shell
    python benchmarks/stages.py --sizes 3 --check            # says what is slower than in the last run kept

Each size runs in a process of its own, which reads the surface from a binary ``.ply``; a stage that is not done within
``--minutes`` in all is left out, and one that is refused shows the code of its error.  *Memory* is the most that the
process has held up to the end of the stage.  *Growth* is the exponent of a power of the number of nodes, fitted to the
times from the second size on; of reading and the offset, of the number of faces.  The checkout beside takes its turn
right after ours, size by size.
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
import tempfile
import time
from pathlib import Path

from shell import make_scan, make_shell, write_ply

ROOT = Path(__file__).resolve().parents[1]
KEPT = Path(__file__).with_name("stages.csv")
BEGIN, END = "<!-- stages -->", "<!-- end of stages -->"
SIZES = ((10_000, 1_000), (30_000, 4_000), (100_000, 15_000), (300_000, 40_000), (1_000_000, 100_000))
"""Faces and nodes, about."""

STAGES = ("read", "offset", "link", "weave", "JSON", "3dm", "picture", "page", "fabricate")
BY_FACES = ("read", "offset")
"""Stages whose growth is over the faces."""

COLUMNS = ("date", "version", "faces", "nodes", "stage", "seconds", "memory_mb")
SLOWER = 1.3
"""A stage whose part of the whole has grown by this factor is reported."""

WORKER = """
import json, resource, sys, tempfile, time, warnings
warnings.simplefilter("ignore")
from dataclasses import replace
from pathlib import Path
from weavecore import pipeline
from weavecore.errors import WeaveError
count, is_told = 0, False
def told(name, work):
    begin = time.process_time()
    row = {"stage": name}
    try:
        value = work()
    except WeaveError as error:
        value, row["refused"] = None, error.code
    row["seconds"] = time.process_time() - begin
    row["memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    if is_told:
        print(json.dumps({**row, "nodes": count}), flush=True)
    if value is None and name in ("read", "offset", "link", "weave"):
        raise SystemExit(0)
    return value
def run(path, nodes, folder):
    global count
    folder.mkdir()
    surface = replace(told("read", lambda: pipeline.read_surface(path)), unit="Millimeters")  # a .ply has none
    spacing = (surface.area / nodes * 0.87) ** 0.5
    latitudes = told("offset", lambda: pipeline.offset(surface, spacing=spacing))
    lattice = told("link", lambda: pipeline.link(latitudes))
    count = lattice.n_nodes
    weave = told("weave", lambda: pipeline.weave(lattice))
    for name, ending in (("JSON", ".json"), ("3dm", ".3dm"), ("picture", ".png"), ("page", ".html")):
        told(name, lambda: pipeline.export(weave, folder / ("woven" + ending)))
    told("fabricate", lambda: pipeline.fabricate(weave, folder / "workshop"))
with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    run(Path(sys.argv[1]), 100, folder / "small")
    is_told = True
    run(Path(sys.argv[2]), int(sys.argv[3]), folder / "large")
"""

Row = dict[str, str]


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Processor seconds and memory of every stage over size.")
    parser.add_argument("--sizes", type=int, default=len(SIZES), help="how many of the sizes, the smallest first")
    parser.add_argument("--skip", type=int, default=0, help="how many of the smallest are left out")
    parser.add_argument("--minutes", type=float, default=30.0, help="of elapsed time, in all")
    parser.add_argument("--scan", action="store_true", help="a noisy scan with holes instead of the smooth shell")
    parser.add_argument("--beside", type=Path, help="another checkout, whose table is printed below ours")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    parser.add_argument("--check", action="store_true", help="compare with the last run kept; status 1 where slower")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    runs: dict[Path, list[list[Row]]] = {one: [] for one in (ROOT, options.beside) if one}
    for faces, nodes in SIZES[options.skip : options.sizes]:
        for checkout, rows in runs.items():
            rows.append(measured(checkout, faces, nodes, options.scan, end))
    text = "\n\n".join(report(rows, checkout, options.scan) for checkout, rows in runs.items())
    print(text)
    if options.check:
        slower = slower_stages(runs[ROOT], kept_rows())
        print("\n".join(slower) or "No stage is slower.")
        raise SystemExit(bool(slower))
    if options.write:
        if not options.scan:
            keep(runs[ROOT])
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def measured(checkout: Path, faces: int, nodes: int, is_scan: bool, end: float) -> list[Row]:
    """A row for each stage of one size that was done before the end of the time."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve()), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.update(dict.fromkeys(names, "2"))
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{n}.ply" for n in (2_000, faces)]
        for n, path in zip((2_000, faces), paths):
            vertices, triangles = (make_scan if is_scan else make_shell)(n)
            write_ply(path, vertices * 1200.0, triangles)
        try:
            run = subprocess.run(
                [sys.executable, "-c", WORKER, *map(str, paths), str(nodes)],
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
    stated = {"date": dt.date.today().isoformat(), "version": version(checkout)}
    return [
        {
            **stated,
            "faces": str(faces),
            "nodes": str(n_nodes),
            "stage": one["stage"],
            "seconds": one.get("refused") or f"{one['seconds']:.3f}",
            "memory_mb": f"{one['memory_mb']:.0f}",
        }
        for one in found
    ]


def version(checkout: Path) -> str:
    """The commit that is checked out, as far as git knows it."""
    run = subprocess.run(["git", "describe", "--always"], cwd=checkout, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "unknown"


def is_done(row: Row) -> bool:
    """Whether the stage was not refused."""
    return row["seconds"][0].isdigit()


def report(runs: list[list[Row]], checkout: Path, is_scan: bool) -> str:
    """The table, as Markdown."""
    names = [f"{int(run[0]['nodes']):,} nodes, {int(run[0]['faces']):,} faces" for run in runs if run]
    command = "python benchmarks/stages.py" + (" --scan" if is_scan else "")
    lines = [
        f"{dt.date.today().isoformat()}, `{command}`, commit {version(checkout)}: processor seconds, and memory in MB.",
        "",
        "| stage | " + " | ".join(names) + " | growth |",
        "|---" * (len(names) + 2) + "|",
    ]
    for stage in STAGES:
        rows = [next((row for row in run if row["stage"] == stage), None) for run in runs if run]
        known = [row for row in rows[1:] if row and is_done(row)]
        growth = f"{exponent(known, 'faces' if stage in BY_FACES else 'nodes'):.2f}" if len(known) > 1 else ""
        lines.append(f"| {stage} | " + " | ".join(map(cell, rows)) + f" | {growth} |")
    return "\n".join(lines)


def cell(row: Row | None) -> str:
    """What the table says of one stage at one size."""
    if row is None:
        return "not done"
    return f"{float(row['seconds']):.2f} ({int(row['memory_mb']):,})" if is_done(row) else row["seconds"]


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
        writer.writerows(row for run in runs for row in run if is_done(row))


def slower_stages(runs: list[list[Row]], before: list[Row]) -> list[str]:
    """What takes a larger part of the whole than before, for each size that both have."""
    found = []
    for run in runs:
        now = {row["stage"]: float(row["seconds"]) for row in run if is_done(row)}
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
