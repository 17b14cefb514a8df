"""Weave the samples in several environments and compare: ``python tests/same_topology.py [--python PATH ...]``.

Not part of the tests, which are to be quick.  Every sample is woven in every pattern, each environment in a process of
its own: this Python with the kernels of BLAS for several processors and with one thread and two, and any other Python
(of another version, with another NumPy) that ``--python`` names.  The bytes of the JSON result must be the same; where
they are not it is said whether the connectivity differs, or places by more than 1e-9 of the size.  The exit status is
the number of weaves that differ, 99 at most.
"""

# ruff: noqa: E402, T201  a script: its folders are put on the path before its imports, and it prints
from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parent / "sample_files"
sys.path[:0] = [str(HERE.parent)]

from weavecore import pipeline

PATTERNS = ("triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal")
KERNELS = ("Haswell", "Nehalem", "SkylakeX")
PLACES = 1e-9

# What says how things hang together; the rest are places and lengths.
TOPOLOGY = {
    "latitudes": ("offsets", "generation", "parents"),
    "lattice": ("faces", "edges", "edge_family", "node_latitude"),
}


def weave_all(samples: list[str], patterns: list[str]) -> dict[str, dict[str, str]]:
    """Of each weave the hash of its topology, that of its bytes, and its places."""
    found: dict[str, dict[str, object]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for sample in samples:
            latitudes = pipeline.offset(pipeline.read_surface(SAMPLES / f"{sample}.3dm"))
            for pattern in patterns:
                path = Path(folder) / "woven.json"
                pipeline.export_together(
                    pipeline.weave(pipeline.link(latitudes, pattern=pattern)), [path], overwrite=True
                )
                found[f"{sample} {pattern}"] = described(path.read_bytes())
    return found


def described(content: bytes) -> dict[str, object]:
    """Hashes and places of a JSON result."""
    result = json.loads(content)
    result["lattice"]["faces"] = [from_least(face) for face in result["lattice"]["faces"]]
    parts = [[result[part][key] for key in keys] for part, keys in TOPOLOGY.items()]
    parts.append([[s["family"], s["nodes"], s["closed"]] for s in result["strands"]])
    parts.append([[c["node"], c["over"], c["under"]] for c in result["crossings"]])
    places = [*result["latitudes"]["points"], *result["lattice"]["nodes"]]
    return {
        "topology": [hashlib.sha256(json.dumps(part).encode()).hexdigest() for part in parts],
        "bytes": hashlib.sha256(content).hexdigest(),
        "places": places,
    }


def from_least(face: list[int]) -> list[int]:
    """The same face, from its least node on."""
    k = face.index(min(face))
    return face[k:] + face[:k]


def run(python: str, settings: dict[str, str], options: argparse.Namespace) -> dict[str, dict[str, object]]:
    """The same in a process of its own."""
    command = [python, str(Path(__file__).resolve()), "--inside", "--sample", *options.sample]
    environment = {**os.environ, **settings, "PYTHONPATH": str(HERE.parent)}
    done = subprocess.run(
        [*command, "--pattern", *options.pattern], env=environment, stdout=subprocess.PIPE, check=True
    )
    return json.loads(done.stdout)


def difference(one: dict[str, object], other: dict[str, object]) -> str:
    """What differs between two weaves, or nothing."""
    names = ("latitudes", "lattice", "strands", "crossings")
    apart = [name for name, a, b in zip(names, one["topology"], other["topology"]) if a != b]
    if apart:
        return f"other {', '.join(apart)}"
    a, b = np.array(one["places"]), np.array(other["places"])
    furthest = float(np.abs(a - b).max() / np.ptp(a, axis=0).max())
    if furthest > PLACES:
        return f"places differ by {furthest:.1e} of the size"
    return "" if one["bytes"] == other["bytes"] else "other bytes"


def main() -> int:
    """Compare the environments, and print what differs."""
    samples = sorted(path.stem for path in SAMPLES.glob("*.3dm"))
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--python", nargs="*", default=[], help="other interpreters, with what weavecore needs")
    parser.add_argument("--sample", nargs="*", choices=samples, default=samples)
    parser.add_argument("--pattern", nargs="*", choices=PATTERNS, default=list(PATTERNS))
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        json.dump(weave_all(options.sample, options.pattern), sys.stdout)
        return 0
    first = {"OPENBLAS_NUM_THREADS": "1"}
    wanted = run(sys.executable, first, options)
    again = run(sys.executable, first, options)
    failures = sum(again[name]["bytes"] != one["bytes"] for name, one in wanted.items())
    print(f"the same environment again: {failures} of {len(wanted)} have other bytes", flush=True)
    others = [(sys.executable, {**first, "OPENBLAS_CORETYPE": kernel}) for kernel in KERNELS]
    others += [(sys.executable, {"OPENBLAS_NUM_THREADS": "2"}), *((python, first) for python in options.python)]
    for python, settings in others:
        found = run(python, settings, options)
        apart = {name: difference(one, found[name]) for name, one in wanted.items()}
        wrong = {name: text for name, text in apart.items() if text}
        failures += len(wrong)
        said = " ".join(f"{key}={value}" for key, value in settings.items())
        print(f"{python} {said}: {len(wrong)} of {len(wanted)} differ", flush=True)
        for name, text in wrong.items():
            print(f"    {name}: {text}", flush=True)
    return min(failures, 99)


if __name__ == "__main__":
    sys.exit(main())
