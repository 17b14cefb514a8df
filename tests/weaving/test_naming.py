from __future__ import annotations

import re

import numpy as np
import pytest

from weavecore import pipeline
from woven_rods import tube_latitudes, woven_sample, woven_tube


@pytest.mark.parametrize("pattern", ["triangular", "kagome", "plain", "hexagonal", "diagonal"])
def test_ids_are_a_letter_and_a_number_and_differ(pattern: str) -> None:
    weave = woven_tube(pattern)
    assert all(re.fullmatch(r"[LABP]\d{2,4}", name) for name in weave.ids)
    assert len(set(weave.ids)) == len(weave)


def test_ids_stay_with_their_rods_when_the_spacing_changes_a_little() -> None:
    before = woven_tube("plain")
    lattice = pipeline.link(tube_latitudes(300.0, 540.0, 60.3), pattern="plain")
    after = pipeline.weave(lattice, rod_diameter=5.0)
    assert sorted(before.ids) == sorted(after.ids)
    for name in before.ids:
        middles = []
        for weave in (before, after):
            s = weave.ids.index(name)
            middles.append(weave.lattice.nodes[weave.strands.strand(s)].mean(0))
        assert np.linalg.norm(middles[0] - middles[1]) < 60


def test_the_two_diagonals_have_letters_of_their_own_and_cross_at_every_inner_node() -> None:
    weave = woven_tube("triangular")
    letters = {}
    for node, strand in zip(weave.joints.node[weave.joints.joint].tolist(), weave.joints.strand.tolist()):
        letters.setdefault(node, []).append(weave.ids[strand][0])
    regular = ["".join(sorted(letters[n])) for n in letters if not weave.is_border_node[n] and len(letters[n]) == 3]
    assert regular.count("ABL") > 0.9 * len(regular)


def test_borders_are_the_first_latitudes() -> None:
    weave = woven_sample("hourglass", "triangular")
    for name in ("L01", "L02"):
        assert weave.is_border_node[weave.strands.strand(weave.ids.index(name))].all()


def test_ends_inside_are_those_that_no_border_has() -> None:
    tube, ball = woven_tube("kagome"), woven_sample("hemisphere", "triangular")
    assert tube.n_ends_inside == 0
    inside = 0
    for s in np.flatnonzero(~ball.strands.closed).tolist():
        nodes = ball.strands.strand(s)
        inside += sum(ball.lattice.nodes[n, 2] > ball.lattice.nodes[:, 2].min() + 1.0 for n in (nodes[0], nodes[-1]))
    assert ball.n_ends_inside == inside
