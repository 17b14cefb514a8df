"""Rods that are broken are fitted anew near the breaks only: that must lead where a fit of all rods leads."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bound_rings import dumbbell, linked
from weavecore import pipeline
from weavecore.model import Lattice
from weavecore.weaving import weave as weaving
from weavecore.weaving.axes import nodes_around
from weavecore.weaving.strands import find_strands


@cache
def latticed() -> Lattice:
    lattice: Lattice = linked(dumbbell(), 0.12)
    return lattice


def test_a_weave_with_breaks_is_the_one_that_fits_of_all_rods_give(monkeypatch: pytest.MonkeyPatch) -> None:
    near = pipeline.weave(latticed(), stock=(0.002,))
    assert len(near) > len(find_strands(latticed())) + 10
    monkeypatch.setattr(
        weaving, "_same_visits", lambda _lattice, strands, _joints, _like: -np.ones(len(strands.nodes), int)
    )
    whole = pipeline.weave(latticed(), stock=(0.002,))
    np.testing.assert_array_equal(near.strands.nodes, whole.strands.nodes)
    np.testing.assert_allclose(near.axes.points, whole.axes.points, atol=1e-3 * near.rod_diameter)
    np.testing.assert_allclose(near.bending.largest_diameter, whole.bending.largest_diameter, rtol=1e-3)


def test_a_change_is_felt_along_the_rods_that_pass_it() -> None:
    strands = find_strands(latticed())
    nodes = np.zeros(latticed().n_nodes, bool)
    nodes[strands.strand(0)[3]] = True
    felt = nodes_around(strands, nodes, 2)
    assert felt[strands.strand(0)[1:6]].all()
    assert nodes_around(strands, nodes, 1).sum() < felt.sum() < 40
