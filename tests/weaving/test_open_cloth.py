"""Rods on surfaces of which selvedges cut the latitudes open: wefts from selvedge to selvedge, and rods along these."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from open_cloth import CLOTHS, EDGE, ROWS, SPACING, cloth_latitudes, woven_cloth
from weavecore.model import LATITUDINAL, LONGITUDINAL, Lattice, Strands, first_generations
from weavecore.validating.check_lattices import free_border_edges
from weavecore.weaving.naming import find_lean
from weavecore.weaving.sequence import find_sequence
from weavecore.weaving.strands import find_strands

WITH_LATITUDES = ("triangular", "plain")


def stretches_along_latitudes(lattice: Lattice, strands: Strands) -> Iterator[tuple[np.ndarray, bool]]:
    """The nodes of every stretch of a rod along a latitude, and whether it is closed."""
    family = lattice.edge_family[np.lexsort(lattice.edges.T[::-1])].tolist()
    kind = dict(zip(sorted(map(tuple, lattice.edges.tolist())), family))
    for s in range(len(strands)):
        nodes = strands.strand(s).tolist()
        along = [kind[min(pair), max(pair)] == LATITUDINAL for pair in zip(nodes, nodes[1:])]
        cuts = [0, *np.flatnonzero(np.diff(along)) + 1, len(along)]
        for start, stop in zip(cuts, cuts[1:]):
            if along[start]:
                yield np.array(nodes[start : stop + 1]), bool(strands.closed[s])


@pytest.mark.parametrize("name", CLOTHS)
@pytest.mark.parametrize("pattern", WITH_LATITUDES)
def test_every_latitude_is_one_rod_broken_only_where_it_turns_by_more_than_45_degrees_or_stays_long(
    name: str, pattern: str
) -> None:
    lattice, latitudes = woven_cloth(name, pattern).lattice, cloth_latitudes(name)
    strands = find_strands(lattice)
    n_edges = np.zeros(len(latitudes), int)
    for nodes, is_closed in stretches_along_latitudes(lattice, strands):
        on = set(lattice.node_latitude[nodes].tolist())
        assert len(on) == 1
        p = on.pop()
        n_edges[p] += len(nodes) - 1 + is_closed
        around = np.flatnonzero(lattice.node_latitude == p)
        around = around[np.argsort(lattice.node_station[around])]
        closed = bool(latitudes.polylines.closed[p])
        for end in () if is_closed else (nodes[0], nodes[-1]):
            k = int(np.flatnonzero(around == end)[0])
            if closed or 0 < k < len(around) - 1:
                before, here, after = lattice.nodes[around[[k - 1, k, (k + 1) % len(around)]]]
                one, other = here - before, after - here
                cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
                assert np.degrees(np.arccos(cosine)) > 44 or len(nodes) >= 8
    counts = np.bincount(lattice.node_latitude[lattice.node_latitude >= 0], minlength=len(latitudes))
    assert n_edges.tolist() == (counts - ~latitudes.polylines.closed).tolist()


def test_rods_end_on_selvedges_and_on_origins_alone() -> None:
    for pattern in ("plain", "diagonal", "kagome"):
        weave = woven_cloth("side", pattern)
        # The far border of the diagonal has a node more than the ring before it.
        assert weave.n_ends_inside <= (3 if pattern == "diagonal" else 0)
        ends = weave.lattice.nodes[weave.end_nodes[weave.is_border_node[weave.end_nodes]]]
        x, y = ends[:, 0], ends[:, 1]
        low, high = weave.lattice.nodes.min(0), weave.lattice.nodes.max(0)
        assert (np.isclose(x, low[0]) | np.isclose(x, high[0]) | np.isclose(y, low[1]) | np.isclose(y, high[1])).all()


def test_a_rod_runs_along_every_straight_selvedge() -> None:
    weave = woven_cloth("side", "plain")
    nodes, strands = weave.lattice.nodes, weave.strands
    corner = nodes.max(0)
    sides = []
    for s in np.flatnonzero(strands.family == LONGITUDINAL).tolist():
        place = nodes[strands.strand(s)]
        for axis in (0, 1):
            sides += [(axis, at) for at in (0.0, corner[axis]) if np.allclose(place[:, axis], at)]
    assert sorted(sides) == [(0, corner[0]), (1, 0.0), (1, corner[1])]


@pytest.mark.parametrize("name", ["side", "two sides", "path across"])
def test_rods_lean_forward_where_they_go_the_way_of_the_latitudes_as_they_go_deeper(name: str) -> None:
    """Latitudes run down where it gets deeper to the right, else up: so forward is down as a rod goes to the right."""
    weave = woven_cloth(name, "triangular")
    strands, lattice = weave.strands, weave.lattice
    lean = find_lean(strands, lattice)
    told = 0
    for s in np.flatnonzero(strands.family == LONGITUDINAL).tolist():
        step = np.diff(lattice.nodes[strands.strand(s)], axis=0)
        slant = -np.sign(step[:, 0]) * step[:, 1] / np.linalg.norm(step, axis=1)
        if abs(slant.sum()) > 0.4:
            told += 1
            assert lean[s] == np.sign(slant.sum())
    assert told > 12


@pytest.mark.parametrize("name", CLOTHS)
def test_rods_along_selvedges_lean_neither_way(name: str) -> None:
    weave = woven_cloth(name, "triangular")
    lattice, strands = weave.lattice, weave.strands
    hem = {frozenset(edge) for edge in lattice.edges[free_border_edges(lattice)].tolist()}
    lean = find_lean(strands, lattice)
    found = 0
    for s in np.flatnonzero(strands.family == LONGITUDINAL).tolist():
        nodes = strands.strand(s).tolist()
        if all(frozenset(pair) in hem for pair in zip(nodes, nodes[1:])):
            found += len(nodes) - 1 + strands.closed[s]
            assert lean[s] == 0
    assert found == len(hem)


@pytest.mark.parametrize("name", CLOTHS)
@pytest.mark.parametrize("pattern", ["triangular", "plain", "kagome"])
def test_wefts_are_set_in_the_order_of_the_generations_and_bound_as_soon_as_two_stand(name: str, pattern: str) -> None:
    weave = woven_cloth(name, pattern)
    sequence, strands = find_sequence(weave), weave.strands
    is_weft = strands.family == LATITUDINAL
    assert np.array_equal(sequence.is_ring, is_weft[sequence.strand])
    assert sequence.is_ring[0] or pattern == "kagome"  # whose rods run beside the latitudes
    assert (np.diff(sequence.generation) >= 0).all()
    step = np.empty(len(sequence), int)
    step[sequence.strand] = np.arange(len(sequence))
    weft_at = {int(node): s for s in np.flatnonzero(is_weft).tolist()[::-1] for node in strands.strand(s)}
    for s in np.flatnonzero(~is_weft).tolist():
        met = [weft_at[node] for node in strands.strand(s).tolist() if node in weft_at]
        pairs = [max(step[a], step[b]) for a, b in zip(met, met[1:]) if a != b]
        assert not pairs or min(pairs) < step[s]
    assert sorted(sequence.tied.tolist()) == list(range(len(weave.joints)))


def test_the_rods_of_a_cloth_go_over_and_under_without_conflict() -> None:
    weave = woven_cloth("side", "plain")
    assert len(weave.conflicts) == len(weave.clashes) == 0
    s = weave.ids.index("L01")
    assert weave.axes.lengths[s] - weave.axes.overhangs[s].sum() == pytest.approx(ROWS * EDGE, rel=0.01)


def test_rods_beside_the_latitudes_begin_at_the_generation_before_them() -> None:
    weave = woven_cloth("side", "kagome")
    lattice, strands = weave.lattice, weave.strands
    begins = first_generations(strands, lattice)
    for s in range(len(strands)):
        nodes = strands.strand(s)
        if (lattice.node_latitude[nodes] < 0).all():
            assert abs(begins[s] - lattice.nodes[nodes, 0].min() / SPACING) <= 1.0 + EDGE / SPACING
    wefts = np.flatnonzero(strands.family == LATITUDINAL).tolist()
    order = sorted(wefts, key=lambda s: lattice.nodes[strands.strand(s), 0].mean())
    assert (np.diff(begins[order]) >= 0).all()
    assert begins[order[-1]] > 5
