"""Lattices coarser than their surface have no inverted faces, and say how far their edges leave it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planar_meshes import circle, plate
from weavecore import pipeline
from weavecore.errors import Doubtful
from weavecore.exporting.registry import encode
from weavecore.linking import link
from weavecore.model import Lattice, Note, Origins, SurfaceMesh
from weavecore.model.lattice_fit import (
    edge_gaps,
    face_middles,
    inverted_faces,
    note_far_edges,
    note_inverted_faces,
    note_short_edges,
)
from weavecore.validating import validate


def sheet(height: Callable[..., np.ndarray], n: int = 40, width: float = 100.0) -> SurfaceMesh:
    """A square with heights (n + 1, n + 1)."""
    x, y = np.meshgrid(np.linspace(0, width, n + 1), np.linspace(0, width, n + 1))
    corner = (np.arange(n * n) // n) * (n + 1) + np.arange(n * n) % n
    faces = np.r_[np.c_[corner, corner + 1, corner + n + 2], np.c_[corner, corner + n + 2, corner + n + 1]]
    return SurfaceMesh(np.c_[x.ravel(), y.ravel(), height(x, y).ravel()], faces)


FOLDED = {
    "pleats": lambda x, _y: 6.0 * np.abs((x / 10.0) % 2 - 1),
    "egg_box": lambda x, y: 5.0 * np.sin(x / 4.0) * np.sin(y / 4.0),
    "ridge": lambda x, _y: 40.0 * np.exp(-(((x - 47.0) / 6.0) ** 2)),
}


@pytest.mark.parametrize("name", sorted(FOLDED))
def test_folds_narrower_than_the_spacing_have_no_inverted_face(name: str) -> None:
    lattice = pipeline.link(pipeline.offset(sheet(FOLDED[name]), spacing=12.0))
    assert len(inverted_faces(lattice)) == 0


def notes_of(lattice: Lattice) -> tuple[Note, ...]:
    return tuple(lattice.latitudes.surface.notes)


def crumpled(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 4 * np.sin(x / 2.3) * np.cos(y / 3.1) + 3 * np.sin((x + y) / 1.9)


@pytest.mark.parametrize("pattern", ["kagome", "diagonal", "hexagonal"])
def test_inverted_faces_of_derived_patterns_are_mended_by_other_divisions_or_noted(pattern: str) -> None:
    """Without other divisions, untangling and moves back kagome has 5 and diagonal 3."""
    lattice = pipeline.link(pipeline.offset(sheet(crumpled), spacing=12.0), pattern=pattern)
    n_inverted = len(inverted_faces(lattice))
    assert n_inverted <= 1
    assert (n_inverted > 0) == any(note.code == "COARSE" and "inverted" in note.text for note in notes_of(lattice))


def test_inverted_faces_that_remain_are_noted_in_the_result_and_refused_where_doubts_are() -> None:
    latitudes = pipeline.offset(sheet(crumpled), spacing=12.0)
    lattice = pipeline.link(latitudes, pattern="plain")
    inverted = inverted_faces(lattice)
    assert len(inverted) > 0
    written = json.loads(encode(pipeline.weave(lattice), "a.json"))["notes"][-1]
    assert (written["code"], written["is_doubt"]) == ("COARSE", True)
    assert written["numbers"]["inverted_faces"] == len(inverted)
    assert np.allclose(written["points"], face_middles(lattice)[0][inverted][:8])
    assert ("doubt", f"COARSE: {written['text']}") in pipeline.describe(lattice)
    with pytest.raises(Doubtful, match="inverted"):
        pipeline.refuse_doubts(lattice.latitudes.surface)


def test_a_lattice_without_inverted_faces_gets_no_note() -> None:
    lattice = pipeline.link(pipeline.offset(sheet(FOLDED["ridge"]), spacing=12.0))
    assert note_inverted_faces(lattice) is lattice


def test_nodes_move_back_where_smoothing_inverts_a_face() -> None:
    before = pipeline.link(pipeline.offset(sheet(lambda x, _y: 0 * x), spacing=12.0))
    inner = np.flatnonzero(before.node_latitude == before.node_latitude.max())[:1]
    nodes = before.nodes.copy()
    nodes[inner] += [40.0, 0.0, 0.0]
    bad = replace(before, nodes=nodes)
    assert len(inverted_faces(bad)) > 0
    mended = link._without_new_inversions(before, bad)
    assert len(inverted_faces(mended)) == 0


def test_the_gap_under_an_edge_over_a_crease_is_measured() -> None:
    lattice = pipeline.link(pipeline.offset(sheet(lambda x, _y: np.abs(x - 50.0)), spacing=12.0))
    gaps = edge_gaps(lattice)
    across = (lattice.nodes[lattice.edges][:, :, 0] - 50.0).prod(1) < -1.0
    assert gaps[across].max() > 0.4
    assert gaps[~across].max() < 0.2
    finding = validate(lattice)["edges_off_surface_of_spacing"]
    assert finding.figure == pytest.approx(gaps.max() / max(lattice.edge_length, 12.0))
    lifted = replace(lattice, nodes=lattice.nodes + np.array([0.0, 0.0, 30.0]))
    assert not validate(lifted)["edges_off_surface_of_spacing"].holds


def sawtooth(teeth: int, pitch: float, depth: float) -> SurfaceMesh:
    """A plate of which the lower side is a saw blade; the three other sides are straight."""
    width = teeth * pitch
    x = np.linspace(0.0, width, 2 * teeth + 1)
    rows = [np.c_[x, np.where(np.arange(len(x)) % 2, -depth, 0.0)]]
    rows += [np.c_[x, np.full(len(x), y)] for y in np.linspace(0.0, width, teeth + 1)[1:]]
    n, m = len(x), len(rows)
    a = (np.arange((n - 1) * (m - 1)) // (n - 1)) * n + np.arange((n - 1) * (m - 1)) % (n - 1)
    points = np.concatenate(rows)
    return SurfaceMesh(np.c_[points, 0 * points[:, 0]], np.r_[np.c_[a, a + 1, a + n + 1], np.c_[a, a + n + 1, a + n]])


@pytest.mark.parametrize(("pitch", "depth"), [(100.0, 40.0), (60.0, 30.0), (150.0, 90.0)])
def test_straight_sides_beside_a_side_of_many_corners_keep_their_edges(pitch: float, depth: float) -> None:
    surface = sawtooth(20, pitch, depth)
    lattice = pipeline.link(pipeline.offset(surface, spacing=100.0))
    width, edge = 20 * pitch, lattice.edge_length
    on_border = lattice.node_latitude == 0
    y = lattice.nodes[on_border, 1]
    top = int((y > width - 1e-6).sum()) - 1
    assert abs(top - round(width / edge)) <= max(1, 0.2 * width / edge)
    assert validate(lattice).holds


def test_edges_far_off_the_surface_are_noted_with_their_number_and_distance() -> None:
    lattice = pipeline.link(pipeline.offset(sheet(lambda x, _y: 0 * x), spacing=12.0))
    assert note_far_edges(lattice) is lattice
    inner = np.flatnonzero(lattice.node_latitude > 0)[0]
    nodes = lattice.nodes + np.where(np.arange(lattice.n_nodes) == inner, 16.0, 0.0)[:, None] * [0, 0, 1]
    (note,) = notes_of(note_far_edges(replace(lattice, nodes=nodes)))
    assert (note.code, note.is_doubt) == ("COARSE", True)
    numbers = dict(note.numbers)
    assert numbers["far_edges"] == (lattice.edges == inner).any(1).sum()
    assert 0.7 * 16 < numbers["distance"] < 16


def almost_touching(gap: float, n_holes: int) -> SurfaceMesh:
    """A disc in which a hole comes that near to the rim, or two holes come that near to each other."""
    radius = 0.3
    shift = radius + gap / 2
    centres = [(1.0 - radius - gap, 0.0)] if n_holes == 1 else [(-shift, 0.0), (shift, 0.0)]
    return SurfaceMesh(*plate([circle(1.0, n=60), *(circle(radius, centre, 24) for centre in centres)], 0.1))


@pytest.mark.parametrize("n_holes", [1, 2])
def test_an_edge_without_length_between_borders_that_almost_touch_is_noted_with_its_place(n_holes: int) -> None:
    lattice = pipeline.link(pipeline.offset(almost_touching(1e-5, n_holes)))
    (note,) = notes_of(lattice)
    numbers = dict(note.numbers)
    assert (note.code, note.is_doubt, numbers["short_edges"]) == ("COARSE", True, 1)
    assert numbers["length"] == pytest.approx(lattice.edge_lengths.min()) == pytest.approx(1e-5)
    assert np.allclose(note.points, [[1.0, 0.0, 0.0] if n_holes == 1 else [0.0, 0.0, 0.0]], atol=1e-5)


def test_borders_that_are_a_hundredth_of_the_size_apart_are_not_doubted() -> None:
    assert notes_of(pipeline.link(pipeline.offset(almost_touching(0.01, 1)))) == ()


def test_edges_around_a_border_far_shorter_than_the_spacing_are_noted_where_distances_start_there() -> None:
    x, y = (axis.ravel() for axis in np.meshgrid([0.0, 40.0, 40.001, 80.0], [0.0, 40.0, 40.001, 80.0]))
    a = np.array([4 * j + i for j in range(3) for i in range(3) if (i, j) != (1, 1)])
    plate = SurfaceMesh(np.c_[x, y, 0 * x], np.r_[np.c_[a, a + 1, a + 5], np.c_[a, a + 5, a + 4]])
    hole = next(loop for loop in plate.borders if len(loop) == 4 and np.ptp(plate.vertices[loop]) < 41)
    lattice = pipeline.link(pipeline.offset(replace(plate, starts=Origins((hole,), np.array([True]))), spacing=12.0))
    assert note_short_edges(lattice) is not lattice
    note = notes_of(lattice)[-1]
    assert (note.code, note.is_doubt, dict(note.numbers)["short_edges"]) == ("COARSE", True, 3)
    assert np.allclose(note.points, [40.0005, 40.0005, 0.0], atol=1e-3)
    assert not validate(lattice)["degenerate_edges"].holds
    whole = pipeline.link(pipeline.offset(plate, spacing=12.0))
    assert note_short_edges(whole) is whole


@pytest.mark.parametrize(("share_inverted", "n_divisions"), [(0.0, 6), (0.1, 7)])
def test_lattices_with_many_inverted_faces_are_not_divided_again_for_short_rods(
    share_inverted: float, n_divisions: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    latitudes = pipeline.offset(sheet(lambda x, _y: 0 * x, n=10), spacing=12.0)
    divided: list[float] = []
    linked = link._linked

    def counted(*args: Any) -> Lattice:
        divided.append(args[1])
        return linked(*args)

    monkeypatch.setattr(link, "_linked", counted)
    monkeypatch.setattr(link, "count_short_rods", lambda _paired: (50, 100))
    monkeypatch.setattr(link, "inverted_faces", lambda lattice: np.arange(int(share_inverted * lattice.n_faces)))
    link.link_pattern(latitudes)
    assert len(divided) == n_divisions
