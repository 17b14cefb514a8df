"""Fuzzing guided by coverage: ``python tests/fuzzing/guided.py NAME [OPTION OF LIBFUZZER ...]``.

Needs ``pip install atheris`` (Python 3.9 to 3.13 on Linux).  NAME is a target of `targets.py`; it starts from the files
of `corpus/` and `failed/`, and what it finds on the way is kept in a new folder, or in the one given as the first
option that is no option::

    python tests/fuzzing/guided.py obj -max_total_time=600
    python tests/fuzzing/guided.py json found/ -max_total_time=600

It ends at the first failure, whose bytes are in a file ``crash-…``, ``timeout-…`` or ``oom-…``.  In a ``.3dm`` a crash
inside rhino3dm is no failure of weavecore, which reads such files in a child process: ``fuzz.py --like FILE`` says so.
"""

# ruff: noqa: E402, T201  a script: what it instruments is imported late, and it prints
from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import random
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1])]

import atheris

with atheris.instrument_imports(include=["weavecore"]):
    from fuzzing.damage import change_value
    from fuzzing.fuzz import MOST_MEMORY, MOST_SECONDS, SAME_FILES
    from fuzzing.targets import TARGETS

import numpy as np


def change_json(data: bytes, most: int, seed: int) -> bytes:
    """Mutate for JSON: mostly a value, so that it still is JSON."""
    if random.Random(seed).random() < 0.1:
        return bytes(atheris.Mutate(data, most))
    return change_value(data, np.random.default_rng(seed), [])[:most]


def main() -> None:
    """Run until a failure, or as long as libFuzzer's options say."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        print(f"usage: guided.py {{{','.join(TARGETS)}}} [FOLDER] [OPTION OF LIBFUZZER ...]", file=sys.stderr)
        raise SystemExit(2)
    name, options = sys.argv[1], sys.argv[2:]
    target, kind = TARGETS[name], SAME_FILES.get(name, name)

    def call(data: bytes) -> None:
        target(data)

    folders = [one for one in options if not one.startswith("-")] or [tempfile.mkdtemp(prefix=f"fuzz_{name}_")]
    seeds = [str(folder) for folder in (HERE / "corpus" / kind, HERE / "failed" / kind) if folder.is_dir()]
    limits = [f"-timeout={MOST_SECONDS:.0f}", f"-rss_limit_mb={MOST_MEMORY >> 20}", "-max_len=100000"]
    own = [one for one in options if one.startswith("-")]
    is_json = kind == "json"
    atheris.Setup(
        [sys.argv[0], *limits, *own, *folders, *seeds], call, **({"custom_mutator": change_json} if is_json else {})
    )
    print(f"finds are kept in {folders[0]}")
    atheris.Fuzz()


if __name__ == "__main__":
    main()
