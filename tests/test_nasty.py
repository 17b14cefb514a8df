"""The catalogue of tough surfaces, through all stages: each is woven and keeps all promises."""

from __future__ import annotations

import numpy as np
import pytest

import raw_meshes
from stages import hold, weave
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import BadIndex, Degenerate, NonFinite, NonManifold, NotOrientable, WeaveError

SLOW = {"spiral"}
NAMES = [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in TOUGH]


@pytest.mark.parametrize("name", NAMES)
def test_a_tough_surface_is_woven_and_keeps_all_promises(name: str) -> None:
    hold(weave(pipeline.surface_from(TOUGH[name](0))))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("name", TOUGH)
def test_more_tough_surfaces_keep_all_promises(name: str, seed: int) -> None:
    hold(weave(pipeline.surface_from(TOUGH[name](seed))))


def broken_sheet(row: int, what: object) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = raw_meshes.grid()
    vertices[row] = what
    return vertices, raw_meshes.triangles(faces)


REFUSED = {
    "Moebius strip": (raw_meshes.band(twisted=True), NotOrientable),
    "three faces on an edge": (
        (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float), [[0, 1, 2], [1, 0, 3], [0, 1, 4]]),
        NonManifold,
    ),
    "two fans at a vertex": (
        (np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], float), [[0, 1, 2], [0, 3, 4]]),
        NonManifold,
    ),
    "not a number": (broken_sheet(3, np.nan), NonFinite),
    "infinite": (broken_sheet(7, [0, np.inf, 0]), NonFinite),
    "an index beyond the vertices": ((np.eye(3), [[0, 1, 2], [0, 2, 9]]), BadIndex),
    "no area": ((np.zeros((3, 3)), [[0, 1, 2]]), Degenerate),
    "no faces": ((np.eye(3), np.zeros((0, 3), int)), Degenerate),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_surface_is_refused_with_a_remedy(name: str) -> None:
    mesh, kind = REFUSED[name]
    with pytest.raises(WeaveError) as caught:
        pipeline.surface_from(mesh)
    assert isinstance(caught.value, kind)
    assert caught.value.code in str(caught.value)
    assert caught.value.remedy in str(caught.value)
