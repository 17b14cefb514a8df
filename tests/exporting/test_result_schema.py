"""The schema of the JSON result: results of every kind of value keep to it, and it describes every key."""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from fabricated import PATTERNS
from open_cloth import CLOTHS, woven_cloth
from weavecore import pipeline
from weavecore.exporting.json_result import result_schema
from weavecore.exporting.product import StageValue
from weavecore.exporting.registry import encode
from weavecore.model import Latitudes
from weavecore.weaving.strands import find_strands
from woven_rods import FOLDER, tube_latitudes, woven_sample, woven_tube

SAMPLES = sorted(path.stem for path in FOLDER.glob("*.3dm"))


@cache
def strict_schema() -> Draft202012Validator:
    """The schema, with no key allowed that it does not describe."""

    def close(part: Any) -> Any:
        if isinstance(part, list):
            return [close(one) for one in part]
        if not isinstance(part, dict):
            return part
        closed = {key: close(value) for key, value in part.items()}
        # Conditions name keys without describing them.
        return {"additionalProperties": False, **closed} if closed.get("type") == "object" else closed

    return Draft202012Validator(close(result_schema()))


def written(value: StageValue, **options: Any) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(encode(value, "a.json", **options))
    return document


def small_tube() -> Latitudes:
    return tube_latitudes(150.0, 240.0, 60.0)


def faults(document: dict[str, Any]) -> list[str]:
    return [f"{'/'.join(map(str, one.path))}: {one.message[:200]}" for one in strict_schema().iter_errors(document)]


def test_the_schema_is_one_of_draft_2020_12() -> None:
    Draft202012Validator.check_schema(result_schema())
    assert result_schema()["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize(
    "value",
    [
        lambda: small_tube().surface,
        small_tube,
        lambda: pipeline.link(small_tube()),
        lambda: pipeline.read_surface(FOLDER / "closed_body.3dm"),
        lambda: pipeline.offset(small_tube().surface, spacing=[60.0, 90.0]),
    ],
    ids=["surface", "latitudes", "lattice", "closed surface", "spacings"],
)
def test_every_kind_of_value_keeps_to_the_schema(value: Callable[[], StageValue]) -> None:
    assert faults(written(value())) == []


def test_a_lattice_with_strands_keeps_to_the_schema() -> None:
    lattice = pipeline.link(small_tube(), pattern="quad")
    assert faults(written(lattice, strands=find_strands(lattice))) == []


@pytest.mark.parametrize("pattern", PATTERNS)
def test_weaves_of_every_pattern_keep_to_the_schema(pattern: str) -> None:
    weave = pipeline.weave(pipeline.link(small_tube(), pattern=pattern), rod_diameter=2.0)
    assert faults(written(weave)) == []


@pytest.mark.parametrize("name", sorted(CLOTHS))
def test_open_polylines_and_chosen_origins_keep_to_the_schema(name: str) -> None:
    document = written(woven_cloth(name, "plain"))
    assert "origins" in document["surface"]
    assert faults(document) == []


@pytest.mark.parametrize("name", SAMPLES)
def test_the_weave_of_every_sample_keeps_to_the_schema(name: str) -> None:
    assert faults(written(woven_sample(name, "triangular"))) == []


@pytest.mark.parametrize(
    "options",
    [{}, {"supports": "none"}, {"gravity": False, "pressure": 50.0, "buckling": True}],
    ids=["weight", "released", "pressure"],
)
def test_equilibria_keep_to_the_schema(options: dict[str, Any]) -> None:
    weave = pipeline.weave(pipeline.link(small_tube()), rod_diameter=2.0)
    document = written(pipeline.simulate(weave, **options))
    assert faults(document) == []
    document = shortened(document)
    assert faults(document) == []
    for key in document["equilibrium"].keys() - {"spread"}:  # Results of 0.2.0 have none.
        assert faults({**document, "equilibrium": {k: v for k, v in document["equilibrium"].items() if k != key}}) != []


def shortened(part: Any) -> Any:
    """The document with no more of any list than a few entries: the schema knows no lengths of long ones."""
    if isinstance(part, dict):
        return {key: shortened(value) for key, value in part.items()}
    return [shortened(one) for one in part[:3]] if isinstance(part, list) else part


@cache
def tube() -> dict[str, Any]:
    document: dict[str, Any] = shortened(written(woven_tube("kagome")))
    return document


def keys_of(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths of all keys of a document; of a list those of its first entry."""
    if isinstance(part, dict):
        return [found for key, value in part.items() for found in [(*path, key), *keys_of(value, (*path, key))]]
    return keys_of(part[0], (*path, 0)) if isinstance(part, list) and part else []


def at(document: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        document = document[key]
    return document


def test_every_key_that_a_weave_needs_is_missed_where_it_is_missing() -> None:
    missed = []
    for path in keys_of(tube()):
        document = deepcopy(tube())
        del at(document, path[:-1])[path[-1]]
        if not faults(document):
            missed.append("/".join(map(str, path)))
    assert missed == []


@pytest.mark.parametrize(
    ("path", "wrong"),
    [
        (("format",), "other"),
        (("version",), 2),
        (("surface", "vertices", 0), [0.0, 1.0]),
        (("surface", "faces", 0), [0, 1, -1]),
        (("latitudes", "distance", 0), None),
        (("lattice", "edge_family", 0), "diagonal"),
        (("strands", 0, "nodes"), "0 1 2"),
        (("strands", 0, "id"), 7),
        (("crossings", 0, "over"), 3),
        (("weave", "material", "modulus"), 0),
    ],
)
def test_wrong_values_are_found(path: tuple[Any, ...], wrong: object) -> None:
    document = deepcopy(tube())
    assert faults(document) == []
    at(document, path[:-1])[path[-1]] = wrong
    assert faults(document) != []


def test_every_part_of_the_schema_is_described() -> None:
    bare: list[str] = []

    def walk(part: Any, path: str) -> None:
        for key, value in part.get("properties", {}).items():
            if value.get("type") in ("array", "object") and "description" not in value:
                bare.append(f"{path}/{key}")
            walk(value, f"{path}/{key}")
        if isinstance(part.get("items"), dict):
            walk(part["items"], path)

    walk(result_schema(), "")
    for name, part in result_schema()["$defs"].items():
        walk(part, name)
    assert bare == []
