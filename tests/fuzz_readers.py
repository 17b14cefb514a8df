"""Damaged files by the thousand: every one must end in a surface or a `WeaveError`, in time and memory.

Run on demand::

    python tests/fuzz_readers.py --cases 2000            # all readers
    python tests/fuzz_readers.py --cases 200 --reader 3dm --seed 7
    python tests/fuzz_readers.py --cases 200 --like some.3dm others/*.3dm

Each case is a whole file that is cut, flipped, spliced, overwritten or, for ``.3dm``, changed inside a
chunk whose checksum is then made right again, so that the damage gets past the first look.  It is read
in a forked process with the limits of `weavecore.reading.sandbox`; a child that crashes, hangs or takes
too much is what the guard turns into an error, and is counted as contained.  Each of those, and every
fortieth case besides, is read once more through the guard itself, which must end in a surface or a
`WeaveError` within ten seconds, this process alive.  Anything else is a failure: an exception of another
kind, more than ten seconds of elapsed time, more than 2 GB.  While the machine has more to do than it has
processors, elapsed time says nothing of a file, and processor time is judged instead.  The bytes of failures
are kept in the folder named at the end.
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
import struct
import sys
import tempfile
import time
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

from weavecore.errors import WeaveError  # noqa: E402
from weavecore.reading import read_surface  # noqa: E402
from weavecore.reading.sandbox import Limits, limit_this_process  # noqa: E402

LIMITS = Limits()
MOST_SECONDS = 10.0
MOST_MEMORY = 2 * 2**30
GUARDED_EVERY = 40
BUSY = 6.0
READERS = ("3dm", "obj", "ply", "stl", "off")
_CHUNK = struct.Struct("<Iq")
_CHECKED = 0x8000

Generator = np.random.Generator


def whole_files(reader: str, folder: Path) -> list[bytes]:
    """Files of a format that are in order."""
    if reader == "3dm":
        return _rhino_files(folder)
    points, faces = _sheet()
    text = {
        "obj": "".join(
            [*(f"v {x} {y} {z}\n" for x, y, z in points), *(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)]
        ),
        "off": f"OFF\n{len(points)} {len(faces)} 0\n"
        + "".join([*(f"{x} {y} {z}\n" for x, y, z in points), *(f"3 {a} {b} {c}\n" for a, b, c in faces)]),
        "ply": _ply_header(len(points), len(faces), "ascii")
        + "".join([*(f"{x} {y} {z}\n" for x, y, z in points), *(f"3 {a} {b} {c}\n" for a, b, c in faces)]),
        "stl": "solid sheet\n" + "".join(_facet(points[list(face)]) for face in faces) + "endsolid sheet\n",
    }[reader]
    files = [text.encode()]
    if reader == "ply":
        rows = b"".join(struct.pack("<B3i", 3, *face) for face in faces.tolist())
        files.append(
            _ply_header(len(points), len(faces), "binary_little_endian").encode()
            + points.astype("<f4").tobytes()
            + rows
        )
    if reader == "stl":
        rows = b"".join(
            struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel().tolist(), 0) for face in faces.tolist()
        )
        files.append(b"binary".ljust(80) + struct.pack("<I", len(faces)) + rows)
    return files


def _sheet(n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n)))
    points = np.column_stack([x, y, np.sin(x) * 0.3]).astype(float)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower, upper = (
        np.column_stack([corner, corner + 1, corner + n]),
        np.column_stack([corner + 1, corner + n + 1, corner + n]),
    )
    return points, np.vstack([lower, upper])


def _ply_header(n_points: int, n_faces: int, form: str) -> str:
    properties = "property float x\nproperty float y\nproperty float z\n"
    faces = f"element face {n_faces}\nproperty list uchar int vertex_indices\n"
    return f"ply\nformat {form} 1.0\nelement vertex {n_points}\n{properties}{faces}end_header\n"


def _facet(corners: np.ndarray) -> str:
    rows = "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners)
    return f"facet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\n"


def _rhino_files(folder: Path) -> list[bytes]:
    import rhino3dm

    import rhino_shapes as make

    points, faces = _sheet()
    mesh = rhino3dm.Mesh()
    for x, y, z in points.tolist():
        mesh.Vertices.Add(x, y, z)
    for a, b, c in faces.tolist():
        mesh.Faces.AddFace(a, b, c)
    files = []
    shapes = [mesh, make.can(), make.punched(), make.bowl(), make.saddle(), make.star()]
    for number, shape in enumerate(shapes):
        model = rhino3dm.File3dm()
        model.Objects.Add(shape, rhino3dm.ObjectAttributes())
        path = folder / f"whole{number}.3dm"
        model.Write(str(path), 5 + number % 4)
        files.append(path.read_bytes())
    return files


def _cut(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    return whole[: draw.integers(0, len(whole))]


def _flip(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    damaged = bytearray(whole)
    for at in draw.integers(0, len(whole), int(draw.integers(1, 20))):
        damaged[at] ^= 1 << int(draw.integers(0, 8))
    return bytes(damaged)


def _overwrite(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    at, length = int(draw.integers(0, len(whole))), int(draw.integers(1, 64))
    fill = [b"\xff" * length, b"\x00" * length, draw.bytes(length), b"9" * length, b"nan "][int(draw.integers(0, 5))]
    return whole[:at] + fill + whole[at + len(fill) :]


def _splice(whole: bytes, draw: Generator, others: list[bytes]) -> bytes:
    other = others[int(draw.integers(0, len(others)))]
    a, b = sorted(draw.integers(0, len(other), 2).tolist())
    at = int(draw.integers(0, len(whole)))
    return whole[:at] + other[a:b] + whole[at + int(draw.integers(0, 2)) * (b - a) :]


def _noise(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    return whole[: int(draw.integers(0, 80))] + draw.bytes(int(draw.integers(0, 4000)))


def _change_word(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    """One word of a text becomes another; in binary files an aligned number becomes an extreme one."""
    words = whole.split(b" ")
    if len(words) > 20:
        words[int(draw.integers(0, len(words)))] = [b"-1", b"1e309", b"99999999", b"", b"nan"][int(draw.integers(0, 5))]
        return b" ".join(words)
    at = 4 * int(draw.integers(0, max(len(whole) // 4 - 1, 1)))
    value = [2**31 - 1, -1, 2**24, 0][int(draw.integers(0, 4))]
    return whole[:at] + struct.pack("<i", value) + whole[at + 4 :]


def _change_in_chunk(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    """Change a `.3dm` inside a chunk and make its checksum right again."""
    chunks = list(_checked_chunks(whole))
    if not chunks:
        return _flip(whole, draw, [])
    damaged = bytearray(whole)
    for _again in range(int(draw.integers(1, 4))):
        start, end = chunks[int(draw.integers(0, len(chunks)))]
        at = int(draw.integers(start, max(end - 8, start + 1)))
        size = min(8, end - at)
        value = [draw.bytes(8), b"\xff" * 8, struct.pack("<d", float("nan")), struct.pack("<q", 2**40)][
            int(draw.integers(0, 4))
        ]
        damaged[at : at + size] = value[:size]
        damaged[end : end + 4] = struct.pack("<I", zlib.crc32(bytes(damaged[start:end])))
    return bytes(damaged)


def _checked_chunks(whole: bytes) -> Iterator[tuple[int, int]]:
    """Where chunks with a checksum that is right begin and end."""
    for at in range(32, len(whole) - _CHUNK.size):
        if not whole[at + 1] & (_CHECKED >> 8) or whole[at + 3] > 0x40:
            continue
        _, length = _CHUNK.unpack_from(whole, at)
        start, end = at + _CHUNK.size, at + _CHUNK.size + length - 4
        if 8 < length < len(whole) - start and struct.unpack_from("<I", whole, end)[0] == zlib.crc32(whole[start:end]):
            yield start, end


DAMAGES: list[Callable[[bytes, Generator, list[bytes]], bytes]] = [
    _cut,
    _flip,
    _overwrite,
    _splice,
    _noise,
    _change_word,
]


def run_case(path: Path) -> tuple[str, float, int]:
    """Read a file in a forked child; what became of it, its seconds and its greatest memory in bytes."""
    start = time.monotonic()
    ear, mouth = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(ear)
        os.write(mouth, _read(path).encode()[:200])
        os._exit(0)
    os.close(mouth)
    heard = b""
    if select.select([ear], [], [], LIMITS.seconds * (BUSY if is_busy() else 1.0))[0]:
        heard = os.read(ear, 200)
    else:
        os.kill(child, signal.SIGKILL)
    _, status, used = os.wait4(child, 0)
    os.close(ear)
    outcome = heard.decode() or f"contained: signal {status & 0x7F}"
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


def _read(path: Path) -> str:
    limit_this_process(LIMITS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read_surface(path)
    except WeaveError as error:
        return f"refused: {error.code}"
    except MemoryError:
        return "contained: memory"
    except BaseException as error:  # noqa: BLE001 - that is what is looked for
        return f"ESCAPED: {type(error).__name__}: {error}"
    return "read"


@dataclasses.dataclass
class Tally:
    """Outcomes by name, the longest time of a case, the most memory, and the files that failed."""

    outcomes: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    seconds: float = 0.0
    memory: int = 0
    failed: list[Path] = dataclasses.field(default_factory=list)


def fuzz(reader: str, wholes: list[bytes], cases: int, seed: int, folder: Path, keep: bool) -> Tally:
    """What becomes of so many files of a reader, made by damaging whole ones."""
    draw = np.random.default_rng([seed, READERS.index(reader)])
    damages = [*DAMAGES, _change_in_chunk, _change_in_chunk, _change_in_chunk] if reader == "3dm" else DAMAGES
    tally = Tally()
    for number in range(cases):
        damaged = damages[number % len(damages)](wholes[int(draw.integers(0, len(wholes)))], draw, wholes)
        path = folder / f"case{number}.{reader}"
        path.write_bytes(damaged)
        outcome, seconds, memory = run_case(path)
        tally.outcomes[outcome] += 1
        bad = outcome.startswith("ESCAPED") or memory > MOST_MEMORY
        contained = outcome.startswith("contained")
        if contained or number % GUARDED_EVERY == 0:
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


def main() -> int:
    """Run from the command line; the exit status is 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=2000, help="for each reader")
    parser.add_argument("--reader", choices=READERS, action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--like", type=Path, nargs="+", default=[], help="files of your own to be damaged instead")
    parser.add_argument("--keep", action="store_true", help="keep the files that the guard had to contain")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
    bad = False
    for reader in given.reader or READERS:
        own = [path.read_bytes() for path in given.like if path.suffix.lower() == f".{reader}"]
        if given.like and not own:
            continue
        tally = fuzz(reader, own or whole_files(reader, folder), given.cases, given.seed, folder, given.keep)
        told = ", ".join(f"{name} {n}" for name, n in tally.outcomes.most_common())
        most = f"longest {tally.seconds:.1f} s, most memory {tally.memory / 2**20:.0f} MB"
        print(f"{reader}: {given.cases} cases, {most}: {told}", flush=True)  # noqa: T201
        for path in tally.failed:
            print(f"  failed: {path}", flush=True)  # noqa: T201
        bad |= bool(tally.failed)
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
