"""Support for the Grasshopper components: read inputs, run a stage, keep and show its result.

A *solution* is one run of a component.  Its inputs that are not wired are None; `solve` does nothing until those that
are needed are there, keeps results of the same inputs, and turns every error into a balloon.
Nothing here imports Grasshopper before it is needed, so that it can be tested without.
"""

from weavecore.canvas.inputs import chosen, diameters, numbers, read_curves, read_geometry
from weavecore.canvas.measuring import Measures, measure, measures_caption
from weavecore.canvas.results import (
    LatitudeResults,
    LatticeResults,
    RodResults,
    draw_latitudes,
    draw_lattice,
    draw_rods,
    draw_surface,
)
from weavecore.canvas.solve import Cancelled, Run, solve
from weavecore.canvas.writing import check, concerns, counts, report_lines, write_value

__all__ = [
    "Cancelled",
    "LatitudeResults",
    "LatticeResults",
    "Measures",
    "RodResults",
    "Run",
    "check",
    "chosen",
    "concerns",
    "counts",
    "diameters",
    "draw_latitudes",
    "draw_lattice",
    "draw_rods",
    "draw_surface",
    "measure",
    "measures_caption",
    "numbers",
    "read_curves",
    "read_geometry",
    "report_lines",
    "solve",
    "write_value",
]
