"""A few hundred models woven with the defaults, each in a process of its own: seconds, memory, and what came out.

    python benchmarks/models.py --seeds 6 --files FOLDER --write docs/models.md

Models are the samples, the meshes in the folders of ``--files``, the tough surfaces of the tests with several seeds,
and messy exports of them.  All go from the mesh or file to the weave in the triangular pattern.  Seconds are of the
processor.  The table has a row for each generator; ``docs/models.csv`` has one for each model.  Needs a system with
``fork``.
"""

# ruff: noqa: E402  a script: the folders of the tests are put on the path before they are imported

from __future__ import annotations

import argparse
import csv
import multiprocessing
import resource
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "sample_files")]

from messy_exports import MESSES
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import WeaveError
from weavecore.validating import validate

BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"
LONGEST = 600.0
"""Elapsed seconds after which a model is ended, and counts as hung."""
FIELDS = ("model", "seed", "faces", "outcome", "said", "nodes", "seconds", "megabytes")


@dataclass(frozen=True)
class Model:
    """What is woven: its generator or file, a seed, and how it is read."""

    name: str
    seed: int
    read: Callable[[], Any]


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=6, help="how many of each generator")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--minutes", type=float, default=np.inf, help="after so many no other model is begun")
    parser.add_argument("--files", type=Path, nargs="*", default=[], help="folders with meshes")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    options = parser.parse_args()
    rows, began = [], time.monotonic()
    for model in models(options):
        if time.monotonic() - began > 60.0 * options.minutes:
            break
        rows.append(run(model))
        print(",".join(str(rows[-1][field]) for field in FIELDS), flush=True)
    text = table(rows)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")
        with options.write.with_suffix(".csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, FIELDS)
            writer.writeheader()
            writer.writerows(rows)


def models(options: argparse.Namespace) -> Iterator[Model]:
    """All models, in order."""
    for folder in (ROOT / "sample_files", *options.files):
        for path in sorted(folder.iterdir()):
            if path.suffix in (".3dm", ".obj", ".off", ".ply", ".stl"):
                yield Model(f"file: {path.name}", 0, lambda path=path: pipeline.read_surface(path))
    for seed in range(options.first, options.first + options.seeds):
        for name in TOUGH:
            yield Model(name, seed, lambda name=name, seed=seed: pipeline.surface_from(TOUGH[name](seed)))
        for number, name in enumerate(MESSES):
            base = list(TOUGH)[(seed * len(MESSES) + number) % len(TOUGH)]
            yield Model(f"messy: {name}", seed, lambda name=name, base=base, seed=seed: messy(name, base, seed))


def messy(name: str, base: str, seed: int) -> Any:
    """A tough surface as an exporter leaves it."""
    vertices, faces = MESSES[name].spoil(*TOUGH[base](seed), np.random.default_rng([seed, *name.encode()]))
    return pipeline.surface_from((vertices, TOUGH[base](seed)[1] if faces is None else faces))


def run(model: Model) -> dict[str, Any]:
    """A row: a model woven in a process of its own."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=weave, args=(model, there))
    child.start()
    there.close()
    row = dict.fromkeys(FIELDS, "") | {"model": model.name, "seed": model.seed, "outcome": "hung"}
    try:
        if here.poll(LONGEST):
            row.update(here.recv())
    except EOFError:
        row["outcome"] = "killed"
    child.kill()
    child.join()
    return row


def weave(model: Model, answer: Any) -> None:
    """From a mesh to the weave; sends what came out."""
    began, row = time.process_time(), {}
    try:
        surface = model.read()
        row["faces"] = surface.n_faces
        latitudes = pipeline.offset(surface)
        woven = pipeline.weave(pipeline.link(latitudes))
        row["nodes"] = woven.lattice.n_nodes
        row.update(judge(woven))
    except WeaveError as error:
        row.update(outcome="typed", said=error.code)
    except Exception as error:  # noqa: BLE001  a crash is a result here
        place = traceback.extract_tb(error.__traceback__)[-1]
        row.update(outcome="crashed", said=f"{type(error).__name__} in {Path(place.filename).name}:{place.lineno}")
    row["seconds"] = round(time.process_time() - began, 2)
    row["megabytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    answer.send(row)


def judge(woven: Any) -> dict[str, str]:
    """Whether a weave keeps its promises, and what is noted."""
    lattice = woven.lattice
    reports = (validate(lattice.latitudes), validate(lattice), validate(woven.strands, lattice=lattice))
    broken = [finding.name for report in reports for finding in report if not finding.holds]
    doubts = sorted({note.code for note in lattice.latitudes.surface.notes if note.is_doubt})
    if broken:
        return {"outcome": "broken and noted" if "COARSE" in doubts else "broken", "said": " ".join(broken)}
    return {"outcome": "woven with a doubt" if doubts else "woven", "said": " ".join(doubts)}


def table(rows: list[dict[str, Any]]) -> str:
    """A line for each generator, and one for all, as Markdown."""
    lines = [
        "| model | number | faces | outcomes | seconds, median | longest | MB, most |",
        "|---|---:|---:|---|---:|---:|---:|",
    ]
    names = list(dict.fromkeys(row["model"] for row in rows))
    for name in [*names, None]:
        chosen = [row for row in rows if name in (None, row["model"])]
        outcomes = Counter(
            f"{row['outcome']} {row['said']}" if row["outcome"] == "typed" else row["outcome"] for row in chosen
        )
        told = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items(), key=lambda item: -item[1]))
        keys = ("faces", "seconds", "megabytes")
        faces, seconds, memory = ([row[key] for row in chosen if row[key] != ""] for key in keys)
        span = f"{min(faces):,} to {max(faces):,}" if faces else "–"
        figures = f"{np.median(seconds):.1f} | {max(seconds):.1f} | {max(memory):,}" if seconds else "– | – | –"
        lines.append(f"| {name or '**all**'} | {len(chosen)} | {span} | {told} | {figures} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
