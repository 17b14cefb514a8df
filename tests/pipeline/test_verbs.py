"""The public verbs, one after the other on a tube."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import weavecore as wc
from weavecore import pipeline
from weavecore.errors import NotWritten, OutputExists, Unsupported
from weavecore.exporting.registry import WRITERS, encode
from weavecore.viewing.page.html_page import encode_page
from weavecore.viewing.picture import encode_picture
from weavecore.weaving.sequence import find_sequence
from woven_tube import tube_lattice, tube_surface


def test_the_verbs_take_the_value_of_the_one_before(tmp_path: Path) -> None:
    latitudes = wc.offset(tube_surface(), spacing=1.0)
    lattice = wc.link(latitudes)
    wc.export(lattice, tmp_path / "w.json", parameters={"note": "織"})
    result = json.loads((tmp_path / "w.json").read_text("utf-8"))
    assert isinstance(latitudes, wc.Latitudes)
    assert isinstance(lattice, wc.Lattice)
    assert lattice.latitudes is latitudes
    assert result["parameters"]["note"] == "織"
    assert len(result["strands"]) > 0
    for value in (latitudes.surface, latitudes, lattice):
        wc.validate(value).raise_if_broken()


def test_without_spacing_the_suggested_one_is_taken() -> None:
    surface = tube_surface()
    assert wc.offset(surface).spacing == wc.suggest_spacing(surface)


def test_a_method_that_is_not_known_is_refused() -> None:
    with pytest.raises(Unsupported, match=r"method 'guess'.*levels"):
        wc.offset(tube_surface(), spacing=1.0, method="guess")


def test_progress_is_told_and_raising_in_it_cancels() -> None:
    told: list[float] = []
    latitudes = wc.offset(tube_surface(), spacing=1.0, progress=lambda fraction, _label: told.append(fraction))
    wc.link(latitudes, progress=lambda fraction, _label: told.append(1 + fraction))
    assert told == sorted(told)
    assert told[0] >= 0
    assert told[-1] <= 2

    class Stopped(Exception):
        pass

    def stop(_fraction: float, _label: str) -> None:
        raise Stopped

    with pytest.raises(Stopped):
        wc.offset(tube_surface(), spacing=1.0, progress=stop)
    with pytest.raises(Stopped):
        wc.link(latitudes, progress=stop)


def test_pictures_are_drawn_by_both_verbs(tmp_path: Path) -> None:
    lattice = tube_lattice()
    wc.export(lattice, tmp_path / "a.png")
    wc.draw_picture(lattice, tmp_path / "b.PNG")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.PNG").read_bytes()
    wc.draw_picture(lattice, tmp_path / "b.PNG", size=(64, 48), view=np.array([1, 0, 0]), overwrite=True)
    assert (tmp_path / "b.PNG").stat().st_size < (tmp_path / "a.png").stat().st_size


def test_pictures_are_refused_before_they_are_drawn(tmp_path: Path) -> None:
    lattice = tube_lattice()
    (tmp_path / "a.png").write_bytes(b"old")
    with pytest.raises(OutputExists):
        wc.draw_picture(lattice, tmp_path / "a.png")
    with pytest.raises(Unsupported, match="ending"):
        wc.draw_picture(lattice, tmp_path / "a.jpg")
    with pytest.raises(NotWritten):
        wc.export(lattice, tmp_path / "nowhere" / "a.png")
    assert (tmp_path / "a.png").read_bytes() == b"old"


def test_names_that_are_not_there_are_no_attributes() -> None:
    with pytest.raises(AttributeError, match=r"weavecore.*wave"):
        _ = wc.wave
    assert set(wc.__all__) <= set(dir(wc))
    assert wc.__version__[0].isdigit()


def test_pictures_and_pages_are_written_through_the_registry_of_endings(tmp_path: Path) -> None:
    assert {pipeline.PICTURE, pipeline.PAGE} < set(WRITERS)
    weave = wc.weave(tube_lattice(), rod_diameter=0.05)
    wc.export(weave, tmp_path / "a.html")
    assert (
        (tmp_path / "a.html").read_bytes()
        == encode(weave, "b.HTML")
        == encode_page(weave, sequence=find_sequence(weave))
    )
    for value in (tube_surface(), tube_lattice().latitudes, weave):
        assert encode(value, "a.png") == encode_picture(value)
    with pytest.raises(Unsupported, match=r"\.3dm, .*\.png, \.html"):
        wc.export(weave, tmp_path / "a.dwg")
