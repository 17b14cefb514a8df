"""Stage 1: what a file or a program holds → the `SurfaceMesh` that is woven."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weavecore.reading.curves import CURVE_ENDINGS, curve_from, curves_from, read_curves
    from weavecore.reading.formats.result_json import read_result
    from weavecore.reading.inspect import CurveReport, FileReport, ObjectReport, inspect_file
    from weavecore.reading.points import read_places
    from weavecore.reading.read import read_surface, surface_from
    from weavecore.reading.repair import surface_from_arrays

__all__ = [
    "CURVE_ENDINGS",
    "CurveReport",
    "FileReport",
    "ObjectReport",
    "curve_from",
    "curves_from",
    "inspect_file",
    "read_curves",
    "read_places",
    "read_result",
    "read_surface",
    "surface_from",
    "surface_from_arrays",
]

_HOMES = {
    "curves": ("CURVE_ENDINGS", "curve_from", "curves_from", "read_curves"),
    "formats.result_json": ("read_result",),
    "inspect": ("CurveReport", "FileReport", "ObjectReport", "inspect_file"),
    "points": ("read_places",),
    "read": ("read_surface", "surface_from"),
    "repair": ("surface_from_arrays",),
}


def __getattr__(name: str) -> Any:
    """Import a function when it is asked for: most commands need one, and each brings readers of its own."""
    home = next((module for module, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{home}"), name)
    return value
