"""Spacings at which fronts meet halfway between two latitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.offsetting.phase import find_meetings, spacing_in_phase
from weavecore.offsetting.spacing import suggest_spacing


def tube(height: float, radius: float = 300.0) -> SurfaceMesh:
    """An upright tube in millimetres, 144 columns around."""
    columns, rows = 144, int(height / 8) + 1
    turn = 2 * np.pi * np.arange(columns) / columns
    circle = radius * np.c_[np.cos(turn), np.sin(turn)]
    vertices = np.concatenate([np.c_[circle, np.full(columns, z)] for z in np.linspace(0, height, rows)])
    r, j = (part.ravel() for part in np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij"))
    a, b = r * columns + j, r * columns + (j + 1) % columns
    faces = np.concatenate([np.c_[a, b, b + columns], np.c_[a, b + columns, a + columns]])
    return SurfaceMesh(vertices, faces, unit="Millimeters")


def test_the_fronts_of_a_tube_meet_at_half_its_height_all_around() -> None:
    surface = tube(400.0)
    meetings = find_meetings(surface, measure_distance(surface))
    assert meetings.depth == pytest.approx(np.full(len(meetings.depth), 200.0), abs=0.1)
    assert meetings.length.sum() == pytest.approx(2 * np.pi * 300.0, rel=0.1)
    assert meetings.share_in_phase(200 / 5.5) == pytest.approx(1.0)
    assert meetings.share_in_phase(200 / 5.05) == 0.0


@pytest.mark.parametrize("height", [400.0, 716.0])
def test_the_suggested_spacing_of_a_tube_leaves_no_rod_end_inside(height: float) -> None:
    latitudes = pipeline.offset(tube(height))
    weave = pipeline.weave(pipeline.link(latitudes), rod_diameter=1.0)
    assert weave.n_ends_inside == 0
    assert not [note for note in latitudes.surface.notes if note.code == "PHASE"]


@pytest.mark.parametrize("height", [400.0, 501.0])
def test_the_suggested_spacing_is_the_same_in_metres(height: float) -> None:
    surface = tube(height)
    metres = replace(surface, vertices=surface.vertices / 1000.0, unit="Meters")
    assert suggest_spacing(metres) == pytest.approx(suggest_spacing(surface) / 1000.0, rel=1e-12)


def test_a_spacing_out_of_phase_is_kept_and_the_nearest_in_phase_is_noted() -> None:
    latitudes = pipeline.offset(tube(400.0), spacing=39.0)
    assert latitudes.spacing == 39.0
    (note,) = (note for note in latitudes.surface.notes if note.code == "PHASE")
    assert not note.is_doubt
    better = dict(note.numbers)["spacing_in_phase"]
    assert (200.0 / better) % 1.0 == pytest.approx(0.5, abs=0.07)
    assert f"{better:g}" in note.text
    assert not [note for note in pipeline.offset(tube(400.0), spacing=better).surface.notes if note.code == "PHASE"]


def test_where_fronts_meet_at_a_point_the_spacing_stays() -> None:
    turn, r = np.meshgrid(2 * np.pi * np.arange(60) / 60, np.linspace(1, 300, 40))
    points = np.c_[(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), 0 * r.ravel()]
    here = np.arange(60 * 39)
    right = here // 60 * 60 + (here + 1) % 60
    faces = np.concatenate([np.c_[here, here + 60, right + 60], np.c_[here, right + 60, right]])
    centre = len(points)
    middle = np.c_[np.full(60, centre), np.arange(60), (np.arange(60) + 1) % 60]
    surface = SurfaceMesh(np.concatenate([points, [[0, 0, 0]]]), np.concatenate([faces, middle]))
    field = measure_distance(surface)
    assert [spacing_in_phase(surface, field, s) for s in (20.0, 21.0, 22.0)] == [20.0, 21.0, 22.0]
