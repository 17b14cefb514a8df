"""A small grid of a tube: all borders, and one that is not there, in two patterns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from weavecore.exploring import Exploration, explore
from weavecore.exploring.table import TIMES
from woven_tube import tube_surface

GRID: dict[str, Any] = {
    "spacings": [1.0],
    "borders": ["all", (7,)],
    "patterns": ["triangular", "plain"],
    "rods": [0.02],
}


def explore_tube(folder: Path, **options: Any) -> Exploration:
    """Without pages, which take most of the time."""
    return explore(replace(tube_surface(), name="tube"), folder, **{"pages": False, **GRID, **options})


def contents(folder: Path) -> dict[str, bytes]:
    """All files that do not depend on time."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != TIMES]
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(files)}
