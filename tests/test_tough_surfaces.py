"""One of each tough surface is woven and keeps all promises; ``tests/sweep.py`` weaves them by the hundred."""

from __future__ import annotations

import numpy as np
import pytest

from stages import hold, weave
from tough_origins import started
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import Degenerate
from weavecore.model import SurfaceMesh
from weavecore.validating import validate

# Folded more sharply than a right angle: a face whose corners lie on both sides may look away from one of them.
KNIFE_FOLDED = {"two_triangles"}

TOO_SHARP_FOR_FRONTS = {"crumpled", "neck"}

every_surface = pytest.mark.parametrize("name", sorted(TOUGH))


@every_surface
def test_a_surface_is_valid_and_the_same_each_time(name: str) -> None:
    vertices, faces = TOUGH[name](7)
    surface = SurfaceMesh(vertices, faces)
    assert np.array_equal(np.unique(surface.faces), np.arange(surface.n_vertices))
    again = TOUGH[name](7)
    assert np.array_equal(vertices, again[0])
    assert np.array_equal(faces, again[1])
    assert not np.array_equal(vertices, TOUGH[name](8)[0])


@pytest.mark.parametrize("name", sorted(set(TOUGH) - KNIFE_FOLDED))
def test_a_surface_is_woven(name: str) -> None:
    hold(weave(pipeline.surface_from(TOUGH[name](0))))


@pytest.mark.parametrize("name", sorted(KNIFE_FOLDED))
def test_a_knife_fold_is_woven_but_for_faces_across_it(name: str) -> None:
    woven = weave(pipeline.surface_from(TOUGH[name](0)))
    findings = [*validate(woven.latitudes), *validate(woven.lattice), *validate(woven.strands, lattice=woven.lattice)]
    assert {finding.name for finding in findings if not finding.holds} <= {"flipped_faces_share"}


@every_surface
def test_a_surface_is_woven_from_a_part_of_its_borders(name: str) -> None:
    hold(weave(started(pipeline.surface_from(TOUGH[name](0)), np.random.default_rng(0))))


@pytest.mark.parametrize("name", sorted(set(TOUGH) - TOO_SHARP_FOR_FRONTS))
def test_the_papers_method_offsets_a_part_of_the_borders_too(name: str) -> None:
    surface = started(pipeline.surface_from(TOUGH[name](0)), np.random.default_rng(0))
    latitudes = pipeline.offset(surface, method="fronts")
    for report in (validate(latitudes), validate(pipeline.link(latitudes))):
        assert report.holds, f"\n{report}"


@pytest.mark.parametrize("name", sorted(TOO_SHARP_FOR_FRONTS))
def test_what_is_too_sharp_for_the_papers_method_is_refused(name: str) -> None:
    surface = started(pipeline.surface_from(TOUGH[name](0)), np.random.default_rng(0))
    with pytest.raises(Degenerate, match="levels"):
        pipeline.offset(surface, method="fronts")


def test_a_surface_that_the_papers_method_would_leave_bare_in_part_is_refused() -> None:
    draw = np.random.default_rng([22002, *b"crumpled"])
    surface = started(pipeline.surface_from(TOUGH["crumpled"](22002)), draw)
    with pytest.raises(Degenerate, match="levels"):
        pipeline.offset(surface, method="fronts")
