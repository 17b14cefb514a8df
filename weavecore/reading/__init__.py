"""Stage 1: what a file or a program holds → the `SurfaceMesh` that is woven."""

from weavecore.reading.curve_files import CURVE_ENDINGS, read_curves
from weavecore.reading.curve_objects import curve_from, curves_from
from weavecore.reading.inspecting import CurveReport, FileReport, ObjectReport, inspect_file
from weavecore.reading.read import read_surface, surface_from
from weavecore.reading.repair import surface_from_arrays
from weavecore.reading.result_file import read_result

__all__ = [
    "CURVE_ENDINGS",
    "CurveReport",
    "FileReport",
    "ObjectReport",
    "curve_from",
    "curves_from",
    "inspect_file",
    "read_curves",
    "read_result",
    "read_surface",
    "surface_from",
    "surface_from_arrays",
]
