"""Rods of one diameter a family: layers, bending, clearance, results and the workshop folder."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fabricated import make, table
from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.model import FAMILIES, Weave
from weavecore.weaving.clashes import find_clashes
from woven_rods import tube_latitudes, woven_tube

THICK, THIN = 3.0, 1.5


@cache
def woven(pattern: str) -> Weave:
    lattice = pipeline.link(tube_latitudes(), pattern=pattern)
    return pipeline.weave(lattice, rod_diameter={"latitudinal": THICK, "longitudinal": THIN})


@pytest.mark.parametrize("pattern", ["triangular", "plain"])
def test_each_family_has_its_diameter(pattern: str) -> None:
    weave = woven(pattern)
    families = np.array(FAMILIES)[weave.strands.family]
    assert (weave.diameters == np.where(families == "latitudinal", THICK, THIN)).all()
    assert weave.rod_diameter == THICK


def test_rods_lie_half_of_both_diameters_apart() -> None:
    weave = woven("plain")
    joints = weave.joints
    offsets = weave.axes.layer_offsets[joints.visit]
    lower, upper = joints.contacts.T
    assert offsets[upper] - offsets[lower] == pytest.approx(np.full(len(lower), (THICK + THIN) / 2), rel=0.02)
    assert len(weave.clashes) == 0
    assert len(find_clashes(weave.axes, np.full(len(weave), THICK))) > 0


def test_the_bending_of_each_rod_is_that_of_its_diameter() -> None:
    weave, bending = woven("plain"), woven("plain").bending
    least = weave.material.least_bend
    assert bending.utilisation == pytest.approx(least * weave.diameters / bending.min_radius)


def test_the_largest_diameters_are_those_at_which_rods_in_proportion_just_pass() -> None:
    weave = woven("plain")
    part = float((weave.bending.largest_diameter / weave.diameters).min())
    grown = {name: part * size for name, size in weave.family_diameters.items()}
    assert pipeline.weave(weave.lattice, rod_diameter=grown).bending.utilisation.max() == pytest.approx(1.0, rel=0.02)


def test_one_diameter_for_all_is_the_same_as_that_for_each_family() -> None:
    one = woven_tube("plain", rod_diameter=THIN)
    each = pipeline.weave(one.lattice, rod_diameter=dict.fromkeys(FAMILIES, THIN))
    assert (one.axes.controls == each.axes.controls).all()
    assert (one.bending.utilisation == each.bending.utilisation).all()


@pytest.mark.parametrize(
    "given", [{"latitudinal": 3.0}, {"rings": 3.0}, {"latitudinal": 3.0, "longitudinal": 0.0}, {"longitudinal": 2.0}]
)
def test_families_without_a_positive_diameter_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(Unsupported):
        pipeline.weave(woven("plain").lattice, rod_diameter=given)


def test_a_result_keeps_the_diameters(tmp_path: Path) -> None:
    weave = woven("plain")
    pipeline.export(weave, tmp_path / "woven.json")
    again = pipeline.read_result(tmp_path / "woven.json")
    assert isinstance(again, Weave)
    assert (again.diameters == weave.diameters).all()


@pytest.mark.parametrize("pattern", ["triangular", "plain"])
def test_the_workshop_folder_has_no_bar_and_no_row_of_two_diameters(pattern: str) -> None:
    folder = make(woven(pattern))
    assert {finding.invariant for finding in folder.failed} <= {"rod_bending_utilisation", "splice_utilisation"}
    rods, bom = table(folder, "rods"), table(folder, "bom")
    assert bom.floats("diameter").tolist() == [THICK, THIN]
    assert set(rods.floats("diameter").tolist()) == {THICK, THIN}
    assert bom.floats("stock_count").sum() == len(table(folder, "nesting"))


@pytest.mark.parametrize("ending", [".obj", ".png", ".html", ".3dm"])
def test_all_outputs_take_rods_of_two_diameters(ending: str, tmp_path: Path) -> None:
    pipeline.export(woven("plain"), tmp_path / f"woven{ending}")
