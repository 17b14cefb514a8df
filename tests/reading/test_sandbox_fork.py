"""A worker that is a copy of the process: where it is made, and what it does not keep of its parent.

`test_sandbox.py` holds that it does else what a new process does.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from weavecore.reading import sandbox
from weavecore.reading.sandbox_fork import can_fork

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux only")

PLACES = [str(Path(__file__).resolve().parents[1]), str(Path(sandbox.__file__).resolve().parents[2])]
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
START = f"""
import sys
sys.path[:0] = {PLACES!r}
sys.executable = "/no/such/python"  # A new process would not start.
"""


def run(code: str, **variables: str) -> str:
    """What a process of one thread prints; it warns of nothing."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", START + code],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **variables},
    )
    assert done.stderr == ""
    return done.stdout


def called(work: str, *, before: str = "") -> str:
    return run(
        "import misbehaving\nfrom weavecore.reading.sandbox import Limits, call_guarded\n"
        f"{before}\nprint(call_guarded(misbehaving.{work}, limits=Limits(memory=2**28)))"
    )


def test_a_command_reads_in_a_copy(tmp_path):
    (tmp_path / "square.obj").write_text(SQUARE)
    told = run(f"from weavecore.cli import main\nmain(['info', {str(tmp_path / 'square.obj')!r}])")
    assert "can be woven" in told


def test_a_process_with_a_second_thread_is_not_copied():
    waits = threading.Event()
    thread = threading.Thread(target=waits.wait)
    thread.start()
    try:
        assert not can_fork()
    finally:
        waits.set()
        thread.join()


def test_a_copy_has_no_files_of_its_parent():
    assert called("open_files", before="import os\nos.open(os.devnull, os.O_RDONLY)") == "['pipe']\n"


def test_what_the_parent_has_not_written_yet_is_written_once():
    assert called("noisily", before="print('before')") == "before\nheard\n"


def test_signals_end_a_copy_whatever_its_parent_does_on_them():
    before = (
        "import signal\nfor name in ('TERM', 'HUP', 'ALRM'):\n    signal.signal(getattr(signal, 'SIG' + name), print)"
    )
    assert called("handlers", before=before) == "[True, True, True]\n"


def test_a_copy_does_not_call_the_progress_of_its_parent():
    before = (
        "from weavecore.polling import listening\n"
        "from os import getpid\n"
        "parent, heard = getpid(), []\n"
        "def progress(*_):\n    assert getpid() == parent\n"
        "guard = listening(progress)\nguard.__enter__()"
    )
    assert called("poll_long", before=before) == "polled\n"


def test_memory_of_the_parent_does_not_count():
    assert called(
        "noisily", before="import numpy\nlarge = numpy.zeros(2**27)  # A gigabyte, four times the limit."
    ) == ("heard\n")
