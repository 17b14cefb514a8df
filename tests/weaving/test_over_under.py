from __future__ import annotations

import numpy as np
import pytest

from weavecore.errors import Unsupported
from weavecore.geometry.spanning import spread_signs, spread_sums
from weavecore.model import LATITUDINAL, POCKET
from weavecore.weaving.twill import settle_phases
from woven_rods import sides_along, woven_sample, woven_tube


def changes_sides(sides: list[int], *, closed: bool) -> bool:
    pairs = zip(sides, sides[1:] + sides[:1] if closed else sides[1:])
    return all(a * b <= 0 for a, b in pairs)


# One surface of each kind: no border, a handle, two borders, six borders, a border that pinches itself.
@pytest.mark.parametrize("name", ["closed_body", "handle", "hourglass", "six_way_joint", "narrow_neck"])
def test_kagome_alternates_without_a_single_conflict(name: str) -> None:
    weave = woven_sample(name, "kagome")
    assert len(weave.conflicts) == 0
    for s in range(len(weave)):
        assert changes_sides(sides_along(weave, s), closed=bool(weave.strands.closed[s]))


@pytest.mark.parametrize("pattern", ["plain", "diagonal", "kagome"])
def test_a_tube_is_woven_plainly_without_a_conflict(pattern: str) -> None:
    weave = woven_tube(pattern)
    assert len(weave.conflicts) == 0
    for s in range(len(weave)):
        assert changes_sides(sides_along(weave, s), closed=bool(weave.strands.closed[s]))


def test_two_rods_meet_at_a_joint_of_a_kagome_and_three_on_its_borders() -> None:
    weave = woven_tube("kagome")
    counts = np.diff(weave.joints.offsets)
    on_border = weave.is_border_node[weave.joints.node]
    assert set(counts[~on_border].tolist()) == {2}
    assert set(counts[on_border].tolist()) == {3}


def test_a_border_ring_lies_between_the_ends_of_the_rods_that_it_holds() -> None:
    weave = woven_tube("kagome")
    border = {
        name for name, s in zip(weave.ids, range(len(weave))) if weave.is_border_node[weave.strands.strand(s)].all()
    }
    assert len(border) == 2
    for name in border:
        assert set(sides_along(weave, weave.ids.index(name))) == {0}


def test_a_twill_goes_over_two_and_under_two() -> None:
    weave = woven_tube("twill")
    assert (weave.over_under, len(weave.conflicts)) == ("twill 2/2", 0)
    for s in np.flatnonzero(weave.strands.family == LATITUDINAL).tolist():
        sides = sides_along(weave, s)
        assert len(sides) % 4 == 0
        assert sum(abs(a - b) // 2 for a, b in zip(sides, sides[1:] + sides[:1])) == len(sides) // 2
        assert all(sides[k] != sides[k - 2] for k in range(len(sides)))


def test_a_twill_steps_aside_from_ring_to_ring() -> None:
    weave = woven_tube("twill")
    longitudes = np.flatnonzero(weave.strands.family != LATITUDINAL)
    assert len(longitudes)
    for s in longitudes.tolist():
        sides = sides_along(weave, s)
        assert all(sides[k] != sides[k - 2] for k in range(2, len(sides)))


def test_a_surface_of_plain_bands_is_woven_plainly_without_a_conflict() -> None:
    weave = woven_sample("hourglass", "plain", coarser=1.0)
    assert len(set(np.bincount(weave.lattice.node_latitude[weave.lattice.node_latitude >= 0]).tolist())) > 1
    assert set(np.diff(weave.lattice.face_offsets).tolist()) == {4}
    assert len(weave.conflicts) == 0


def test_a_dome_has_conflicts_in_its_pocket_alone() -> None:
    weave = woven_sample("hemisphere", "plain", coarser=1.0)
    lattice = weave.lattice
    in_pocket = np.unique(lattice.edges[lattice.edge_family == POCKET])
    assert len(weave.conflicts) < 0.01 * len(weave.joints)
    assert np.isin(weave.conflicts[:, 1:], in_pocket).all()


def test_conflicts_are_listed_by_the_joints_where_a_rod_stays_on_its_side() -> None:
    weave = woven_sample("narrow_neck", "plain")
    assert len(weave.conflicts)
    listed = {(s, frozenset((a, b))) for s, a, b in weave.conflicts.tolist()}
    side = {}
    for j in range(len(weave.joints)):
        rods = weave.joints.strand[weave.joints.offsets[j] : weave.joints.offsets[j + 1]].tolist()
        side.update({(rod, int(weave.joints.node[j])): k for rod, k in ((rods[0], -1), (rods[-1], 1))})
    for s in range(len(weave)):
        nodes = weave.strands.strand(s).tolist()
        for a, b in zip(nodes, nodes[1:]):
            stays = side.get((s, a), 0) * side.get((s, b), 0) > 0
            assert stays == ((s, frozenset((a, b))) in listed)


def test_every_pair_of_rods_at_a_joint_is_a_crossing_once() -> None:
    weave = woven_tube("triangular")
    counts = np.diff(weave.joints.offsets)
    assert len(weave.crossings) == (counts * (counts - 1) // 2).sum()
    height = {}
    for node, strand, visit in zip(
        weave.joints.node[weave.joints.joint].tolist(), weave.joints.strand.tolist(), weave.joints.visit.tolist()
    ):
        height[node, strand] = weave.axes.layer_offsets[visit]
    assert all(height[node, over] > height[node, under] for node, over, under in weave.crossings.tolist())


def test_a_weave_that_is_not_known_is_refused() -> None:
    with pytest.raises(Unsupported, match="twill 2/2"):
        woven_tube("quad", 5.0, "basket")


def test_values_along_a_spanning_forest_meet_all_ties_that_agree() -> None:
    rng = np.random.default_rng(1)
    x = rng.integers(-9, 10, 40)
    a, b = rng.integers(0, 40, (2, 90))
    a, b = a[a != b], b[a != b]
    found = spread_sums(a, b, x[b] - x[a], 40)
    assert np.array_equal(found[b] - found[a], x[b] - x[a])
    signs = rng.choice([-1, 1], 40)
    found = spread_signs(a, b, signs[a] * signs[b], 40)
    assert np.array_equal(found[a] * found[b], signs[a] * signs[b])


@pytest.mark.parametrize("seed", range(6))
def test_no_single_joint_of_a_twill_would_do_better_with_another_phase(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n, cycle = 30, 4
    one, other = (draw.integers(0, n, 90) for _ in "ab")
    a, b = one[one != other], other[one != other]
    rise, start = draw.choice([-1, 1], len(a)), draw.integers(0, 9, n)

    def held(phase: np.ndarray) -> int:
        return int(((phase[b] - phase[a] - rise) % cycle == 0).sum())

    phase = settle_phases(a, b, rise, start, cycle)
    assert held(phase) >= held(start)
    for joint in range(n):
        for other_phase in range(cycle):
            changed = phase.copy()
            changed[joint] = other_phase
            assert held(changed) <= held(phase)
