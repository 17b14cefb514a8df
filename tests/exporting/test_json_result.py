"""The JSON result holds what the contract says, to the last bit."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from open_cloth import CLOTHS, cloth_latitudes
from weavecore.exporting.registry import encode
from weavecore.model import FAMILIES, SurfaceMesh
from woven_tube import tube_latitudes, tube_lattice, tube_strands, tube_surface


def test_every_part_of_a_lattice_is_read_back_to_the_bit() -> None:
    lattice, strands = tube_lattice(), tube_strands()
    latitudes, surface = lattice.latitudes, lattice.latitudes.surface
    result = json.loads(encode(lattice, "a.json", strands=strands, parameters={"method": "levels"}))

    assert (result["format"], result["version"], result["unit"]) == ("weavecore", 1, "Meters")
    assert result["parameters"] == {"method": "levels", "spacing": 1.0, "edge_length": 1.0, "pattern": "triangular"}
    assert np.array_equal(result["surface"]["vertices"], surface.vertices)
    assert np.array_equal(result["surface"]["faces"], surface.faces)
    assert np.array_equal(result["latitudes"]["points"], latitudes.polylines.points)
    assert np.array_equal(result["latitudes"]["offsets"], latitudes.polylines.offsets)
    for name in ("generation", "distance", "parents"):
        assert np.array_equal(result["latitudes"][name], getattr(latitudes, name))
    for name in ("nodes", "edges", "node_latitude", "node_station"):
        assert np.array_equal(result["lattice"][name], getattr(lattice, name))
    assert np.array_equal(np.concatenate(result["lattice"]["faces"]), lattice.face_nodes)
    assert result["lattice"]["edge_family"] == [FAMILIES[k] for k in lattice.edge_family]


def test_strands_have_ids_families_nodes_and_lengths() -> None:
    lattice, strands = tube_lattice(), tube_strands()
    rows = json.loads(encode(lattice, "a.json", strands=strands))["strands"]
    assert [row["id"] for row in rows] == list(range(len(strands)))
    for s in (0, len(strands) - 1):
        path = lattice.nodes[strands.strand(s)]
        if rows[s]["closed"]:
            path = np.concatenate([path, path[:1]])
        assert rows[s]["length"] == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        assert rows[s]["nodes"] == strands.strand(s).tolist()
    assert (rows[0]["closed"], rows[0]["family"]) == (True, "latitudinal")
    assert (rows[-1]["closed"], rows[-1]["family"]) == (False, FAMILIES[strands.family[-1]])


def test_a_result_has_only_the_stages_that_were_done() -> None:
    surface = json.loads(encode(tube_surface(), "a.json"))
    latitudes = json.loads(encode(tube_latitudes(), "a.json"))
    assert {"latitudes", "lattice", "strands", "crossings"}.isdisjoint(surface)
    assert "latitudes" in latitudes
    assert {"lattice", "strands", "crossings"}.isdisjoint(latitudes)
    assert latitudes["parameters"] == {"spacing": 1.0}


def test_a_cut_is_named_of_a_closed_surface_alone() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    closed = SurfaceMesh(corners, faces, cuts=(np.array([0, 1, 2]),))
    assert json.loads(encode(closed, "a.json"))["surface"]["cut"] == [[0, 1, 2]]
    assert "cut" not in json.loads(encode(tube_surface(), "a.json"))["surface"]


def test_every_polyline_says_whether_it_is_closed() -> None:
    assert json.loads(encode(tube_latitudes(), "a.json"))["latitudes"]["closed"] == [True] * len(tube_latitudes())
    latitudes = cloth_latitudes("hole")
    closed = json.loads(encode(latitudes, "a.json"))["latitudes"]["closed"]
    assert closed == latitudes.polylines.closed.tolist()
    assert sorted(set(closed)) == [False, True]


def test_origins_are_named_where_they_were_chosen_alone() -> None:
    assert "origins" not in json.loads(encode(tube_surface(), "a.json"))["surface"]
    for name, is_closed in (("hole", True), ("slit", False)):
        surface = CLOTHS[name]()
        told = json.loads(encode(surface, "a.json"))["surface"]["origins"]
        assert told == [{"vertices": surface.origins.paths[0].tolist(), "closed": is_closed}]


def test_floats_are_the_shortest_that_read_back() -> None:
    surface = tube_surface()
    odd = replace(surface, vertices=surface.vertices + np.array([0.1, 1 / 3, 1e-17]))
    text = encode(odd, "a.json").decode()
    assert np.array_equal(json.loads(text)["surface"]["vertices"], odd.vertices)
    assert b"1.1000000000000001," not in encode(odd, "a.json")
    assert " " not in text
    assert "NaN" not in text


def test_a_number_that_json_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="JSON"):
        encode(tube_surface(), "a.json", parameters={"spacing": float("nan")})


def test_names_in_other_scripts_stay_readable() -> None:
    assert "織" in encode(tube_surface(), "a.json", parameters={"layer": "織"}).decode()
