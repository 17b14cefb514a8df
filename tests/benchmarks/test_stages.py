"""The benchmark of stages: surfaces that it makes, and its table."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shell
from weavecore import pipeline

# By its path: the tests have a module of this name too.
SPEC = importlib.util.spec_from_file_location("benchmark_of_stages", Path(shell.__file__).with_name("stages.py"))
assert SPEC is not None
assert SPEC.loader is not None
stages = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(stages)


def row(stage: str, seconds: str, faces: int, nodes: int) -> dict[str, str]:
    return {"stage": stage, "seconds": seconds, "memory_mb": "100", "faces": str(faces), "nodes": str(nodes)}


def test_a_scan_read_from_its_file_is_rough_and_has_holes(tmp_path: Path) -> None:
    vertices, faces = shell.make_scan(4_000)
    shell.write_ply(tmp_path / "scan.ply", vertices, faces)
    scan = pipeline.read_surface(tmp_path / "scan.ply")
    smooth = pipeline.surface_from(shell.make_shell(4_000))
    assert len(scan.borders) > 5 > len(smooth.borders)
    assert np.array_equal(np.unique(scan.vertices, axis=0), np.unique(vertices[np.unique(faces)], axis=0))
    turns = [
        np.einsum("ij,ij->i", *(one.face_normals[h // 3] for h in (inner, one.twins[inner])))
        for one in (scan, smooth)
        for inner in [np.flatnonzero(one.twins >= 0)]
    ]
    assert np.median(np.arccos(turns[0])) > 2 * np.median(np.arccos(turns[1].clip(max=1.0)))


def test_the_table_fits_growth_and_shows_what_was_refused_or_not_done() -> None:
    runs = [
        [row("read", "0.1", 100, 10), row("link", "1.0", 100, 10)],
        [row("read", "0.2", 1_000, 100), row("link", "1.0", 1_000, 100)],
        [row("read", "0.4", 10_000, 400), row("link", "4.0", 10_000, 400), row("weave", "TOO_MUCH_WORK", 10_000, 400)],
    ]
    lines: Any = {line.split("|")[1].strip(): line for line in stages.report(runs, stages.ROOT, False).splitlines()[2:]}
    assert lines["read"].endswith("| 0.30 |")
    assert lines["link"].endswith("| 1.00 |")
    assert lines["weave"].endswith("| not done | not done | TOO_MUCH_WORK |  |")


@pytest.mark.parametrize("seconds", ["TOO_MUCH_WORK", "0.500"])
def test_only_what_was_done_is_kept(seconds: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages, "KEPT", tmp_path / "stages.csv")
    stages.keep([[{"date": "2026-01-01", "version": "x", **row("link", seconds, 10, 10)}]])
    assert len(stages.kept_rows()) == (seconds == "0.500")
