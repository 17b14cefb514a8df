"""Weave messy exports by the hundred: ``python tests/sweep_exports.py [--count 500] [--mess NAME ...] [--seed N]``.

Not part of the tests, which are to be quick.  A surface of ``tough_surfaces.py`` is spoiled as exporters do
(``messy_exports.py``), and what comes out must be the clean surface (as many borders and pieces, the same area and
length of borders), or what is wrong with it must be noted: by a doubt, or by a typed error where that is as good.
The lattice must keep its promises, or a doubt must say so.  What is wrong and not noted is *silent*.  The exit
status is the number of failures, 99 at most.
"""

# ruff: noqa: E402, T201  a script: its folders are put on the path before its imports, and it prints
from __future__ import annotations

import argparse
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "sample_files"), str(HERE)]

from messy_exports import MESSES
from sweep import most_of
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import TooMuchWork, WeaveError
from weavecore.geometry.halfedges import components, find_twins
from weavecore.validating import validate
from weavecore.weaving.strands import find_strands

# Folded so sharply that the clean surface breaks a promise; the others take longest.
LEFT_OUT = {"two_triangles", "spiral", "frill", "graded_holes", "maze"}

# A mesh of so few faces may have an opening of one face.
FEW_FACES = 110


def shape_of(surface):
    """What a mended surface has in common with the clean one: borders, pieces, area, length of borders."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    around = [np.roll(surface.vertices[border], -1, axis=0) - surface.vertices[border] for border in surface.borders]
    length = sum(float(np.linalg.norm(steps, axis=1).sum()) for steps in around)
    n_pieces = components(find_twins(surface.faces, surface.n_vertices))[0]
    return len(surface.borders), n_pieces, area, length


def doubts_of(notes):
    return {note.code for note in notes if note.is_doubt}


def compare(clean, spoiled, notes, wanted):
    """What is wrong with the surface that was read, and not told."""
    told = doubts_of(notes) - doubts_of(clean.notes)
    if wanted:
        return [] if doubts_of(notes) & wanted else [f"none of {sorted(wanted)} was noted"]
    if told:
        return []
    (borders, pieces, area, length), (n, m, a, s) = shape_of(clean), shape_of(spoiled)
    wrong = [] if borders == n else [f"{n} borders instead of {borders}"]
    if pieces != m:
        wrong.append(f"{m} pieces instead of {pieces}")
    if abs(a - area) > 1e-5 * area or abs(s - length) > 1e-4 * length:
        wrong.append(f"area {a:.8g} instead of {area:.8g}, borders of {s:.8g} instead of {length:.8g}")
    return wrong


def is_thick(name, vertices, spoiled_vertices, spacing):
    """Whether a thickened surface is no thinner than the spacing: there is nothing to doubt."""
    if name != "thickened":
        return False
    across = spoiled_vertices[len(vertices) :] - spoiled_vertices[: len(vertices)]
    return bool(np.linalg.norm(across, axis=1).min() > spacing)


def run_case(base, name, seed):
    """The outcome of a case in a word, and what there is to tell."""
    rng = np.random.default_rng([seed, *base.encode(), *name.encode()])
    vertices, faces = TOUGH[base](seed)
    mess = MESSES[name]
    spoiled_vertices, spoiled_faces = mess.spoil(vertices, faces, rng)
    if spoiled_faces is None or (name == "missing_face" and len(faces) < FEW_FACES):
        return "no case", []
    clean = pipeline.surface_from((vertices, faces))
    try:
        surface = pipeline.surface_from((spoiled_vertices, spoiled_faces))
        suggested = pipeline.suggest_spacing(surface)
        spacing = suggested if mess.doubts else pipeline.suggest_spacing(clean)
        latitudes = pipeline.offset(surface, spacing=spacing)
        if is_thick(name, vertices, spoiled_vertices, spacing):
            return "thicker than the spacing", []
        silent = compare(clean, surface, latitudes.surface.notes, mess.doubts)
        lattice = pipeline.link(latitudes)
    except WeaveError as error:
        if error.code in mess.refusals or (isinstance(error, TooMuchWork) and mess.doubts):
            return "refused as it should", []
        return "refused", [f"{error.code}: {error}"]
    except Exception as error:  # noqa: BLE001  a crash is a result here
        place = traceback.extract_tb(error.__traceback__)[-1]
        return "crashed", [f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"]
    reports = [validate(latitudes), validate(lattice), validate(find_strands(lattice), lattice=lattice)]
    broken = [str(finding) for report in reports for finding in report if not finding.holds]
    if silent:
        return "silent", silent
    told = sorted(doubts_of(lattice.latitudes.surface.notes))
    if broken:
        return ("broken and told" if "COARSE" in told else "broken"), [*broken, *told]
    return ("told" if told else "mended"), []


def main() -> int:
    """Run the sweep and print a summary by mess."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=500, help="how many cases in all")
    parser.add_argument("--mess", nargs="*", choices=sorted(MESSES), help="only these")
    parser.add_argument("--base", nargs="*", choices=sorted(TOUGH), help="only these surfaces")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    options = parser.parse_args()
    names = options.mess or list(MESSES)
    bases = options.base or [name for name in TOUGH if name not in LEFT_OUT]
    outcomes: dict[str, Counter[str]] = {name: Counter() for name in names}
    failures, longest = 0, (0.0, "", 0)
    for case in range(options.count):
        name, base = names[case % len(names)], bases[(case // len(names) + case) % len(bases)]
        seed = options.seed + case // len(names)
        start = time.process_time()
        outcome, told = run_case(base, name, seed)
        took = time.process_time() - start
        longest = max(longest, (took, name, seed))
        outcomes[name][outcome] += 1
        failures += outcome in ("silent", "broken", "refused", "crashed")
        if told or took > 20:
            print(f"{outcome:8s} --mess {name} --base {base} --seed {seed} --count 1  {took:.1f} s", flush=True)
            for line in told:
                print(f"         {line}", flush=True)
    print(most_of(longest))
    for name, counts in outcomes.items():
        print(f"{name:24s} " + ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items())))
    return min(failures, 99)


if __name__ == "__main__":
    sys.exit(main())
