"""Stage 1: what a file or a program holds → the `SurfaceMesh` that is woven."""

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
