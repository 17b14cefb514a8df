"""Every stage asks often whether it is to go on: counted by the work that lies between two calls, not by the clock."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from weavecore import pipeline, polling
from woven_rods import woven_sample

MOST_CALLS = {
    "offset": 30_000,
    "link": 30_000,
    "weave": 30_000,
    "simulate": 60_000,
    "fabricate": 120_000,
    "json": 30_000,
    "3dm": 60_000,
    "page": 30_000,
    "picture": 30_000,
    "repair": 30_000,
}
"""Calls of functions, of Python and of C, between two polls."""


@cache
def stages() -> dict[str, Callable[..., Any]]:
    woven = woven_sample("narrow_neck", "triangular")
    latitudes = woven.lattice.latitudes
    vertices, faces = latitudes.surface.vertices, latitudes.surface.faces
    return {
        "offset": lambda _folder, **more: pipeline.offset(latitudes.surface, spacing=latitudes.spacing, **more),
        "link": lambda _folder, **more: pipeline.link(latitudes, **more),
        "weave": lambda _folder, **more: pipeline.weave(woven.lattice, **more),
        "simulate": lambda _folder, **more: pipeline.simulate(woven, **more),
        "fabricate": lambda folder, **more: pipeline.fabricate(woven, folder / "out", **more),
        "json": lambda folder, **more: pipeline.export_together(woven, [folder / "w.json"], **more),
        "3dm": lambda folder, **more: pipeline.export_together(woven, [folder / "w.3dm"], **more),
        "page": lambda folder, **more: pipeline.export_together(woven, [folder / "w.html"], **more),
        "picture": lambda folder, **more: pipeline.export_together(woven, [folder / "w.png"], **more),
        "repair": lambda _folder, **more: pipeline.surface_from((vertices, faces), **more),
    }


class Cancelled(Exception):
    pass


@pytest.mark.parametrize("name", sorted(MOST_CALLS))
def test_no_stage_works_long_between_two_polls(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polling, "INTERVAL", 0.0)
    import_module("reportlab.pdfgen.canvas")  # Takes a second, once.
    calls, longest = 0, 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    def progress(_fraction: float, _label: str) -> None:
        nonlocal calls, longest
        longest, calls = max(longest, calls), 0

    run = stages()[name]
    sys.setprofile(count)
    try:
        run(tmp_path, progress=progress)
    finally:
        sys.setprofile(None)
    assert max(longest, calls) < MOST_CALLS[name]


@pytest.mark.parametrize("name", sorted(MOST_CALLS))
def test_raising_in_a_poll_cancels_and_leaves_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(polling, "INTERVAL", 0.0)
    seen: list[float] = []

    def progress(fraction: float, _label: str) -> None:
        seen.append(fraction)
        if len(seen) > 4:
            raise Cancelled

    with pytest.raises(Cancelled):
        stages()[name](tmp_path, progress=progress)
    assert list(tmp_path.iterdir()) == []
    polling.poll()  # The stage that has ended is not asked any more.
    assert len(seen) == 5


def test_a_long_call_of_a_library_is_left_when_a_poll_raises() -> None:
    ended = threading.Event()

    @polling.pollable
    def stage(*, progress: Any = None) -> None:
        progress(0.0, "factors")
        polling.poll_during(ended.wait, 20.0)

    n_asked = 0

    def progress(_fraction: float, _label: str) -> None:
        nonlocal n_asked
        n_asked += 1
        if n_asked > 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        stage(progress=progress)
    ended.set()


def test_what_a_long_call_returns_and_raises_comes_through() -> None:
    @polling.pollable
    def stage(work: Callable[[], Any], *, progress: Any = None) -> Any:
        return polling.poll_during(work)

    assert stage(lambda: 5, progress=lambda *_: None) == stage(lambda: 5) == 5
    with pytest.raises(ZeroDivisionError):
        stage(lambda: 1 / 0, progress=lambda *_: None)
