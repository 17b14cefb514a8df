"""A reader in a child process: its result, its errors, and its crashes, hangs and gluttony."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import pytest

import misbehaving
from weavecore.errors import NonManifold, TooMuchWork, Unreadable
from weavecore.reading import inspect_file, read_surface
from weavecore.reading.sandbox import Limits, call_guarded, limits_for, limits_for_all

posix = pytest.mark.skipif(sys.platform == "win32", reason="the platform sets no limits on memory and processor time")


@pytest.fixture(autouse=True)
def _findable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(misbehaving.__file__).parent))


def test_the_result_and_the_progress_are_handed_over():
    told: list[tuple[float, str]] = []
    result = call_guarded(misbehaving.well, 5, progress=lambda *what: told.append(what))
    assert np.array_equal(result, np.arange(5))
    assert told == [(0.5, "half"), (1.0, "done")]


def test_what_libraries_print_does_not_disturb():
    assert call_guarded(misbehaving.noisily) == "heard"


def test_a_refusal_keeps_its_kind_and_its_ids():
    with pytest.raises(NonManifold, match="Two sheets touch") as caught:
        call_guarded(misbehaving.refuse)
    assert caught.value.ids == (3, 5)
    assert caught.value.kind == "vertex"
    assert caught.value.remedy == "Pull them apart."


def test_any_other_error_makes_the_file_unreadable():
    with pytest.raises(Unreadable, match="ZeroDivisionError"):
        call_guarded(misbehaving.fail)


def test_a_crash_of_the_child_leaves_the_parent_alive():
    with pytest.raises(Unreadable, match="ended by itself"):
        call_guarded(misbehaving.crash)


@posix
def test_a_child_that_spins_is_ended():
    start = time.process_time()
    with pytest.raises(Unreadable, match="within 1 seconds"):
        call_guarded(misbehaving.spin, limits=Limits(reading_seconds=1.0))
    assert time.process_time() - start < 1.0


def test_a_child_that_waits_is_ended():
    start = time.monotonic()
    with pytest.raises(Unreadable, match="within"):
        call_guarded(misbehaving.sleep, limits=Limits(reading_seconds=1.5))
    assert time.monotonic() - start < 15


@posix
def test_work_that_follows_the_reading_has_a_limit_of_its_own():
    with pytest.raises(TooMuchWork, match="longer than 2 seconds"):
        call_guarded(misbehaving.spin_after_reading, limits=Limits(reading_seconds=1.0, seconds=2.0))


@posix
def test_a_child_that_eats_memory_is_stopped():
    with pytest.raises(TooMuchWork, match="memory"):
        call_guarded(misbehaving.eat, limits=Limits(reading_seconds=60.0, seconds=60.0, memory=2**30))


def test_raising_in_the_progress_ends_the_child():
    def cancel(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        call_guarded(misbehaving.well, 5, progress=cancel)


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


def test_a_file_is_read_and_looked_at_in_a_process_of_its_own(tmp_path):
    path = tmp_path / "square.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    guarded, plain = read_surface(path, guarded=True), read_surface(path)
    assert np.array_equal(guarded.vertices, plain.vertices)
    assert np.array_equal(guarded.faces, plain.faces)
    assert guarded.mendings == plain.mendings
    assert inspect_file(path, guarded=True) == inspect_file(path)


def test_a_missing_file_is_refused_as_ever(tmp_path):
    with pytest.raises(Unreadable, match="does not exist"):
        read_surface(tmp_path / "missing.3dm", guarded=True)
