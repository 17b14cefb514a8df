"""Clashes: those that comparing every straight piece with every other one finds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from weavecore import pipeline
from weavecore.geometry.arrays import rows_of
from weavecore.geometry.closest import segment_distances
from weavecore.geometry.splines import fit_splines
from weavecore.model import RodAxes
from weavecore.weaving import joint_gaps
from weavecore.weaving.clashes import find_clashes
from woven_rods import tube_latitudes


def clashes_of_all_pieces(axes: RodAxes, diameter: float) -> dict[tuple[int, int], float]:
    """Least distance of each pair of rods, of those nearer than a diameter less its tolerance."""
    samples = axes.samples(diameter / 2)
    strand = rows_of(samples.offsets)
    start = np.flatnonzero(np.diff(strand) == 0)
    a, b = samples.points[start], samples.points[start + 1]
    least = 0.98 * diameter
    # Pieces are no longer than half a diameter.
    one, other = cKDTree((a + b) / 2).query_pairs(least + diameter / 2, output_type="ndarray").T
    distance, _ = segment_distances(a[one], b[one], a[other], b[other])
    apart = np.abs(samples.stations[start[one]] - samples.stations[start[other]])
    length = np.where(axes.closed, axes.lengths, np.inf)[strand[start[one]]]
    apart = np.minimum(apart, length - apart)
    owners = np.sort(strand[start][np.stack([one, other], axis=1)], axis=1)
    near = (distance < least) & ((owners[:, 0] != owners[:, 1]) | (apart >= 4 * diameter))
    found: dict[tuple[int, int], float] = {}
    for pair, gap in zip(map(tuple, owners[near].tolist()), distance[near].tolist()):
        found[pair] = min(gap, found.get(pair, np.inf))
    return found


@pytest.mark.parametrize("pattern", ["plain", "kagome"])
@pytest.mark.parametrize("part", [1.0, 1.6], ids=["as woven", "thicker"])
def test_they_are_those_of_all_pairs_of_pieces(pattern: str, part: float) -> None:
    lattice = pipeline.link(tube_latitudes(150.0, 180.0, 60.0), pattern=pattern)
    weave = pipeline.weave(lattice, rod_diameter=12.0)
    found = find_clashes(weave.axes, np.full(len(weave), part * 12.0))
    wanted = clashes_of_all_pieces(weave.axes, part * 12.0)
    assert {tuple(pair) for pair in found.strands.tolist()} == set(wanted)
    distances = [wanted[tuple(pair)] for pair in found.strands.tolist()]
    np.testing.assert_allclose(found.distance, distances, rtol=1e-9)
    assert (np.diff(found.distance) >= 0).all()
    assert part == 1.0 or len(found) > 20


def test_thin_rods_on_long_ways_clash_as_all_their_pieces_do() -> None:
    """Runs of 64 pieces are divided three times on the way to single ones."""
    weave = pipeline.weave(pipeline.link(tube_latitudes(150.0, 180.0, 60.0), pattern="plain"), rod_diameter=1.0)
    wanted = clashes_of_all_pieces(weave.axes, 1.4)
    found = find_clashes(weave.axes, np.full(len(weave), 1.4))
    assert {tuple(pair) for pair in found.strands.tolist()} == set(wanted)
    assert len(wanted) > 5


def test_only_the_pairs_asked_for_are_looked_at() -> None:
    weave = pipeline.weave(pipeline.link(tube_latitudes(150.0, 180.0, 60.0), pattern="plain"), rod_diameter=12.0)
    diameters = np.full(len(weave), 1.6 * 12.0)
    every = find_clashes(weave.axes, diameters)
    some = find_clashes(weave.axes, diameters, among=every.strands[::3])
    assert some.strands.tolist() == every.strands[::3].tolist()
    np.testing.assert_array_equal(some.distance, every.distance[::3])


def test_gaps_that_are_solved_for_are_those_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    weave = pipeline.weave(pipeline.link(tube_latitudes(150.0, 180.0, 60.0), pattern="triangular"), rod_diameter=6.0)
    axes, joints = weave.axes, weave.joints
    rows = fit_splines(axes.points, axes.offsets, axes.closed)
    n = len(joints.contacts)
    asked = axes.points, rows, weave.strands, joints, np.full(n, 6.0), np.zeros(n, bool), np.arange(n)
    solved = joint_gaps.gaps_at_joints(*asked)
    monkeypatch.setattr(joint_gaps, "_LEAST_SINE", 1.1)  # No angle is wide enough.
    sampled = joint_gaps.gaps_at_joints(*asked)
    np.testing.assert_allclose(solved, sampled, rtol=1e-4)
    assert (solved != sampled).mean() > 0.5
