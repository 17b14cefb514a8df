"""The .3dm for Kangaroo2 and Karamba, read back: its springs are those of the simulation."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import rhino3dm

from weavecore import pipeline
from weavecore.errors import OutputExists
from weavecore.exporting.handover_file import encode_handover
from weavecore.model import Equilibrium
from weavecore.model.springs import springs_of
from weavecore.simulating.discretise import place_points
from woven_rods import woven_tube


@cache
def at_rest() -> Equilibrium:
    diameters = {"latitudinal": 3.0, "longitudinal": 1.5}
    return pipeline.simulate(pipeline.weave(woven_tube("plain").lattice, rod_diameter=diameters))


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    path = tmp_path_factory.mktemp("handover") / "handover.3dm"
    pipeline.write_handover(at_rest(), path)
    with pytest.raises(OutputExists):
        pipeline.write_handover(at_rest(), path)
    document = rhino3dm.File3dm.Read(str(path))
    assert document.Settings.ModelUnitSystem == rhino3dm.UnitSystem.Millimeters
    layers: dict[str, list[Any]] = {}
    for one in document.Objects:
        layers.setdefault(document.Layers[one.Attributes.LayerIndex].FullPath, []).append(one)
    return layers


def number(one: Any, key: str) -> float:
    return float(one.Attributes.GetUserString(key))


def ends_of(one: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in (one.Geometry.PointAtStart, one.Geometry.PointAtEnd)])


def test_springs_have_the_length_between_the_marks_and_the_stiffness_of_the_rod(objects: dict[str, list[Any]]) -> None:
    weave = at_rest().weave
    lines = objects["handover::springs"]
    counts = np.diff(weave.strands.offsets) - ~weave.strands.closed
    assert len(lines) == counts.sum()
    diameters = dict(zip(weave.ids, weave.diameters.tolist()))
    lengths = dict.fromkeys(weave.ids, 0.0)
    for one in lines:
        length = number(one, "kangaroo_Length")
        diameter = diameters[one.Attributes.GetUserString("id")]
        area = np.pi * diameter**2 / 4
        # E in GPa is kN/mm²; a unit is a millimetre.
        assert number(one, "kangaroo_Strength") == pytest.approx(1000 * weave.material.modulus * area / length)
        chord = np.linalg.norm(np.diff(ends_of(one), axis=0))
        assert 0.95 * length < chord <= length * (1 + 1e-9)
        lengths[one.Attributes.GetUserString("id")] += length
        assert number(one, "karamba_Diameter_cm") == pytest.approx(diameter / 10)
    spans = weave.axes.lengths - weave.axes.overhangs.sum(1)
    assert list(lengths.values()) == pytest.approx(spans.tolist(), rel=1e-6)


def test_springs_fit_the_segments_that_the_simulation_has() -> None:
    weave = at_rest().weave
    springs = springs_of(weave, metres=1e-3)
    rods = place_points(weave.axes, segments=16, metres=1.0)
    fine = np.bincount(rods.rod[rods.segments[:, 0]], rods.rest_lengths)
    assert np.bincount(springs.rod, springs.rest_length) == pytest.approx(fine, rel=1e-3)
    # EI in N·mm²: E in MPa times π d⁴ / 64.
    inertia = np.pi * weave.diameters**4 / 64
    assert springs.bending_stiffness == pytest.approx(1000 * weave.material.modulus * inertia)


def test_ties_run_from_axis_to_axis_as_long_as_the_gap(objects: dict[str, list[Any]]) -> None:
    ties = objects["handover::ties"]
    assert len(ties) == len(at_rest().weave.joints.contacts)
    for one, crossing in zip(ties, at_rest().contact_rods[:, 1:].tolist()):
        gap = np.linalg.norm(np.diff(ends_of(one), axis=0))
        assert number(one, "kangaroo_Length") == pytest.approx(gap)
        assert gap == pytest.approx(at_rest().weave.diameters[list(crossing)].mean(), rel=0.2)


def test_supports_and_loads_are_those_of_the_equilibrium(objects: dict[str, list[Any]]) -> None:
    supports = {int(number(one, "node")) for one in objects["handover::supports"]}
    assert supports == set(np.flatnonzero(at_rest().is_supported))
    assert {one.Attributes.GetUserString("karamba_Conditions") for one in objects["handover::supports"]} == {"111000"}
    total = np.zeros(3)
    for one in objects["handover::loads"]:
        force, kilo = (
            np.array([float(part) for part in one.Attributes.GetUserString(key).split(",")])
            for key in ("kangaroo_Force_N", "karamba_ForceVec_kN")
        )
        assert kilo == pytest.approx(force / 1000)
        total += force
    assert total == pytest.approx(at_rest().load.sum(0))


def test_lines_of_a_rod_meet_at_its_joints(objects: dict[str, list[Any]]) -> None:
    of_rod: dict[str, list[np.ndarray]] = {}
    for one in objects["handover::springs"]:
        of_rod.setdefault(one.Attributes.GetUserString("id"), []).append(ends_of(one))
    for ends in of_rod.values():
        for before, after in zip(ends, ends[1:]):
            assert (before[1] == after[0]).all()


def test_a_weave_alone_has_no_supports_and_the_same_bytes_each_time() -> None:
    first, second = (encode_handover(at_rest().weave, metres=1e-3) for _ in range(2))
    assert first == second
    names = {layer.Name for layer in rhino3dm.File3dm.FromByteArray(first).Layers}
    assert "springs" in names
    assert "supports" not in names
