from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import NotConverged, Unsupported
from weavecore.model import Equilibrium, Weave
from weavecore.simulating import newton
from woven_rods import tube_latitudes, woven_tube

GRAVITY = 9.80665


@cache
def tube() -> Weave:
    return woven_tube("triangular")


@cache
def at_rest(supports: str = "borders", **options: object) -> Equilibrium:
    return pipeline.simulate(tube(), supports=supports, **options)  # type: ignore[arg-type]


def test_reactions_of_the_supports_carry_the_weight() -> None:
    equilibrium, weave = at_rest(), tube()
    area = np.pi * (weave.rod_diameter / 1000) ** 2 / 4
    spans = weave.axes.lengths - weave.axes.overhangs.sum(1)
    weight = weave.material.density * area * spans.sum() / 1000 * GRAVITY
    assert equilibrium.is_stable
    assert equilibrium.reaction.sum(0) == pytest.approx([0, 0, weight], rel=1e-3, abs=1e-6 * weight)
    assert not equilibrium.reaction[~equilibrium.is_supported].any()


@pytest.mark.parametrize("segments", [2, 3])
def test_the_loads_of_the_nodes_are_those_of_the_rods_and_balance_the_reactions(segments: int) -> None:
    equilibrium = at_rest(pressure=100.0, segments=segments)
    size = np.abs(equilibrium.load).sum(0).max()
    assert equilibrium.load[:, 2].sum() < 0
    assert np.abs(equilibrium.load.sum(0) + equilibrium.reaction.sum(0)).max() < 1e-6 * size
    pressed = at_rest(pressure=100.0, segments=segments, gravity=False)
    weight = equilibrium.load - pressed.load
    assert np.abs(weight[:, :2]).max() < 1e-12
    # A node carries what lies halfway to its neighbours.
    strands, axes = tube().strands, tube().axes
    halves = np.zeros(tube().lattice.n_nodes)
    for s, closed in enumerate(strands.closed.tolist()):
        part = slice(strands.offsets[s], strands.offsets[s + 1])
        nodes, at = strands.nodes[part], axes.stations[part]
        spans = np.diff(np.append(at, axes.lengths[s]) if closed else at)
        np.add.at(halves, nodes[: len(spans)], spans / 2)
        np.add.at(halves, np.roll(nodes, -1)[: len(spans)], spans / 2)
    assert weight[:, 2] / weight[:, 2].sum() == pytest.approx(halves / halves.sum(), rel=0.03)


def test_held_nodes_stay_and_all_others_may_move() -> None:
    equilibrium = at_rest()
    assert (equilibrium.is_supported == tube().is_border_node).all()
    assert equilibrium.departure[equilibrium.is_supported].max() < 1e-12
    assert equilibrium.departure[~equilibrium.is_supported].min() > 0


def test_released_weave_has_less_energy_than_the_drawn_and_the_held_one() -> None:
    released, held = at_rest("none"), at_rest(gravity=False)
    assert sum(released.energies.values()) < sum(held.energies.values()) < held.drawn_energy


def test_released_weave_is_laid_over_the_drawn_one() -> None:
    equilibrium = at_rest("none")
    move = equilibrium.points - equilibrium.drawn
    assert np.abs(move.mean(0)).max() < 0.1 * equilibrium.departure_mean
    turned = np.cross(equilibrium.drawn - equilibrium.drawn.mean(0), move).mean(0)
    assert np.abs(turned).max() < 0.1 * equilibrium.departure_mean * 300


def test_rods_keep_their_gap_and_their_marks_at_the_ties() -> None:
    weave, equilibrium = tube(), at_rest("none")
    lower, upper = equilibrium.point_of_visit[weave.joints.visit[weave.joints.contacts]].T
    drawn, now = (np.linalg.norm(x[upper] - x[lower], axis=1) for x in (equilibrium.drawn, equilibrium.points))
    assert np.abs(now - drawn).max() < 0.01 * weave.rod_diameter


def test_twice_as_many_segments_change_the_mean_departure_by_less_than_a_twentieth() -> None:
    coarse, fine = at_rest("none", segments=4), at_rest("none", segments=8)
    assert coarse.departure_mean == pytest.approx(fine.departure_mean, rel=0.05)


def test_pressure_pushes_against_the_normals_and_a_force_where_it_acts() -> None:
    rest, pressed = at_rest(gravity=False), at_rest(gravity=False, pressure=2000.0)
    nodes = tube().lattice.nodes
    ring = np.abs(nodes[:, 2] - np.median(nodes[:, 2])) < 40
    radius = [np.linalg.norm(e.points[e.point_of_visit][:, :2], axis=1) for e in (rest, pressed)]
    at_ring = ring[tube().strands.nodes]
    assert radius[1][at_ring].mean() < radius[0][at_ring].mean() - 0.01
    node = int(np.argmax(nodes[:, 0] * ring))
    pulled = pipeline.simulate(tube(), gravity=False, forces=[(nodes[node], (3.0, 0.0, 0.0))])
    visits = np.flatnonzero(tube().strands.nodes == node)
    moved = (pulled.points - rest.points)[rest.point_of_visit[visits]]
    assert moved[:, 0].min() > 0.02
    assert pulled.reaction.sum(0) == pytest.approx([-3.0, 0.0, 0.0], abs=1e-5)


def test_supports_are_the_nodes_at_points_and_along_curves() -> None:
    nodes = tube().lattice.nodes
    line = [[300, 0, 0], [300, 0, 540]]
    equilibrium = pipeline.simulate(tube(), supports=[nodes[7] + 3.0, line], gravity=False)
    held = np.flatnonzero(equilibrium.is_supported)
    assert 7 in held
    others = held[held != 7]
    assert len(others) >= 9
    assert np.linalg.norm(nodes[others][:, :2] - [300, 0], axis=1).max() < 60


@pytest.mark.parametrize("supports", ["floor", [], [[[0, 0, 9000], [1, 0, 9000]]], [[[0.0, np.nan, 0.0]]]])
def test_supports_that_hold_nothing_are_refused(supports: object) -> None:
    with pytest.raises(Unsupported):
        pipeline.simulate(tube(), supports=supports)  # type: ignore[arg-type]


def test_loads_without_supports_are_refused() -> None:
    with pytest.raises(Unsupported, match="without supports"):
        pipeline.simulate(tube(), supports="none", pressure=10.0)


def test_a_search_that_ends_early_raises_with_the_state_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(newton, "_MOST_STEPS", 1)
    with pytest.raises(NotConverged) as caught:
        pipeline.simulate(tube(), supports="none")
    reached = caught.value.reached
    assert isinstance(reached, Equilibrium)
    assert not reached.is_stable
    assert reached.departure_max > 0


def test_progress_is_told_and_can_cancel() -> None:
    told: list[float] = []

    def tell(fraction: float, _: str) -> None:
        told.append(fraction)
        if len(told) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pipeline.simulate(tube(), progress=tell)
    assert all(0 <= fraction <= 1 for fraction in told)


def test_json_gives_the_same_equilibrium_back_and_the_same_bytes(tmp_path: Path) -> None:
    equilibrium = at_rest()
    pipeline.export(equilibrium, tmp_path / "one.json")
    back = pipeline.read_result(tmp_path / "one.json")
    assert isinstance(back, Equilibrium)
    for name in ("points", "drawn", "axial_force", "moment", "stress", "tie_force", "reaction", "load", "is_supported"):
        assert (getattr(back, name) == getattr(equilibrium, name)).all(), name
    pipeline.export(back, tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    again = pipeline.simulate(tube())
    assert (again.points == equilibrium.points).all()


def test_mesh_files_refuse_an_equilibrium(tmp_path: Path) -> None:
    with pytest.raises(Unsupported, match="at rest"):
        pipeline.export(at_rest(), tmp_path / "relaxed.stl")


def test_rods_are_taken_between_their_outermost_joints() -> None:
    weave, equilibrium = tube(), at_rest()
    is_open = ~weave.strands.closed
    assert weave.axes.overhangs[is_open].min() > 0
    ends = np.stack([equilibrium.offsets[:-1], equilibrium.offsets[1:] - 1], axis=1)[is_open]
    visits = np.stack([weave.strands.offsets[:-1], weave.strands.offsets[1:] - 1], axis=1)[is_open]
    assert np.allclose(equilibrium.drawn[ends], weave.axes.points[visits], atol=1e-9)


def test_unit_of_the_model_changes_nothing() -> None:
    from dataclasses import replace

    weave = tube()
    surface = replace(weave.lattice.latitudes.surface, unit="None")
    latitudes = replace(weave.lattice.latitudes, surface=surface)
    unitless = replace(weave, lattice=replace(weave.lattice, latitudes=latitudes))
    with pytest.raises(Unsupported):
        pipeline.simulate(unitless)
    assert (pipeline.simulate(unitless, unit="mm").points == at_rest().points).all()


def test_buckling_factor_is_above_one_for_a_stable_weave_and_falls_with_the_load() -> None:
    light, heavy = (at_rest(gravity=False, pressure=p, buckling=True) for p in (50.0, 100.0))
    assert light.buckling_factor is not None
    assert heavy.buckling_factor is not None
    assert 1 < heavy.buckling_factor < light.buckling_factor


def test_few_held_nodes_keep_all_within_the_limit() -> None:
    limit = 0.8 * at_rest("none").departure_max
    equilibrium = at_rest(within=limit, gravity=False)
    assert equilibrium.is_stable
    assert equilibrium.departure_max <= limit
    assert 3 <= equilibrium.is_supported.sum() < tube().lattice.n_nodes / 2


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan])
def test_limits_of_departure_that_are_not_positive_are_refused(limit: float) -> None:
    with pytest.raises(Unsupported, match="positive"):
        pipeline.simulate(tube(), within=limit)


def test_a_weave_that_keeps_its_shape_within_the_limit_is_not_held() -> None:
    assert not at_rest(within=1000.0, gravity=False).is_supported.any()


def test_a_released_tube_that_shears_says_so_and_stands_with_stiff_ties() -> None:
    lattice = pipeline.link(tube_latitudes(300.0, 540.0, 108.0), pattern="plain")
    weave = pipeline.weave(lattice, rod_diameter=5.0)
    with pytest.raises(NotConverged, match="shears"):
        pipeline.simulate(weave, supports="none")
    stiff = pipeline.simulate(weave, supports="none", tie_stiffness=0.1)
    assert stiff.is_stable
    assert stiff.n_steps < 30
    assert stiff.departure_max < 5.0


@pytest.mark.parametrize("stiffness", [-1.0, np.nan, np.inf])
def test_stiffnesses_of_ties_that_are_not_numbers_from_0_up_are_refused(stiffness: float) -> None:
    with pytest.raises(Unsupported, match="stiffness"):
        pipeline.simulate(tube(), tie_stiffness=stiffness)
