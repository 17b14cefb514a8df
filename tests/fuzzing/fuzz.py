"""Damaged files by the thousand: every one must end in a result or a `WeaveError`, in time and memory.

Run on demand::

    python tests/fuzzing/fuzz.py --cases 2000            # all targets
    python tests/fuzzing/fuzz.py --cases 200 --target 3dm --seed 7
    python tests/fuzzing/fuzz.py --cases 200 --like some.3dm others/*.3dm
    python tests/fuzzing/fuzz.py --replay                # every input that is kept, as it is

Each case is a whole file (of `corpus/`) that is cut, flipped, spliced, overwritten, of which a value is changed (JSON),
or, for ``.3dm``, that is changed inside a chunk whose checksum is then made right again, so that the damage gets past
the first look.  It goes to its target (`targets.py`) in a forked process with the limits of
`weavecore.reading.sandbox`; a child that crashes, hangs or takes too much is what the guard of the readers turns into
an error, and is counted as contained.  Each of those, and every fortieth case besides, is read once more through the
guard itself, which must end in a surface or a `WeaveError` within ten seconds, this process alive.  JSON results are
read without a guard, so that nothing contains those.  Anything else is a failure: an exception of another kind, more
than ten seconds of elapsed time, more than 2 GB.  While the machine has more to do than it has processors, elapsed
time says nothing of a file, and processor time is judged instead.  The bytes of failures are kept in the folder named
at the end; a small one belongs into `failed/`, which the tests replay.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # A process with threads cannot fork safely.

import argparse
import collections
import dataclasses
import resource
import select
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1])]

from fuzzing.damage import damages_of  # noqa: E402
from fuzzing.targets import READERS, TARGETS  # noqa: E402
from weavecore.errors import WeaveError  # noqa: E402
from weavecore.reading import read_surface  # noqa: E402
from weavecore.reading.sandbox import Limits, limit_this_process  # noqa: E402

LIMITS = Limits()
MOST_SECONDS = 10.0
MOST_MEMORY = 2 * 2**30
GUARDED_EVERY = 40
BUSY = 6.0
SAME_FILES = {"fabricate": "json"}


def whole_files(name: str) -> list[bytes]:
    """The files of the corpus that a target starts from."""
    return [path.read_bytes() for path in sorted((HERE / "corpus" / SAME_FILES.get(name, name)).iterdir())]


def run_case(name: str, data: bytes) -> tuple[str, float, int]:
    """Call a target in a forked child; what became of it, its seconds and its greatest memory in bytes."""
    start = time.monotonic()
    ear, mouth = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Of threads, which sleep meanwhile.
        child = os.fork()
    if child == 0:
        os.close(ear)
        os.write(mouth, _run(name, data).encode("utf-8", "backslashreplace")[:200])
        os._exit(0)
    os.close(mouth)
    heard = b""
    if select.select([ear], [], [], LIMITS.seconds * (BUSY if is_busy() else 1.0))[0]:
        heard = os.read(ear, 200)
    else:
        os.kill(child, signal.SIGKILL)
    _, status, used = os.wait4(child, 0)
    os.close(ear)
    outcome = heard.decode("utf-8", "replace") or f"contained: signal {status & 0x7F}"
    seconds = used.ru_utime + used.ru_stime if is_busy() else time.monotonic() - start
    return outcome, seconds, used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def run_guarded(path: Path) -> tuple[str, float]:
    """Read a file as the command does; what became of it and its seconds."""
    start, used = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read_surface(path, guarded=True)
    except WeaveError as error:
        outcome = f"guarded, refused: {error.code}"
    except Exception as error:  # noqa: BLE001 - that is what is looked for
        outcome = f"ESCAPED the guard: {type(error).__name__}: {error}"
    else:
        outcome = "guarded, read"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    of_processor = after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime
    return outcome, of_processor if is_busy() else time.monotonic() - start


def is_busy() -> bool:
    """Whether the machine has more to do than it has processors."""
    return os.getloadavg()[0] > (os.cpu_count() or 1)


def _run(name: str, data: bytes) -> str:
    limit_this_process(LIMITS)
    try:
        return TARGETS[name](data)
    except MemoryError:
        return "contained: memory"
    except BaseException as error:  # noqa: BLE001 - that is what is looked for
        return f"ESCAPED: {type(error).__name__}: {error}"


@dataclasses.dataclass
class Tally:
    """Outcomes by name, the longest time of a case, the most memory, and the files that failed."""

    outcomes: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    seconds: float = 0.0
    memory: int = 0
    failed: list[Path] = dataclasses.field(default_factory=list)


def fuzz(name: str, wholes: list[bytes], cases: int, seed: int, folder: Path, keep: bool) -> Tally:
    """What becomes of so many files of a target, made by damaging whole ones."""
    draw = np.random.default_rng([seed, list(TARGETS).index(name)])
    damages = damages_of(name)
    tally = Tally()
    for number in range(cases):
        damaged = damages[number % len(damages)](wholes[int(draw.integers(0, len(wholes)))], draw, wholes)
        path = folder / f"case{number}.{SAME_FILES.get(name, name)}"
        path.write_bytes(damaged)
        outcome, seconds, memory = run_case(name, damaged)
        tally.outcomes[outcome] += 1
        bad = outcome.startswith("ESCAPED") or memory > MOST_MEMORY
        contained = outcome.startswith("contained")
        if name not in READERS:
            bad |= contained
        elif contained or number % GUARDED_EVERY == 0:
            outcome, guarded_seconds = run_guarded(path)
            tally.outcomes[outcome] += 1
            bad |= outcome.startswith("ESCAPED")
            seconds = max(seconds, guarded_seconds)
        tally.seconds, tally.memory = max(tally.seconds, seconds), max(tally.memory, memory)
        if bad or seconds > MOST_SECONDS:
            tally.failed.append(path)
        elif keep and contained:
            print(f"  contained: {path}")  # noqa: T201
        else:
            path.unlink()
    return tally


def replay() -> bool:
    """Call the targets with the inputs that are kept, and print what became of each; whether one failed."""
    bad = False
    for path in sorted(path for folder in ("corpus", "failed") for path in (HERE / folder).glob("*/*")):
        for name in (one for one in TARGETS if SAME_FILES.get(one, one) == path.parent.name):
            outcome, seconds, memory = run_case(name, path.read_bytes())
            is_whole = path.parents[1].name == "corpus" and (name, path.name) != ("fabricate", "whole0")
            fails = not outcome.startswith("read" if is_whole else ("read", "refused: "))
            fails |= seconds > MOST_SECONDS or memory > MOST_MEMORY
            word = "failed" if fails else "as it should be"
            print(f"{word}: {name} {path.relative_to(HERE)}: {outcome}, {seconds:.1f} s", flush=True)  # noqa: T201
            bad |= fails
    return bad


def main() -> int:
    """Run from the command line; the exit status is 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=2000, help="for each target")
    parser.add_argument("--target", choices=list(TARGETS), action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--like", type=Path, nargs="+", default=[], help="files of your own to be damaged instead")
    parser.add_argument("--keep", action="store_true", help="keep the files that the guard had to contain")
    parser.add_argument("--replay", action="store_true", help="call the targets with the inputs that are kept instead")
    given = parser.parse_args()
    if given.replay:
        return int(replay())
    folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
    bad = False
    for name in given.target or TARGETS:
        own = [path.read_bytes() for path in given.like if path.suffix.lower() == f".{SAME_FILES.get(name, name)}"]
        if given.like and not own:
            continue
        tally = fuzz(name, own or whole_files(name), given.cases, given.seed, folder, given.keep)
        told = ", ".join(f"{what} {n}" for what, n in tally.outcomes.most_common())
        most = f"longest {tally.seconds:.1f} s, most memory {tally.memory / 2**20:.0f} MB"
        print(f"{name}: {given.cases} cases, {most}: {told}", flush=True)  # noqa: T201
        for path in tally.failed:
            print(f"  failed: {path}", flush=True)  # noqa: T201
        bad |= bool(tally.failed)
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
