"""Several surfaces or spacings in one solution: right trees, one broken leaves the others, nothing is done twice."""

from __future__ import annotations

import gc
import tracemalloc
from typing import Any

import numpy as np
import pytest

import weavecore as wc
from ghpython.stubs import COMPONENTS, Canvas, Component, Ran, parameters_of, run_component
from weavecore import pipeline
from weavecore.model import SurfaceMesh
from woven_tube import tube_surface

Geometry = tuple[np.ndarray, np.ndarray]


def tube(scale: float) -> Geometry:
    surface = tube_surface()
    return surface.vertices * scale, surface.faces


def broken() -> Geometry:
    """Three triangles at one edge."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    return points, np.array([[0, 1, 2], [0, 3, 1], [0, 1, 4]])


def solution(name: str, values: list[dict[str, Any]], **grafted: Any) -> list[Ran]:
    """One solution of a component: it runs once for each set of inputs."""
    names = [p["name"] for p in parameters_of(COMPONENTS / name, "input")]
    component = Component(names, wired=list(values[0]), InstanceGuid=f"{name} of several", **grafted)
    runs = []
    for k, inputs in enumerate(values):
        component.RunCount = k + 1
        runs.append(run_component(name, component=component, **inputs))
    return runs


def paths_of(ran: Ran, output: str) -> list[str]:
    return list(map(str, ran[output].branches))


@pytest.fixture
def offsets(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The surfaces that were offset."""
    done: list[Any] = []

    def offset(surface: SurfaceMesh, **options: Any) -> wc.Latitudes:
        done.append(surface)
        return pipeline.offset(surface, **options)

    monkeypatch.setattr(wc, "offset", offset)
    return done


def test_twelve_surfaces_of_which_one_is_broken_keep_apart_and_are_reused(canvas: Canvas, offsets: list[Any]) -> None:
    geometry = [tube(1.0 + k / 10) for k in range(12)]
    geometry[3] = broken()
    seen = []
    for _ in range(2):
        surfaces = solution("Weave_Surface", [{"geometry": one} for one in geometry], n_items=12)
        told = [text for ran in surfaces for level, text in ran.messages if level == "Error"]
        assert [text[:27] for text in told] == ["Item 4 of 12: NON_MANIFOLD:"]
        assert surfaces[3]["surface"] is None
        inputs = [{"surface": ran["surface"], "spacing": [1.0 + k / 10]} for k, ran in enumerate(surfaces)]
        seen.append(solution("Weave_Offset", inputs, n_items=12, lists=["spacing", "borders", "guides"]))
        assert len(offsets) == 11, "what was there already was computed again"
    first, second = seen
    for k, (ran, again) in enumerate(zip(first, second)):
        if k == 3:
            assert ran.is_empty
            assert ran.messages == [("Warning", "Item 4 of 12: surface: nothing comes through the wire.")]
            continue
        assert again["latitudes"] is ran["latitudes"]
        generations = range(ran["latitudes"].n_generations)
        assert paths_of(ran, "curves") == [f"{{{k};{g}}}" for g in generations]
        assert all(path.startswith(f"{{{k};") for path in paths_of(ran, "parents"))


def test_grafted_spacings_give_a_branch_of_results_each(canvas: Canvas, offsets: list[Any]) -> None:
    surface = tube_surface()
    spacings = [[1.0], [0.5], [1.25, 0.8]]
    options: dict[str, Any] = {"lists": ["spacing"], "n_branches": len(spacings)}
    for _ in range(2):
        ran = solution("Weave_Offset", [{"surface": surface, "spacing": one} for one in spacings], **options)
        assert len(offsets) == len(spacings)
    assert [path for one in ran for path in paths_of(one, "curves")] == [
        f"{{{k};{g}}}" for k, one in enumerate(ran) for g in range(one["latitudes"].n_generations)
    ]
    refused = solution(
        "Weave_Offset", [{"surface": surface, "spacing": one} for one in ([1.0], ["x"], [0.8])], **options
    )
    assert [bool(one.messages) for one in refused] == [False, True, False]
    assert refused[1].messages[0][1].startswith("Item 2 of 3: UNSUPPORTED: spacing must be a number (got 'x')")


@pytest.mark.slow
def test_memory_stays_flat_over_fifty_steps_of_a_slider(canvas: Canvas) -> None:
    lattice = pipeline.link(pipeline.offset(tube_surface(), spacing=1.0), pattern="quad")
    sizes = []
    tracemalloc.start()
    try:
        for step in range(51):
            weave = run_component("Weave_Strands", lattice=lattice, diameter=0.01 + step / 1e4)["weave"]
            run_component("Weave_Preview", weave=weave)
            del weave
            if step % 10 == 0:
                gc.collect()
                sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # The caches are full after the first ten steps; later ones take no more.
    assert max(sizes[2:]) - sizes[1] < 0.1 * sizes[1], sizes


def test_what_is_measured_for_galapagos_are_plain_numbers(stages: dict[str, Ran]) -> None:
    measured = stages["measure"]
    for name in ("regular", "radius", "utilisation", "length", "waste", "mass"):
        assert type(measured[name]) is float, name
    assert type(measured["joints"]) is int
