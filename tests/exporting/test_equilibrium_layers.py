"""The layers of a .3dm that show a weave at rest, read back."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm

from weavecore import pipeline
from weavecore.exporting.registry import encode
from weavecore.model import Equilibrium
from weavecore.palette import utilisation_colours
from woven_rods import woven_tube


@cache
def at_rest() -> Equilibrium:
    return pipeline.simulate(woven_tube("plain"), pressure=200.0)


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """The objects of each layer."""
    path = tmp_path_factory.mktemp("layers") / "relaxed.3dm"
    path.write_bytes(encode(at_rest(), "relaxed.3dm"))
    document = rhino3dm.File3dm.Read(str(path))
    layers: dict[str, list[Any]] = {}
    for one in document.Objects:
        layers.setdefault(document.Layers[one.Attributes.LayerIndex].FullPath, []).append(one)
    return layers


def ends_of(one: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in (one.Geometry.PointAtStart, one.Geometry.PointAtEnd)])


def places_of(cloud: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in cloud.Geometry.GetPoints()])


def text(one: Any, key: str) -> float:
    return float(one.Attributes.GetUserString(key))


def test_stress_is_a_coloured_point_wherever_it_was_found(objects: dict[str, list[Any]]) -> None:
    (cloud,) = objects["equilibrium::stress"]
    assert (places_of(cloud) == at_rest().points).all()
    colours = [colour[:3] for colour in cloud.Geometry.GetColors()]
    assert colours == [tuple(row) for row in utilisation_colours(at_rest().utilisation).tolist()]
    assert len(set(colours)) > 10
    assert text(cloud, "utilisation_max") == at_rest().utilisation_max
    assert text(cloud, "stress_max_mpa") / text(cloud, "allowable_stress_mpa") == pytest.approx(
        at_rest().utilisation_max
    )


def test_an_arrow_runs_from_where_a_node_was_drawn_to_where_it_rests(objects: dict[str, list[Any]]) -> None:
    arrows = objects["equilibrium::departure"]
    assert len(arrows) > 100
    for one in arrows:
        node = int(one.Attributes.GetUserString("node"))
        start, end = ends_of(one)
        assert (start == at_rest().weave.lattice.nodes[node]).all()
        assert np.linalg.norm(end - start) == pytest.approx(at_rest().departure[node], rel=1e-9)
        assert one.Attributes.ObjectDecoration == rhino3dm.ObjectDecoration.EndArrowhead
    longest = max(arrows, key=lambda one: text(one, "departure"))
    assert longest.Attributes.ObjectColor[:3] == tuple(utilisation_colours([1.0])[0].tolist())
    (cloud,) = objects["equilibrium::nodes"]
    assert text(cloud, "departure_max") == at_rest().departure_max


@pytest.mark.parametrize("name", ["reactions", "loads"])
def test_forces_are_arrows_with_their_newtons_on_one_scale(objects: dict[str, list[Any]], name: str) -> None:
    forces = at_rest().reaction if name == "reactions" else at_rest().load
    arrows = objects[f"equilibrium::{name}"]
    total = np.zeros(3)
    for one in arrows:
        node = int(one.Attributes.GetUserString("node"))
        force = np.array([text(one, key) for key in ("x_n", "y_n", "z_n")])
        assert (force == forces[node]).all()
        start, end = ends_of(one)
        assert end - start == pytest.approx(force * text(one, "length_of_1_n"), abs=1e-9)
        total += force
    # What has no arrow is below a thousandth of the largest force.
    assert np.abs(total - forces.sum(0)).max() < 1e-3 * np.linalg.norm(forces, axis=1).max() * len(forces)
    assert len({text(one, "length_of_1_n") for one in arrows}) == 1


def test_supports_stand_at_the_heads_of_their_reactions(objects: dict[str, list[Any]]) -> None:
    (cloud,) = objects["equilibrium::supports"]
    assert len(places_of(cloud)) == at_rest().is_supported.sum()
    heads = {tuple(ends_of(one)[1].round(6)) for one in objects["equilibrium::reactions"]}
    assert heads <= {tuple(place) for place in places_of(cloud).round(6)}


def test_the_legend_names_the_extremes(objects: dict[str, list[Any]]) -> None:
    texts = [one.Geometry.Text for one in objects["equilibrium::legend"]]
    assert any(f"{at_rest().stress_max:.0f} MPa" in one for one in texts)
    assert any(one.startswith("departure at most") and "mm" in one for one in texts)
    assert any(one.startswith("reaction at most") for one in texts)


def test_a_released_weave_has_no_forces_to_show(tmp_path: Path) -> None:
    pipeline.export(pipeline.simulate(woven_tube("triangular"), supports="none"), tmp_path / "free.3dm")
    layers = {layer.FullPath for layer in rhino3dm.File3dm.Read(str(tmp_path / "free.3dm")).Layers}
    assert layers.isdisjoint({"equilibrium::reactions", "equilibrium::loads", "equilibrium::supports"})
    assert "equilibrium::departure" in layers


def test_the_same_equilibrium_gives_the_same_bytes() -> None:
    assert encode(at_rest(), "one.3dm") == encode(at_rest(), "two.3dm")
