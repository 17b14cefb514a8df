"""``weavecore simulate``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable

import pytest

from weavecore import structural_analysis
from weavecore.model import BuildSequence, Replay
from weavecore.simulating.replay import FindSequence

Run = Callable[..., Any]


@pytest.fixture
def woven(run: Run, folder: Path) -> Path:
    assert run("weave", "tube.3dm", "--json", "woven.json", "-q").status == 0
    return folder / "woven.json"


def test_simulate_writes_the_equilibrium_and_a_picture(run: Run, woven: Path) -> None:
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--picture", "relaxed.png", "--buckling")
    assert (ended.status, ended.err) == (0, "")
    entry = json.loads(Path("relaxed.json").read_text("utf-8"))["equilibrium"]
    assert entry["converged"]
    assert entry["supports"] == "borders"
    assert entry["loads"] == "self-weight"
    assert 0 < entry["departure"]["mean"] <= entry["departure"]["p95"] <= entry["departure"]["max"]
    strands = json.loads(woven.read_text("utf-8"))["strands"]
    assert [axis["id"] for axis in entry["axes"]] == [strand["id"] for strand in strands]
    assert Path("relaxed.png").read_bytes()[:4] == b"\x89PNG"
    assert "departure" in ended.out


def test_a_released_weave_has_no_weight(run: Run, woven: Path) -> None:
    assert run("simulate", "woven.json", "-o", "relaxed.json", "--supports", "none", "-q").status == 0
    assert json.loads(Path("relaxed.json").read_text("utf-8"))["equilibrium"]["loads"] == "none"
    ended = run("simulate", "woven.json", "-o", "heavy.json", "--supports", "none", "--gravity")
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert not Path("heavy.json").exists()


def test_relaxed_results_can_be_simulated_viewed_and_written_for_rhino(run: Run, woven: Path) -> None:
    assert run("simulate", "woven.json", "-o", "relaxed.json", "-q").status == 0
    assert run("simulate", "relaxed.json", "-o", "again.json", "-q").status == 0
    first, second = (json.loads(Path(name).read_text("utf-8")) for name in ("relaxed.json", "again.json"))
    assert first["equilibrium"] == second["equilibrium"]
    assert run("view", "relaxed.json", "-o", "relaxed.html", "-q").status == 0
    assert run("simulate", "woven.json", "-o", "relaxed.3dm", "-q").status == 0
    import rhino3dm

    layers = {layer.FullPath for layer in rhino3dm.File3dm.Read("relaxed.3dm").Layers}
    assert "equilibrium::supports" in layers
    assert "equilibrium::rods::latitudes" in layers


def test_simulate_chooses_the_supports_for_a_limit(run: Run, woven: Path) -> None:
    assert run("simulate", "woven.json", "-o", "free.json", "--supports", "none", "-q").status == 0
    limit = 0.8 * json.loads(Path("free.json").read_text("utf-8"))["equilibrium"]["departure"]["max"]
    ended = run("simulate", "woven.json", "-o", "held.json", "--within", str(limit), "--no-gravity", "-q")
    assert (ended.status, ended.err) == (0, "")
    entry = json.loads(Path("held.json").read_text("utf-8"))["equilibrium"]
    assert entry["departure"]["max"] <= limit
    assert entry["supports"].endswith("nodes")


def test_supports_are_read_from_a_file_of_points(run: Run, woven: Path) -> None:
    points = json.loads(woven.read_text("utf-8"))["lattice"]["nodes"]
    lowest = min(point[2] for point in points)
    rim = [point for point in points if point[2] < lowest + 1e-6]
    rows = [",".join(repr(c) for c in point) for point in (*rim, rim[0])]
    Path("rim.csv").write_text("\n".join(rows), "utf-8")
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--supports", "rim.csv", "-q")
    assert (ended.status, ended.err) == (0, "")
    entry = json.loads(Path("relaxed.json").read_text("utf-8"))["equilibrium"]
    held = {reaction["node"] for reaction in entry["reactions"]}
    assert {n for n, point in enumerate(points) if point[2] < lowest + 1e-6} <= held
    assert len(held) < len(points)


def test_simulate_compensates_marks_and_replays_the_sequence(
    run: Run, woven: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spread(find: FindSequence, replay: Callable[[BuildSequence], Replay]) -> Replay:
        return replace(replay(find((1,))), spread=(1,))

    monkeypatch.setattr(structural_analysis, "improve_sequence", spread)
    assert run("simulate", "woven.json", "-o", "drawn.json", "--no-gravity", "-q").status == 0
    departure = json.loads(Path("drawn.json").read_text("utf-8"))["equilibrium"]["departure"]["max"]
    options = (
        "--compensate",
        "--within",
        str(0.9 * departure),
        "--no-gravity",
        "--sequence",
        "steps.json",
        "--improve-sequence",
    )
    ended = run("simulate", "woven.json", "-o", "cut.json", *options)
    assert (ended.status, ended.err) == (0, "")
    before = json.loads(woven.read_text("utf-8"))
    after = json.loads(Path("cut.json").read_text("utf-8"))
    assert after["notes"][-1]["code"] == "COMPENSATED"
    assert after["equilibrium"]["departure"]["max"] <= 0.9 * departure
    assert after["equilibrium"]["spread"] == [1]
    steps = json.loads(Path("steps.json").read_text("utf-8"))["steps"]
    assert steps[-1]["rods"] == len(before["strands"])
    assert "displacement" in ended.out


def test_improving_a_sequence_that_is_not_replayed_is_refused(run: Run, woven: Path) -> None:
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--improve-sequence")
    assert ended.status == 1
    assert "--sequence" in ended.err
    assert not Path("relaxed.json").exists()


@pytest.mark.parametrize(
    "option", [("--segments", "4"), ("--buckling",), ("--tie-stiffness", "0.1"), ("--tie-friction", "5")]
)
def test_compensation_refuses_options_that_it_would_ignore(run: Run, woven: Path, option: tuple[str, ...]) -> None:
    ended = run("simulate", "woven.json", "-o", "cut.json", "--compensate", *option)
    assert ended.status == 1
    assert option[0] in ended.err
    assert not Path("cut.json").exists()
