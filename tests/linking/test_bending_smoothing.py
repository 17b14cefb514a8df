"""Smoothing that bends rods least: what it makes better, and what it leaves as it was."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bound_rings import hemisphere
from weavecore import pipeline
from weavecore.linking.bending_smoothing import FREE_ON_SURFACE, WEAVE_RISE, smooth_bending
from weavecore.linking.bending_terms import (
    LEAST_ANGLE,
    AngleTerm,
    Bends,
    CornerArms,
    EdgeTerm,
    FaceCorners,
    Segments,
    corners_of,
    edge_of_sides,
    summed_at_nodes,
)
from weavecore.linking.link import DERIVED, link_latitudes
from weavecore.linking.rod_runs import RodRuns, find_runs
from weavecore.model import Lattice, SurfaceMesh
from weavecore.model.rod_pairing import pair_darts
from weavecore.validating import validate
from weavecore.weaving.axes import surface_normals

SPACING = 0.2
DIAMETER = 0.0034
PATTERNS = ("triangular", "plain", "kagome", "diagonal")


@cache
def raw(pattern: str) -> Lattice:
    latitudes = pipeline.offset(SurfaceMesh(*hemisphere()), spacing=SPACING)
    made = DERIVED.get(pattern)
    lattice = link_latitudes(latitudes, pattern=made.base if made else pattern)
    return made.derive(lattice, pattern) if made else lattice


@cache
def smoothed(pattern: str) -> Lattice:
    return smooth_bending(raw(pattern), rod_diameter=DIAMETER)


@pytest.fixture(scope="module", params=PATTERNS)
def pair(request: pytest.FixtureRequest) -> tuple[Lattice, Lattice]:
    """A lattice before and after."""
    return raw(request.param), smoothed(request.param)


def runs_of(lattice: Lattice) -> RodRuns:
    return find_runs(lattice.edges, pair_darts(lattice))


def bends_of(lattice: Lattice, runs: RodRuns, rise: float, nodes: np.ndarray | None = None) -> Bends:
    segments = Segments(runs, lattice.nodes if nodes is None else nodes)
    return Bends(runs, surface_normals(lattice), segments, rise=rise, admissible=1.0 / (93.75 * DIAMETER))


def curvatures(lattice: Lattice, like: Lattice) -> np.ndarray:
    """At the joints of one lattice, with the nodes of another."""
    return bends_of(lattice, runs_of(like), DIAMETER).curvature


def on_border(lattice: Lattice) -> np.ndarray:
    flag = np.zeros(lattice.n_nodes, bool)
    flag[lattice.edges[edge_of_sides(lattice)[1]]] = True
    return flag


def test_rods_bend_less(pair: tuple[Lattice, Lattice]) -> None:
    rise = DIAMETER * WEAVE_RISE.get(pair[0].pattern, 1.0)
    before, after = (float(bends_of(lattice, runs_of(lattice), rise).costs.sum()) for lattice in pair)
    assert after < 0.96 * before


@pytest.mark.parametrize(("pattern", "part"), [("plain", 0.8), ("kagome", 0.1)])
def test_fewer_joints_bend_more_than_admissible(pattern: str, part: float) -> None:
    before = raw(pattern)
    most = 1.0 / (93.75 * DIAMETER)
    bad = [(curvatures(lattice, before) > most).sum() for lattice in (before, smoothed(pattern))]
    assert bad[1] < part * bad[0]


def test_rods_of_kagome_on_a_dome_can_all_be_bent() -> None:
    lattice = smoothed("kagome")
    assert curvatures(lattice, lattice).max() < 1.1 / (93.75 * DIAMETER)


def test_topology_stays(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    for name in ("face_offsets", "face_nodes", "edges", "edge_family", "node_latitude"):
        assert np.array_equal(getattr(before, name), getattr(after, name))


def test_what_must_hold_of_lattices_holds(pair: tuple[Lattice, Lattice]) -> None:
    report = validate(pair[1])
    assert report.holds, f"\n{report}"


def test_rings_keep_their_distance_where_a_pattern_has_rings(pair: tuple[Lattice, Lattice]) -> None:
    _, after = pair
    assert after.off_latitudes == (after.pattern in FREE_ON_SURFACE)
    held = validate(replace(after, off_latitudes=False))
    assert held.holds == (after.pattern not in FREE_ON_SURFACE)


def test_rings_that_are_free_leave_the_latitudes_and_bend_less() -> None:
    before = raw("plain")
    held, free = smoothed("plain"), smooth_bending(before, rod_diameter=DIAMETER, free_rings=True)
    assert free.off_latitudes
    assert not validate(replace(free, off_latitudes=False)).holds
    assert validate(free).holds
    most = 1.0 / (93.75 * DIAMETER)
    assert (curvatures(free, before) > most).sum() < (curvatures(held, before) > most).sum()


def test_nodes_of_borders_stay_on_them(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    border = on_border(before)
    np.testing.assert_allclose(after.nodes[border, 2], before.nodes[border, 2], atol=1e-9)
    assert not np.array_equal(after.nodes[~border], before.nodes[~border])


def test_edges_keep_to_their_bounds(pair: tuple[Lattice, Lattice]) -> None:
    before, after = pair
    median = np.median(before.edge_lengths)
    low, high = (np.minimum(0.5 * median, before.edge_lengths), np.maximum(1.7 * median, before.edge_lengths))
    assert (after.edge_lengths >= low * (1 - 1e-9)).all()
    assert (after.edge_lengths <= high * (1 + 1e-9)).all()


def test_no_corner_gets_sharper_than_its_bound(pair: tuple[Lattice, Lattice]) -> None:
    arms = [CornerArms(corners_of(lattice), lattice.nodes, surface_normals(lattice)) for lattice in pair]
    angle = [np.arctan2(one.sine, one.cosine) for one in arms]
    # The normals of the mesh, which the bound goes by, are not quite those of the lattice.
    assert (angle[1] > np.minimum(np.radians(25.0), angle[0]) - np.radians(2.0)).all()


def test_the_same_lattice_gives_the_same_bytes() -> None:
    again = smooth_bending(raw("kagome"), rod_diameter=DIAMETER)
    assert np.array_equal(again.nodes, smoothed("kagome").nodes)


def test_results_scale_with_the_unit() -> None:
    def kagome(scale: float) -> Lattice:
        vertices, faces = hemisphere()
        scaled = SurfaceMesh(vertices * scale, faces)
        lattice = link_latitudes(pipeline.offset(scaled, spacing=SPACING * scale), pattern="triangular")
        return smooth_bending(DERIVED["kagome"].derive(lattice, "kagome"), rod_diameter=DIAMETER * scale)

    np.testing.assert_allclose(kagome(1024.0).nodes / 1024.0, kagome(1.0).nodes, atol=1e-6)


def noisy(pattern: str) -> tuple[Lattice, RodRuns, np.ndarray]:
    lattice = raw(pattern)
    nodes = lattice.nodes + 0.01 * np.random.default_rng(3).normal(size=lattice.nodes.shape)
    return lattice, runs_of(lattice), nodes


def pulled(runs: RodRuns, forces: np.ndarray, n_nodes: int) -> np.ndarray:
    """Gradient by the nodes, from the forces at the ends of segments."""
    pulls = -forces
    pulls[:, 1:] += forces[:, :-1]
    return summed_at_nodes(runs.node, pulls, n_nodes)


def test_the_gradient_of_edge_lengths_is_their_difference() -> None:
    lattice, runs, nodes = noisy("kagome")
    way = np.random.default_rng(7).normal(size=nodes.shape)
    median = 0.7 * float(np.median(lattice.edge_lengths))

    def term(places: np.ndarray) -> EdgeTerm:
        return EdgeTerm(runs, Segments(runs, places), median)

    slope = (term(nodes + 1e-7 * way).costs.sum() - term(nodes - 1e-7 * way).costs.sum()) / 2e-7
    gradient = pulled(runs, term(nodes).forces(), lattice.n_nodes)
    assert slope == pytest.approx((gradient * way).sum(), rel=1e-4)


def test_the_gradient_of_sharp_corners_is_their_difference() -> None:
    lattice, _, nodes = noisy("kagome")
    normals, corners = surface_normals(lattice), corners_of(lattice)
    way = np.random.default_rng(7).normal(size=nodes.shape)

    def term(places: np.ndarray) -> AngleTerm:
        return AngleTerm(corners, CornerArms(corners, places, normals), places, normals)

    slope = (term(nodes + 1e-7 * way).costs.sum() - term(nodes - 1e-7 * way).costs.sum()) / 2e-7
    here = term(nodes)
    assert here.costs.sum() > 0
    assert slope == pytest.approx((here.gradient(lattice.n_nodes) * way).sum(), rel=1e-4)


def test_corners_up_to_an_angle_are_found_inverted_ones_too() -> None:
    angle = np.radians([-89.0, -10.0, 0.0, 32.9, 33.1, 100.0, 181.0])
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], *np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    before = np.arange(2, 2 + len(angle))
    corners = FaceCorners(np.zeros(len(angle), np.int64), before, np.ones(len(angle), np.int64))
    arms = CornerArms(corners, nodes, np.tile([0.0, 0.0, 1.0], (len(nodes), 1)))
    assert np.flatnonzero(arms.are_below(LEAST_ANGLE)).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize("rise", [0.0, DIAMETER])
@pytest.mark.parametrize("pattern", ["kagome", "plain"])
def test_the_gradient_of_bending_is_near_its_difference(pattern: str, rise: float) -> None:
    """Frames of rods count as fixed in the gradient, so it is not exact."""
    lattice, runs, nodes = noisy(pattern)

    def cost(places: np.ndarray) -> float:
        return float(bends_of(lattice, runs, rise, places).costs.sum())

    gradient = pulled(runs, bends_of(lattice, runs, rise, nodes).forces(), lattice.n_nodes)
    way = gradient / np.linalg.norm(gradient)
    slope = (cost(nodes + 1e-7 * way) - cost(nodes - 1e-7 * way)) / 2e-7
    assert slope == pytest.approx((gradient * way).sum(), rel=0.05)


@pytest.mark.parametrize("rise", [0.0, DIAMETER])
@pytest.mark.parametrize("pattern", ["kagome", "plain"])
def test_moving_all_nodes_alike_bends_nothing(pattern: str, rise: float) -> None:
    lattice, runs, nodes = noisy(pattern)
    rows = bends_of(lattice, runs, rise, nodes).rows(None, np.tile(np.eye(3)[:, :, None], len(runs)))
    assert np.abs(rows.sum(0)).max() < 1e-9 * np.abs(rows).max()


@pytest.mark.parametrize("rise", [0.0, DIAMETER])
def test_rows_are_derivatives_of_curvatures_but_for_joints_out_of_reach(rise: float) -> None:
    """Moves along the normal of the rod, at joints that are bent enough for their frames to count for little."""
    lattice, runs, nodes = noisy("kagome")
    here = bends_of(lattice, runs, rise, nodes)
    rows = here.rows(None, np.tile(np.eye(3)[:, :, None], len(runs)))
    worst = int(np.argmax(here.curvature))
    node = runs.node[worst]
    step = np.zeros_like(nodes)
    step[node] = 1e-6 * np.random.default_rng(1).normal(size=3)
    there = bends_of(lattice, runs, rise, nodes + step)
    second = np.sqrt(there._cost[2][worst]) * 93.75 * DIAMETER
    found = (rows[3, :, 0, worst] * step[node]).sum() / second
    assert found == pytest.approx(there.curvature[worst] - here.curvature[worst], rel=0.15)


def test_every_edge_is_one_segment_and_every_pair_one_joint() -> None:
    for pattern in ("kagome", "plain"):
        lattice = raw(pattern)
        partner = pair_darts(lattice)
        runs = find_runs(lattice.edges, partner)
        at = np.flatnonzero(runs.is_segment)
        edges = np.sort(np.stack([runs.node[at], runs.node[at + 1]], axis=1), axis=1)
        assert np.array_equal(np.unique(edges, axis=0), np.unique(np.sort(lattice.edges, axis=1), axis=0))
        assert len(at) == lattice.n_edges
        assert runs.is_joint.sum() == (partner >= 0).sum() // 2


def test_the_places_around_a_closed_rod_go_on_beyond_its_ends() -> None:
    """A ring of the nodes 0 to 3, and an edge from 4 to it on which no rod goes on."""
    edges = np.array([[0, 1], [2, 1], [2, 3], [3, 0], [4, 0]])
    partner = np.array([7, 3, 4, 1, 2, 6, 5, 0, -1, -1])
    runs = find_runs(edges, partner)
    ring = runs.node[runs.first[0] - 3 : runs.last[0] + 4].tolist()
    assert ring[:6] == ring[4:]
    assert {frozenset(pair) for pair in zip(ring[3:7], ring[4:8])} == {frozenset(edge) for edge in edges[:4].tolist()}
    alone = [p for p in np.flatnonzero(runs.is_segment) if not (runs.is_joint[p] or runs.is_joint[p + 1])]
    assert [sorted(runs.node[[p, p + 1]].tolist()) for p in alone] == [[0, 4]]


def test_spline_moments_match_those_of_scipy() -> None:
    from weavecore.geometry.splines import fit_splines
    from weavecore.weaving.strands import find_strands

    lattice = raw("kagome")
    strands = find_strands(lattice)
    s = int(np.flatnonzero(~strands.closed & (np.diff(strands.offsets) > 6))[0])
    points = lattice.nodes[strands.strand(s)]
    rows = fit_splines(points, np.array([0, len(points)]), np.array([False]))
    runs = runs_of(lattice)
    flat = bends_of(lattice, runs, 0.0).curvature
    # The second derivative of the cubic at its beginning, without what lies along the rod.
    width = np.diff(rows.parameters)[:, None]
    second = 6 * np.diff(points, axis=0) / width**2 - (4 * rows.derivatives[:-1] + 2 * rows.derivatives[1:]) / width
    for k in range(1, len(points) - 1):
        way = points[k + 1] - points[k], points[k] - points[k - 1]
        tangent = sum(v / np.linalg.norm(v) for v in way)
        tangent /= np.linalg.norm(tangent)
        across = second[k] - (second[k] @ tangent) * tangent
        ends = {int(n) for n in strands.strand(s)[[k - 1, k + 1]]}
        at = [
            p
            for p in np.flatnonzero(runs.is_joint & (runs.node == strands.strand(s)[k]))
            if {int(runs.node[p - 1]), int(runs.node[p + 1])} == ends
        ]
        assert flat[at[0]] == pytest.approx(np.linalg.norm(across), rel=1e-6)
