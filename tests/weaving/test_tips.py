"""Ends of rods run on past the others at their joint: there is room for them, or they are shorter."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.geometry.splines import fit_splines
from weavecore.model import Weave
from weavecore.weaving.axes import OVERHANG_DIAMETERS
from weavecore.weaving.overhangs import clear_overhangs, with_overhangs
from weavecore.weaving.weave import move_nodes
from woven_plates import woven_plate
from woven_rods import woven_sample


def room_beside_ends(weave: Weave) -> np.ndarray:
    """(S, 2) the length of the edge beside each end."""
    first, last = weave.strands.offsets[:-1], weave.strands.offsets[1:] - 1
    points = weave.axes.points
    return np.linalg.norm(np.stack([points[first + 1] - points[first], points[last] - points[last - 1]], 1), axis=2)


@pytest.mark.parametrize("pattern", ["triangular", "plain"])
def test_rods_that_are_broken_around_a_tongue_pass_each_other(pattern: str) -> None:
    weave = woven_plate("tongue", pattern)
    assert weave.n_ends_inside > 50
    assert len(weave.clashes) == 0


def test_there_is_room_for_overhangs_where_other_rods_are_too_thick_to_be_bent() -> None:
    weave = woven_sample("minimal_surface", "triangular", 0.52)
    assert (weave.bending.utilisation > 1.0).any()
    assert len(weave.clashes) < 40  # 167 without the room.


def test_an_overhang_that_clashes_is_shortened_to_five_diameters_at_least() -> None:
    weave = woven_plate("saddle", "kagome")
    long = with_overhangs(weave, OVERHANG_DIAMETERS * weave.rod_diameter)
    points, strands = long.axes.points, long.strands
    rows = fit_splines(points, strands.offsets, strands.closed)
    overhangs, clashes = clear_overhangs(points, rows, strands, long.axes.overhangs, long.diameters)
    shorter = overhangs < long.axes.overhangs - 1e-12
    assert shorter.any()
    assert len(clashes) < len(long.clashes)
    assert overhangs[shorter].min() >= 5.0 * weave.rod_diameter - 1e-9
    rods = np.flatnonzero(shorter.any(axis=1))
    assert np.isin(rods, long.clashes.strands).all()
    again = with_overhangs(long, OVERHANG_DIAMETERS * weave.rod_diameter)
    np.testing.assert_allclose(again.axes.controls, long.axes.controls, atol=1e-9 * weave.rod_diameter)


def test_all_other_overhangs_are_of_ten_diameters_or_two_fifths_of_the_edge() -> None:
    weave = woven_sample("hemisphere", "plain")
    open_ = ~weave.strands.closed
    usual = np.minimum(OVERHANG_DIAMETERS * weave.rod_diameter, 0.4 * room_beside_ends(weave))
    assert np.allclose(weave.axes.overhangs[open_], usual[open_])
    assert (weave.axes.overhangs[~open_] == 0.0).all()


def test_rods_through_nodes_that_stay_keep_the_layers_that_they_were_woven_in() -> None:
    weave = woven_sample("narrow_neck", "plain")
    again = move_nodes(weave, weave.lattice.nodes)
    assert (again.axes.layer_offsets == weave.axes.layer_offsets).all()
    assert np.abs(again.axes.points - weave.axes.points).max() < 1e-3
    assert np.abs(again.axes.overhangs - weave.axes.overhangs).max() < 1e-3
    assert len(again.clashes) == len(weave.clashes)
