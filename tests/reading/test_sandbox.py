"""A reader in a child process: its result, its errors, and its crashes, hangs and gluttony."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import misbehaving
from weavecore.errors import NonManifold, TooMuchWork, Unreadable, Unsupported
from weavecore.polling import pollable
from weavecore.reading import inspect_file, read_surface, sandbox
from weavecore.reading.sandbox import Limits, call_guarded, limits_for, limits_for_all
from weavecore.units import Length

posix = pytest.mark.skipif(sys.platform == "win32", reason="the platform sets no limits on memory and processor time")


@pytest.fixture(autouse=True)
def new_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child is a new process, whatever the threads of this one."""
    monkeypatch.setattr(sandbox, "can_fork", lambda: False)


@pytest.fixture(params=["new", "copy"])
def either(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, new_process: None) -> None:
    """The child is a new process, or a copy of this one."""
    if request.param == "copy":
        if sys.platform != "linux":
            pytest.skip("processes are copied on Linux only")
        monkeypatch.setattr(sandbox, "can_fork", lambda: True)
        warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)


@pytest.mark.usefixtures("either")
def test_the_result_and_the_progress_are_handed_over():
    told: list[tuple[float, str]] = []
    result = call_guarded(misbehaving.well, 5, progress=lambda *what: told.append(what))
    assert np.array_equal(result, np.arange(5))
    assert told == [(0.5, "half"), (1.0, "done")]


@pytest.mark.usefixtures("either")
def test_reading_is_left_when_progress_raises_while_the_child_works():
    @pollable
    def read(*, progress):
        return call_guarded(misbehaving.sleep, progress=progress)

    asked = []

    def progress(_share, _label):
        asked.append(_label)
        if len(asked) > 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read(progress=progress)


@pytest.mark.usefixtures("either")
def test_what_libraries_print_does_not_disturb():
    assert call_guarded(misbehaving.noisily) == "heard"


def test_what_is_printed_before_the_first_message_does_not_disturb(monkeypatch):
    monkeypatch.setattr(sandbox, "_START", "import os; os.write(1, b'hello' * 300_000)\n" + sandbox._START)
    assert call_guarded(misbehaving.noisily) == "heard"


@pytest.mark.usefixtures("either")
def test_a_refusal_keeps_its_kind_and_its_ids():
    with pytest.raises(NonManifold, match="Two sheets touch") as caught:
        call_guarded(misbehaving.refuse)
    assert caught.value.ids == (3, 5)
    assert caught.value.kind == "vertex"
    assert caught.value.remedy == "Pull them apart."


def test_a_refusal_of_a_million_faces_keeps_all_their_ids():
    with pytest.raises(NonManifold, match="1000000 in all") as caught:
        call_guarded(misbehaving.refuse_many, 1_000_000)
    assert caught.value.ids == tuple(range(1_000_000))


@pytest.mark.usefixtures("either")
def test_ids_that_are_not_numbers_come_as_texts():
    with pytest.raises(NonManifold, match=r"\(layer Shell, 2\)") as caught:
        call_guarded(misbehaving.refuse_layer)
    assert caught.value.ids == ("Shell", "2")


@pytest.mark.usefixtures("either")
def test_any_other_error_makes_the_file_unreadable():
    with pytest.raises(Unreadable, match="ZeroDivisionError"):
        call_guarded(misbehaving.fail)


@pytest.mark.usefixtures("either")
def test_too_little_memory_is_not_a_damaged_file():
    with pytest.raises(TooMuchWork, match="memory") as caught:
        call_guarded(misbehaving.run_out_of_memory)
    assert "damaged" not in str(caught.value)


@pytest.mark.usefixtures("either")
def test_a_library_that_is_missing_is_not_a_damaged_file():
    with pytest.raises(Unreadable, match="No module named 'no_such_library'") as caught:
        call_guarded(misbehaving.miss_a_library)
    assert "damaged" not in str(caught.value)
    assert sys.executable in caught.value.remedy


@pytest.mark.usefixtures("either")
def test_a_crash_of_the_child_leaves_the_parent_alive():
    with pytest.raises(Unreadable, match=r"crashed .* probably damaged"):
        call_guarded(misbehaving.crash)


@pytest.mark.usefixtures("either")
@posix
def test_a_child_that_is_killed_from_outside_is_not_a_damaged_file():
    with pytest.raises(Unreadable, match=r"ended from outside \(SIGKILL\)") as caught:
        call_guarded(misbehaving.be_killed, int(signal.SIGKILL))
    assert "damaged" not in str(caught.value)


@pytest.mark.usefixtures("either")
def test_a_child_that_exits_is_not_a_damaged_file():
    with pytest.raises(Unreadable, match=r"without a result \(exit status 3\)") as caught:
        call_guarded(misbehaving.leave)
    assert "damaged" not in str(caught.value)


def test_an_interpreter_that_cannot_start_is_not_a_damaged_file(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with pytest.raises(Unreadable, match="could not be started") as caught:
        call_guarded(misbehaving.well, 5)
    assert "damaged" not in str(caught.value)


def test_a_child_that_is_not_ready_in_time_is_not_a_damaged_file(monkeypatch):
    monkeypatch.setattr(sandbox, "_START_SECONDS", 0.01)
    with pytest.raises(Unreadable, match="could not be started") as caught:
        call_guarded(misbehaving.well, 5)
    assert "damaged" not in str(caught.value)


def test_a_child_without_numpy_says_so(monkeypatch, tmp_path):
    (tmp_path / "numpy.py").write_text("raise ImportError('NumPy is for another Python')")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(Unreadable, match=r"could not be started \(ImportError: NumPy is for another Python\)"):
        call_guarded(misbehaving.well, 5)


@pytest.mark.usefixtures("either")
@pytest.mark.parametrize("way", ["length", "pickle", "restart"])
def test_a_faulty_answer_is_refused(way):
    with pytest.raises(Unreadable, match="faulty answer"):
        call_guarded(misbehaving.answer_wrongly, way)


@pytest.mark.usefixtures("either")
def test_an_answer_that_breaks_off_is_refused():
    with pytest.raises(Unreadable, match="without a result"):
        call_guarded(misbehaving.answer_wrongly, "short")


@pytest.mark.usefixtures("either")
def test_only_classes_that_are_asked_for_are_made():
    sent = call_guarded(misbehaving.length, classes=(Length,))
    assert sent == Length(2.5, "Meters")
    with pytest.raises(Unreadable, match="faulty answer"):
        call_guarded(misbehaving.length)


@pytest.mark.usefixtures("either")
@posix
def test_a_child_that_spins_is_ended():
    start = time.process_time()
    with pytest.raises(Unreadable, match="within 1 seconds"):
        call_guarded(misbehaving.spin, limits=Limits(reading_seconds=1.0))
    assert time.process_time() - start < 1.0


@pytest.mark.usefixtures("either")
def test_a_child_that_waits_is_ended():
    start = time.monotonic()
    with pytest.raises(Unreadable, match="within"):
        call_guarded(misbehaving.sleep, limits=Limits(reading_seconds=1.5))
    assert time.monotonic() - start < 15


@pytest.mark.usefixtures("either")
@posix
def test_work_that_follows_the_reading_has_a_limit_of_its_own():
    with pytest.raises(TooMuchWork, match="longer than 2 seconds"):
        call_guarded(misbehaving.spin_after_reading, limits=Limits(reading_seconds=1.0, seconds=2.0))


@pytest.mark.usefixtures("either")
@posix
def test_a_child_that_eats_memory_is_stopped():
    with pytest.raises(TooMuchWork, match="memory"):
        call_guarded(misbehaving.eat, limits=Limits(reading_seconds=60.0, seconds=60.0, memory=2**30))


def test_raising_in_the_progress_ends_the_child():
    def cancel(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        call_guarded(misbehaving.well, 5, progress=cancel)


@pytest.mark.usefixtures("either")
def test_a_child_that_tells_more_than_is_taken_is_ended_with_the_call():
    def cancel(*_: object) -> None:
        time.sleep(0.5)  # Meanwhile the pipe and the queue fill.
        raise KeyboardInterrupt

    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        call_guarded(misbehaving.flood, progress=cancel)
    assert threading.active_count() == before


def test_a_larger_file_gets_more(tmp_path):
    large = tmp_path / "large.3dm"
    with large.open("wb") as stream:
        stream.truncate(50 * 2**20)
    small, more = limits_for(tmp_path / "missing.3dm"), limits_for(large)
    assert small == Limits()
    assert more.seconds > small.seconds
    assert more.memory > small.memory


def test_a_file_of_ordinary_size_ends_in_ten_seconds_and_two_gigabytes_unless_more_is_asked_for(tmp_path):
    ordinary = tmp_path / "ordinary.3dm"
    with ordinary.open("wb") as stream:
        stream.truncate(500_000)
    usual = limits_for(ordinary)
    assert usual.reading_seconds <= usual.seconds < 10.0
    assert (usual.memory, usual.n_objects) == (2 * 2**30, 1)
    assert limits_for(ordinary, is_fineness_asked=True).seconds > 60
    assert limits_for(ordinary, time_limit=30.0).seconds == 30.0
    assert limits_for(ordinary, time_limit=30.0).reading_seconds == 30.0


def test_a_time_limit_may_be_infinite_but_must_be_a_number(tmp_path):
    limits = limits_for(tmp_path / "missing.3dm", time_limit=float("inf"))
    assert np.array_equal(call_guarded(misbehaving.well, 5, limits=limits), np.arange(5))
    with pytest.raises(Unsupported, match="time limit of nan"):
        limits_for(tmp_path / "missing.3dm", time_limit=float("nan"))


def test_the_time_limit_is_of_elapsed_time():
    start = time.monotonic()
    with pytest.raises(TooMuchWork, match="longer than 2 seconds"):
        call_guarded(misbehaving.sleep_after_reading, limits=Limits(reading_seconds=1.0, seconds=2.0))
    assert 1.9 < time.monotonic() - start < 12


def test_every_object_of_a_report_has_the_time_of_a_single_one(tmp_path):
    one, every = limits_for(tmp_path / "missing.3dm"), limits_for_all(tmp_path / "missing.3dm")
    assert every.seconds == one.seconds
    assert every.n_objects >= 5
    limits = Limits(reading_seconds=1.0, seconds=1.0, n_objects=4)
    assert call_guarded(misbehaving.four_objects, limits=limits) == "done"
    with pytest.raises(TooMuchWork, match="longer than 1 seconds"):
        call_guarded(misbehaving.sleep_after_reading, limits=limits)


def test_telling_progress_does_not_put_the_end_off():
    start = time.monotonic()
    with pytest.raises(TooMuchWork, match="longer than 2 seconds"):
        call_guarded(misbehaving.chatter, limits=Limits(reading_seconds=1.0, seconds=2.0))
    assert time.monotonic() - start < 12


@pytest.mark.usefixtures("either")
def test_a_file_is_read_and_looked_at_in_a_process_of_its_own(tmp_path):
    path = tmp_path / "square.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    guarded, plain = read_surface(path, guarded=True), read_surface(path)
    assert np.array_equal(guarded.vertices, plain.vertices)
    assert np.array_equal(guarded.faces, plain.faces)
    assert guarded.notes == plain.notes
    assert repr(inspect_file(path, guarded=True)) == repr(inspect_file(path))


def test_a_missing_file_is_refused_as_ever(tmp_path):
    with pytest.raises(Unreadable, match="does not exist"):
        read_surface(tmp_path / "missing.3dm", guarded=True)


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
ROOT = Path(sandbox.__file__).resolve().parents[2]
SHADOWS = ("queue", "numpy", "json", "struct", "weavecore", "rhino3dm", "scipy", "sitecustomize", "usercustomize")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: a good file, and modules that leave a mark if they are run."""
    monkeypatch.chdir(tmp_path)
    Path("square.obj").write_text(SQUARE)
    for name in SHADOWS:
        Path(f"{name}.py").write_text(f"open('run_{name}', 'w').close()")
    return tmp_path


def marks(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("run_*"))


def test_nothing_in_the_current_folder_is_run(folder):
    assert read_surface("square.obj", guarded=True).n_faces == 2
    assert marks(folder) == []


def test_nothing_beside_the_package_is_run_where_that_is_the_current_folder(folder, monkeypatch):
    shutil.copytree(ROOT / "weavecore", folder / "weavecore")
    monkeypatch.setattr(sandbox, "__file__", str(folder / "weavecore" / "reading" / Path(sandbox.__file__).name))
    assert read_surface("square.obj", guarded=True).n_faces == 2
    assert marks(folder) == []


@pytest.mark.parametrize("entry", ["", ".", "{folder}", "{folder}/"])
@pytest.mark.parametrize("named", ["", os.pathsep, "."])
def test_the_child_does_not_look_in_the_current_folder_where_the_parent_does(folder, monkeypatch, entry, named):
    monkeypatch.setenv("PYTHONPATH", named)
    before = sandbox._search_path()
    monkeypatch.setattr(sys, "path", [entry.format(folder=folder), *sys.path, entry.format(folder=folder)])
    assert sandbox._search_path() == before
    assert not {"", ".", str(folder)} & set(before)


def test_the_current_folder_counts_where_pythonpath_names_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("brought_along.py").write_text("def read(*, progress):\n    return 'read'\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    import brought_along

    with pytest.raises(Unreadable, match="No module named 'brought_along'"):
        call_guarded(brought_along.read)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert call_guarded(brought_along.read) == "read"


@pytest.mark.usefixtures("either")
def test_the_current_folder_may_have_been_deleted(tmp_path, monkeypatch):
    path = tmp_path / "square.obj"
    path.write_text(SQUARE)
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert read_surface(path, guarded=True).n_faces == 2


@pytest.mark.usefixtures("either")
def test_the_child_looks_for_modules_where_the_parent_does(tmp_path, monkeypatch):
    (tmp_path / "elsewhere.py").write_text("def read(*, progress):\n    return 'read'\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    import elsewhere

    assert call_guarded(elsewhere.read) == "read"


def test_a_good_file_is_read_where_only_the_parents_path_has_numpy(tmp_path):
    """As in Grasshopper with ``# env:``, which appends to the path of a Python that has no packages of its own."""
    (tmp_path / "square.obj").write_text(SQUARE)
    bare = tmp_path / "bare"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(bare)], check=True)
    python = next(path for path in (bare / "bin" / "python", bare / "Scripts" / "python.exe") if path.exists())
    code = (
        f"import sys; sys.path += {[str(ROOT), *filter(os.path.isdir, sys.path)]!r}\n"
        "from weavecore import read_surface\n"
        f"print(read_surface({str(tmp_path / 'square.obj')!r}, guarded=True).n_faces)"
    )
    done = subprocess.run([str(python), "-I", "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("2\n", "")
