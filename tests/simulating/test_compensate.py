from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.model import Compensation, Equilibrium, Weave
from weavecore.simulating import compensate
from weavecore.simulating.discretise import place_points
from weavecore.simulating.simulate import SEGMENTS, laid_over, simulate_weave
from woven_rods import woven_sample

LIMIT = 6.0


@cache
def dome() -> Weave:
    return woven_sample("hemisphere", "plain")


@cache
def compensated() -> Compensation:
    return pipeline.compensate(dome(), supports="none", within=LIMIT)


def far_from_enough(weave: Weave, limit: float, **_options: Any) -> tuple[Ints, Floats]:
    """The first three nodes, from where the weave was drawn."""
    return np.arange(3), place_points(weave.axes, segments=SEGMENTS, metres=1.0).points


def test_a_released_weave_rests_within_the_limit_once_its_marks_are_compensated() -> None:
    found = compensated()
    assert found.before.departure_max > LIMIT
    assert found.after.is_stable
    assert found.after.departure_max <= LIMIT
    assert found.is_within
    assert found.verdict == "marks"
    assert len(found.held) == 0


def test_the_weave_that_is_to_be_cut_rests_near_the_first_drawing() -> None:
    found = compensated()
    alone = pipeline.simulate(found.weave, supports="none")
    weights = np.ones(len(alone.points))
    rests = laid_over(alone.points, found.before.drawn, weights=weights)[alone.point_of_visit]
    off = np.linalg.norm(rests - found.before.drawn[alone.point_of_visit], axis=1)
    assert off.max() <= LIMIT


def test_marks_move_and_rods_stay_the_same() -> None:
    found, weave = compensated(), dome()
    assert 0 < np.abs(found.mark_changes).max() < 10.0
    assert np.abs(found.length_changes).max() > 0
    assert found.weave.ids == weave.ids
    assert (found.weave.strands.nodes == weave.strands.nodes).all()
    assert (found.weave.joints.visit == weave.joints.visit).all()
    assert np.linalg.norm(found.weave.lattice.nodes - weave.lattice.nodes, axis=1).max() <= 1.5 * LIMIT
    assert found.weave.lattice.off_latitudes


def test_a_note_states_what_was_reached() -> None:
    note = compensated().weave.lattice.latitudes.surface.notes[-1]
    assert note.code == "COMPENSATED"
    numbers = dict(note.numbers)
    assert numbers["departure_max_after"] == pytest.approx(compensated().after.departure_max)
    assert numbers["departure_max_before"] == pytest.approx(compensated().before.departure_max)


def test_compensated_results_are_read_back_and_fabricated_with_their_marks(tmp_path: Path) -> None:
    found = compensated()
    pipeline.export(found.after, tmp_path / "cut.json")
    back = pipeline.read_result(tmp_path / "cut.json")
    assert isinstance(back, Equilibrium)
    assert back.departure_max == pytest.approx(found.after.departure_max)
    pipeline.fabricate(tmp_path / "cut.json", tmp_path / "bench")
    assert "COMPENSATED: Marks move" in (tmp_path / "bench" / "report.txt").read_text("utf-8")
    rows = (tmp_path / "bench" / "rods.csv").read_text("utf-8").splitlines()
    at = [line for line in rows if not line.startswith("#")]
    length = at[0].split(",").index("length")
    lengths = [float(line.split(",")[length]) for line in at[1:]]
    assert lengths == pytest.approx(found.weave.axes.lengths.tolist(), abs=0.01)


def test_supported_nodes_stay_where_they_were_drawn() -> None:
    before = pipeline.simulate(dome(), gravity=False)
    found = pipeline.compensate(dome(), gravity=False, within=0.7 * before.departure_max)
    border = dome().is_border_node
    assert np.linalg.norm((found.weave.lattice.nodes - dome().lattice.nodes)[border], axis=1).max() < 1e-9
    assert found.after.departure_max <= found.limit


def test_a_weave_that_keeps_its_shape_within_the_limit_is_left_as_drawn() -> None:
    found = pipeline.compensate(dome(), supports="none", within=1000.0)
    assert found.weave is dome()
    assert found.verdict == "as drawn"
    assert not found.mark_changes.any()


def test_where_no_marks_are_found_the_drawn_ones_stay_and_nodes_are_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compensate, "_NEAR", 0.0)
    monkeypatch.setattr(compensate, "_PARTS", ())
    found = pipeline.compensate(dome(), supports="none", within=2.0)
    assert found.before.departure_max > 2.0
    assert found.verdict == "held nodes"
    assert found.after.is_stable
    assert found.is_within
    assert not found.mark_changes.any()
    assert (np.flatnonzero(found.after.is_supported) == found.held).all()
    assert 3 <= len(found.held) < 60
    note = found.weave.lattice.latitudes.surface.notes[-1]
    assert note.code == "COMPENSATED"
    assert "no other marks" in note.text


def test_no_weave_comes_to_rest_after_the_work_is_spent(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[int] = []

    def simulated(*arguments: Any, **options: Any) -> Equilibrium:
        steps.append(options["most_steps"])
        return simulate_weave(*arguments, **options)

    monkeypatch.setattr(compensate, "simulate_weave", simulated)
    monkeypatch.setattr(compensate, "_MOST_WORK", 1.0)
    monkeypatch.setattr(compensate, "_NEAR", 0.0)
    monkeypatch.setattr(compensate, "nodes_to_hold", far_from_enough)
    found = pipeline.compensate(dome(), supports="none", within=0.01)
    assert steps == [12, 12]
    assert found.verdict == "out of reach"
    assert found.weave.lattice.latitudes.surface.notes[-1].code == "SPRINGS_BACK"


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan])
def test_limits_that_are_not_positive_are_refused(limit: float) -> None:
    with pytest.raises(Unsupported, match="positive"):
        pipeline.compensate(dome(), within=limit)


def test_a_limit_that_marks_do_not_reach_gives_a_doubt() -> None:
    found = pipeline.compensate(dome(), supports="none", within=1e-4, hold=False)
    assert not found.is_within
    assert found.verdict in ("out of reach", "unstable")
    assert found.weave.lattice.latitudes.surface.notes[-1].code == "SPRINGS_BACK"


def test_the_same_weave_gives_the_same_bytes(tmp_path: Path) -> None:
    again = pipeline.compensate(dome(), supports="none", within=LIMIT)
    for name, found in (("one.json", compensated()), ("two.json", again)):
        pipeline.export(found.after, tmp_path / name)
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    assert json.loads((tmp_path / "one.json").read_text("utf-8"))["equilibrium"]["departure"]["max"] <= LIMIT
