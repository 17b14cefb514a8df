"""Mesh files, read back with trimesh or by hand."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from weavecore.errors import Unsupported
from weavecore.exporting.registry import WRITERS, encode
from woven_tube import tube_latitudes, tube_lattice, tube_surface

MESHES = (".obj", ".ply", ".off", ".stl")


@pytest.mark.parametrize("ending", MESHES)
@pytest.mark.parametrize("value", [tube_surface(), tube_lattice()], ids=["surface", "lattice"])
def test_trimesh_reads_back_the_same_mesh(ending: str, value: object) -> None:
    content = encode(value, f"a{ending}")
    loaded = trimesh.load(io.BytesIO(content), file_type=ending[1:], process=False, force="mesh")
    if ending == ".stl":
        loaded.merge_vertices()
    surface = value if ending and hasattr(value, "vertices") else None
    expected = surface.vertices if surface is not None else tube_lattice().nodes
    n_faces = len(surface.faces) if surface is not None else tube_lattice().n_faces
    assert len(loaded.vertices) == len(expected)
    assert len(loaded.faces) == n_faces
    assert np.allclose(np.sort(loaded.vertices, axis=0), np.sort(expected, axis=0), atol=1e-6)


@pytest.mark.parametrize("ending", [".obj", ".ply", ".off"])
def test_every_bit_of_the_coordinates_is_kept(ending: str) -> None:
    odd = replace(tube_surface(), vertices=tube_surface().vertices / 3 + 4e6)
    content = encode(odd, f"a{ending}")
    loaded = trimesh.load(io.BytesIO(content), file_type=ending[1:], process=False, force="mesh")
    assert np.array_equal(loaded.vertices, odd.vertices)
    assert np.array_equal(loaded.faces, odd.faces)


def test_polygons_stay_polygons_in_text() -> None:
    lattice = replace(tube_lattice(), face_offsets=[0, 3, 7, 12], face_nodes=np.arange(12))
    lines = encode(lattice, "a.obj").decode().splitlines()
    assert [line for line in lines if line.startswith("f")] == ["f 1 2 3", "f 4 5 6 7", "f 8 9 10 11 12"]
    assert encode(lattice, "a.off").decode().splitlines()[-1] == "5 7 8 9 10 11"
    assert int.from_bytes(encode(lattice, "a.stl")[80:84], "little") == 1 + 2 + 3


@pytest.mark.parametrize("ending", MESHES)
def test_latitudes_alone_are_no_mesh(ending: str) -> None:
    with pytest.raises(Unsupported, match="latitudes are curves"):
        encode(tube_latitudes(), f"a{ending}")


def test_an_unknown_ending_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(Unsupported, match=r"a\.dwg .* Use one of the endings \.3dm, \.json"):
        encode(tube_surface(), "a.dwg")


@pytest.mark.parametrize("ending", sorted(WRITERS))
def test_the_same_value_gives_the_same_bytes(ending: str) -> None:
    assert encode(tube_lattice(), f"a{ending}") == encode(tube_lattice(), f"A{ending.upper()}")
