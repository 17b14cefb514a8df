"""No rod turns by more than 45° at a joint: on a saddle, at the corners of a border, and around a narrow tongue."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.geometry.arrays import next_in_loop, rows_of
from weavecore.model import Weave
from weavecore.model.lattice import LATITUDINAL
from woven_plates import woven_plate

PATTERNS = ["triangular", "plain", "kagome"]


def turns_of(weave: Weave) -> np.ndarray:
    """Degrees by which the rods turn at the nodes that they pass, rings included."""
    strands = weave.strands
    after = next_in_loop(strands.offsets)
    steps = weave.lattice.nodes[strands.nodes[after]] - weave.lattice.nodes[strands.nodes]
    inner = strands.closed[rows_of(strands.offsets)].copy()
    inner |= after > np.arange(len(after))
    arrives, leaves = np.flatnonzero(inner), after[inner]
    passes = inner[leaves]
    one, other = steps[arrives[passes]], steps[leaves[passes]]
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(1)))


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("shape", ["tongue", "square", "saddle"])
def test_no_rod_turns_by_more_than_45_degrees_at_a_joint(shape: str, pattern: str) -> None:
    assert turns_of(woven_plate(shape, pattern)).max() <= 45.0


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("shape", ["tongue", "square", "saddle"])
def test_nearly_all_rods_bend_in_the_diameter_that_is_chosen(shape: str, pattern: str) -> None:
    weave = woven_plate(shape, pattern)
    assert len(weave.bending.violations) <= max(1, 0.04 * len(weave))


@pytest.mark.parametrize("pattern", ["triangular", "plain"])
def test_rings_that_would_turn_round_a_tongue_are_broken_at_its_tip(pattern: str) -> None:
    weave = woven_plate("tongue", pattern)
    rings = np.flatnonzero(weave.strands.family == LATITUDINAL)
    at_tip = weave.lattice.nodes[:, 1] > 310.0
    reach = np.array([at_tip[weave.strands.strand(s)].any() for s in rings.tolist()])
    assert reach.sum() >= 2
    assert not weave.strands.closed[rings[reach]].any()
    ends = weave.end_nodes
    assert at_tip[ends].sum() >= 4
    assert f"{weave.n_ends_inside} ends inside" in dict(pipeline.describe(weave))["rods"]
