from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from weavecore.model import Weave
from weavecore.weaving.axes import _common_normals
from woven_rods import curve_of, woven_sample, woven_tube

WEAVES = [("tube", pattern) for pattern in ("triangular", "quad", "kagome", "diagonal", "hexagonal", "twill")] + [
    ("hemisphere", "triangular"),
    ("hemisphere", "kagome"),
    ("closed_body", "plain"),
]

MOST_OFF = {("tube", "hexagonal"): 0.1, ("closed_body", "plain"): 0.16}
"""Where many rods end at a node they lie on one another there at sharp angles."""


def weave_of(name: str, pattern: str) -> Weave:
    return woven_tube(pattern) if name == "tube" else woven_sample(name, pattern, 2.0)


def near_joint(weave: Weave, visit: int) -> np.ndarray:
    """Points of an axis, a tenth of a diameter apart, up to three diameters from a joint."""
    axes, s = weave.axes, int(weave.axes.strand[visit])
    at = axes.parameters[visit] + np.linspace(-3, 3, 61) * weave.rod_diameter
    return curve_of(weave, s)(at % axes.ends[s] if axes.closed[s] else np.clip(at, 0, axes.ends[s]))


@pytest.mark.parametrize(("name", "pattern"), WEAVES)
def test_rods_that_touch_are_a_diameter_apart_at_every_joint_or_are_told(name: str, pattern: str) -> None:
    weave = weave_of(name, pattern)
    contacts = weave.joints.visit[weave.joints.contacts]
    assert len(contacts) > 50
    gaps = np.array([cdist(near_joint(weave, a), near_joint(weave, b)).min() for a, b in contacts.tolist()])
    clashing = {tuple(pair) for pair in weave.clashes.strands.tolist()}
    pairs = np.sort(weave.axes.strand[contacts], axis=1)
    told = np.array([tuple(pair) in clashing for pair in pairs.tolist()])
    off = np.abs(gaps - weave.rod_diameter) > 0.1
    assert off.mean() < MOST_OFF.get((name, pattern), 0.02)
    assert told[off].all()


@pytest.mark.parametrize(("name", "pattern"), [("tube", "triangular"), ("tube", "plain"), ("hemisphere", "kagome")])
def test_no_other_pair_of_rods_is_nearer(name: str, pattern: str) -> None:
    weave = weave_of(name, pattern)
    assert len(weave.clashes) == 0
    rods = [curve_of(weave, s)(np.arange(0, weave.axes.ends[s], 2.0)) for s in range(len(weave))]
    points, owner = np.concatenate(rods), np.repeat(np.arange(len(rods)), [len(rod) for rod in rods])
    a, b = cKDTree(points).query_pairs(0.98 * weave.rod_diameter, output_type="ndarray").T
    assert (owner[a] == owner[b]).all()


def test_rods_too_thick_for_their_spacing_are_told_as_clashes() -> None:
    weave = woven_tube("diagonal", 24.0)
    assert len(weave.clashes) > 0
    for (a, b), distance, point in zip(weave.clashes.strands.tolist(), weave.clashes.distance, weave.clashes.point):
        assert distance < weave.rod_diameter
        for s in (a, b):
            axis = curve_of(weave, s)(np.linspace(0, weave.axes.ends[s], 4000))
            assert np.linalg.norm(axis - point, axis=1).min() < distance / 2 + 0.5


@pytest.mark.parametrize("pattern", ["triangular", "kagome"])
def test_nodes_are_found_again_from_the_axes_and_their_layers(pattern: str) -> None:
    weave = woven_tube(pattern)
    for s in range(len(weave)):
        part = slice(weave.axes.offsets[s], weave.axes.offsets[s + 1])
        nodes = weave.strands.strand(s)
        on_axis = curve_of(weave, s)(weave.axes.parameters[part])
        found = on_axis - weave.axes.layer_offsets[part][:, None] * weave.normals[nodes]
        assert np.abs(found - weave.lattice.nodes[nodes]).max() < 1e-6


def test_three_rods_at_a_node_lie_in_three_layers_with_the_ring_in_the_middle() -> None:
    weave = woven_tube("triangular")
    joints = weave.joints
    three = np.flatnonzero(np.diff(joints.offsets) == 3)
    assert len(three) > 0.9 * len(joints)
    rows = joints.offsets[three][:, None] + np.arange(3)
    assert {weave.ids[s][0] for s in joints.strand[rows[:, 1]].tolist()} == {"L"}
    heights = weave.axes.layer_offsets[joints.visit[rows]]
    assert np.allclose(heights, [-5.0, 0.0, 5.0], atol=0.15)


def test_layers_are_counted_out_of_the_surface() -> None:
    weave = woven_tube("triangular")
    outward = weave.lattice.nodes * (1, 1, 0)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert (weave.normals * outward).sum(1).min() > 0.9


@pytest.mark.parametrize("pattern", ["triangular", "hexagonal"])
def test_stations_and_lengths_are_arc_lengths(pattern: str) -> None:
    weave = woven_tube(pattern)
    axes = weave.axes
    for s in range(0, len(weave), 3):
        fine = np.linspace(0, axes.ends[s], 20_001)
        steps = np.linalg.norm(np.diff(curve_of(weave, s)(fine), axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        part = slice(axes.offsets[s], axes.offsets[s + 1])
        assert abs(axes.lengths[s] - along[-1]) < 0.01
        assert np.abs(axes.stations[part] - np.interp(axes.parameters[part], fine, along)).max() < 0.05


def test_a_closed_axis_goes_around_smoothly() -> None:
    weave = woven_tube("kagome")
    for s in np.flatnonzero(weave.strands.closed).tolist():
        curve = curve_of(weave, s)
        for order in range(3):
            start, end = curve.derivative(order)(0.0), curve.derivative(order)(weave.axes.ends[s])
            assert np.allclose(start, end, atol=1e-6 * max(1.0, np.abs(start).max()))


def test_where_rods_run_alongside_the_surface_decides_in_which_direction_they_are_stacked() -> None:
    along = np.array([[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]])
    normals = _common_normals(along, np.array([0, 0]), np.array([[0.0, 0.0, 1.0]]))
    assert np.allclose(normals, [[0.0, 0.0, 1.0]], atol=1e-6)
