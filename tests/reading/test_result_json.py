"""The JSON result is read back value for value, and a damaged one is refused by a kind of `WeaveError`."""

from __future__ import annotations

import copy
import dataclasses
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from open_cloth import CLOTHS, cloth_latitudes, woven_cloth
from weavecore import pipeline
from weavecore.errors import BadIndex, NonFinite, TooMuchWork, Unreadable, Unsupported, WeaveError
from weavecore.exporting.registry import encode
from weavecore.model import Clashes, Material, Note, Weave
from weavecore.reading.formats import result_json
from weavecore.reading.formats.result_json import decode_result, read_result, take_result
from woven_rods import FOLDER, woven_sample
from woven_tube import tube_lattice

PATTERNS = ["triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal"]


def assert_same(one: Any, other: Any, where: str = "result") -> None:
    """Every field of every value is equal to the bit."""
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        assert np.array_equal(one, other), where
    elif dataclasses.is_dataclass(one):
        assert type(one) is type(other), where
        for field in dataclasses.fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, tuple):
        assert len(one) == len(other), where
        for k, pair in enumerate(zip(one, other)):
            assert_same(*pair, f"{where}[{k}]")
    else:
        assert one == other, where


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_weave_is_read_back_value_for_value(pattern: str) -> None:
    weave = woven_sample("narrow_neck", pattern)
    content = encode(weave, "a.json")
    again = decode_result(content)
    assert_same(weave, again)
    assert encode(again, "a.json") == content


def test_clashes_conflicts_and_straight_rods_are_read_back() -> None:
    whole = woven_sample("narrow_neck", "triangular")
    endless = whole.bending.min_radius * np.inf
    weave = dataclasses.replace(
        whole,
        bending=dataclasses.replace(whole.bending, min_radius=endless, largest_diameter=endless),
        conflicts=np.array([[3, 5, 2], [0, 1, 4]]),
        clashes=Clashes(np.array([[1, 4], [2, 2]]), np.array([0.1, 1.7]), np.array([[1.0, 2, 3], [0, 0.5, 1 / 3]])),
    )
    assert_same(weave, decode_result(encode(weave, "a.json")))


def test_the_earlier_stages_are_read_back(tmp_path: Path) -> None:
    lattice = tube_lattice()
    for value in (lattice.latitudes.surface, lattice.latitudes, lattice):
        path = tmp_path / f"{type(value).__name__}.json"
        pipeline.export(value, path)
        assert_same(value, pipeline.read_result(path))


def test_a_closed_surface_keeps_its_cuts() -> None:
    surface = pipeline.read_surface(FOLDER / "closed_body.3dm")
    assert surface.cuts
    assert_same(surface, decode_result(encode(surface, "a.json")))


@pytest.mark.parametrize("name", CLOTHS)
def test_origins_and_open_polylines_are_read_back(name: str) -> None:
    latitudes = cloth_latitudes(name)
    again = decode_result(encode(latitudes, "a.json"))
    assert_same(latitudes, again)
    assert again.surface.starts is not None
    assert_same(latitudes.surface, decode_result(encode(latitudes.surface, "a.json")))


@pytest.mark.parametrize("pattern", ["triangular", "plain", "kagome"])
def test_a_weave_with_selvedges_is_read_back_value_for_value(pattern: str) -> None:
    weave = woven_cloth("side with hole", pattern)
    assert_same(weave, decode_result(encode(weave, "a.json")))


def test_a_result_that_does_not_say_what_is_closed_has_closed_polylines() -> None:
    whole = json.loads(encode(tube_lattice().latitudes, "a.json"))
    del whole["latitudes"]["closed"]
    assert_same(tube_lattice().latitudes, take_result(whole))


def open_document() -> dict[str, Any]:
    """Latitudes, of which some are open, from a path inside a surface."""
    found: dict[str, Any] = json.loads(encode(cloth_latitudes("slit"), "a.json"))
    return found


def document() -> dict[str, Any]:
    """A weave of a few dozen rods with a conflict and a clash."""
    found: dict[str, Any] = json.loads(encode(pipeline.weave(tube_lattice()), "a.json"))
    one, other = (strand["id"] for strand in found["strands"][:2])
    found["weave"]["conflicts"] = [{"strand": one, "node": 0, "node_before": 1}]
    found["weave"]["clashes"] = [{"strands": [one, other], "distance": 1.0, "point": [0.0, 0.0, 0.0]}]
    return found


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every key of every object, and the last of every list."""
    if isinstance(value, dict):
        for key, below in value.items():
            yield (*path, key)
            yield from places(below, (*path, key))
    elif isinstance(value, list) and value:
        yield (*path, len(value) - 1)
        yield from places(value[-1], (*path, len(value) - 1))


@pytest.mark.parametrize(("make", "least"), [(document, 300), (open_document, 100)])
def test_whatever_is_put_anywhere_is_read_or_refused(make: Callable[[], dict[str, Any]], least: int) -> None:
    """The one list of all the wrong values, at every place in turn: no error but a `WeaveError`."""
    whole = make()
    wrong = (None, "x", -1, 10**30, 0.5, [])
    refused = 0
    for path in places(whole):
        if path[0] == "parameters" and path[-1] not in ("spacing", "edge_length", "pattern"):
            continue
        holder = whole
        for key in path[:-1]:
            holder = holder[key]
        before = holder[path[-1]]
        for value in wrong:
            holder[path[-1]] = value
            refused += is_refused(whole)
        holder[path[-1]] = before
        if isinstance(holder, dict):
            short = copy.copy(holder)
            del holder[path[-1]]
            refused += is_refused(whole)
            holder.clear()
            holder.update(short)
    assert refused > least
    decode_result(json.dumps(whole).encode())


@pytest.mark.parametrize("value", [None, "x", 10**30, True])
def test_long_lists_that_are_kept_as_arrays_are_refused_as_lists_are(value: Any) -> None:
    whole = document()
    n_lists = 0
    for key in ("surface", "latitudes", "lattice", "weave"):
        for items in whole[key].values():
            if isinstance(items, list) and len(items) >= 64:
                n_lists += 1
                last, items[-1] = items[-1], value
                assert said_of(lambda: take_result(whole)) == said_of(lambda: decode_result(json.dumps(whole).encode()))
                items[-1] = last
    assert n_lists >= 8


def said_of(read: Callable[[], Any]) -> str:
    """The error of reading; "" where there is none."""
    try:
        read()
    except WeaveError as error:
        return str(error)
    return ""


def is_refused(whole: dict[str, Any]) -> bool:
    try:
        take_result(whole)
    except WeaveError:
        return True
    return False


@pytest.mark.parametrize(
    ("path", "value", "kind", "where"),
    [
        (("lattice", "edges", 0, 1), 10**6, BadIndex, "lattice.edges"),
        (("strands", 2, "nodes", 0), -1, BadIndex, r"strands\[2\].nodes"),
        (("joints", 0, "order", 0), "Z99", BadIndex, "Z99"),
        (("joints", 0, "places", 0), 0.5, Unreadable, "whole number"),
        (("strands", 1, "axis", "controls", 3, 0), 1e6, Unreadable, "does not pass"),
        (("strands", 1, "stations", 3), 0.0, Unreadable, "do not rise"),
        (("strands", 0, "id"), "L02", Unreadable, "same id"),
        (("strands", 0, "id"), "=cmd|' /C calc'!A0", Unreadable, r"strands\[0\].id is .* letters, digits"),
        (("strands", 0, "id"), "L 01", Unreadable, r"strands\[0\].id is 'L 01'"),
        (("strands", 0, "id"), "L\n01", Unreadable, r"strands\[0\].id has the character U\+000A"),
        (("strands", 0, "id"), "L\u202801", Unreadable, r"U\+2028"),
        (("strands", 0, "id"), "L\ud80001", Unreadable, r"U\+D800"),
        (("strands", 0, "id"), "", Unreadable, "letters, digits"),
        (("weave", "over_under"), "upside", Unreadable, "weave.over_under is 'upside', and must be stacked"),
        (("weave", "material", "name"), "g\x1bfrp", Unreadable, r"weave.material.name has the character U\+001B"),
        (("surface", "name"), "x" * 10_001, Unreadable, "surface.name has more than 10,000"),
        (("unit",), "mm; x", Unreadable, "unit is 'mm; x'"),
        (("parameters", "pattern"), "a/b", Unreadable, "parameters.pattern is"),
        (("weave", "normals", 0, 0), "up", Unreadable, "weave.normals"),
        (("weave", "normals"), [], Unreadable, "weave.normals"),
        (("weave", "rod_diameter"), 0, Unreadable, "weave.rod_diameter"),
        (("parameters", "spacing"), -3.0, Unreadable, "parameters.spacing"),
        (("version",), 2, Unsupported, "version 2"),
        (("format",), "gltf", Unsupported, "not a result"),
    ],
)
def test_what_is_wrong_is_named(path: tuple[Any, ...], value: Any, kind: type[WeaveError], where: str) -> None:
    whole = document()
    holder = whole
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = value
    with pytest.raises(kind, match=where):
        decode_result(json.dumps(whole).encode())


@pytest.mark.parametrize(
    ("path", "value", "kind", "where"),
    [
        (("surface", "origins", 0, "vertices", 0), 10**6, BadIndex, r"surface.origins\[0\].vertices"),
        (("surface", "origins", 0, "vertices"), [3], Unreadable, "too few"),
        (("surface", "origins", 0, "vertices"), [208, 209, 208], Unreadable, "pass a vertex twice"),
        (("surface", "origins", 0, "vertices"), [208, 210], BadIndex, "do not run along edges"),
        (("surface", "origins", 0, "closed"), True, BadIndex, "do not run along edges"),
        (("surface", "origins", 0, "closed"), 1, Unreadable, "neither true nor false"),
        (("surface", "origins"), {}, Unreadable, "not a list"),
        (("latitudes", "closed"), [True], Unreadable, "latitudes.closed"),
        (("latitudes", "closed", 0), "no", Unreadable, "latitudes.closed"),
    ],
)
def test_what_is_wrong_about_origins_is_named(
    path: tuple[Any, ...], value: Any, kind: type[WeaveError], where: str
) -> None:
    whole = open_document()
    holder: Any = whole
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = value
    with pytest.raises(kind, match=where):
        take_result(whole)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "\xff", "[" * 100_000, '{"format":"weavecore","version":NaN}'])
def test_what_is_no_json_object_is_unreadable(text: str) -> None:
    with pytest.raises(Unreadable):
        decode_result(text.encode("latin-1"))


def test_numbers_beyond_all_floats_are_not_finite() -> None:
    whole = json.dumps({**document(), "tolerance": 777.0}).replace("777.0", "1e999")
    with pytest.raises(NonFinite, match="tolerance"):
        decode_result(whole.encode())


def test_texts_that_are_written_can_be_read_back() -> None:
    """Names and materials of a caller may hold what no terminal shows."""
    weave = pipeline.weave(tube_lattice(), material=Material("=a\tb\ud800", 1e9, 1e8, 2.0, 1e3, "a\nb"))
    again = decode_result(encode(weave, "a.json"))
    assert isinstance(again, Weave)
    assert (again.material.name, again.material.source) == ("=a\ufffdb\ufffd", "a\ufffdb")
    assert Note("SLIT", "a\x1bb").text == "a\ufffdb"


@pytest.mark.skipif(os.name == "nt", reason="POSIX files")
def test_pipes_and_devices_are_refused_before_they_are_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "zero.json").symlink_to("/dev/zero")
    for name in ("pipe.json", "zero.json"):
        with pytest.raises(Unreadable, match="is not a file"):
            read_result(tmp_path / name)


@pytest.mark.parametrize(
    ("limit", "most", "content", "what"),
    [
        ("MOST_BYTES", 1000, b" " * 5_000_000, "has 5 MB, more than the limit of 0 MB"),
        ("MOST_MEMORY", 90_000_000, b"[" + b"[]," * 1_000_000 + b"0]", r"about 0\.1 GB of memory, more than 0\.1 GB"),
    ],
)
def test_a_result_too_large_for_the_memory_is_refused_before_it_is_parsed(
    limit: str, most: int, content: bytes, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(result_json, limit, most)
    (tmp_path / "large.json").write_bytes(content)
    with pytest.raises(TooMuchWork, match=what):
        read_result(tmp_path / "large.json")


def test_a_missing_file_is_unreadable(tmp_path: Path) -> None:
    for path in (tmp_path / "no.json", tmp_path):
        with pytest.raises(Unreadable):
            read_result(path)
