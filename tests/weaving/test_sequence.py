"""The order of construction: what stands before what, and when joints are tied."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.model import LATITUDINAL, Weave
from weavecore.model.sequence import BuildSequence
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_sample, woven_tube

WOVEN = [
    ("tube", "triangular"),
    ("tube", "plain"),
    ("hemisphere", "twill"),
    ("hemisphere", "hexagonal"),
    ("hemisphere", "diagonal"),
    ("six_way_joint", "triangular"),
    ("six_way_joint", "kagome"),
]


def weave_of(name: str, pattern: str) -> Weave:
    # With a diameter of its own: no ring is broken for being bent too much.
    return woven_tube(pattern) if name == "tube" else woven_sample(name, pattern, rod_diameter=0.4)


def steps_of(sequence: BuildSequence) -> np.ndarray:
    """The step of each strand."""
    step = np.empty(len(sequence), int)
    step[sequence.strand] = np.arange(len(sequence))
    return step


@pytest.mark.parametrize(("name", "pattern"), WOVEN)
def test_every_rod_is_set_once_and_every_joint_tied_once_when_its_last_rod_stands(name: str, pattern: str) -> None:
    weave = weave_of(name, pattern)
    sequence = find_sequence(weave)
    assert sorted(sequence.strand.tolist()) == list(range(len(weave)))
    assert sorted(sequence.tied.tolist()) == list(range(len(weave.joints)))
    step, joints = steps_of(sequence), weave.joints
    for k in range(len(sequence)):
        for j in sequence.tied_at(k).tolist():
            rods = joints.strand[joints.offsets[j] : joints.offsets[j + 1]]
            assert step[rods].max() == k


@pytest.mark.parametrize(("name", "pattern"), WOVEN)
def test_nothing_needs_what_comes_later(name: str, pattern: str) -> None:
    sequence = find_sequence(weave_of(name, pattern))
    assert all((sequence.needed_by(k) < k).all() for k in range(len(sequence)))
    assert len(sequence.after) > 0


@pytest.mark.parametrize(("name", "pattern"), [one for one in WOVEN if one[1] in ("triangular", "plain", "twill")])
def test_borders_come_first_and_parents_before_children(name: str, pattern: str) -> None:
    weave = weave_of(name, pattern)
    sequence, latitudes = find_sequence(weave), weave.lattice.latitudes
    step, strands = steps_of(sequence), weave.strands
    ring_of = {
        int(weave.lattice.node_latitude[strands.strand(s)[0]]): s
        for s in np.flatnonzero(strands.family == LATITUDINAL).tolist()
    }
    linked = np.unique(weave.lattice.node_latitude[weave.lattice.node_latitude >= 0])
    assert sorted(ring_of) == linked.tolist()
    n_borders = len(latitudes.surface.borders)
    assert sorted(step[ring_of[p]] for p in range(n_borders)) == list(range(n_borders))
    assert all(
        step[ring_of[parent]] < step[ring_of[child]] for parent, child in latitudes.parents.tolist() if child in linked
    )


@pytest.mark.parametrize(("name", "pattern"), [one for one in WOVEN if one[1] != "diagonal"])
def test_a_rod_is_woven_in_as_soon_as_two_rings_that_follow_each_other_along_it_stand(name: str, pattern: str) -> None:
    weave = weave_of(name, pattern)
    sequence, strands = find_sequence(weave), weave.strands
    step = steps_of(sequence)
    is_ring = (strands.family == LATITUDINAL) & strands.closed
    ring_at = {int(node): s for s in np.flatnonzero(is_ring).tolist()[::-1] for node in strands.strand(s)}
    for s in np.flatnonzero(~is_ring).tolist():
        met = [ring_at[node] for node in strands.strand(s).tolist() if node in ring_at]
        pairs = [max(step[a], step[b]) for a, b in zip(met, met[1:]) if a != b] or [step[r] for r in met[:1]]
        if not pairs:
            continue
        ready = min(pairs)
        assert ready < step[s]
        assert sequence.generation[ready] == sequence.generation[step[s]]
        assert {int(sequence.strand[k]) for k in sequence.needed_by(int(step[s]))} <= set(met)


def test_rods_are_woven_in_between_the_rings_and_go_around_them() -> None:
    weave = woven_tube("plain")
    sequence = find_sequence(weave)
    names = [weave.ids[s] for s in sequence.strand.tolist()]
    rods = [name for name in names if name[0] != "L"]
    assert names[:4] == ["L01", "L02", "L03", "L04"]
    assert names[4 + len(rods) :] == [f"L{k:02d}" for k in range(5, len(names) - len(rods) + 1)]
    beside = [weave.axes.points[weave.axes.offsets[s]] for s in sequence.strand[~sequence.is_ring].tolist()]
    steps = np.linalg.norm(np.diff(beside, axis=0), axis=1)
    assert steps.max() < 1.5 * np.median(steps)


def test_without_inner_rings_the_rods_go_around_the_border() -> None:
    weave = woven_sample("hemisphere", "diagonal")
    sequence, strands = find_sequence(weave), weave.strands
    assert sequence.is_ring.tolist() == [True] + [False] * (len(weave) - 1)
    border = {node: k for k, node in enumerate(strands.strand(int(sequence.strand[0])).tolist())}
    places = [[border[n] for n in strands.strand(s).tolist() if n in border] for s in sequence.strand[1:].tolist()]
    first = [at[0] for at in places if len(at) == 1]
    assert len(first) > 20
    assert first == sorted(first)
