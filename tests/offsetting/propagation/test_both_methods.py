"""Each method is the other's check: on every sample they agree."""

from functools import cache
from pathlib import Path

import pytest

from comparing import AGREED, compare
from stages import Woven, hold
from weavecore import pipeline
from weavecore.validating import validate
from weavecore.weaving.strands import find_strands

FOLDER = Path(__file__).resolve().parents[3] / "sample_files"
SAMPLES = sorted(path.stem for path in FOLDER.glob("*.3dm"))


@cache
def offset(name, method):
    surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
    return pipeline.offset(surface, spacing=pipeline.suggest_spacing(surface), method=method)


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_offset_by_fronts_keeps_all_promises(name):
    report = validate(offset(name, "fronts"))
    assert report.holds, f"\n{report}"


@pytest.mark.parametrize("name", SAMPLES)
def test_both_methods_give_as_many_polylines_with_the_same_parents(name):
    comparison = compare(offset(name, "levels"), offset(name, "fronts"))
    assert comparison.same_counts, comparison.counts
    assert comparison.same_parents


@pytest.mark.parametrize("name", SAMPLES)
def test_polylines_of_both_methods_lie_together_but_for_the_tips_of_tongues(name):
    comparison = compare(offset(name, "levels"), offset(name, "fronts"))
    assert comparison.mean < 0.003
    assert comparison.apart < 0.01
    assert comparison.farthest_outside < 3 * AGREED


@pytest.mark.parametrize("name", ["hourglass", "handle", "shell_2400x1600"])
def test_what_fronts_give_can_be_woven(name):
    lattice = pipeline.link(offset(name, "fronts"))
    hold(Woven(offset(name, "fronts"), lattice, find_strands(lattice)))
