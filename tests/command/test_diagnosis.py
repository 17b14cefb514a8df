"""Each cause gets its own word, in one line: outputs that are closed or full, names, numbers and files that are odd."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Callable

import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.texts import printable
from woven_tube import tube_lattice, tube_surface

ROOT = Path(__file__).resolve().parents[2]
COMMAND = f"{sys.executable} -m weavecore"
Run = Callable[..., object]


def ended(shell: str) -> subprocess.CompletedProcess[str]:
    """Run a command line of the shell."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(shell, shell=True, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.skipif(os.name == "nt", reason="POSIX shell")
def test_a_closed_output_does_not_end_the_work(folder: Path) -> None:
    done = ended(f"{COMMAND} mesh tube.obj -o m.off >&-")
    assert (done.returncode, done.stderr) == (0, "")
    assert Path("m.off").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", ["--help"])
def test_an_output_that_is_full_is_named(folder: Path, arguments: str) -> None:
    done = ended(f"{COMMAND} {arguments} >/dev/full")
    assert done.returncode == 1
    assert done.stderr.startswith("weavecore: NOT_WRITTEN: The standard output could not be written: No space left")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(("signal", "status", "said"), [("INT", 130, "stopped by"), ("TERM", 143, "ended by SIGTERM")])
def test_a_signal_ends_it_with_one_line(folder: Path, signal: str, status: int, said: str) -> None:
    code = (
        "import os, signal, sys; from weavecore import cli, pipeline\n"
        # A shell starts what it runs in the background with SIGINT ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"pipeline.read_surface = lambda *_a, **_o: os.kill(os.getpid(), signal.SIG{signal})\n"
        "cli.main(['mesh', 'tube.obj', '-o', 'm.off'])"
    )
    Path("ends.py").write_text(code)
    done = ended(f"{sys.executable} ends.py")
    assert (done.returncode, done.stderr.count("\n")) == (status, 1)
    assert said in done.stderr


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (["--rod", "1e-40"], 1, "TOO_MUCH_WORK: Rods of 1e-40"),
        (["--edge", "1e-40"], 1, "TOO_MUCH_WORK: Edges of 1e-40"),
        (["--rod", "1e-300"], 2, "between 1e-50"),
    ],
)
def test_absurd_lengths_are_refused_by_their_kind(run: Run, options: list[str], status: int, said: str) -> None:
    done = run("weave", "tube.obj", "--spacing", "1", *options)
    assert done.status == status
    assert said in done.err
    assert len(done.err) < 1000


def test_lengths_whose_squares_are_not_finite_are_refused_in_python() -> None:
    lattice = tube_lattice()
    for call in (
        lambda: pipeline.offset(tube_surface(), spacing=1e-300),
        lambda: pipeline.link(lattice.latitudes, edge_length=1e-300),
        lambda: pipeline.weave(lattice, rod_diameter=1e-300),
        lambda: pipeline.weave(lattice, stock=[1e-300, 1e300]),
    ):
        with pytest.raises(Unsupported, match="between 1e-50 and 1e\\+50"):
            call()


@pytest.mark.parametrize("over", ["tube.obj", "link.obj"])
def test_the_input_is_never_overwritten(run: Run, over: str) -> None:
    Path("link.obj").symlink_to("tube.obj")
    before = Path("tube.obj").read_bytes()
    done = run("mesh", "tube.obj", "-o", over, "--overwrite")
    assert done.status == 1
    assert "is the input, which would be lost" in done.err
    assert Path("tube.obj").read_bytes() == before


def test_an_archive_named_as_a_mesh_is_unreadable(run: Run) -> None:
    with zipfile.ZipFile("zip.obj", "w") as archive:
        archive.write("tube.obj")
    done = run("info", "zip.obj")
    assert "zip.obj is not a text file: it begins with b'PK" in done.out + done.err


@pytest.mark.skipif(sys.platform != "linux", reason="file names of any bytes")
def test_file_names_in_no_encoding_are_read_and_written(run: Run) -> None:
    odd = os.fsdecode(b"na\xffme.obj")
    Path("tube.obj").rename(odd)
    done = run("weave", odd, "--spacing", "1", "--json", os.fsdecode(b"o\xffut.json"), "-o", "o.3dm")
    assert (done.status, done.err) == (0, "")


def test_escape_sequences_in_names_do_not_reach_the_terminal(run: Run) -> None:
    Path("tube.obj").rename("red\x1b[31m.obj")
    for arguments in (
        ["info", "red\x1b[31m.obj"],
        ["info", "no\x1b[31m.obj"],
        ["mesh", "red\x1b[31m.obj", "-o", "m.off"],
    ):
        done = run(*arguments)
        assert "\x1b" not in done.out + done.err
        assert "[31m" in done.out + done.err


def test_printable_keeps_all_that_people_write() -> None:
    for text in ("Gitter Süd ∅5", "格子 1", "a\u200d\u0301b", "🧺"):
        assert printable(text) == text
    assert printable("a\tb\u2028c\udcffd\u202ee") == "a\ufffdb\ufffdc\ufffdd\ufffde"
