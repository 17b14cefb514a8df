"""Files that may not be read and processes that may not be started: a typed error with the right word.

Root may do all, so that as root the tests give up its rights first, in a process of their own.
"""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from weavecore.errors import WeaveError
from weavecore.reading import read_surface

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="rights of POSIX")

NOBODY = 65534


@pytest.fixture
def sheet() -> Iterator[Path]:
    """A file that all may read, in a folder that all may enter."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        path = Path(folder) / "sheet.obj"
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "utf-8")
        yield path


def as_nobody(call: Callable[[], object]) -> str:
    """What a call raises without root's rights, or nothing."""
    ear, mouth = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Of threads, which sleep meanwhile.
        child = os.fork()
    if child == 0:
        said = "ended early"
        try:
            if os.geteuid() == 0:
                os.setgroups([])
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            call()
            said = ""
        except WeaveError as error:
            said = str(error)
        except BaseException as error:  # noqa: BLE001 - that is what is looked for
            said = repr(error)
        finally:
            os.write(mouth, said.encode()[:4000])
            os._exit(0)
    os.close(mouth)
    with os.fdopen(ear, "rb") as pipe:
        said = pipe.read().decode()
    os.waitpid(child, 0)
    return said


def test_a_file_without_the_right_to_read_is_unreadable(sheet: Path) -> None:
    assert as_nobody(lambda: read_surface(sheet)) == ""
    sheet.chmod(0)
    said = as_nobody(lambda: read_surface(sheet))
    assert said.startswith("UNREADABLE")
    assert "ermission" in said


def test_where_no_process_may_be_started_that_is_said(sheet: Path) -> None:
    import resource

    def read() -> None:
        resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
        read_surface(sheet, guarded=True)

    said = as_nobody(read)
    assert said.startswith("UNREADABLE")
    assert "could not be started" in said
