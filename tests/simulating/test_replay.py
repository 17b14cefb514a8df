from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.model import BuildSequence, Replay, Weave
from weavecore.simulating import replay
from weavecore.simulating.replay import chosen_steps, improve_sequence
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


def test_spread_generations_keep_their_rods_and_their_needs() -> None:
    plain, spread = find_sequence(tube()), find_sequence(tube(), spread=(1,))
    assert sorted(spread.strand) == list(range(len(tube())))
    assert (spread.generation == plain.generation).all()
    assert (spread.is_ring == plain.is_ring).all()
    moved = spread.generation[plain.strand != spread.strand]
    assert set(moved.tolist()) == {1}
    needing = np.repeat(np.arange(len(tube())), np.diff(spread.after_offsets))
    assert (spread.after < needing).all()
    # The second rod of a spread generation is not beside the first: half of the others lie between them.
    at = np.flatnonzero((plain.generation == 1) & ~plain.is_ring)
    places = {strand: k for k, strand in enumerate(plain.strand[at].tolist())}
    first, second = (places[strand] for strand in spread.strand[at][:2].tolist())
    assert abs(second - first) >= len(at) // 4


def test_the_sequence_is_spread_where_it_moves_most_and_only_where_that_helps() -> None:
    kept = pipeline.replay(tube(), most_steps=6)

    def moving(generations: tuple[int, ...], size: float) -> Replay:
        step = np.flatnonzero(np.isin(find_sequence(tube()).generation, generations))[:1]
        moves = np.where(kept.step == kept.step[np.argmin(np.abs(kept.step - step[0]))], size, 0.0)
        return replace(kept, displacement=moves)

    sequence = find_sequence(tube())
    sizes = iter([9.0, 4.0, 5.0])
    tried: list[tuple[int, ...]] = []

    def find(spread: tuple[int, ...]) -> BuildSequence:
        tried.append(spread)
        return sequence

    found = improve_sequence(find, lambda _: moving((len(tried),), next(sizes)))
    assert tried[0] == ()
    assert len(tried) == 3
    assert found.spread == tried[1]
    assert found.displacement.max() == 4.0


def test_an_improved_sequence_moves_no_further_and_lists_its_rods(tmp_path: Path) -> None:
    plain, better = replayed(), pipeline.replay(tube(), most_steps=6, improve=True)
    assert better.displacement.max() <= plain.displacement.max()
    pipeline.write_replay(better, tmp_path / "steps.json")
    document = json.loads((tmp_path / "steps.json").read_text("utf-8"))
    assert sorted(document["sequence"]) == sorted(tube().ids)
    assert document["spread"] == list(better.spread)
    assert document["sequence"] == [tube().ids[s] for s in find_sequence(tube(), spread=better.spread).strand]


def test_a_replay_of_no_step_is_refused() -> None:
    with pytest.raises(Unsupported, match="shows nothing"):
        pipeline.replay(tube(), most_steps=0)


def test_the_workshop_folder_has_the_sequence_that_a_result_carries(tmp_path: Path) -> None:
    equilibrium = replace(pipeline.simulate(tube()), spread=(1, 2))
    pipeline.export(equilibrium, tmp_path / "relaxed.json")
    back = pipeline.read_result(tmp_path / "relaxed.json")
    assert back.spread == (1, 2)
    pipeline.fabricate(tmp_path / "relaxed.json", tmp_path / "bench")
    rows = (tmp_path / "bench" / "sequence.csv").read_text("utf-8").splitlines()
    header, *rows = [row for row in rows if not row.startswith("#")]
    rods = [row.split(",")[header.split(",").index("rod")] for row in rows]
    order = list(dict.fromkeys(rods))
    assert order == [tube().ids[s] for s in find_sequence(tube(), spread=(1, 2)).strand]
    assert order != [tube().ids[s] for s in find_sequence(tube()).strand]
