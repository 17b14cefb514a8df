"""Weave_Simulate: its outputs are those of the simulation, and points, curves and vectors come through its wires."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import rhino3dm

from ghpython.stubs import Canvas, Ran, run_component
from weavecore import pipeline
from weavecore.canvas.simulating import read_loads
from weavecore.model import Equilibrium
from weavecore.model.springs import springs_of


@pytest.fixture(scope="module")
def ran(stages: dict[str, Ran]) -> Ran:
    return stages["simulate"]


def row(point: Any) -> list[float]:
    return [point.X, point.Y, point.Z]


def test_the_outputs_are_those_of_the_simulation(ran: Ran, stages: dict[str, Ran]) -> None:
    e, weave = ran["equilibrium"], stages["strands"]["weave"]
    assert isinstance(e, Equilibrium)
    assert (e.points == pipeline.simulate(weave).points).all()
    assert ran["departure"] == e.departure.tolist()
    assert ran["stable"] is True
    used = dict(zip(stages["strands"]["names"], ran["utilisation"]))
    assert used == dict(zip(weave.ids, e.greatest_of_rods(e.utilisation).tolist()))
    assert [row(point) for point in ran["held"]] == weave.lattice.nodes[e.is_supported].tolist()
    assert [row(force) for force in ran["reactions"]] == e.reaction[e.is_supported].tolist()
    assert {type(force) for force in ran["reactions"]} == {rhino3dm.Vector3d}


def test_rods_at_rest_pass_the_points_of_the_equilibrium(ran: Ran, stages: dict[str, Ran]) -> None:
    e = ran["equilibrium"]
    names = list(stages["strands"]["names"])
    assert [str(path) for path in ran["rods"].branches] == [str(path) for path in stages["strands"]["rods"].branches]
    for name, curve in list(zip(names, ran["rods"]))[::7]:
        s = e.weave.ids.index(name)
        points = e.points[e.offsets[s] : e.offsets[s + 1]]
        assert row(curve.PointAtStart) == pytest.approx(points[0].tolist(), abs=1e-9)
        assert bool(curve.IsClosed) == bool(e.weave.strands.closed[s])
        domain = curve.Domain
        dense = np.array([row(curve.PointAt(t)) for t in np.linspace(domain.T0, domain.T1, 40 * len(points))])
        gaps = np.linalg.norm(dense[None] - points[:, None], axis=2).min(1)
        assert gaps.max() < 0.02 * e.weave.lattice.edge_length


def test_springs_lengths_and_strengths_are_in_one_branch_for_each_rod(ran: Ran) -> None:
    weave = ran["equilibrium"].weave
    springs = springs_of(weave, metres=1e-3)
    for name in ("springs", "lengths", "strengths"):
        assert [str(path) for path in ran[name].branches] == [f"{{0;{s}}}" for s in range(len(weave))]
        assert len(list(ran[name])) == len(springs.rest_length)
    assert list(ran["lengths"]) == springs.rest_length.tolist()
    assert list(ran["strengths"]) == springs.stiffness.tolist()
    assert len(ran["ties"]) == len(weave.joints.contacts)


def test_points_and_curves_hold_nodes_and_vectors_load_them(canvas: Canvas, stages: dict[str, Ran]) -> None:
    weave = stages["strands"]["weave"]
    nodes = weave.lattice.nodes
    top = int(np.argmax(nodes[:, 2]))
    rim = rhino3dm.Polyline([rhino3dm.Point3d(*p) for p in weave.lattice.latitudes.polylines.polyline(0)])
    place = rhino3dm.Point3d(*(nodes[top] + 0.5))
    ran = run_component("Weave_Simulate", weave=weave, places=[rim.ToPolylineCurve(), place, None])
    held = ran["equilibrium"].is_supported
    assert held[top]
    assert 10 < held.sum() < len(nodes)
    assert "0.866 mm away" in ran["equilibrium"].supports
    force = rhino3dm.Vector3d(0.0, 0.0, -0.001)
    loaded = run_component("Weave_Simulate", weave=weave, gravity=False, points=[place], forces=[force])
    assert loaded.messages == []
    assert loaded["equilibrium"].load[top].tolist() == [0.0, 0.0, -0.001]
    free = run_component("Weave_Simulate", weave=weave, supports="none")
    assert not free["equilibrium"].is_supported.any()
    assert free["held"] == free["reactions"] == []


def test_the_last_force_is_taken_for_points_that_have_none() -> None:
    points = [rhino3dm.Point3d(k, 0, 0) for k in range(3)]
    forces = [rhino3dm.Vector3d(0, 0, -1), rhino3dm.Vector3d(0, 0, -2)]
    assert [float(force[2]) for _, force in read_loads(points, forces)] == [-1.0, -2.0, -2.0]
    assert read_loads(None, None) == []


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"points": [rhino3dm.Point3d(0, 0, 0)]}, "Points need forces"),
        ({"forces": [rhino3dm.Vector3d(0, 0, -1)]}, "Points need forces"),
        ({"points": ["here"], "forces": [rhino3dm.Vector3d(0, 0, -1)]}, "must be points"),
        ({"supports": "floor"}, "no supports"),
        ({"places": [object()]}, "not a curve"),
        ({"supports": "none", "pressure": 5.0}, "without supports"),
    ],
)
def test_what_holds_or_loads_nothing_is_refused_in_words(
    canvas: Canvas, stages: dict[str, Ran], inputs: dict[str, Any], words: str
) -> None:
    ran = run_component("Weave_Simulate", weave=stages["strands"]["weave"], **inputs)
    assert ran.is_empty
    ((level, text),) = ran.messages
    assert level == "Error"
    assert words in text


def test_a_weave_at_rest_is_exported_and_described(canvas: Canvas, ran: Ran, tmp_path: Any) -> None:
    target = str(tmp_path / "relaxed.json")
    written = run_component("Weave_Export", value=ran["equilibrium"], path=target, write=True)
    assert written["file"] == target
    assert any(line.startswith("departure:") for line in written["report"])
    assert isinstance(pipeline.read_result(target), Equilibrium)
