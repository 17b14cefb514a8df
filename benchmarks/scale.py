"""Processor seconds of every stage over the size of the surface and of the lattice, beside another checkout.

    python benchmarks/scale.py --write docs/scale.md             # prints the table and keeps it
    python benchmarks/scale.py --beside ../before --write docs/scale.md

Each size runs in a process of its own, with ``PYTHONPATH`` set to the checkout; the one beside takes its turn right
after ours, so that both see the same machine.  The surface is the shell of the benchmarks.  *Growth* is the exponent of
a power of the number of nodes, fitted to the times.  BLAS has two threads, unless ``--threads`` says otherwise.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import math
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BEGIN, END = "<!-- scale -->", "<!-- end of scale -->"
STAGES = ("offset", "link", "weave")
SIZES = ((20_000, 1_000), (60_000, 4_000), (100_000, 15_000))
"""Faces and nodes, about."""

WORKER = """
import json, resource, sys, time
sys.path.insert(0, sys.argv[1])
from shell import make_shell
from weavecore import pipeline
faces, nodes = int(sys.argv[2]), int(sys.argv[3])
surface = pipeline.surface_from(make_shell(faces))
spacing = (surface.area / nodes * 0.87) ** 0.5
pipeline.weave(pipeline.link(pipeline.offset(surface, spacing=8 * spacing)))
value, seconds = surface, {}
for name in ("offset", "link", "weave"):
    begin = time.process_time()
    value = getattr(pipeline, name)(value, **({"spacing": spacing} if name == "offset" else {}))
    seconds[name] = time.process_time() - begin
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"faces": surface.n_faces, "nodes": value.lattice.n_nodes, "memory": memory, **seconds}))
"""


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Processor seconds of every stage over size.")
    parser.add_argument("--beside", type=Path, help="another checkout, whose times are printed in brackets")
    parser.add_argument("--sizes", type=int, default=len(SIZES), help="how many of the sizes, the smallest first")
    parser.add_argument("--threads", type=int, default=2, help="threads of BLAS")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    options = parser.parse_args()
    rows = []
    for faces, nodes in SIZES[: options.sizes]:
        checkouts = [ROOT, options.beside] if options.beside else [ROOT]
        rows.append([measured(checkout, faces, nodes, options.threads) for checkout in checkouts])
        print(rows[-1], file=sys.stderr)
    text = report(rows)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def measured(checkout: Path, faces: int, nodes: int, threads: int) -> dict[str, float]:
    """Figures of one size with one checkout."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, "PYTHONPATH": str(checkout), **dict.fromkeys(names, str(threads))}
    command = [sys.executable, "-c", WORKER, str(ROOT / "benchmarks"), str(faces), str(nodes)]
    run = subprocess.run(command, env=environment, cwd="/", check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(run.stdout.splitlines()[-1])
    return found


def report(rows: list[list[dict[str, float]]]) -> str:
    """The table, as Markdown."""
    sizes = [f"{row[0]['nodes']:,.0f} nodes, {row[0]['faces']:,.0f} faces" for row in rows]
    lines = [
        f"{dt.date.today().isoformat()}, `python benchmarks/scale.py`.",
        "",
        "| processor seconds | " + " | ".join(sizes) + " | growth |",
        "|---" * (len(rows) + 2) + "|",
    ]
    for name in (*STAGES, "memory"):
        cells = [
            f"{row[0][name]:.2f}" + "".join(f" ({one[name]:.2f}, {one[name] / row[0][name]:.1f}×)" for one in row[1:])
            if name != "memory"
            else f"{row[0][name]:,.0f} MB"
            for row in rows
        ]
        growth = "" if name == "memory" or len(rows) < 2 else f"{exponent(rows, name):.2f}"
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {growth} |")
    return "\n".join(lines)


def exponent(rows: list[list[dict[str, float]]], name: str) -> float:
    """Slope of the logarithm of the time over that of the nodes, by least squares."""
    points = [(math.log(row[0]["nodes"]), math.log(row[0][name])) for row in rows]
    x, y = (sum(values) / len(points) for values in zip(*points))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


if __name__ == "__main__":
    main()
