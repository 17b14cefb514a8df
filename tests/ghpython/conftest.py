from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from pathlib import Path

import pytest

from ghpython.stubs import Canvas, Ran, install, run_component
from weavecore.canvas.caching import ComponentCache

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"


@pytest.fixture(scope="module")
def _stubbed() -> Iterator[Canvas]:
    canvas = Canvas()
    with pytest.MonkeyPatch.context() as patch:
        install(canvas, patch.setitem)
        yield canvas


@pytest.fixture(scope="module")
def stages(_stubbed: Canvas, dome: str) -> dict[str, Ran]:
    """All components one after the other, on real input."""
    surface = run_component("Weave_Surface", geometry=dome)
    offset = run_component("Weave_Offset", surface=surface["surface"], spacing=50.0)
    link = run_component("Weave_Link", latitudes=offset["latitudes"])
    strands = run_component("Weave_Strands", lattice=link["lattice"], diameter=0.2)
    simulate = run_component("Weave_Simulate", weave=strands["weave"])
    measure = run_component("Weave_Measure", value=strands["weave"])
    ran = {"surface": surface, "offset": offset, "link": link, "strands": strands, "simulate": simulate}
    return {**ran, "measure": measure}


def copied(cache: ComponentCache) -> ComponentCache:
    twin = copy(cache)
    twin._outcomes, twin.down, twin.pressed = cache._outcomes.copy(), set(cache.down), set(cache.pressed)
    return twin


@pytest.fixture
def canvas(_stubbed: Canvas) -> Iterator[Canvas]:
    """Grasshopper's modules, stubbed; what a test leaves in the sticky is taken out again."""
    before = {name: copied(cache) for name, cache in _stubbed.sticky.items()}
    yield _stubbed
    _stubbed.is_escape_down = False
    _stubbed.sticky.clear()
    _stubbed.sticky.update(before)


@pytest.fixture(autouse=True)
def browser(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The pages that were opened."""
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    return opened


@pytest.fixture(scope="session")
def dome() -> str:
    return str(SAMPLES / "hemisphere.3dm")
