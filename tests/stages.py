"""All stages after one another, each result held to what it promises."""

from __future__ import annotations

from typing import NamedTuple, Optional

from weavecore import pipeline
from weavecore.model import Latitudes, Lattice, Strands, SurfaceMesh
from weavecore.validating import validate
from weavecore.weaving.strands import find_strands


class Woven(NamedTuple):
    latitudes: Latitudes
    lattice: Lattice
    strands: Strands


def weave(surface: SurfaceMesh, *, spacing: Optional[float] = None, pattern: str = "triangular") -> Woven:
    latitudes = pipeline.offset(surface, spacing=spacing)
    lattice = pipeline.link(latitudes, pattern=pattern)
    return Woven(latitudes, lattice, find_strands(lattice))


def hold(woven: Woven) -> None:
    """Fail with the whole report where a stage broke a promise."""
    for report in (
        validate(woven.latitudes.surface),
        validate(woven.latitudes),
        validate(woven.lattice),
        validate(woven.strands, lattice=woven.lattice),
    ):
        assert report.holds, f"\n{report}"
