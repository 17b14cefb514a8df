"""What is fuzzed: for each format one function of the bytes of a file, which returns or raises what no file may cause.

A `WeaveError` is an answer; everything else that gets out is a failure.  Both drivers call these: `fuzz.py`, which
damages whole files and forks for each case, and `guided.py`, in which atheris follows the coverage.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from weavecore import pipeline
from weavecore.errors import WeaveError
from weavecore.fabricating.workshop import Workshop
from weavecore.reading import read_surface
from weavecore.reading.formats.result_json import decode_result

Target = Callable[[bytes], str]
"""What becomes of the bytes, in a word: ``"read"``, or ``"refused: CODE"``."""

READERS = ("3dm", "obj", "ply", "stl", "off")


def read_bytes(ending: str, data: bytes) -> str:
    """Read a surface."""
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        path = Path(folder) / f"case.{ending}"
        path.write_bytes(data)
        return _outcome(lambda: read_surface(path))


def read_json(data: bytes) -> str:
    """Read a JSON result, describe it and write it again."""

    def read() -> None:
        value = decode_result(data)
        pipeline.describe(value)
        pipeline.export_together(value, [Path(folder) / "again.json"], overwrite=True)

    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        return _outcome(read)


def fabricate(data: bytes) -> str:
    """Make the tables of a workshop from a JSON result."""
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        path = Path(folder) / "case.json"
        path.write_bytes(data)
        tables = Workshop(templates=())
        return _outcome(lambda: pipeline.fabricate(path, Path(folder) / "workshop", workshop=tables, unit="mm"))


def _outcome(call: Callable[[], object]) -> str:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
    except WeaveError as error:
        return f"refused: {error.code}"
    return "read"


TARGETS: Mapping[str, Target] = {
    **{ending: partial(read_bytes, ending) for ending in READERS},
    "json": read_json,
    "fabricate": fabricate,
}
