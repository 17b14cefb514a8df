"""The tables of a weave at rest: the same numbers as in the equilibrium, checked on what was written."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm

from fabricated import TABLES_ONLY
from weavecore import pipeline
from weavecore.errors import OutputExists, Unsupported
from weavecore.fabricating.csv_tables import ReadTable, read_table
from weavecore.fabricating.equilibrium_checks import check_equilibrium
from weavecore.fabricating.equilibrium_tables import EQUILIBRIUM_FILES, EQUILIBRIUM_TABLES
from weavecore.fabricating.folder_reader import WrittenFolder
from weavecore.fabricating.tie_strength import CABLE_TIES
from weavecore.model import Equilibrium
from woven_rods import tube_latitudes, woven_tube


@cache
def at_rest() -> Equilibrium:
    weave = pipeline.weave(pipeline.link(tube_latitudes(150.0, 240.0, 60.0), pattern="quad"), rod_diameter=1.0)
    return pipeline.simulate(weave)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tables") / "out"
    pipeline.write_equilibrium_tables(at_rest(), path)
    return path


@pytest.fixture
def tables(folder: Path) -> dict[str, ReadTable]:
    return {name: read_table((folder / f"{name}.csv").read_bytes()) for name in EQUILIBRIUM_TABLES}


def columns(table: ReadTable, names: str) -> np.ndarray:
    return np.stack([table.floats(name) for name in names.split()], axis=1)


def test_nodes_have_their_places_and_departure_and_the_load_on_them(tables: dict[str, ReadTable]) -> None:
    nodes, e = tables["departures"], at_rest()
    assert columns(nodes, "x y z") == pytest.approx(e.weave.lattice.nodes, abs=5e-4)
    assert columns(nodes, "x_at_rest y_at_rest z_at_rest") == pytest.approx(
        e.weave.lattice.nodes + e.node_move, abs=5e-4
    )
    assert nodes.floats("departure") == pytest.approx(e.departure, abs=5e-4)
    assert [word == "yes" for word in nodes["supported"]] == e.is_supported.tolist()
    assert columns(nodes, "load_x_n load_y_n load_z_n") == pytest.approx(e.load, abs=1e-6)


def test_rods_ties_and_supports_have_their_forces(tables: dict[str, ReadTable]) -> None:
    e, rods, ties, reactions = at_rest(), tables["rod_forces"], tables["tie_forces"], tables["reactions"]
    assert rods["rod_id"] == list(e.weave.ids)
    for s, (a, b) in enumerate(zip(e.offsets[:-1], e.offsets[1:])):
        assert rods.floats("axial_max_n")[s] == pytest.approx(e.axial_force[a:b].max(), abs=1e-6)
        assert rods.floats("axial_min_n")[s] == pytest.approx(e.axial_force[a:b].min(), abs=1e-6)
        assert rods.floats("stress_max_mpa")[s] == pytest.approx(e.stress[a:b].max(), abs=1e-3)
        assert rods.floats("utilisation")[s] == pytest.approx(e.utilisation[a:b].max(), abs=1e-6)
        nodes = e.weave.strands.strand(s)
        assert rods.floats("departure_max")[s] == pytest.approx(e.departure[nodes].max(), abs=5e-4)
    assert ties.floats("force_n") == pytest.approx(e.tie_force_size, abs=1e-6)
    assert ties.floats("utilisation") == pytest.approx(e.tie_force_size / CABLE_TIES[0].strength, abs=1e-6)
    crossings = {(over, under) for _, over, under in e.weave.crossings.tolist()}
    index = {name: s for s, name in enumerate(e.weave.ids)}
    assert {(index[a], index[b]) for a, b in zip(ties["upper_rod"], ties["lower_rod"])} <= crossings
    assert reactions["node"] == [str(n) for n in np.flatnonzero(e.is_supported)]
    assert columns(reactions, "x_n y_n z_n") == pytest.approx(e.reaction[e.is_supported], abs=1e-6)


def test_the_extremes_are_those_of_json_and_of_the_summary(tables: dict[str, ReadTable]) -> None:
    import json

    from weavecore.exporting.registry import encode

    entry = json.loads(encode(at_rest(), "relaxed.json"))["equilibrium"]
    row = tables["equilibrium"]
    assert row.floats("departure_max")[0] == pytest.approx(entry["departure"]["max"], abs=5e-4)
    assert row.floats("departure_mean")[0] == pytest.approx(entry["departure"]["mean"], abs=5e-4)
    assert row.floats("utilisation_max")[0] == pytest.approx(entry["utilisation_max"], abs=1e-6)
    assert row.floats("stress_max_mpa")[0] == pytest.approx(entry["stress_max"], abs=1e-3)
    assert row.floats("tie_force_max_n")[0] == pytest.approx(entry["tie_force_max"], abs=1e-6)
    told = dict(pipeline.describe(at_rest()))["stress"]
    assert f"{entry['stress_max']:.0f} MPa" in told


def test_a_folder_that_is_there_is_kept_unless_it_may_be_replaced(folder: Path) -> None:
    before = {one.name: one.read_bytes() for one in folder.iterdir()}
    assert sorted(before) == sorted(EQUILIBRIUM_FILES)
    with pytest.raises(OutputExists):
        pipeline.write_equilibrium_tables(at_rest(), folder)
    pipeline.write_equilibrium_tables(at_rest(), folder, overwrite=True)
    assert before == {one.name: one.read_bytes() for one in folder.iterdir()}


def test_the_workshop_folder_has_the_same_tables_and_reports_on_them(folder: Path, tmp_path: Path) -> None:
    made = pipeline.fabricate(at_rest(), tmp_path / "out", workshop=TABLES_ONLY)
    for name in EQUILIBRIUM_FILES:
        # The first line has the hash of the same JSON result.
        assert made.files[name] == (folder / name).read_bytes()
    layers = {layer.FullPath for layer in rhino3dm.File3dm.FromByteArray(made.files["woven.3dm"]).Layers}
    assert {"weave::rods::latitudes", "equilibrium::reactions"} <= layers
    report = made.files["report.txt"].decode()
    value = re.search(r"ok +equilibrium_departure_mm +(\S+) +limit none", report)
    assert value
    assert float(value[1]) == pytest.approx(at_rest().departure_max, abs=2e-3)
    for line in ("equilibrium_utilisation", "tie_force_n", "reaction_n", "loads_not_carried_n"):
        assert re.search(rf"ok +{line} ", report), line
    assert f"limit {CABLE_TIES[0].strength:.6g}" in report


def test_a_folder_without_a_simulation_has_no_tables_of_one(tmp_path: Path) -> None:
    made = pipeline.fabricate(at_rest().weave, tmp_path / "out", workshop=TABLES_ONLY)
    assert not set(EQUILIBRIUM_FILES) & set(made.files)
    assert "departure" not in made.files["report.txt"].decode()
    again = pipeline.fabricate(at_rest().weave, tmp_path / "two", workshop=TABLES_ONLY, simulation=at_rest())
    assert set(EQUILIBRIUM_FILES) <= set(again.files)


def test_the_simulation_of_another_weave_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Unsupported, match="another weave"):
        pipeline.fabricate(woven_tube("plain"), tmp_path / "out", workshop=TABLES_ONLY, simulation=at_rest())
    with pytest.raises(Unsupported, match="no equilibrium"):
        pipeline.fabricate(woven_tube("plain"), tmp_path / "out", workshop=TABLES_ONLY, simulation=at_rest().weave)  # type: ignore[arg-type]


@pytest.mark.parametrize("strength", [0.0, -1.0, np.nan, np.inf])
def test_a_strength_that_is_not_positive_is_refused_with_what_ties_carry(tmp_path: Path, strength: float) -> None:
    with pytest.raises(Unsupported, match=r"3\.6 mm: 178 N"):
        pipeline.write_equilibrium_tables(at_rest(), tmp_path / "out", tie_strength=strength)


def broken(folder: Path, name: str, column: str, change: Any) -> set[str]:
    """The checks that fail where the first number of a column is another."""
    files = {one.name: one.read_bytes() for one in folder.iterdir()}
    head, columns, first, *rest = files[f"{name}.csv"].decode().split("\n")
    cells = first.split(",")
    at = columns.split(",").index(column)
    cells[at] = change(cells[at])
    files[f"{name}.csv"] = "\n".join([head, columns, ",".join(cells), *rest]).encode()
    return {one.invariant for one in check_equilibrium(WrittenFolder(files)) if not one.passes}


@pytest.mark.parametrize(
    ("name", "column", "change", "found"),
    [
        ("equilibrium", "stable", lambda _: "no", {"equilibrium_not_stable"}),
        ("equilibrium", "tie_strength_n", lambda _: "0.000001", {"tie_force_n"}),
        ("equilibrium", "departure_max", lambda text: str(float(text) + 1), {"equilibrium_extremes_off"}),
        ("departures", "departure", lambda text: str(float(text) + 1), {"equilibrium_departure_off_mm"}),
        ("departures", "load_z_n", lambda text: str(float(text) - 1), {"loads_not_carried_n"}),
        ("reactions", "x_n", lambda text: str(float(text) + 1), {"loads_not_carried_n"}),
        ("rod_forces", "utilisation", lambda _: "1.5", {"equilibrium_utilisation"}),
    ],
)
def test_the_report_finds_what_is_wrong_in_the_tables(
    folder: Path, name: str, column: str, change: Any, found: set[str]
) -> None:
    assert broken(folder, name, column, change) == found
