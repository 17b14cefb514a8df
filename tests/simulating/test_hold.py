from __future__ import annotations

from functools import cache

import numpy as np

from weavecore import pipeline
from weavecore.model import Equilibrium, Weave
from weavecore.simulating.anchored import NearDrawing
from weavecore.simulating.boundary import Loads
from weavecore.simulating.hold import MARGIN, WEAK, hold_in_model, linearised_on_springs, nodes_to_hold
from weavecore.simulating.linearised import LinearisedWeave
from woven_rods import woven_sample

LIMIT = 2.0


@cache
def neck() -> Weave:
    return woven_sample("narrow_neck", "plain")


def linear_neck() -> LinearisedWeave:
    weave = neck()
    near = NearDrawing(weave, weave.axes.points / 1000.0, 1e-3)
    return linearised_on_springs(near, np.zeros(weave.lattice.n_nodes, bool), Loads(gravity=(0.0, 0.0, -1.0)))


@cache
def held() -> Equilibrium:
    return pipeline.simulate(neck(), within=LIMIT)


def test_a_weave_that_springs_far_away_is_held_within_the_limit_by_few_nodes() -> None:
    assert pipeline.simulate(neck(), supports="none").departure_max > 10 * LIMIT
    assert held().is_stable
    assert held().departure_max <= LIMIT
    assert 3 <= held().is_supported.sum() <= 0.25 * neck().lattice.n_nodes


def test_the_linear_model_predicts_the_departure_of_the_held_weave() -> None:
    linear = linear_neck()
    linear.held = np.flatnonzero(held().is_supported).tolist()
    linear.on_springs(WEAK)
    assert linear.n_negative == 0
    error = np.abs(1000.0 * linear.departure - held().departure)
    assert error.max() < 0.5 * held().departure_max


def test_without_held_nodes_the_linear_model_is_unstable_at_the_drawing() -> None:
    linear = linear_neck()
    linear.on_springs(WEAK)
    assert linear.n_negative > 0


def test_nodes_that_are_let_go_leave_the_model_as_if_they_had_not_been_held() -> None:
    linear = linear_neck()
    nodes = hold_in_model(linear, MARGIN * LIMIT / 1000.0)
    kept = np.arange(len(nodes)) % 2 == 0
    departure, n_negative = linear.without(kept)
    fresh = linear_neck()
    fresh.held = [node for node, keep in zip(nodes, kept) if keep]
    fresh.on_springs(WEAK)
    assert n_negative == fresh.n_negative
    assert np.abs(departure - fresh.departure).max() < 1e-6


def test_no_node_is_held_that_the_others_make_unnecessary() -> None:
    linear = linear_neck()
    limit = MARGIN * LIMIT / 1000.0
    nodes = hold_in_model(linear, limit)
    for k in range(len(nodes)):
        departure, n_negative = linear.without(np.arange(len(nodes)) != k)
        assert n_negative > 0 or departure.max() > limit


def test_nodes_that_are_held_already_are_not_chosen() -> None:
    weave = neck()
    chosen, _ = nodes_to_hold(weave, LIMIT, is_held=weave.is_border_node, loads=Loads(), metres=1e-3)
    assert not weave.is_border_node[chosen].any()
