from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.model import Replay, Weave
from weavecore.simulating import replay
from weavecore.simulating.replay import chosen_steps
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_tube


@cache
def tube() -> Weave:
    return woven_tube("triangular")


@cache
def replayed(supports: str = "borders", most: int = 6) -> Replay:
    return pipeline.replay(tube(), supports=supports, most_steps=most)


@pytest.mark.parametrize("supports", ["borders", "none"])
def test_the_last_step_is_the_finished_weave_at_rest(supports: str) -> None:
    found, whole = replayed(supports), pipeline.simulate(tube(), supports=supports)
    visits = np.linalg.norm((whole.points - whole.drawn)[whole.point_of_visit], axis=1)
    assert found.is_converged.all()
    assert found.step[-1] == len(tube()) - 1
    assert found.n_rods[-1] == len(tube())
    assert found.displacement[-1] == pytest.approx(visits.max(), rel=1e-3)
    assert found.stress[-1] == pytest.approx(whole.stress_max, rel=0.02)


def test_rods_are_added_and_unfinished_weaves_move_further() -> None:
    found = replayed()
    assert (np.diff(found.n_rods) >= 0).all()
    assert found.n_rods[0] < len(tube())
    assert found.displacement[found.worst] > found.displacement[-1]
    assert found.loads == "self-weight"


def test_steps_are_spread_over_the_sequence_and_end_with_the_last() -> None:
    sequence = find_sequence(tube())
    for most in (1, 2, 5, 1000):
        steps = chosen_steps(sequence, most)
        assert len(steps) <= most
        assert (np.diff(steps) > 0).all()
        assert steps[-1] == len(sequence) - 1


def test_a_first_step_without_ties_moves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay, "chosen_steps", lambda _sequence, _most: np.array([0]))
    found = pipeline.replay(tube(), supports="none")
    assert found.n_rods[0] == 0
    assert found.node[0] == -1
    assert found.displacement[0] == 0.0


def test_json_lists_the_steps_and_the_worst(tmp_path: Path) -> None:
    pipeline.write_replay(replayed(), tmp_path / "steps.json")
    document = json.loads((tmp_path / "steps.json").read_text("utf-8"))
    assert [row["step"] for row in document["steps"]] == replayed().step.tolist()
    worst = document["steps"][document["worst"]["displacement"]]
    assert worst["displacement"] == max(row["displacement"] for row in document["steps"])


def test_a_replay_of_no_step_is_refused() -> None:
    with pytest.raises(Unsupported, match="shows nothing"):
        pipeline.replay(tube(), most_steps=0)
