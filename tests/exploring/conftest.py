"""The small grid, woven once."""

from __future__ import annotations

import pytest

from explored_tube import explore_tube
from weavecore.exploring import Exploration


@pytest.fixture(scope="session")
def explored(tmp_path_factory: pytest.TempPathFactory) -> Exploration:
    """In one process."""
    return explore_tube(tmp_path_factory.mktemp("explored") / "tube")
