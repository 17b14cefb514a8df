"""The .3dm that is written, read back with rhino3dm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rhino3dm

from open_cloth import cloth_latitudes
from weavecore.exporting import rhino_builder
from weavecore.exporting.registry import encode
from weavecore.exporting.rhino_builder import with_fixed_dates
from weavecore.model import LONGITUDINAL, Lattice
from weavecore.palette import latitude_colours
from woven_tube import COLUMNS, tube_latitudes, tube_lattice, tube_strands, tube_surface


def read_back(folder: Path, value: Any, **options: Any) -> rhino3dm.File3dm:
    (folder / "out.3dm").write_bytes(encode(value, "out.3dm", **options))
    return rhino3dm.File3dm.Read(str(folder / "out.3dm"))


def by_layer(document: rhino3dm.File3dm) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for one in document.Objects:
        found.setdefault(document.Layers[one.Attributes.LayerIndex].FullPath, []).append(one)
    return found


def texts_of(one: Any) -> dict[str, str]:
    return dict(one.Attributes.GetUserStrings())


def points_of(curve: Any) -> np.ndarray:
    return np.array([[p.X, p.Y, p.Z] for p in map(curve.Point, range(curve.PointCount))])


def test_layers_are_those_of_the_contract(tmp_path: Path) -> None:
    found = by_layer(read_back(tmp_path, tube_lattice(), strands=tube_strands()))
    counts = {layer: len(objects) for layer, objects in found.items()}
    assert {layer: n for layer, n in counts.items() if "longitudes" not in layer} == {
        "weave::latitudes::00": 2,
        "weave::latitudes::01": 2,
        "weave::latitudes::02": 2,
        "weave::pockets": 2 * COLUMNS,
        "weave::nodes": 1,
        "weave::lattice": 1,
    }
    longitudes = {layer: n for layer, n in counts.items() if "longitudes" in layer}
    assert longitudes == {"weave::longitudes::00": 4 * COLUMNS, "weave::longitudes::01": 4 * COLUMNS}


def test_open_latitudes_are_open_curves_from_selvedge_to_selvedge(tmp_path: Path) -> None:
    latitudes = cloth_latitudes("hole")
    found = by_layer(read_back(tmp_path, latitudes))
    curves = [one.Geometry for layer in sorted(found) if "latitudes" in layer for one in found[layer]]
    assert [curve.IsClosed for curve in curves] == latitudes.polylines.closed.tolist()
    for p, curve in enumerate(curves):
        drawn, wanted = points_of(curve), latitudes.polylines.polyline(p)
        assert np.array_equal(drawn[: len(wanted)], wanted)
        assert len(drawn) == len(wanted) + curve.IsClosed


def test_unit_and_tolerance_are_those_of_the_input(tmp_path: Path) -> None:
    surface = replace(tube_surface(), tolerance=0.0125)
    settings = read_back(tmp_path, surface).Settings
    assert settings.ModelUnitSystem == rhino3dm.UnitSystem.Meters
    assert settings.ModelAbsoluteTolerance == 0.0125
    settings = read_back(tmp_path, replace(surface, unit="None")).Settings
    assert settings.ModelUnitSystem == getattr(rhino3dm.UnitSystem, "None")


def test_latitudes_are_closed_and_say_where_they_come_from(tmp_path: Path) -> None:
    latitudes = tube_latitudes()
    found = by_layer(read_back(tmp_path, latitudes))
    (third,) = [one for one in found["weave::latitudes::01"] if one.Attributes.Name == "latitude 3"]
    texts = texts_of(third)
    assert {key: texts[key] for key in ("id", "family", "generation", "parents")} == {
        "id": "3",
        "family": "latitudinal",
        "generation": "1",
        "parents": "1",
    }
    assert float(texts["distance"]) == latitudes.distance[3]
    assert float(texts["length"]) == latitudes.polylines.lengths[3]
    expected = latitudes.polylines.polyline(3)
    assert np.array_equal(points_of(third.Geometry), np.concatenate([expected, expected[:1]]))
    assert third.Geometry.IsClosed


def test_generations_have_the_colours_of_the_palette(tmp_path: Path) -> None:
    document = read_back(tmp_path, tube_latitudes())
    layers = {layer.FullPath: layer for layer in document.Layers}
    for generation, colour in enumerate(latitude_colours([0, 1, 2], 3).tolist()):
        assert layers[f"weave::latitudes::{generation:02d}"].Color[:3] == tuple(colour)
    assert all(one.Attributes.ColorSource == rhino3dm.ObjectColorSource.ColorFromLayer for one in document.Objects)


def test_strands_run_through_their_nodes(tmp_path: Path) -> None:
    lattice, strands = tube_lattice(), tube_strands()
    found = by_layer(read_back(tmp_path, lattice, strands=strands))
    named = {one.Attributes.Name: one for objects in found.values() for one in objects}
    s = int(np.flatnonzero(strands.family == LONGITUDINAL)[0])
    strand = named[f"strand {s}"]
    assert np.array_equal(points_of(strand.Geometry), lattice.nodes[strands.strand(s)])
    assert texts_of(strand)["family"] == "longitudinal"
    assert float(texts_of(strand)["length"]) == pytest.approx(
        strand.Geometry.PointAtStart.DistanceTo(strand.Geometry.PointAtEnd)
    )
    assert "strand 0" not in named  # It is a ring, which its latitude stands for.


def test_nodes_and_mesh_keep_every_bit(tmp_path: Path) -> None:
    lattice = tube_lattice()
    far = replace(lattice, nodes=lattice.nodes + 4e6 + 1 / 3)
    found = by_layer(read_back(tmp_path, far, strands=tube_strands()))
    cloud, mesh = found["weave::nodes"][0].Geometry, found["weave::lattice"][0].Geometry
    assert np.array_equal([[p.X, p.Y, p.Z] for p in cloud.GetPoints()], far.nodes)
    assert np.array_equal([[p.X, p.Y, p.Z] for p in mesh.Vertices.ToPoint3dArray()], far.nodes)
    faces = np.array(list(mesh.Faces))
    assert np.array_equal(faces[:, :3].ravel(), far.face_nodes)
    assert np.array_equal(faces[:, 2], faces[:, 3])


def with_faces(lattice: Lattice, faces: list[list[int]]) -> Lattice:
    return replace(
        lattice, face_offsets=np.cumsum([0, *map(len, faces)]), face_nodes=[corner for face in faces for corner in face]
    )


def test_quads_stay_quads_and_larger_faces_become_fans(tmp_path: Path) -> None:
    lattice = with_faces(tube_lattice(), [[0, 1, 2], [3, 4, 5, 6], [7, 8, 9, 10, 11]])
    mesh = by_layer(read_back(tmp_path, lattice))["weave::lattice"][0].Geometry
    assert list(mesh.Faces) == [(0, 1, 2, 2), (3, 4, 5, 6), (7, 8, 9, 9), (7, 9, 10, 10), (7, 10, 11, 11)]


def test_a_surface_alone_has_its_own_layer_and_name(tmp_path: Path) -> None:
    found = by_layer(read_back(tmp_path, replace(tube_surface(), name="Tube")))
    assert list(found) == ["weave::surface"]
    assert found["weave::surface"][0].Attributes.Name == "Tube"


def test_the_time_of_writing_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock goes on between two runs: without the fixed dates the bytes differ."""
    import time

    def twice() -> tuple[bytes, bytes]:
        first = encode(tube_lattice(), "a.3dm", strands=tube_strands())
        time.sleep(1.05)
        return first, encode(tube_lattice(), "a.3dm", strands=tube_strands())

    first, second = twice()
    assert first == second
    monkeypatch.setattr("weavecore.exporting.rhino_builder.with_fixed_dates", lambda content: content)
    first, second = twice()
    assert first != second


def test_fixed_dates_leave_a_file_that_is_no_3dm_as_it_is() -> None:
    assert with_fixed_dates(b"x" * 100) == b"x" * 100
    assert rhino_builder.with_fixed_dates(b"") == b""


def test_other_results_have_other_ids(tmp_path: Path) -> None:
    surface = tube_surface()
    one = read_back(tmp_path, surface).Objects[0].Attributes.Id
    same = read_back(tmp_path, tube_surface()).Objects[0].Attributes.Id
    other = read_back(tmp_path, replace(surface, vertices=surface.vertices * 2)).Objects[0].Attributes.Id
    assert one == same
    assert one != other
