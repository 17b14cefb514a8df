from __future__ import annotations

from pathlib import Path

import pytest

from ghpython.stubs import Canvas, install, run_component

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"


@pytest.fixture
def canvas(monkeypatch: pytest.MonkeyPatch) -> Canvas:
    """Grasshopper's modules, stubbed, with an empty sticky."""
    stubbed = Canvas()
    install(stubbed, monkeypatch.setitem)
    return stubbed


@pytest.fixture(scope="session")
def dome() -> str:
    return str(SAMPLES / "hemisphere.3dm")


@pytest.fixture
def surface(canvas: Canvas, dome: str):
    return run_component("Weave_Surface", geometry=dome)["surface"]
