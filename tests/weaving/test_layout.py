"""A layout saves work and changes nothing."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.model import Lattice
from weavecore.weaving import layout as laying
from woven_rods import tube_latitudes


@cache
def latticed(pattern: str = "triangular") -> Lattice:
    lattice: Lattice = pipeline.link(tube_latitudes(150.0, 180.0, 60.0), pattern=pattern)
    return lattice


@pytest.mark.parametrize("diameter", [3.0, 12.0, None], ids=["thin", "thick", "stock"])
def test_a_weave_with_a_layout_has_the_bytes_of_one_without(diameter: float | None, tmp_path: Path) -> None:
    layout = pipeline.lay_out(latticed())
    pipeline.weave(latticed(), rod_diameter=5.0, layout=layout)
    reused, anew = tmp_path / "reused.json", tmp_path / "anew.json"
    pipeline.export(pipeline.weave(latticed(), rod_diameter=diameter, layout=layout), reused)
    pipeline.export(pipeline.weave(latticed(), rod_diameter=diameter), anew)
    assert reused.read_bytes() == anew.read_bytes()


def test_rods_are_not_laid_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = pipeline.lay_out(latticed("kagome"))
    found = []
    monkeypatch.setattr(laying, "find_strands", lambda *arguments, **_: found.append(arguments))
    pipeline.weave(latticed("kagome"), rod_diameter=2.0, layout=layout)
    assert not found


def test_a_layout_of_another_lattice_or_style_is_refused() -> None:
    layout = pipeline.lay_out(latticed(), over_under="stacked")
    with pytest.raises(Unsupported, match="another lattice"):
        pipeline.weave(latticed("plain"), rod_diameter=2.0, layout=layout)
    with pytest.raises(Unsupported, match="stacked, not plain"):
        pipeline.weave(latticed(), rod_diameter=2.0, over_under="plain", layout=layout)
    stacked = pipeline.weave(latticed(), rod_diameter=2.0, over_under="stacked", layout=layout)
    assert stacked.over_under == "stacked"
    assert np.array_equal(stacked.strands.nodes, layout.strands.nodes)
