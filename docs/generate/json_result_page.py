"""The page of the JSON result, from its schema."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from weavecore.exporting.json_result import result_schema

HEAD = """# JSON result

`weavecore weave … --json result.json` writes one object. Made from its schema (JSON Schema, draft 2020-12), which is
`weavecore/exporting/result.schema.json`, or `weavecore.exporting.json_result.result_schema()` in Python.
`weavecore.read_result` reads a result back.
"""


def text() -> str:
    """The page in Markdown."""
    schema = result_schema()
    parts = [HEAD, schema["description"], ""]
    plain = {name: one for name, one in schema["properties"].items() if not _has_keys(_resolved(one, schema))}
    parts += ["## The object", "", *_table((name, one, schema) for name, one in plain.items())]
    for name, one in schema["properties"].items():
        if name not in plain:
            whole = _resolved(one, schema)
            parts += [f"## {name}", "", whole.get("description", ""), "", *_table(_keys(whole, schema))]
    return "\n".join(parts)


def _table(rows: Iterator[tuple[str, Any, Any]]) -> list[str]:
    lines = ["| key | type | what it is |", "|---|---|---|"]
    for name, one, schema in rows:
        whole = _resolved(one, schema)
        words = whole.get("description") or _resolved(whole.get("items", {}), schema).get("description", "")
        lines.append(f"| `{name}` | {_kind(whole, schema)} | {words.replace('|', chr(92) + '|')} |")
    return [*lines, ""]


def _keys(one: dict[str, Any], schema: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Keys of an object or of the objects in a list, and of what they hold in turn."""
    inner = _resolved(one.get("items", one), schema)
    for name, child in inner.get("properties", {}).items():
        whole = _resolved(child, schema)
        path = f"{before}{name}"
        yield path, whole, schema
        if _has_keys(whole):
            is_list = whole.get("type") == "array"
            yield from _keys(whole, schema, f"{path}[]." if is_list else f"{path}.")


def _has_keys(one: dict[str, Any]) -> bool:
    return bool(one.get("properties") or one.get("items", {}).get("properties"))


def _resolved(one: Any, schema: dict[str, Any]) -> dict[str, Any]:
    if not isinstance(one, dict):
        return {}
    if "$ref" in one:
        found: dict[str, Any] = schema
        for part in one["$ref"].removeprefix("#/").split("/"):
            found = found[part]
        return {**_resolved(found, schema), **{key: value for key, value in one.items() if key != "$ref"}}
    return one


def _kind(one: dict[str, Any], schema: dict[str, Any]) -> str:
    if "const" in one:
        return f"`{one['const']!r}`".replace("'", '"')
    if "enum" in one:
        return " or ".join(f'"{value}"' for value in one["enum"])
    kind = one.get("type", "")
    if isinstance(kind, list):
        return " or ".join(kind)
    if kind == "array" and one.get("items"):
        return f"list of {_kind(_resolved(one['items'], schema), schema) or 'values'}"
    return str(kind)
