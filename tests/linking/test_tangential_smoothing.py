"""Sliding nodes along their polylines takes the turns out of the longitudes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bound_rings import dumbbell, hemisphere, linked, pair_of_pants
from weavecore.geometry.arrays import rows_of
from weavecore.linking import link as linking
from weavecore.linking import tangential_smoothing
from weavecore.linking.arc_length import points_at
from weavecore.linking.tangential_smoothing import smooth_tangentially
from weavecore.model import LATITUDINAL, Lattice
from weavecore.weaving.strands import find_strands

SHAPES = {"hemisphere": (hemisphere, 0.1), "pair of pants": (pair_of_pants, 0.12), "dumbbell": (dumbbell, 0.12)}


@pytest.fixture(params=sorted(SHAPES))
def pair(request: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[Lattice, Lattice]:
    """A lattice before and after."""
    make, spacing = SHAPES[request.param]
    after = linked(make(), spacing)
    monkeypatch.setattr(linking, "smooth_tangentially", lambda lattice, _cusps: lattice)
    return linked(make(), spacing), after


def turns(lattice: Lattice, like: Lattice) -> np.ndarray:
    """Angles by which the longitudes of one lattice turn at their nodes when these are where another has them."""
    strands = find_strands(like)
    inner = np.ones(len(strands.nodes), bool)
    inner[strands.offsets[:-1]] = inner[strands.offsets[1:] - 1] = False
    inner &= (strands.family != LATITUDINAL)[rows_of(strands.offsets)]
    at = np.flatnonzero(inner)
    one = lattice.nodes[strands.nodes[at]] - lattice.nodes[strands.nodes[at - 1]]
    other = lattice.nodes[strands.nodes[at + 1]] - lattice.nodes[strands.nodes[at]]
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(1))


def test_longitudes_turn_less(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    assert np.median(turns(after, before)) < 0.88 * np.median(turns(before, before))
    assert np.square(turns(after, before)).sum() < np.square(turns(before, before)).sum()


def test_edges_are_no_less_even(pair: tuple[Lattice, Lattice]) -> None:
    variation = [lattice.edge_lengths.std() / lattice.edge_lengths.mean() for lattice in pair]
    assert variation[1] < 1.02 * variation[0]


def test_nodes_stay_on_their_polylines_and_in_their_order(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    on_ring = after.node_latitude >= 0
    places = points_at(after.latitudes.polylines, after.node_latitude[on_ring], after.node_station[on_ring])
    np.testing.assert_allclose(after.nodes[on_ring], places, atol=1e-9)
    assert np.array_equal(after.nodes[~on_ring], before.nodes[~on_ring])
    for p in range(len(after.latitudes)):
        nodes = np.flatnonzero(after.node_latitude == p)
        ranks = [np.argsort(lattice.node_station[nodes]) for lattice in pair]
        shift = int(np.flatnonzero(ranks[1] == ranks[0][0])[0])
        assert np.array_equal(np.roll(ranks[1], -shift), ranks[0])


def test_nodes_of_borders_stay(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    on_border = np.isin(before.node_latitude, np.flatnonzero(before.latitudes.generation == 0))
    assert np.array_equal(after.nodes[on_border], before.nodes[on_border])


def test_nodes_on_cusps_stay_where_they_would_else_slide(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    furthest = int(np.argmax(np.linalg.norm(after.nodes - before.nodes, axis=1)))
    p, station = int(before.node_latitude[furthest]), before.node_station[furthest]
    held = smooth_tangentially(before, {p: np.array([station])})
    assert np.array_equal(held.nodes[furthest], before.nodes[furthest])
    assert not np.array_equal(held.nodes, before.nodes)
    # A station a whole turn on is the same place.
    around = station + before.latitudes.polylines.lengths[p]
    assert np.array_equal(smooth_tangentially(before, {p: np.array([around])}).nodes, held.nodes)


def test_smoothing_twice_hardly_moves_nodes_again(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    again = smooth_tangentially(after, {})
    moved = np.linalg.norm(after.nodes - before.nodes, axis=1)
    assert np.linalg.norm(again.nodes - after.nodes, axis=1).mean() < 0.6 * moved.mean()


def test_where_conjugate_gradients_do_not_converge_the_steps_are_solved_directly(
    pair: tuple[Lattice, Lattice], monkeypatch: pytest.MonkeyPatch
) -> None:
    before, _ = pair
    converged = smooth_tangentially(before, {}).nodes
    monkeypatch.setattr(tangential_smoothing, "_MOST_CG_STEPS", 1)
    np.testing.assert_allclose(smooth_tangentially(before, {}).nodes, converged, atol=1e-5 * before.edge_length)
