"""Work is estimated before it starts, and a command ends when its time is over."""

from __future__ import annotations

import contextlib
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.cli import main
from weavecore.commands import time_limit
from weavecore.errors import TooMuchWork
from weavecore.exporting.registry import encode
from weavecore.geometry.refine import refine_faces
from weavecore.linking.link import MOST_NODES
from weavecore.model import SurfaceMesh
from weavecore.simulating import work as simulating_work
from weavecore.viewing.page import work as page_work
from woven_tube import tube_lattice

QUICK = 15.0
"""Seconds within which all is refused or done here, on a busy machine."""


def plate(n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A square of side 100 of 2 n² faces."""
    x, y = np.meshgrid(np.linspace(0, 100, n + 1), np.linspace(0, 100, n + 1))
    corner = (np.arange(n * n) // n) * (n + 1) + np.arange(n * n) % n
    faces = [np.c_[corner, corner + 1, corner + n + 2], np.c_[corner, corner + n + 2, corner + n + 1]]
    return np.c_[x.ravel(), y.ravel(), np.zeros((n + 1) ** 2)], np.concatenate(faces)


def spike(height: float) -> SurfaceMesh:
    """A cone of 15 needles over a circle of radius 1."""
    turn = np.linspace(0, 2 * np.pi, 16)[:-1]
    base, rim = np.arange(15), np.c_[np.cos(turn), np.sin(turn), 0 * turn]
    return SurfaceMesh(np.r_[rim, [[0, 0, height]]], np.c_[base, (base + 1) % 15, np.full(15, 15)])


def thrown(vertex: int) -> SurfaceMesh:
    vertices, faces = plate()
    vertices[vertex] = [5e5, 3e5, 1e6]
    return SurfaceMesh(vertices, faces)


def two_scales() -> SurfaceMesh:
    vertices, faces = plate()
    large = 1000.0 * np.array([[1.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]])
    return SurfaceMesh(np.r_[vertices, large], np.r_[faces, len(vertices) + np.array([[0, 1, 2], [0, 2, 3]])])


UNEVEN = {"spike": spike(1e4), "thrown": thrown(84), "thrown_rim": thrown(5), "two_scales": two_scales()}


@pytest.mark.parametrize("name", ["spike", pytest.param("thrown", marks=pytest.mark.slow), "thrown_rim", "two_scales"])
def test_surfaces_of_very_different_edges_are_offset_or_refused_in_seconds(name: str) -> None:
    start = time.process_time()
    with contextlib.suppress(TooMuchWork):
        pipeline.offset(UNEVEN[name])
    assert time.process_time() - start < 2 * QUICK


def test_a_surface_far_wider_than_its_edges_is_refused_with_the_vertex_that_is_far_off() -> None:
    vertices, faces = plate()
    far = vertices[[0, 1, 13]] / 1e3 + [1e5, 2e5, 0]
    surface = SurfaceMesh(np.r_[vertices, far], np.r_[faces, len(vertices) + np.array([[0, 1, 2]])])
    with pytest.raises(TooMuchWork, match=r"the vertex farthest off lies at \(100000, 200000, 0\)"):
        pipeline.offset(surface, spacing=9.0)


def test_the_faces_that_needles_become_are_estimated() -> None:
    needles = spike(1e3)
    refined = refine_faces(needles.vertices, needles.faces, longest=10.0)
    with pytest.raises(TooMuchWork):
        refine_faces(needles.vertices, needles.faces, longest=10.0, most_faces=len(refined.faces) // 2)


def test_a_long_strip_gets_a_spacing_at_which_it_can_be_woven() -> None:
    x = np.linspace(0, 500, 251)  # fifteen generations would take 400,000 nodes
    vertices = np.r_[np.c_[x, 0 * x, 0 * x], np.c_[x, 1 + 0 * x, 0 * x]]
    k = np.arange(250)
    strip = SurfaceMesh(vertices, np.r_[np.c_[k, k + 1, k + 252], np.c_[k, k + 252, k + 251]])
    latitudes = pipeline.offset(strip)
    assert latitudes.generation.max() >= 1
    assert latitudes.polylines.lengths.sum() / latitudes.spacing < 1.1 * MOST_NODES  # edges are longer than it


@pytest.mark.parametrize(("spacing", "edge"), [(20.0, 0.01), (40.0, 0.2)])
def test_edges_too_short_for_the_rings_or_the_pockets_are_refused_with_those_that_would_do(
    spacing: float, edge: float
) -> None:
    latitudes = pipeline.offset(SurfaceMesh(*plate()), spacing=spacing)
    with pytest.raises(TooMuchWork, match="edges of at least"):
        pipeline.link(latitudes, edge_length=edge)


@pytest.mark.parametrize(("diameter", "why"), [(1e-6, "at least"), (1e9, "smaller")])
def test_rods_too_thin_or_too_thick_to_be_compared_are_refused(diameter: float, why: str) -> None:
    lattice = pipeline.link(pipeline.offset(SurfaceMesh(*plate(24)), spacing=3.0))
    with pytest.raises(TooMuchWork, match=why):
        pipeline.weave(lattice, rod_diameter=diameter)


def test_rods_that_take_too_many_points_or_pieces_of_stock_are_not_fabricated(tmp_path: Path) -> None:
    woven = pipeline.weave(tube_lattice())
    thin = replace(woven, diameters=np.full(len(woven), 1e-9))
    with pytest.raises(TooMuchWork, match=r"measured at about 85,\d\d\d,\d\d\d,\d\d\d points"):
        pipeline.fabricate(thin, tmp_path / "thin")
    with pytest.raises(TooMuchWork, match="pieces of stock of 1 mm"):
        pipeline.fabricate(woven, tmp_path / "short", workshop=pipeline.Workshop(stock=1.0))
    assert list(tmp_path.iterdir()) == []


def test_pages_that_a_browser_cannot_hold_are_not_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    woven = pipeline.weave(tube_lattice())
    for name, why in (("MOST_SAMPLES", "would be drawn through about"), ("MOST_FACES", "would hold a surface of")):
        with monkeypatch.context() as patch:
            patch.setattr(page_work, name, 10)
            with pytest.raises(TooMuchWork, match=why):
                pipeline.export(woven, tmp_path / "woven.html")
    assert list(tmp_path.iterdir()) == []


def test_more_points_than_the_memory_holds_are_not_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulating_work, "MOST_POINTS", 500)
    with pytest.raises(TooMuchWork, match="of 32 segments have about"):
        pipeline.simulate(pipeline.weave(tube_lattice()), segments=32)


def test_a_command_ends_when_its_time_is_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "plate.obj"
    file.write_bytes(encode(SurfaceMesh(*plate()), "plate.obj"))
    monkeypatch.setattr(pipeline, "offset", lambda *_args, **_options: time.sleep(30))
    start = time.monotonic()
    with pytest.raises(SystemExit) as ended:
        main(["weave", str(file), "--time-limit", "3"])
    assert ended.value.code == 1
    assert "takes longer than 3 seconds" in capsys.readouterr().err
    assert time.monotonic() - start < QUICK


def test_without_timers_it_ends_at_the_next_progress(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(time_limit, "_has_timer", lambda: False)
    time_limit.start_clock(tmp_path, 1e-9)
    try:
        with pytest.raises(TooMuchWork):
            time_limit.checked(lambda _fraction, _label: None)(0.5, "linking")
    finally:
        time_limit.stop_clock()


def test_large_files_get_more_time(tmp_path: Path) -> None:
    seconds = []
    for megabytes in (1, 8):
        file = tmp_path / f"{megabytes}.obj"
        file.write_bytes(bytes(megabytes * 1_000_000))
        time_limit.start_clock(file)
        seconds.append(time_limit._seconds)
        time_limit.stop_clock()
    assert seconds == [time_limit.DEFAULT_SECONDS, time_limit.DEFAULT_SECONDS + 60.0]
