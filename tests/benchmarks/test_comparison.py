"""The comparison with other tools: tiny cases, so that it does not rot; what is not installed is left out."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import comparison
from comparison_methods import METHODS, Line, Mesh, march, run_levels
from comparison_quality import Result, count_crossed, errors, locate
from comparison_worker import as_mesh, forget_peak, memory_of, pack
from shell import make_shell

ROOT = Path(__file__).resolve().parents[2]
SPACING = 0.15


@pytest.fixture(scope="module")
def shell() -> tuple[np.ndarray, np.ndarray]:
    return make_shell(1500)


def result_of(*lines: Line) -> Result:
    return Result(1.0, 1.0, **pack(list(lines)))


def ring(radius: float, x: float = 0.0, distance: float = 1.0, n: int = 40) -> Line:
    turn = 2 * np.pi * (np.arange(n) + 0.3) / n
    return Line(np.stack([x + radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1), distance, True)


def test_points_on_a_mesh_are_found_in_their_faces(shell: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = shell
    weights = np.random.default_rng(0).dirichlet([2, 2, 2], len(faces))
    points = np.einsum("nk,nkd->nd", weights, vertices[faces])
    face, found = locate(vertices, faces, points)
    np.testing.assert_array_equal(face, np.arange(len(faces)))
    np.testing.assert_allclose(found, weights, atol=1e-9)


def test_polylines_that_lie_apart_are_simple() -> None:
    assert count_crossed(result_of(ring(1.0), ring(2.0), ring(0.5))) == 0


def test_polylines_of_one_distance_that_cross_are_counted() -> None:
    assert count_crossed(result_of(ring(1.0), ring(1.0, x=1.5), ring(9.0))) == 2
    assert count_crossed(result_of(ring(1.0), ring(1.0, x=1.5, distance=2.0))) == 0


def test_a_figure_of_eight_is_not_simple() -> None:
    turn = 2 * np.pi * (np.arange(41) + 0.3) / 41
    eight = Line(np.stack([np.sin(turn), np.sin(turn) * np.cos(turn), 0 * turn], axis=1), 1.0, True)
    assert count_crossed(result_of(eight)) == 1


def test_an_open_polyline_has_no_closing_segment() -> None:
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [1, 1, 0], [1, 0.5, 0], [1.5, 0.5, 0], [1.5, 2.0, 0]], float)
    bay = corners[[0, 1, 2, 3, 4]]
    assert count_crossed(result_of(Line(bay, 1.0, False))) == 0
    assert count_crossed(result_of(Line(corners, 1.0, False))) == 1


def test_the_levels_are_nearly_exact_and_a_wrong_distance_is_seen(shell: tuple[np.ndarray, np.ndarray]) -> None:
    pytest.importorskip("pygeodesic", reason="the exact solver is not installed")
    from exact import ExactDistance

    exact = ExactDistance(*shell)
    lines = run_levels(as_mesh(*shell, SPACING))
    assert errors(exact, *shell, result_of(*lines)).mean() < 0.003 * SPACING
    wrong = [Line(line.points, line.distance + 0.1 * SPACING, line.closed) for line in lines]
    assert errors(exact, *shell, result_of(*wrong)).mean() == pytest.approx(0.1 * SPACING, rel=0.05)


@pytest.mark.parametrize("name", METHODS)
def test_each_method_gives_rings_at_the_right_depth(name: str) -> None:
    if not comparison.is_installed(METHODS[name][0]):
        pytest.skip(f"{METHODS[name][0]} is not installed")
    turn = 2 * np.pi * np.arange(60) / 60
    # A flat disc of radius 1 as rings of triangles around a middle.
    rings = [np.stack([r * np.cos(turn), r * np.sin(turn), 0 * turn], axis=1) for r in np.linspace(1, 0.1, 10)]
    vertices = np.concatenate([*rings, np.zeros((1, 3))])
    i, j = np.arange(60), (np.arange(60) + 1) % 60
    bands = [np.concatenate([np.c_[i, j, j + 60], np.c_[i, j + 60, i + 60]]) + 60 * k for k in range(9)]
    faces = np.concatenate([*bands, np.c_[i + 540, j + 540, np.full(60, 600)]])
    lines = METHODS[name][1](Mesh(vertices, faces, [i], 0.23))
    assert all(line.closed for line in lines)
    for line in lines:
        assert np.linalg.norm(line.points, axis=1).mean() == pytest.approx(1 - line.distance, abs=0.1)
    assert {round(line.distance / 0.23) for line in lines} >= {1, 2, 3}


def test_isolines_of_a_linear_field_lie_where_it_has_their_value(shell: tuple[np.ndarray, np.ndarray]) -> None:
    pytest.importorskip("potpourri3d", reason="potpourri3d is not installed")
    field = shell[0][:, 0] + 1.5
    lines = march(as_mesh(*shell, SPACING), field)
    assert len(lines) > 10
    for line in lines:
        np.testing.assert_allclose(line.points[:, 0] + 1.5, line.distance, atol=1e-9)


def test_the_report_names_what_is_left_out_and_what_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(comparison, "is_installed", lambda package: package == "weavecore")
    names = ["weavecore levels", "heat method"]
    text = comparison.report(["shell"], [1200], names)
    assert "Not installed, and left out: heat method (potpourri3d)." in text
    assert re.findall(r"^\| weavecore levels \| [\d.]+ \(1\.00×\) \| (\d+|nan) \|$", text, re.MULTILINE)
    (lines,) = re.findall(r"^\| weavecore levels \| (\d+) / 0 / 0 / \d+ \|$", text, re.MULTILINE)
    assert int(lines) >= 8
    assert comparison.run("no such method", *make_shell(300), SPACING) is None


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="Linux alone tells the peak of memory so")
def test_the_peak_of_memory_is_that_of_the_run_alone() -> None:
    large = np.ones(30_000_000)
    large.sum()
    del large
    before = forget_peak()
    assert memory_of("VmHWM") - before < 20
    small = np.ones(10_000_000)
    assert memory_of("VmHWM") - before == pytest.approx(small.nbytes / 1e6, abs=20)


def test_the_page_has_a_place_for_the_tables() -> None:
    page = (ROOT / "docs" / "comparison.md").read_text("utf-8")
    assert page.index(comparison.BEGIN) < page.index(comparison.END)
    assert "| weavecore fronts |" in page
