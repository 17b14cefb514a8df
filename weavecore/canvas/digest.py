"""A short text that tells one input from another, whatever came through the wire."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.rhino_geometry import is_rhino_mesh, rhino_faces, rhino_vertices

_known: WeakKeyDictionary[Any, str] = WeakKeyDictionary()
"""Texts of weavecore's values, which never change."""


_TOLD_BY = (
    ("X", "Y", "Z"),
    ("Origin", "XAxis", "YAxis"),
    ("From", "To"),
    ("StartPoint", "MidPoint", "EndPoint"),
    ("Plane", "Radius"),
)
"""What Rhino's structures are told by: points, planes, lines, arcs and circles."""


class Indistinct(TypeError):
    """Two such inputs cannot be told apart."""


def digest(value: Any) -> str:
    """The text of a value.

    Raises
    ------
    Indistinct
        Where it is of a kind that has nothing to be told by.
    """
    if is_dataclass(value) and not isinstance(value, type):
        if value not in _known:
            _known[value] = _hash(type(value).__name__, *(digest(getattr(value, f.name)) for f in fields(value)))
        return _known[value]
    if value is None or isinstance(value, (bool, int, float, str, bytes)):
        return _hash(type(value).__name__, repr(value), _file_state(value))
    if isinstance(value, np.ndarray):
        return _hash(value.dtype.str, str(value.shape), np.ascontiguousarray(value).tobytes())
    if isinstance(value, dict):
        return _hash("dict", *(digest(part) for pair in value.items() for part in pair))
    if is_rhino_mesh(value):
        return _hash("mesh", digest(rhino_vertices(value)), digest(rhino_faces(value)))
    return _of_rhino(value)


def _of_rhino(value: Any) -> str:
    """Of Rhino's other geometry, lines, arcs, circles, planes and points, and of lists."""
    kind = type(value).__name__
    if hasattr(value, "DataCRC"):
        box = value.GetBoundingBox(False)
        return _hash(kind, str(value.DataCRC(0)), digest(box.Min), digest(box.Max))
    if hasattr(value, "Encode"):
        return _hash(kind, json.dumps(value.Encode(), sort_keys=True))
    for names in _TOLD_BY:
        if all(hasattr(value, name) for name in names):
            return _hash(kind, *(digest(getattr(value, name)) for name in names))
    if isinstance(value, Iterable):
        return _hash("list", *(digest(part) for part in value))
    raise Indistinct(f"A {kind} cannot be told from another")


def _file_state(value: Any) -> str:
    """Size and time of the file that a text names, so that a file that has changed is read again."""
    if not isinstance(value, str):
        return ""
    try:
        state = os.stat(value)  # noqa: PTH116 - a text that is no path must not become one.
    except (OSError, ValueError):
        return ""
    return f"{state.st_size} {state.st_mtime_ns}"


def _hash(*parts: str | bytes) -> str:
    content = hashlib.sha256()
    for part in parts:
        encoded = part if isinstance(part, bytes) else part.encode("utf-8", "surrogatepass")
        content.update(b"%d:" % len(encoded))
        content.update(encoded)
    return content.hexdigest()
