"""Weave the tough surfaces by the hundred: ``python tests/sweep.py [--count 300] [--name NAME ...] [--seed N]``.

Not part of the tests, which are to be quick.  Each case has a name and a seed, and is woven at the
suggested spacing or at up to twice or half of it; what breaks a promise is printed with how to
repeat it.  With ``--open`` distances start at a part of the borders alone.  A lattice that breaks a promise and has
the note COARSE that says so is *noted*.  The exit status is the number of failures, 99 at most.
"""

# ruff: noqa: E402, T201  a script: its folders are put on the path before its imports, and it prints
from __future__ import annotations

import argparse
import resource
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "sample_files"), str(HERE)]

from tough_origins import started
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import SpacingTooLarge, WeaveError
from weavecore.validating import validate
from weavecore.weaving.strands import find_strands

# What the note COARSE speaks of.
NOTED = {"degenerate_edges", "edges_off_surface_of_spacing", "flipped_faces_share"}


def weave_case(name: str, seed: int, pattern: str, method: str, is_open: bool) -> tuple[str, list[str]]:
    """Weave one case: the outcome in a word, and what went wrong, one line each."""
    rng = np.random.default_rng([seed, *name.encode()])
    surface = pipeline.surface_from(TOUGH[name](seed))
    if is_open:
        surface = started(surface, rng)
    spacing = pipeline.suggest_spacing(surface) * (1.0 if seed % 2 == 0 else 2.0 ** rng.uniform(-1, 1))
    try:
        latitudes = pipeline.offset(surface, spacing=spacing, method=method)
    except SpacingTooLarge:
        return "fine", []  # a spacing that was drawn, not suggested, may be more than the surface holds
    lattice = pipeline.link(latitudes, pattern=pattern)
    reports = [
        validate(latitudes),
        validate(lattice),
        validate(find_strands(lattice), lattice=lattice),
    ]
    broken = [finding for report in reports for finding in report if not finding.holds]
    is_noted = any(note.code == "COARSE" for note in lattice.latitudes.surface.notes)
    outcome = "noted" if is_noted and {finding.name for finding in broken} <= NOTED else "broken"
    return (outcome if broken else "fine"), [str(finding) for finding in broken]


def run_case(name: str, seed: int, options: argparse.Namespace) -> tuple[str, list[str]]:
    """The outcome of a case in a word, and what there is to tell."""
    try:
        return weave_case(name, seed, options.pattern, options.method, options.open)
    except WeaveError as error:
        return "refused", [str(error)]
    except Exception as error:  # noqa: BLE001  a crash is a result here
        if options.traceback:
            traceback.print_exc()
        place = traceback.extract_tb(error.__traceback__)[-1]
        return "crashed", [f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"]


def most_of(longest: tuple[float, str, int]) -> str:
    """The longest case, in seconds of the processor, and the most memory of all."""
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    took, name, seed = longest
    return f"longest {took:.1f} s ({name}, seed {seed}), most memory {memory:.0f} MB"


def main() -> int:
    """Run the sweep and print a summary by surface."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=300, help="how many cases in all")
    parser.add_argument("--name", nargs="*", choices=sorted(TOUGH), help="only these surfaces")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument("--pattern", default="triangular")
    parser.add_argument("--method", default="levels")
    parser.add_argument("--open", action="store_true", help="distances start at a part of the borders")
    parser.add_argument("--traceback", action="store_true", help="show where a case crashed")
    options = parser.parse_args()
    names = options.name or list(TOUGH)
    outcomes: Counter[str] = Counter()
    failures, longest = 0, (0.0, "", 0)
    for case in range(options.count):
        name, seed = names[case % len(names)], options.seed + case // len(names)
        start = time.process_time()
        outcome, told = run_case(name, seed, options)
        took = time.process_time() - start
        longest = max(longest, (took, name, seed))
        outcomes[outcome] += 1
        failures += outcome not in ("fine", "noted")
        if told or took > 20:
            print(f"{outcome:8s} --name {name} --seed {seed}  {took:.1f} s", flush=True)
            for line in told:
                print(f"         {line}", flush=True)
    print(most_of(longest))
    print(", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items())))
    return min(failures, 99)


if __name__ == "__main__":
    sys.exit(main())
