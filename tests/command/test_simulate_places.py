"""``weavecore simulate``: supports and loads from layers of a file, tables, and the workshop folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import rhino3dm

Run = Callable[..., Any]


@pytest.fixture
def woven(run: Run, folder: Path) -> Path:
    assert run("weave", "tube.3dm", "--json", "woven.json", "-q").status == 0
    return folder / "woven.json"


def rhino_file(path: str, unit: str, layers: dict[str, list[Any]], texts: dict[str, str] | None = None) -> None:
    """A file with points (3,), lists of them as clouds, and polylines (n, 3) on layers; user texts are those of all."""
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, unit)
    for name, things in layers.items():
        layer = rhino3dm.Layer()
        layer.Name = name
        index = model.Layers.Add(layer)
        for thing in things:
            attributes = rhino3dm.ObjectAttributes()
            attributes.LayerIndex = index
            for key, text in (texts or {}).items():
                attributes.SetUserString(key, text)
            if np.ndim(thing) == 1:
                model.Objects.Add(rhino3dm.Point(rhino3dm.Point3d(*thing)), attributes)
            else:
                line = rhino3dm.Polyline([rhino3dm.Point3d(*point) for point in thing])
                model.Objects.AddPolyline(line, attributes)
    assert model.Write(path, 7)


def equilibrium_of(path: str) -> dict[str, Any]:
    entry: dict[str, Any] = json.loads(Path(path).read_text("utf-8"))["equilibrium"]
    return entry


def nodes_of(woven: Path) -> np.ndarray:
    return np.array(json.loads(woven.read_text("utf-8"))["lattice"]["nodes"])


def test_supports_are_points_and_curves_of_a_layer_in_another_unit(run: Run, woven: Path) -> None:
    nodes = nodes_of(woven)
    rim = nodes[nodes[:, 2] < nodes[:, 2].min() + 1e-6]
    top = nodes[int(np.argmax(nodes[:, 2]))]
    ring = 1000 * np.concatenate([rim, rim[:1]])
    off = 1000 * top + np.array([0.0, 0.0, 0.25])
    layers = {"Feet": [ring.tolist(), off.tolist()], "Other": [(1000 * nodes[len(nodes) // 2]).tolist()]}
    rhino_file("held.3dm", "Millimeters", layers)
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--supports", "held.3dm:feet")
    assert (ended.status, ended.err) == (0, "")
    entry = equilibrium_of("relaxed.json")
    held = {reaction["node"] for reaction in entry["reactions"]}
    assert {n for n, node in enumerate(nodes) if node[2] < nodes[:, 2].min() + 1e-6} <= held
    assert int(np.argmax(nodes[:, 2])) in held
    assert entry["supports"] == f"{len(held)} nodes, the support points at most 0.00025 m away"
    assert "at most 0.00025 m away" in ended.out
    ended = run("simulate", "woven.json", "-o", "all.json", "--supports", "held.3dm", "-q")
    assert len(equilibrium_of("all.json")["reactions"]) == len(held) + 1


def test_a_layer_that_is_not_there_is_refused_with_those_that_are(run: Run, woven: Path) -> None:
    rhino_file("held.3dm", "Millimeters", {"Feet": [[0.0, 0.0, 0.0]]})
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--supports", "held.3dm:Roof")
    assert ended.status == 1
    assert "NO_CURVE" in ended.err
    assert "Feet" in ended.err
    assert len(ended.err.splitlines()) == 1


def test_forces_are_read_from_points_of_a_layer(run: Run, woven: Path) -> None:
    nodes = nodes_of(woven)
    middle = int(np.argmin(np.abs(nodes[:, 2] - nodes[:, 2].mean())))
    place = (1000 * nodes[middle]).tolist()
    rhino_file("pull.3dm", "Millimeters", {"Pull": [place]}, {"force": "0, 0, -0.5"})
    rhino_file("plain.3dm", "Millimeters", {"Pull": [place]})
    options = ("simulate", "woven.json", "--no-gravity", "-q", "--loads")
    assert run(*options, "pull.3dm:Pull", "-o", "pulled.json").status == 0
    assert run(*options, "plain.3dm:Pull", "--force", "0,0,-0.5", "-o", "same.json").status == 0
    pulled, same = equilibrium_of("pulled.json"), equilibrium_of("same.json")
    assert pulled == same
    assert pulled["node_loads"][middle] == [0.0, 0.0, -0.5]
    assert np.abs(pulled["node_loads"]).sum() == 0.5
    for file, words in (("plain.3dm:Pull", "states no force"), ("woven.json", "not a Rhino file")):
        ended = run(*options, file, "-o", "never.json")
        assert ended.status == 1
        assert words in ended.err
    rhino_file("odd.3dm", "Millimeters", {"Pull": [place]}, {"force": "down"})
    assert "is not a force" in run(*options, "odd.3dm", "-o", "never.json").err
    assert run(*options, "plain.3dm", "--force", "0,0", "-o", "never.json").status == 2


def test_tables_are_written_beside_the_result(run: Run, woven: Path) -> None:
    ended = run("simulate", "woven.json", "-o", "relaxed.json", "--tables", "tables", "--tie-strength", "178")
    assert (ended.status, ended.err) == (0, "")
    assert "tables" in ended.out.splitlines()[-1]
    row = dict(zip(*(line.split(",") for line in Path("tables/equilibrium.csv").read_text().splitlines()[1:])))
    assert float(row["tie_strength_n"]) == 178.0
    assert float(row["departure_max"]) == pytest.approx(
        1000 * equilibrium_of("relaxed.json")["departure"]["max"], abs=1e-3
    )
    ended = run("simulate", "woven.json", "-o", "again.json", "--tables", "tables")
    assert ended.status == 1
    assert not Path("again.json").exists()


def test_the_workshop_folder_takes_a_simulated_result(run: Run, woven: Path) -> None:
    assert run("simulate", "woven.json", "-o", "relaxed.json", "-q").status == 0
    assert run("fabricate", "relaxed.json", "-o", "one", "--templates", "none", "-q").status == 0
    options = ("fabricate", "woven.json", "--simulation", "relaxed.json", "--templates", "none", "-q")
    assert run(*options, "-o", "two").status == 0
    for name in ("departures", "reactions"):
        one, two = (Path(folder, f"{name}.csv").read_text().split("\n", 1)[1] for folder in ("one", "two"))
        assert one == two
    assert "equilibrium_departure_mm" in Path("one/report.txt").read_text()
