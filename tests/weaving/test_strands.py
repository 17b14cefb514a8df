"""Strands: every edge in one rod, and rods that bend little."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bound_rings import cylinder, dumbbell, hemisphere, linked, pair_of_pants
from weavecore.geometry.arrays import rows_of
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.model import LATITUDINAL, LONGITUDINAL, POCKET
from weavecore.model.rod_pairing import MOST_TURN
from weavecore.weaving.strands import find_strands, part_at_latitudes, steps_along
from woven_rods import woven_sample, woven_tube


def edges_of(strands, s):
    nodes = strands.strand(s).tolist()
    pairs = list(zip(nodes, nodes[1:])) + ([(nodes[-1], nodes[0])] if strands.closed[s] else [])
    return [tuple(sorted(pair)) for pair in pairs]


@pytest.mark.parametrize("pattern", ["triangular", "quad"])
@pytest.mark.parametrize(("make", "spacing"), [(hemisphere, 0.12), (dumbbell, 0.17), (pair_of_pants, 0.2)])
def test_every_edge_lies_in_one_strand_and_those_of_several_families_are_longitudinal(make, spacing, pattern):
    lattice = linked(make(), spacing, pattern=pattern)
    strands = find_strands(lattice)
    family = dict(zip(map(tuple, lattice.edges.tolist()), lattice.edge_family.tolist()))
    used = Counter()
    for s in range(len(strands)):
        pairs = edges_of(strands, s)
        used.update(pairs)
        own, found = strands.family[s], {family[pair] for pair in pairs}
        assert found == {own} or (own == LONGITUDINAL and len(found) > 1)
    assert used == Counter(family.keys())


def test_every_latitude_without_a_sharp_turn_is_one_closed_strand_in_the_order_of_the_latitudes():
    lattice = linked(hemisphere(), 0.12)
    strands = find_strands(lattice)
    rings = np.flatnonzero(strands.family == LATITUDINAL)
    whole = [p for p in range(len(lattice.latitudes)) if np.count_nonzero(lattice.node_latitude == p) > 8]
    assert len(whole) >= 10
    for p in whole:
        assert strands.closed[rings[p]]
        nodes = strands.strand(rings[p])
        np.testing.assert_array_equal(np.sort(nodes), np.flatnonzero(lattice.node_latitude == p))
        assert np.count_nonzero(np.diff(lattice.node_station[nodes]) < 0) <= 1


def test_a_ring_is_broken_where_it_turns_by_more_than_45_degrees():
    lattice = linked(dumbbell(), 0.17)
    strands = find_strands(lattice)
    turns = []
    for s in np.flatnonzero(strands.family == LATITUDINAL).tolist():
        path = strands.strand(s)
        path = np.concatenate([path, path[:2]]) if strands.closed[s] else path
        along = np.diff(lattice.nodes[path], axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        turns += np.arccos(np.clip((along[1:] * along[:-1]).sum(1), -1, 1)).tolist()
    assert max(turns) <= MOST_TURN
    assert not strands.closed[strands.family == LATITUDINAL].all()


def test_families_come_one_after_the_other():
    strands = find_strands(linked(dumbbell(), 0.17))
    assert (np.diff(strands.family) >= 0).all()
    assert set(strands.family.tolist()) == {LATITUDINAL, LONGITUDINAL, POCKET}


def test_rods_other_than_rings_hardly_ever_bend_sharply():
    lattice = linked(pair_of_pants(), 0.2)
    strands = find_strands(lattice)
    bends = []
    for s in np.flatnonzero(strands.family != LATITUDINAL):
        along = np.diff(lattice.nodes[strands.strand(s)], axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        cosine = (along[1:] * along[:-1]).sum(1)
        bends += np.arccos(np.clip(cosine, -1, 1)).tolist()
    assert np.mean(np.array(bends) > MOST_TURN) < 0.01
    assert np.median(bends) < np.radians(20)


def test_the_stakes_of_a_tube_run_from_border_to_border_through_the_pocket():
    lattice = linked(cylinder(height=3.9), 0.3)
    strands = find_strands(lattice)
    generation = lattice.latitudes.generation[lattice.node_latitude]
    whole = 0
    stakes = np.flatnonzero(strands.family == LONGITUDINAL)
    for s in stakes:
        along = generation[strands.strand(s)]
        whole += along[0] == along[-1] == 0
        assert {along[0], along[-1]} <= {0, generation.max()}
    assert whole > 0.5 * len(stakes)


def test_turns_are_those_of_the_longitudes_at_the_nodes_that_they_pass() -> None:
    weave = woven_tube("triangular")
    expected = []
    for s in range(len(weave)):
        nodes = weave.lattice.nodes[weave.strands.strand(s)]
        if weave.strands.family[s] != LATITUDINAL and len(nodes) > 2:
            steps = np.diff(nodes, axis=0)
            steps /= np.linalg.norm(steps, axis=1, keepdims=True)
            expected += np.arccos(np.clip((steps[1:] * steps[:-1]).sum(1), -1, 1)).tolist()
    np.testing.assert_allclose(np.sort(weave.turns), np.sort(expected), atol=1e-6)


def test_strands_parted_at_latitudes_run_along_these_or_across_them() -> None:
    lattice = woven_sample("narrow_neck", "triangular").lattice
    strands = find_strands(lattice)
    parts = part_at_latitudes(strands, lattice)
    before, after = steps_along(parts)
    edge = edges_between(lattice.edges, parts.nodes[before], parts.nodes[after])
    assert sorted(edge.tolist()) == list(range(lattice.n_edges))
    owner = rows_of(parts.offsets)[before]
    along = lattice.edge_family[edge] == LATITUDINAL
    assert np.array_equal(along, parts.family[owner] == LATITUDINAL)
    assert len(parts) > len(strands)
